#compdef morphbus
# Completion of morphbus in zsh. Written by `morphbus completion zsh`.
_morphbus() {
  local -a found typed plain open endings
  local line word what files= folders=
  # Quotes are the shell's; of the last word counts what stands before the cursor.
  typed=("${(@Q)words[2,CURRENT-1]}" "${(Q)PREFIX}")
  found=("${(@f)$(${~words[1]} complete -- "${typed[@]}" 2>/dev/null)}")
  for line in "${found[@]}"; do
    word=${line%%$'\t'*}
    what=${line#*$'\t'}
    case $word in
      '') ;;
      :files*) files=1; endings=(${=word#:files}) ;;
      :folders) folders=1 ;;
      # A value follows, in the same word.
      *[=@]) open+=("${word//:/\\:}:$what") ;;
      *) plain+=("${word//:/\\:}:$what") ;;
    esac
  done
  (( ${#plain} == 0 )) || _describe -t values value plain
  (( ${#open} == 0 )) || _describe -t values value open -S ''
  # The value of --option=value is a path.
  [[ $PREFIX != --*=* ]] || compset -P '*='
  if [[ -n $files && ${#endings} -gt 0 ]]; then
    _files -g "${(j: :)endings/#/*}"
  elif [[ -n $files ]]; then
    _files
  elif [[ -n $folders ]]; then
    _files -/
  fi
}
# It is called at once where the shell has found it in a file, and is only made known where it was sourced.
if [[ ${funcstack[1]} == _morphbus ]]; then
  _morphbus "$@"
else
  compdef _morphbus morphbus
fi
