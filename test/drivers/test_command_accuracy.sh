# TEST full memory program seconds=180 needs=flesh
# test_command_accuracy.sh: `flesh accuracy`: its figures, orders and reference, resuming, and refusals.
set -u
. "$(dirname -- "$0")/../shared/command.sh"

# column FILE NAME METHOD [PRICE]: prints the values of column NAME in the method's rows of this price (default work).
column() {
  awk -F , -v name="$2" -v method="$3" -v price="${4:-work}" '
    NR == 1 { for (c = 1; c <= NF; c++) at[$c] = c; next }
    $1 == method && $at["price"] == price { print $at[name] }' "$1"
}

# order METHOD LOW HIGH: the method's fitted order lies between LOW and HIGH and has a standard error below 0.2.
order() {
  awk -F , -v method="$1" -v low="$2" -v high="$3" '
    $1 == method && $3 >= 3 && $4 > low && $4 < high && $5 > 0 && $5 < 0.2 { found = 1 }
    END { exit !found }' all/orders.csv || { echo "order of $1 not in ($2, $3)"; cat all/orders.csv; return 1; }
}

"$flesh" mesh box --cells 4,1,1 --size 4,1,1 --out bar.msh >/dev/null || exit 1
cat >fall.yaml <<'END'
body:
  mesh: bar.msh
  density: 1000
  material: {energy: S, constants: matched, young: 4e6, poisson: 0.4}
effects:
  - inertia: {}
  - gravity: {}
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}
time: {method: backward-euler, step: 1/50, end: 0.4}
solver: {newton_tolerance: 1e-10}
END
# Long damped steps leave only the slow motion, so that the motion from there on is smooth.
"$flesh" run fall.yaml --out fall --no-frames --quiet || exit 1
grep -v '^#' fall/state.txt >start.txt
sed 's|^time.*|time: {method: backward-euler, step: 1/50, end: 1}\nstart: {state: start.txt}|' fall.yaml >bar.yaml

fixed=backward-euler,bdf2,midpoint,newmark,hht,generalized-alpha

the_table_is_complete() {
  expect 0 "$flesh" accuracy bar.yaml --quick --repeat 1 --out all \
    --steps 1/25,1/50,1/100,1/200,1/400,1/800 \
    --reference-seconds 1 || return 1
  [ ! -s stderr.txt ] || { cat stderr.txt; return 1; } # no progress line without a terminal
  # All rows are whole, have been run and have costs; those of the methods' work have an error, or one below the reference.
  awk -F , '
    NR == 1 { n = NF; for (c = 1; c <= NF; c++) at[$c] = c; next }
    NF != n { print "row", NR, "has", NF, "fields"; exit 1 }
    $at["status"] != "complete" && $at["status"] != "below reference" { print; exit 1 }
    !($at["steps"] > 0 && $at["residual_evaluations"] > 0 && $at["newton"] > 0 && $at["wall_s_min"] > 0 &&
      $at["wall_s_median"] >= $at["wall_s_min"] && $at["cpu_s"] > 0) { print; exit 1 }
    $at["price"] == "work" && ($at["status"] == "complete") != ($at["error_position_rms"] > 0) { print; exit 1 }
    { seen[$at["price"]]++ }
    END { exit !(seen["newton_tolerance"] > 2 && seen["linear_tolerance"] > 2 && seen["eigenvalue_filter"] == 3 &&
                 seen["mass"] == 2) }' all/accuracy.csv || return 1
  for method in backward-euler bdf2 midpoint newmark hht generalized-alpha; do
    [ "$(column all/accuracy.csv setting $method | wc -l)" -eq 6 ] || { echo "$method"; return 1; }
  done
  for name in work_time work_residuals orders energy steps; do
    [ ! -e "$(command -v gnuplot)" ] || [ -s all/$name.png ] || { echo "no $name.png"; return 1; }
  done
  ! find . -name '*.part-*' | grep .
}

