# TEST full memory program seconds=120 needs=flesh uses=stop_at
# test_command_accuracy_mesh.sh: `flesh accuracy --mesh`: the error of the mesh beside that of the step, and resuming.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
# STOP_AT names the library to preload; without it the test of killed comparisons is left out.
if [ -n "${STOP_AT-}" ]; then shim=$(preloadable "$STOP_AT") || exit 1; fi
meshes=$source_folder/../data/meshes

"$flesh" mesh box --cells 4,1,1 --size 4,1,1 --out small.mesh >/dev/null || exit 1
cat >sag.yaml <<END
body: {mesh: $meshes/bar_8x2x2.mesh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.49}}
effects:
  - gravity: {acceleration: [0, 0, -0.2]}
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}
END
sed "s|$meshes/bar_8x2x2.mesh|small.mesh|" sag.yaml >small.yaml

# value COLUMN ELEMENT TETS FILE: prints the value of the row with this element and number of tets.
value() {
  awk -F , -v name="$1" -v element="$2" -v tets="$3" 'NR == 1 { for (c = 1; c <= NF; c++) at[$c] = c; next }
    $at["element"] == element && $at["tets"] == tets { print $at[name] }' "$4"
}

# between LOW VALUE HIGH
between() {
  awk -v low="$1" -v value="$2" -v high="$3" 'BEGIN { exit !(value != "" && low + 0 <= value + 0 && value + 0 <= high + 0) }' ||
    { echo "$2 is not between $1 and $3"; return 1; }
}

# The errors of meshes and elements in an equilibrium are in the table, the words and the picture.
an_equilibrium_is_judged() {
  expect 0 "$flesh" accuracy sag.yaml --mesh --coarser small.yaml --mesh-seconds 2 --out sag || return 1
  [ ! -s stderr.txt ] || { cat stderr.txt; return 1; }
  has sag/mesh.csv '^element,tets,nodes,refine,scene,poisson,method,step,cpu_s,error_over_motion,' || return 1
  # A bar of 192 linear tets hardly bends, one of ten-node tets does.
  between 0.75 "$(value error_over_motion tet4 192 sag/mesh.csv)" 0.9 &&
    between 0.01 "$(value error_over_motion tet10-mean 192 sag/mesh.csv)" 0.04 &&
    between 0.05 "$(value error_over_motion tet10 192 sag/mesh.csv)" 0.12 || return 1
  has sag/mesh.txt "At a Poisson's ratio of 0.49 your 192 tets (tet4) are 8[0-9] % off.$" &&
    has sag/mesh.txt 'reference: tet10-mean of 192 and 1536 tets, extrapolated at order [0-9.]* (measured over three meshes)' &&
    has sag/mesh.txt 'against tet10 of 192 and 1536 tets' && has sag/mesh.txt 'For 10 % in all: tet10-mean, [0-9]* tets, [0-9.e-]* s' &&
    has sag/mesh.txt 'Order of convergence in the size of the cells: ' || return 1
  [ ! -e "$(command -v gnuplot)" ] || [ -s sag/work_mesh.png ] || return 1
  ! find sag -name '*.states' | grep .
}

# The reported error of the scene's mesh is the difference of two runs of the scene.
the_errors_are_those_of_runs() {
  expect 0 "$flesh" run sag.yaml --out own --no-frames --quiet && expect 0 "$flesh" run sag.yaml --set body.element=tet10-mean \
    --set body.refine=1 --out best --no-frames --quiet || return 1
  # The mesh's nodes come first in both states; they have trapezoidal weights.
  grep -v '^#' own/state.txt >own.txt
  grep -v '^#' best/state.txt | head -n "$(lines own.txt)" >best.txt
  awk 'function square(x) { return x * x }
    FNR == 1 { file++ } file == 1 && NF == 4 { X[++n] = $1; Y[n] = $2; Z[n] = $3 }
    file == 2 { for (c = 1; c <= 3; c++) own[FNR, c] = $c }
    file == 3 { w = 1; if (X[FNR] == 0 || X[FNR] == 4) w /= 2; if (Y[FNR] != 0.5) w /= 2; if (Z[FNR] != 0.5) w /= 2
      d += w * (square(own[FNR, 1] - $1) + square(own[FNR, 2] - $2) + square(own[FNR, 3] - $3))
      m += w * (square(X[FNR] - $1) + square(Y[FNR] - $2) + square(Z[FNR] - $3)) }
    END { print sqrt(d / m) }' "$meshes/bar_8x2x2.mesh" own.txt best.txt >ratio.txt
  reported=$(value error_over_motion tet4 192 sag/mesh.csv)
  awk -v reported="$reported" '{ print "runs differ by", $1, "reported:", reported; exit !($1 > 0.97 * reported && $1 < 1.03 * reported) }' ratio.txt
}

# For a motion, the errors of meshes stand beside those of steps.
a_motion_is_judged_beside_its_steps() {
  cat >swing.yaml <<END
body: {mesh: small.mesh, density: 1000, material: {energy: S, young: 4e6, poisson: 0.4}}
effects:
  - inertia: {}
  - gravity: {}
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}
time: {method: newmark, step: 1/100, end: 1/5}
END
  expect 0 "$flesh" accuracy swing.yaml --mesh --mesh-seconds 0.1 --quick --reference-seconds 0.5 --methods newmark,backward-euler \
    --steps 1/50,1/100,1/200,1/400 --out swing || return 1
  has swing/mesh.txt 'The error of the mesh beside that of the step' && has swing/mesh.txt 'your 24 tets (tet4) are [0-9]* % off; the step (newmark at 1/100 s) adds' &&
    has swing/mesh.txt 'The mesh makes the error' && has swing/mesh.txt 'assumed: two meshes' || return 1
  awk -F , 'NR == 1 { for (c = 1; c <= NF; c++) at[$c] = c; next }
    !($at["step_error_over_motion"] > 0 && $at["step"] > 0 && $at["cpu_s"] > 0) { print; exit 1 }' swing/mesh.csv || return 1
  [ -s swing/verdict.txt ] && between 0.15 "$(value error_over_motion tet4 24 swing/mesh.csv)" 1
}

