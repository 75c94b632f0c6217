# TEST quick program seconds=60 needs=flesh
# test_command_words.sh: a command line with wrong words, however odd, is refused in one short printable line, and nothing is
# written. FLESH names the program.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
"$flesh" mesh box --cells 1,1,1 --size 1,1,1 --out box.msh >/dev/null || exit 1
cat >box.yaml <<'END'
body: {mesh: box.msh, material: {energy: S, young: 1e5, poisson: 0.45}}
effects: [{inertia: {}}, {gravity: {}}]
time: {step: 1/60, end: 1/60}
END
escape=$(printf '\033[2J')
long=$(printf '%02000d' 0 | tr 0 x)

# refused WORD...: the command ends with 2 and one line of at most 600 printable ASCII characters, and writes no file.
refused() {
  : >stdout.txt && : >stderr.txt && : >after.txt
  ls >before.txt
  expect 2 "$flesh" "$@" || return 1
  ls >after.txt
  diff before.txt after.txt || return 1
  [ "$(wc -l <stderr.txt)" -eq 1 ] && [ "$(wc -c <stderr.txt)" -le 600 ] && ! LC_ALL=C grep -q '[^ -~]' stderr.txt ||
    { cat -v stderr.txt | cut -c 1-300; return 1; }
}

words_are_quoted_in_one_printable_line() {
  for word in "$escape" "$long" "$(printf '\377\376')" "$(printf 'a\nb')"; do
    refused "$word" && refused run box.yaml --out new --max-seconds "$word" && refused run box.yaml "--$word" &&
      refused mesh "$word" && refused mesh box --cells "$word" --size 1,1,1 --out new.msh && refused skin "$word" &&
      refused skin apply a b c --out new --formats "$word" && refused snap box.yaml --out "$word" &&
      refused sweep box.yaml --jobs "$word" && refused run box.yaml --method "$word" --out new || return 1
  done
}
# Words that YAML takes for a comment, a directive or nothing are refused as methods and values.
no_method_is_the_default_by_mistake() {
  for word in '' ' ' '%s' '# bdf2' '~' null; do
    refused run box.yaml --method "$word" --out new || return 1
  done
  refused run box.yaml --set 'time.end=%s' --out new && refused run box.yaml --set 'time.end= # 3' --out new &&
    refused run box.yaml --set 'solver.threads=# 2' --out new && has stderr.txt 'no value follows the =' &&
    expect 0 "$flesh" run box.yaml --set solver.threads= --out new --quiet
}
a_bad_skin_is_refused_before_anything_is_written() {
  printf 'v 0 0 0\nf 1 2 3\n' >bad.obj
  expect 3 "$flesh" run box.yaml --set output.skin.surface=bad.obj --out skinned --quiet && has stderr.txt 'bad.obj' &&
    [ ! -e skinned ]
}

# lists CODES COMMAND...: the commands' help lists exactly the exit codes 0 to 3 and CODES.
lists() {
  codes=$1
  shift
  for command in "$@"; do
    # shellcheck disable=SC2086
    expect 0 "$flesh" $command --help || return 1
    found=$(sed -n 's/^  \([0-9][0-9/]*\)  *[a-z].*/\1/p' stdout.txt | tr '\n' ' ')
    [ "$found" = "0 1 2 3 $codes" ] || { echo "$command: $found"; return 1; }
  done
}
exit_codes_are_those_of_the_command() {
  lists '4 5 6 7 8 130/143 ' run accuracy && lists '4 5 7 8 130/143 ' bench &&
    lists '130/143 ' drift hardcases sweep film &&
    lists '' check material schema manual mesh 'mesh info' 'mesh split' skin 'skin bind' snap plot report 'sweep export'
}

run_tests exit_codes_are_those_of_the_command words_are_quoted_in_one_printable_line no_method_is_the_default_by_mistake \
  a_bad_skin_is_refused_before_anything_is_written