errors_fall_with_the_step() {
  for method in backward-euler bdf2 midpoint newmark hht generalized-alpha; do
    column all/accuracy.csv error_position_rms $method |
      awk 'NR > 1 && $1 != "" && !($1 < last) { exit 1 } $1 != "" { last = $1; n++ } END { exit n < 4 }' ||
      { echo "$method:"; column all/accuracy.csv error_position_rms $method; return 1; }
  done
}

# Errors of ida fall with the tolerance, and are below 100 times the tolerance as a fraction of the body's length (4 m);
# those of ida5, whose order is above 2, need not fall at loose tolerances.
errors_follow_the_tolerance() {
  for method in ida ida5; do
    [ "$(column all/accuracy.csv setting $method | wc -l)" -eq 3 ] || { echo "$method"; return 1; }
  done
  column all/accuracy.csv error_position_rms ida | awk '
    { ratio = $1 / (4 * 10^(-1 - NR)); if (!(ratio < 100) || NR > 1 && !($1 < last)) exit 1; last = $1 }' || return 1
  [ "$(column all/accuracy.csv error_over_tolerance ida | head -n 1)" != '' ] || return 1
  # The table of the method's own steps is in order of time and reaches the end.
  awk -F , 'NR == 1 { exit $0 != "t,h,order,rejected,convergence_failures" }' all/steps/ida_1e-4.csv || return 1
  awk -F , 'NR > 1 { if (!($1 > t && $2 > 0 && $3 >= 1 && $3 <= 2)) exit 1; t = $1 } END { exit !(NR > 20 && t >= 1) }' \
    all/steps/ida_1e-4.csv
}

# accuracy_of_ida FOLDER OPTION...: compares ida and ida5 on a bar that falls and is nearly incompressible.
accuracy_of_ida() {
  to=$1 && shift
  expect 0 "$flesh" accuracy fall.yaml --set body.material.poisson=0.49 --set time.end=2 --methods ida,ida5 "$@" \
    --tolerances 3e-3,1e-3 --quick --repeat 1 --reference-seconds 1 --out "$to"
}

# A nearly incompressible bar swings for long: order 5 feeds energy into its fast oscillations, which is reported; order 2
# does not.
energy_from_nowhere_is_reported() {
  accuracy_of_ida gains --set time.max_energy_gain=1e9 && accuracy_of_ida ended || return 1
  [ "$(column ended/accuracy.csv status ida5 | sort -u)" = failed ] && has ended/verdict.txt 'ida5 gains energy' || return 1
  ! has gains/verdict.txt 'warning: ida gains' && has gains/verdict.txt 'warning: ida5 gains energy' && has gains/verdict.txt 'not stable for fast oscillations' ||
    return 1
  column gains/accuracy.csv energy_drift ida5 | awk '$1 > 0.2 { gained = 1 } END { exit !gained }' || return 1
  column gains/accuracy.csv energy_drift ida | awk '$1 > 0.1 { gained = 1 } END { exit gained }'
}

orders_are_those_of_the_methods() {
  order backward-euler 0.85 1.1 && order bdf2 1.85 2.1 && order midpoint 1.9 2.1 && order newmark 1.9 2.1 &&
    order hht 1.85 2.1 && order generalized-alpha 1.9 2.1
}

the_reference_is_known() {
  has all/verdict.txt 'they differ by [0-9.e-]* m rms' && has all/accuracy.json '"uncertainty_position_rms": ' ||
    return 1
  # No error below the reference's uncertainty is reported.
  u=$(sed -n 's/.*"uncertainty_position_rms": \([0-9.e+-]*\),*/\1/p' all/accuracy.json)
  awk -F , -v u="$u" 'NR == 1 { for (c = 1; c <= NF; c++) at[$c] = c; next }
    $at["error_position_rms"] != "" && $at["error_position_rms"] <= u { print u, $0; exit 1 }' all/accuracy.csv
}

