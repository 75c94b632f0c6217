# TEST full program seconds=120 needs=flesh
# test_manual.sh: manual pages and completion have every command, option and key, and man, bash and zsh accept them.
# FLESH names the program, in whose folder the build has put them.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
made=$(dirname -- "$flesh")/manual

# commands_of WORD...: prints the commands in the help of `flesh WORD...`.
commands_of() { "$flesh" "$@" --help | sed -n '/^Commands:/,/^$/s/^  \([a-z]*\) .*/\1/p'; }
# options_of WORD...: prints its options, with their dashes.
options_of() { "$flesh" "$@" --help | sed -n 's/^  \(--[a-z-]*\).*/\1/p'; }
# below COMMAND: prints the commands of several words that begin with COMMAND.
below() {
  case $1 in
  sweep) printf '%s\n' 'sweep export' 'sweep plot' 'sweep merge' ;;
  *) commands_of "$1" | sed "s/^/$1 /" ;;
  esac
}

every_command_has_a_page_that_man_likes() {
  [ "$(commands_of | wc -l)" -ge 15 ] || return 1
  for name in flesh scene $(commands_of); do
    expect 0 "$flesh" manual "$name" && mv stdout.txt page && [ -s page ] || return 1
    if command -v man >/dev/null; then
      LC_ALL=C.UTF-8 man --warnings -l page >/dev/null 2>warnings
      [ ! -s warnings ] || { echo "$name"; cat warnings; return 1; }
    fi
    # Pages have no date, so that they are the same whenever they are built.
    if command -v mandoc >/dev/null; then
      ! mandoc -T lint page | grep -E 'WARNING|ERROR' | grep -v 'missing date' || return 1
    fi
  done
  expect 2 "$flesh" manual nonsense && has stderr.txt "'nonsense' has no page"
}

the_build_has_these_pages() {
  [ -d "$made" ] || { echo "no $made"; return 1; }
  for name in flesh $(commands_of); do
    page=$made/flesh-$name.1
    [ "$name" != flesh ] || page=$made/flesh.1
    "$flesh" manual "$name" | cmp - "$page" || return 1
  done
  "$flesh" manual scene | cmp - "$made/flesh-scene.5" && "$flesh" completion bash | cmp - "$made/flesh" &&
    "$flesh" completion zsh | cmp - "$made/_flesh"
}

every_option_stands_in_its_page() {
  for name in $(commands_of); do
    "$flesh" manual "$name" >page
    { echo "$name"; below "$name"; } >commands
    while read -r command; do
      # shellcheck disable=SC2086
      for option in $(options_of $command); do
        grep -qF "\\fB$(printf %s "$option" | sed 's/-/\\-/g')\\fR" page || { echo "$command: $option"; return 1; }
      done
    done <commands
  done
}

every_key_stands_in_the_page_of_scenes() {
  "$flesh" manual scene >page
  "$flesh" schema --format paths >paths
  [ "$(wc -l <paths)" -gt 150 ] || return 1
  sed 's/.*\.//' paths | sort -u | while read -r key; do
    grep -q "^\\\\fB$key\\\\fR: " page || { echo "no key $key"; return 1; }
  done || return 1
  for section in $("$flesh" schema | sed -n 's/^## //p'); do
    grep -qxF ".SH \"$section\"" page || { echo "no section $section"; return 1; }
  done
  # Every path is known to --set, whatever is said of the value.
  "$flesh" mesh box --cells 1,1,1 --size 1,1,1 --out box.msh >/dev/null || return 1
  echo '{body: {mesh: box.msh, material: {energy: S, young: 1e5, poisson: 0.45}}}' >box.yaml
  "$flesh" check box.yaml --set body.nonsense=1 2>&1 | grep -q 'is unknown' || return 1
  while read -r path; do
    "$flesh" check box.yaml --set "$path=[]" 2>&1 </dev/null | grep 'is unknown' && return 1
  done <paths
  return 0
}

# completes EXPECTED WORD...: bash's completions of the last word are EXPECTED.
completes() {
  expected=$1
  shift
  got=$(bash -c '. ./flesh.bash; COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)); _flesh; echo "${COMPREPLY[*]}"' bash "$@" 2>&1)
  [ "$got" = "$expected" ] || { echo "$*: '$got' instead of '$expected'"; return 1; }
}

bash_completes() {
  command -v bash >/dev/null || return 0
  "$flesh" completion bash >flesh.bash && bash -n flesh.bash || return 1
  completes run flesh ru && completes "$(commands_of | tr '\n' ' ')--help --version" flesh '' || return 1
  completes 'time.max_energy_gain= time.max_order= time.max_step= time.max_steps=' flesh run --set time.max &&
    completes effects.spring.stiffness= flesh run scene.yaml --set effects.spring.st &&
    completes hht flesh run --method h && completes 'none J stress speed young' flesh snap out --colour '' &&
    completes '' flesh run --out some && completes '' flesh run --max-seconds '' && completes '' flesh run some || return 1
  completes box flesh mesh b && completes --origin flesh mesh box --ori && completes export flesh sweep ex &&
    completes csv flesh sweep export --format c && completes '' flesh run box || return 1
  for name in $(commands_of); do
    { echo "$name"; below "$name"; } >commands
    while read -r command; do
      # shellcheck disable=SC2086
      completes "$({ options_of $command; echo --help; } | awk '!seen[$0]++' | tr '\n' ' ' | sed 's/ $//')" \
        flesh $command -- || return 1
    done <commands
  done
  eval_works=$(bash -c 'eval "$("$1" completion bash)"; complete -p flesh' bash "$flesh")
  case $eval_works in *'-F _flesh flesh') ;; *) echo "$eval_works"; return 1 ;; esac
}

zsh_has_every_option() {
  "$flesh" completion zsh >_flesh
  for name in $(commands_of); do
    { echo "$name"; below "$name"; } >commands
    while read -r command; do
      # shellcheck disable=SC2086
      for option in $(options_of $command); do
        [ "$option" = --help ] || grep -qE -- "^$command	\\*?$option	" _flesh || { echo "$command: $option"; return 1; }
      done
    done <commands
  done
  command -v zsh >/dev/null || return 0
  cat >words.zsh <<'END'
. ./_flesh
words_of() { local -a options commands; _flesh_words "$1"; print -rl -- $options $commands; }
words_of run; words_of mesh
END
  zsh -n _flesh && zsh -f words.zsh >words 2>&1 && grep -qF '*--set[a value of the scene' words &&
    grep -qF ']:KEY=VALUE:compadd -S "" -a _flesh_keys' words && grep -qx 'box:make a regular grid of boxes, six tets each' words
}

other_shells_are_refused() {
  expect 2 "$flesh" completion fish && has stderr.txt "'fish'.*bash or zsh" && expect 2 "$flesh" completion
}

run_tests every_command_has_a_page_that_man_likes the_build_has_these_pages every_option_stands_in_its_page \
  every_key_stands_in_the_page_of_scenes bash_completes zsh_has_every_option other_shells_are_refused
