# Completes the verbs and options of partiemc and partiemc-server, as their --help has them.
_partiemc() {
  local command=("${COMP_WORDS[0]}") current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]}
  local help values
  if [[ ${COMP_WORDS[0]##*/} == partiemc ]] && ((COMP_CWORD > 1)); then
    command+=("${COMP_WORDS[1]}")
  fi
  help=$("${command[@]}" --help 2>/dev/null) || return
  COMPREPLY=()
  if [[ $previous == --* ]]; then
    # Its values, where it takes one of some: "--mode MODE:{latest,every}".
    values=$(sed -n -E "s/^ +$previous [^ {]*\{([^}]*)\}.*/\1/p" <<<"$help")
    if [[ -n $values ]]; then
      mapfile -t COMPREPLY < <(compgen -W "${values//,/ }" -- "$current")
      return
    fi
  fi
  if [[ $current == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$(sed -n -E 's/^ +(-.,)?(--[a-z-]+).*/\2/p' <<<"$help")" -- "$current")
  elif ((${#command[@]} == 1 && COMP_CWORD == 1)) && [[ ${command[0]##*/} == partiemc ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$(sed -n '/^Subcommands:/,/^$/s/^ *\([a-z]*\) .*/\1/p' <<<"$help")" -- "$current")
  else
    mapfile -t COMPREPLY < <(compgen -f -- "$current")
  fi
}
complete -o filenames -F _partiemc partiemc partiemc-server