# Against a reference that was refined as little as possible, the error of a very small step is not reported.
a_poor_reference_tells_less() {
  expect 0 "$flesh" accuracy bar.yaml --quick --repeat 1 --out poor --methods midpoint --steps 1/25,1/25600 \
    --reference-seconds 1e-6 || return 1
  has poor/verdict.txt 'midpoint  *step=1/25600 .* error below the reference' || return 1
  column poor/accuracy.csv status midpoint | tail -n 1 | grep -q '^below reference$' || return 1
  [ -z "$(column poor/accuracy.csv error_position_rms midpoint | tail -n 1)" ]
}

# A run is compared at every step that it takes: its errors depend neither on the other runs of the comparison nor on
# whether their steps coincide.
worst_is_the_worst_of_all_steps() {
  expect 0 "$flesh" accuracy bar.yaml --quick --repeat 1 --out alone --methods bdf2,ida --steps 1/50 \
    --tolerances 1e-3 --set time.end=2 --reference-seconds 0.5 || return 1
  expect 0 "$flesh" accuracy bar.yaml --quick --repeat 1 --out beside --methods bdf2,ida --steps 1/4,1/7,1/50 \
    --tolerances 1e-3 --set time.end=2 --reference-seconds 0.5 || return 1
  for figure in error_position_rms error_position_max error_tip error_volume energy_drift; do
    for method in bdf2 ida; do
      one=$(column alone/accuracy.csv $figure $method | tail -n 1)
      two=$(column beside/accuracy.csv $figure $method | tail -n 1)
      echo "$figure of $method: $one and $two"
      awk -v a="$one" -v b="$two" 'BEGIN { exit !(a * b > 0 && (a / b - 1)^2 < 1e-4) }' || return 1
    done
  done
}

# A method that cannot run the scene is refused with its reason, which is printed once.
a_refusal_has_its_reason() {
  "$flesh" mesh box --cells 1,1,1 --size 1,1,1 --out one.msh >/dev/null || return 1
  expect 0 "$flesh" accuracy fall.yaml --quick --repeat 1 --out refusing --methods bdf2,ida,ida5 --steps 1/25,1/50 \
    --tolerances 1e-2,1e-3 --set body.mesh=one.msh --set body.element=tet10-mean --set body.material.poisson=0.5 \
    --set time.end=0.04 --reference-seconds 0.1 --max-seconds 600 || return 1
  has refusing/verdict.txt '^refused: ida, ida5: .*cannot judge the error of the pressures of incompressible tets' &&
    [ "$(grep -c 'cannot judge' refusing/verdict.txt)" -eq 1 ]
}

