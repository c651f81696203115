# Completion of morphbus in fish. Written by `morphbus completion fish`.
function __morphbus_complete
    set -l words (commandline -opc)
    set -l current (commandline -ct)
    set -l program $words[1]
    set -e words[1]
    # The value of --option=value is a path; fish replaces the whole word.
    set -l before (string match -r -- '^--[^=]*=' $current)
    set -l path (string replace -r -- '^--[^=]*=' '' $current)
    for line in ($program complete -- $words "$current" 2>/dev/null)
        set -l parts (string split ' ' -- $line)
        switch $parts[1]
            case :files
                test (count $parts) -gt 1; or set -a parts ''
                for ending in $parts[2..-1]
                    for file in (__fish_complete_suffix "$path" $ending)
                        echo "$before$file"
                    end
                end
            case :folders
                for folder in (__fish_complete_directories "$path" '')
                    echo "$before$folder"
                end
            case '*'
                printf '%s\n' $line
        end
    end
end
complete -c morphbus -k -f -a '(__morphbus_complete)'