# same_meshes FIRST SECOND: one table has all meshes of the other (which fit into a time), and tables of the same meshes are
# equal.
same_meshes() {
  awk -F , '{ key = $1 "," $2 "," $3 "," $4 "," $5 "," $6 "," $7 }
    NR == FNR { of_first[key] = $0; first++; next }
    { second++; if (key in of_first) both++; if (of_first[key] != $0) differ = $0 }
    END { if (both < first && both < second) { print "meshes are others"; exit 1 }
      if (first == second && differ != "") { print "differs:", differ; exit 1 } }' "$1" "$2"
}

# child_is_stopped PID: the process or a child of it is stopped; sets `child`, the number of that process.
child_is_stopped() {
  for child in "$1" $(cat "/proc/$1/task/$1/children"); do
    grep -q '^State:.T' "/proc/$child/status" && return 0
  done
  return 1
}

# A comparison that is killed during the reference, the runs of methods or those of meshes, each time when a file of states
# is complete and the database does not have its row yet, resumes: it gives the same table of meshes, and repeats no row.
a_killed_comparison_resumes() {
  set -- accuracy swing.yaml --mesh --mesh-seconds 0.1 --quick --reference-seconds 0.5 --methods newmark,backward-euler \
    --steps 1/50,1/100,1/200,1/400 --out killed
  cut -d , -f 1-7,10,11,13 swing/mesh.csv >expected
  for file in reference_ida5.states reference.states mesh_1.states; do
    rm -rf killed
    env LD_PRELOAD="$shim" FLESH_STOP_AFTER="$file" FLESH_STOP_SIGNAL=19 "$flesh" "$@" >/dev/null 2>&1 &
    run=$!
    wait_until "$run" child_is_stopped "$run" || return 1
    kill -KILL "$run" "$child"
    wait "$run" 2>/dev/null
    "$flesh" sweep export killed/accuracy.db --columns 'id,started' --where "status = 'complete'" >before
    expect 0 "$flesh" "$@" --resume || return 1
    "$flesh" sweep export killed/accuracy.db --columns 'id,started' --where "status = 'complete'" >after
    while read -r row; do grep -q -x -F "$row" after || { echo "$file: $row is gone"; cat after; return 1; }; done <before
    cut -d , -f 1-7,10,11,13 killed/mesh.csv >found
    same_meshes expected found && ! grep -q ',not run,' killed/accuracy.csv &&
      ! find killed -name 'mesh_*.states' -o -name 'reference_*.states' -o -name tight.states | grep . || return 1
  done
  # If all rows are complete, nothing runs.
  cp killed/mesh.txt killed/verdict.txt . && expect 0 "$flesh" "$@" --resume && cmp mesh.txt killed/mesh.txt &&
    cmp verdict.txt killed/verdict.txt || return 1
  # With more time more meshes are run, and earlier ones are judged with them.
  expect 0 "$flesh" "$@" --resume --mesh-seconds 4 && [ "$(lines killed/mesh.csv)" -gt "$(lines found)" ]
}

# A coarser scene from another start would be another motion, not a coarser mesh.
another_start_is_another_motion() {
  expect 0 "$flesh" accuracy swing.yaml --mesh --coarser swing.yaml --mesh-seconds 0.1 --quick --reference-seconds 0.1 \
    --methods newmark --steps 1/50,1/100 --out same || return 1
  ! grep 'starts elsewhere' same/mesh.csv || return 1
  "$flesh" run swing.yaml --set time.end=1/50 --out moved --no-frames --quiet && grep -v '^#' moved/state.txt >moved.txt || return 1
  sed 's|^time|start: {state: moved.txt}\ntime|' swing.yaml >moved.yaml
  expect 0 "$flesh" accuracy swing.yaml --mesh --coarser moved.yaml --mesh-seconds 0.1 --quick --reference-seconds 0.1 \
    --methods newmark --steps 1/50,1/100 --out moved_from || return 1
  [ "$(grep -c 'moved.yaml.*starts elsewhere' moved_from/mesh.csv)" -eq 3 ]
}

bad_usage_is_refused() {
  expect 2 "$flesh" accuracy sag.yaml --out none && has stderr.txt 'no inertia.*--mesh' &&
    expect 2 "$flesh" accuracy swing.yaml --coarser small.yaml --out none && has stderr.txt '--coarser is given without --mesh' &&
    expect 3 "$flesh" accuracy sag.yaml --mesh --coarser none.yaml --out none && has stderr.txt none.yaml &&
    expect 2 "$flesh" accuracy small.yaml --mesh --coarser sag.yaml --out none && [ ! -e none ] &&
    has stderr.txt 'sag.yaml has 192 tets, and is finer than small.yaml with its 24; it must not have more'
}

run_tests an_equilibrium_is_judged the_errors_are_those_of_runs a_motion_is_judged_beside_its_steps \
  ${STOP_AT:+a_killed_comparison_resumes} another_start_is_another_motion bad_usage_is_refused
