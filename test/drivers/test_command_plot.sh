# TEST full memory program seconds=60 needs=flesh
# test_command_plot.sh: `flesh plot`: its curves, axes, scripts and refusals. FLESH names the program.
set -u
. "$(dirname -- "$0")/../shared/command.sh"

cat >bar.yaml <<'END'
body: {mesh: bar.msh, material: {energy: S, young: 1e5, poisson: 0.45}}
effects:
  - inertia: {}
  - gravity: {}
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}
time: {method: newmark, step: 1/60, end: 1}
output:
  frame_interval: 0
  probes:
    - {name: tip, point: [3, 0.5, 0.5], quantities: [position, J]}
    - {name: clamp, box: [[-1, -1, -1], [1e-9, 2, 2]], quantities: [reaction]}
END
"$flesh" mesh box --cells 4,1,1 --size 3,1,1 --out bar.msh >/dev/null && "$flesh" run bar.yaml --out one --quiet &&
  "$flesh" run bar.yaml --out two --quiet --set time.method=backward-euler || exit 1

check() { /usr/bin/python3 "$source_folder/shared/check_plot.py" "$@"; }
refused() { # CODE SENTENCE ARGUMENT...
  code=$1 sentence=$2
  shift 2
  expect "$code" "$flesh" plot "$@" && has stderr.txt "$sentence" && [ "$(lines stderr.txt)" -eq 1 ]
}

curves_are_those_of_the_runs() {
  expect 0 "$flesh" plot one two --y probe.tip.z --out tip.svg && has stdout.txt '^picture: tip.svg$' || return 1
  check tip.svg one/probes.csv 't [s]' 'tip.position_z [m]' '#0072b2' &&
    check tip.svg two/probes.csv 't [s]' 'tip.position_z [m]' '#d55e00' || return 1
  has tip.svg '>one<' && has tip.svg '>two<' && has tip.svg '>t \[s\]<' && has tip.svg '>tip.position_z \[m\]<' || return 1
  ! check tip.svg one/probes.csv 't [s]' 'tip.position_x [m]' '#0072b2' || { echo 'another curve passes'; return 1; }
}

pictures_are_not_empty() {
  expect 0 "$flesh" plot one two/ --y tip.position_z --x tip.position_x --out tip.png --width 500 --height 300 &&
    check tip.png '#0072b2' '#d55e00' || return 1
  expect 0 "$flesh" plot one --y tip.J --out J.pdf && [ "$(head -c 5 J.pdf)" = %PDF- ] && [ "$(wc -c <J.pdf)" -gt 3000 ] &&
    has J.gp "set ylabel \"tip.J\"" || return 1
  has J.gp '^unset key$' # a single curve has no legend
}

columns_have_units_and_may_be_many() {
  expect 0 "$flesh" plot one/history.csv --y 'energy_*' || return 1 # plot.svg
  has plot.gp 'set ylabel "energy_.052 \[J\]"' && has plot.gp 'title "energy_total"' || { cat plot.gp; return 1; }
  check plot.svg one/history.csv t energy_elasticity '#009e73' || return 1
  expect 0 "$flesh" plot one --y clamp.reaction_z,clamp.reaction_x --x energy_inertia --out reaction.svg &&
    has reaction.gp 'set ylabel "clamp.reaction_z, clamp.reaction_x \[N\]"' &&
    has reaction.gp 'set xlabel "energy_inertia \[J\]"' || return 1
  refused 2 'tip.J is in numbers without a unit and tip.position_z in m; one axis has one unit' one --y tip.J,tip.z || return 1
  mkdir -p second && printf 't,weld_2_traction,weld_released,contact_2_force\n0,1,2,3\n1,2,3,4\n' >second/history.csv
  refused 2 'weld_2_traction is in Pa and weld_released in J; one axis has one unit' second/history.csv --y 'weld_*' &&
    refused 2 'weld_released is in J and contact_2_force in N' second/history.csv --y weld_released,contact_2_force
}

# The legend names as many curves as leave room for the plot, here three columns of 25, and counts the rest.
keys_leave_room_for_curves() {
  awk 'BEGIN { printf "t"; for (k = 1; k <= 300; k++) printf(",column_%03d", k); print "";
    for (r = 0; r < 3; r++) { printf "%d", r; for (k = 1; k <= 300; k++) printf ",%d", k * r; print "" } }' >many.csv
  expect 0 "$flesh" plot many.csv --y 'column_*' --out many.svg && has many.svg '>and 226 more<' && has many.svg '>column_074<' &&
    ! has many.svg '>column_075<' >/dev/null || return 1
  expect 0 "$flesh" plot many.csv --y 'column_00*' --out few.svg && has few.svg '>column_009<' && ! has few.svg ' more<' >/dev/null
}

