# Completion of morphbus in bash. Written by `morphbus completion bash`.
_morphbus() {
  # bash takes words apart at = and :, which are parts of words here: --robot=walker, udpm://239.255.76.67:7667.
  local words=() word index
  for ((index = 1; index <= COMP_CWORD; ++index)); do
    word=${COMP_WORDS[index]}
    if ((${#words[@]} > 0)) && [[ $word == [=:]* || ${words[-1]} == *[=:] ]]; then
      words[-1]+=$word
    else
      words+=("$word")
    fi
  done
  # What bash puts in stands behind the last of those signs.
  local current=${COMP_WORDS[COMP_CWORD]} before
  [[ $current != [=:]* ]] || current=
  before=${words[-1]%"$current"}
  # Quotes and backslashes are the shell's.
  words=("${words[@]//[\\\"\']/}")

  COMPREPLY=()
  local candidate what files=false folders=false endings=()
  while IFS=$'\t' read -r candidate what; do
    case $candidate in
      :files*) files=true; read -r -a endings <<<"${candidate#:files}" ;;
      :folders) folders=true ;;
      *) COMPREPLY+=("${candidate#"$before"}") ;;
    esac
  done < <("${COMP_WORDS[0]/#\~/$HOME}" complete -- "${words[@]}" 2>/dev/null)
  # A value follows, in the same word.
  [[ ${#COMPREPLY[@]} -eq 0 || ${COMPREPLY[0]} != *[=@] ]] || compopt -o nospace

  local found=() fitting=() path ending
  if $files; then
    mapfile -t found < <(compgen -f -- "$current")
  elif $folders; then
    mapfile -t found < <(compgen -d -- "$current")
  fi
  [[ ${#found[@]} -gt 0 ]] || return 0
  compopt -o filenames
  for path in "${found[@]}"; do
    [[ ${#endings[@]} -gt 0 && ! -d $path ]] || { fitting+=("$path"); continue; }
    for ending in "${endings[@]}"; do
      [[ $path != *"$ending" ]] || fitting+=("$path")
    done
  done
  # Where no file has the ending, another one may be meant.
  [[ ${#fitting[@]} -gt 0 ]] || fitting=("${found[@]}")
  COMPREPLY+=("${fitting[@]}")
}
complete -F _morphbus morphbus
