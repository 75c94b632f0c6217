#!/bin/sh
# TEST quick source needs=cc,includes
# test_every_pointer.sh: every pointer of every public function that returns a status is named in test_null.c.
root=$(cd "$(dirname "$0")/../.." && pwd)
names=$(tr '\n' ' ' <"$root/test/tree/test_null.c" | sed 's/ [*] / /g; s/REFUSES(\([a-z_]*\), \([A-Za-z_]*\),/\1 \2,/g; s/  */ /g')
free=" $(sed -n '/^.. No status/,/[*][/]/p' "$root/test/tree/test_null.c" | tr '\n*./,' '     ') "
missing=$(cat "$root"/include/flesh/*.h | tr '\n' ' ' | sed 's|/\*|\n/*|g; s|\*/|*/\n|g' | grep -v '^/\*' | tr '\n' ' ' |
  sed 's/;/;\n/g' | sed -n 's/.*FLESH_API  *int  *\(flesh_[a-z_]*\)(\(.*\));.*/\1|\2/p' | tr -s ' ' |
  awk -F'|' '{
    n = split($2, parameter, ",")
    for (i = 1; i <= n; i++) {
      p = parameter[i]
      if (p !~ /[*[]/ && p !~ /^ *(N_Vector|SUN[A-Z]|flesh_psi_function)/ || p ~ /[(]/) continue
      sub(/[[].*/, "", p); sub(/.*[ *]/, "", p)
      print $1, p
    }
  }' | while read -r function name; do
    case $free in *" $function "*) continue ;; esac
    case $names in
    *"$function $name"[,.]*) ;;
    *) echo "# $function: $name is not in test_null.c" ;;
    esac
  done)
echo 1..1
[ -z "$missing" ] && echo 'ok 1 - every pointer is tried' || printf '%s\nnot ok 1 - every pointer is tried\n' "$missing"