# The errors are those of `flesh run`: the command that the verdict names has them when compared with a much finer run.
the_named_command_repeats_a_run() {
  expect 0 "$flesh" accuracy bar.yaml --quick --repeat 1 --out one --methods midpoint --steps 1/25,1/50,1/100 \
    --reference-seconds 0.1 ||
    return 1
  command=$(grep -m 1 -o 'flesh run .*time.method=midpoint.*' one/verdict.txt)
  [ -n "$command" ] || { cat all/verdict.txt; return 1; }
  sh -c "\"$flesh\" ${command#flesh } --out named --no-frames --quiet" || return 1
  expect 0 "$flesh" run bar.yaml --set time.method=midpoint --set time.step=1/6400 --out fine --no-frames --quiet ||
    return 1
  setting=$(echo "$command" | sed 's/.*time.step=//')
  reported=$(awk -F , -v s="step=$setting" '
    NR == 1 { for (c = 1; c <= NF; c++) at[$c] = c; next }
    $1 == "midpoint" && $2 == s { print $at["error_position_max"]; exit }' one/accuracy.csv)
  grep -v '^#' named/state.txt >one.txt
  grep -v '^#' fine/state.txt >two.txt
  # The largest error of a node at the end is at most the reported one, that at the worst time, and at least 1/20 of it.
  paste -d ' ' one.txt two.txt | awk -v reported="$reported" '
    { d = sqrt(($1-$7)^2 + ($2-$8)^2 + ($3-$9)^2); if (d > most) most = d }
    END { print most, reported; exit !(most <= 1.05 * reported && most > reported / 20) }'
}

# If the scene's own steps are adaptive, rows of fixed steps, also those with other settings, have fixed steps all the same.
fixed_steps_are_fixed() {
  for own in 'hht --set time.adaptive=true' runge-kutta; do
    expect 0 "$flesh" accuracy bar.yaml --quick --repeat 1 --out own --methods adaptive,hht --steps 1/25,1/50 \
      --tolerances 1e-2 --set time.tolerance=1e-5 --set time.method=$own --reference-seconds 0.1 || return 1
    [ "$(column own/accuracy.csv steps hht | paste -sd ' ' -)" = '25 50' ] &&
      column own/accuracy.csv steps hht newton_tolerance | grep -q '^50$' &&
      [ -z "$(column own/accuracy.csv steps adaptive newton_tolerance)" ] || { cat own/accuracy.csv; return 1; }
  done
}

# The verdict says what methods and settings cost for an error of 1 % and of 0.1 % of the motion.
shares_are_answered() {
  has all/verdict.txt '^For 1 % of the motion' && has all/verdict.txt '^For 0.1 % of the motion' &&
    has all/verdict.txt '<- least CPU time' && has all/verdict.txt 'Backward Euler costs' &&
    has all/verdict.txt 'solver.eigenvalue_filter=trust-region-always' && has all/verdict.txt '--mesh measures its error'
}

# Results differ less as the Newton tolerance becomes tighter.
tight_solves_change_less() {
  column all/accuracy.csv difference backward-euler newton_tolerance |
    awk 'NR > 1 && !($1 < last) { exit 1 } { last = $1 } END { exit NR < 3 }'
}

# rows COLUMNS: prints columns of the completed rows of the comparison's database.
rows() { "$flesh" sweep export more/accuracy.db --columns "$1" --where "wall_s_min IS NOT NULL" 2>/dev/null | sed 1d; }
three_rows() { [ "$(rows id | grep -c .)" -ge 3 ]; }
# A comparison that is interrupted after about its third row resumes; completed rows stay as they are.
resuming_goes_on() {
  set -- accuracy bar.yaml --quick --repeat 1 --out more --methods $fixed \
    --steps 1/25,1/50,1/100,1/200,1/400,1/800,1/1600 \
    --reference-seconds 1
  "$flesh" "$@" >stdout.txt 2>stderr.txt &
  run=$!
  wait_until "$run" three_rows || return 1
  kill -INT $run
  wait $run
  status=$?
  [ $status -eq 130 ] && has stderr.txt 'interrupted after [0-9]* of' ||
    { echo "ended with $status"; cat stdout.txt stderr.txt; return 1; }
  rows id,wall_s_min >before.txt
  cp more/reference.states before.states
  done=$(lines before.txt)
  [ "$done" -ge 3 ] && has more/accuracy.csv ',not run,' || return 1
  expect 0 "$flesh" "$@" --resume || return 1
  has stdout.txt "$done of them done before" && cmp before.states more/reference.states || return 1
  ! grep -q ',not run,' more/accuracy.csv || return 1
  # Rows that were complete keep their times.
  rows id,wall_s_min >after.txt
  while read -r t; do grep -q -x -F "$t" after.txt || { echo "$t is gone"; return 1; }; done <before.txt
  # If all rows are complete, nothing runs.
  cp more/accuracy.csv before.csv
  expect 0 "$flesh" "$@" --resume && cmp before.csv more/accuracy.csv
}

resuming_refuses_what_changed() {
  set -- --resume --quick --out more --methods $fixed --reference-seconds 1
  cp more/accuracy.json before.json
  rows id,wall_s_min >before.txt
  expect 2 "$flesh" accuracy bar.yaml "$@" --steps 1/25,1/50 --set body.density=900 &&
    has stderr.txt 'accuracy.db: is of another accuracy: its scene or --set .* (there scene [0-9a-f]*, here scene [0-9a-f]*)$' ||
    return 1
  expect 2 "$flesh" accuracy bar.yaml "$@" --steps 1/20,1/40 && has stderr.txt '(there longest step 0.04 s, here longest step 0.05 s)$' ||
    return 1
  cmp before.json more/accuracy.json && rows id,wall_s_min | cmp - before.txt
}

a_spent_budget_is_a_row() {
  set -- accuracy bar.yaml --resume --quick --out spent --methods midpoint --reference-seconds 0.1 --repeat 1
  expect 0 "$flesh" "$@" --steps 1/25,1/50 || return 1
  expect 0 "$flesh" "$@" --steps 1/25,1/50,1/800 --max-seconds 1e-3 || return 1
  [ "$(column spent/accuracy.csv status midpoint | tr '\n' ' ')" = 'complete complete out of budget ' ] || {
    cat spent/accuracy.csv
    return 1
  }
  # With a larger budget the row is completed.
  expect 0 "$flesh" "$@" --steps 1/25,1/50,1/400,1/800 || return 1
  ! grep -q 'out of budget' spent/accuracy.csv
}

a_run_that_fails_is_a_row() {
  # The bar falls fast at first: single long steps of at most three iterations and no cutbacks do not converge.
  expect 0 "$flesh" accuracy bar.yaml --quick --repeat 1 --out fails --methods backward-euler,bdf2,midpoint \
    --steps 1/2,1/1000 \
    --reference-seconds 1 --set solver.max_newton=3 --set solver.max_cutbacks=0 || return 1
  column fails/accuracy.csv status backward-euler | grep -q '^failed$' &&
    column fails/accuracy.csv status backward-euler | grep -q '^complete$'
}

bad_usage_is_refused() {
  for words in '' 'bar.yaml two.yaml' 'bar.yaml --methods rk4' 'bar.yaml --methods bdf2,bdf2' 'bar.yaml --steps 1/60,0' \
    'bar.yaml --steps 1/30,x' 'bar.yaml --tolerances -1' 'bar.yaml --repeat 0' \
    'bar.yaml --set time.end=0' 'bar.yaml --set effects.inertia=null' 'bar.yaml --set nonsense=1' \
    'bar.yaml --steps 1/30,1/30' 'bar.yaml --methods ,'; do
    expect 2 "$flesh" accuracy $words --out refused && [ "$(lines stderr.txt)" -eq 1 ] ||
      { echo "words: $words"; cat stderr.txt; return 1; }
  done
  expect 2 "$flesh" accuracy bar.yaml --methods rk4 && has stderr.txt 'some of backward-euler, bdf2' || return 1
  expect 3 "$flesh" accuracy none.yaml && has stderr.txt none.yaml || return 1
  expect 3 "$flesh" accuracy bar.yaml --out start.txt && has stderr.txt start.txt || return 1
  expect 0 "$flesh" accuracy --help && has stdout.txt 'error_over_tolerance' && has stdout.txt '130/143' || return 1
  [ ! -e refused ]
}

without_gnuplot_the_figures_stand() {
  mkdir -p bin
  PATH=$work/bin expect 0 "$flesh" accuracy bar.yaml --quick --repeat 1 --out plain --methods midpoint \
    --steps 1/25,1/50 \
    --reference-seconds 0.1 || return 1
  has stderr.txt 'gnuplot is not installed' && [ "$(lines stderr.txt)" -eq 1 ] && [ -s plain/accuracy.csv ]
}

tests="the_table_is_complete
errors_fall_with_the_step
errors_follow_the_tolerance
${long:+energy_from_nowhere_is_reported}
orders_are_those_of_the_methods
the_reference_is_known
${long:+a_poor_reference_tells_less worst_is_the_worst_of_all_steps}
${long:+a_refusal_has_its_reason the_named_command_repeats_a_run fixed_steps_are_fixed}
shares_are_answered
tight_solves_change_less
resuming_goes_on
resuming_refuses_what_changed
a_spent_budget_is_a_row
a_run_that_fails_is_a_row
bad_usage_is_refused
without_gnuplot_the_figures_stand"
# shellcheck disable=SC2086
run_tests $tests
