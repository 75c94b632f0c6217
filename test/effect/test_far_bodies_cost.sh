# TEST full needs=far_bodies_cost builds=plain
# test_far_bodies_cost.sh: contact between two bodies 100 m apart costs at most a 28th of a step's instructions with 96
# tets and a 56th with 768, as valgrind counts them: the same on every run, however busy the machine is.
set -u

if ! command -v valgrind >/dev/null 2>&1; then
  echo '1..0 # SKIP valgrind is missing'
  exit 0
fi
room=$(mktemp -d)
trap 'rm -rf "$room"' EXIT

# count CELLS CONTACT STEPS: instructions of so many steps.
count() {
  valgrind --tool=callgrind --toggle-collect=flesh_integrator_step --callgrind-out-file="$room/profile" \
    "$FAR_BODIES_COST" "$@" >"$room/log" 2>&1 || { cat "$room/log" >&2; return 1; }
  awk '/Collected/ { print $4 }' "$room/log"
}

echo 1..2
# steps CELLS CONTACT: those of 20 steps after 10, as the first search is made once.
steps() {
  first=$(count "$1" "$2" 10) && all=$(count "$1" "$2" 30) && echo $((all - first))
}

number=0 failed=0
for case in 2:28 4:56; do
  cells=${case%:*}
  number=$((number + 1))
  alone=$(steps "$cells" 0) && contact=$(steps "$cells" 1) || { alone=1 contact=2; }
  echo "# $((12 * cells * cells * cells)) tets: $alone instructions alone, $contact with contact"
  if [ $((${case#*:} * (contact - alone))) -le "$alone" ]; then echo "ok $number - far_bodies_of_${cells}_cells_cost_little"
  else echo "not ok $number - far_bodies_of_${cells}_cells_cost_little"; failed=1
  fi
done
exit "$failed"