axes_may_be_logarithmic() {
  expect 0 "$flesh" plot two --y energy_elasticity --log y --out log.svg &&
    check log.svg two/history.csv t energy_elasticity '#0072b2' log || return 1
  ! check log.svg two/history.csv t energy_elasticity '#0072b2' 2>/dev/null || { echo 'not logarithmic'; return 1; }
  printf 'cost,error\n1,-1\n2,0\n' >negative.csv
  refused 2 'there is nothing to draw: error over cost has no row with finite and, on logarithmic axes, positive' \
    negative.csv --y error --log xy --out none.svg && [ ! -e none.svg ] || return 1
  refused 2 "log is 'z'; it must be x, y or xy" one --y t --log z
}

any_table_can_be_grouped() {
  cat >work.csv <<'END'
"method","cpu [s]",error
bdf2,1,1e-2
"a ""fast"", one",1,1e-1
bdf2,2,2.5e-3
"a ""fast"", one",2,5e-2
bdf2,4,
END
  expect 0 "$flesh" plot work.csv --x cpu --y error --by method --log xy --out work.svg || return 1
  has work.svg '>bdf2<' && has work.svg '>a &quot;fast&quot;, one<\|>a "fast", one<' && has work.svg '>cpu \[s\]<' &&
    has work.gp '^2 0.0025$' && has work.gp '^4 NaN$' || return 1
  refused 2 "work.csv: method of row 1 is 'bdf2', which is no number; --by makes a curve for each word" work.csv --y method
}

a_script_draws_it_again() {
  expect 0 "$flesh" plot one --y J_min --out again.svg --title "it's 100 %; \`touch sign\`" || return 1
  mv again.svg first.svg && gnuplot -d ./again.gp && cmp first.svg again.svg && [ ! -e sign ]
}

# Of many rows only those that show are kept: the picture, with a spike of one row, is the same as that of all rows.
many_rows_are_thinned() {
  python3 - <<'END' >many.csv || return 1
import math, random
random.seed(3)
rows = [[1 + k / 1000, math.exp(random.gauss(0, 0.3) + math.sin(k / 2000))] for k in range(12000)]
rows[7001][1], rows[3000:3400] = 40, [[t, "nan"] for t, _ in rows[3000:3400]]
print("t,a", *(f"{t},{a}" for t, a in rows), sep="\n")
END
  for log in '' 'x' 'xy'; do
    expect 0 "$flesh" plot many.csv --y a ${log:+--log $log} --width 300 --height 200 --out many.png || return 1
    [ "$(lines many.gp)" -lt 4840 ] || { lines many.gp; return 1; }
    { echo '$curve_1 << END'; sed '1d; s/,/ /' many.csv; sed -n '/^END$/,$p' many.gp; } >all.gp
    gnuplot -d -e "picture='all.png'" ./all.gp && check many.png all.png || return 1
  done
  expect 0 "$flesh" plot many.csv --y a --points --out dots.svg && [ "$(lines dots.gp)" -gt 12000 ]
}

what_is_not_there_is_told() {
  refused 2 'one has no column foo; it has t, step, h, internal_steps, newton, .*, inverted, tip.position_x, .*, clamp.reaction_moment_z$' \
    one --y foo &&
    refused 2 'one has no column bar; it has t' one --y J_min --x bar &&
    refused 2 'one has no column law; it has t' one --y J_min --by law &&
    refused 2 '^flesh plot: --y is missing; it must be the name of a column$' one &&
    refused 3 'nowhere: cannot be opened' nowhere --y t &&
    refused 3 '\.: this folder has no history.csv' . --y t &&
    refused 2 "out is 'tip.gif'; it must be a file whose name ends in .svg, .png or .pdf" one --y t --out tip.gif &&
    refused 2 'width is 3; it must be 100 to 10000 pixels' one --y t --width 3 &&
    refused 3 'away/x.svg\|away' one --y J_min --out away/x.svg || return 1
  printf 't,a\n0,1\n1\n' >short.csv
  refused 3 'short.csv:3: there are 1 fields, but the header names 2' short.csv --y a || return 1
  : >empty.csv
  refused 3 'empty.csv: the file is empty' empty.csv --y a || return 1
  printf 't,a\n' >header.csv
  refused 2 'there is nothing to draw' header.csv --y a || return 1
  printf 't,a\n0,1\n1,2\n' >own.gp
  refused 2 'is read by' own.gp --y a --out own.svg && [ "$(lines own.gp)" -eq 3 ]
}

run_tests keys_leave_room_for_curves curves_are_those_of_the_runs pictures_are_not_empty columns_have_units_and_may_be_many \
  axes_may_be_logarithmic any_table_can_be_grouped a_script_draws_it_again many_rows_are_thinned what_is_not_there_is_told
