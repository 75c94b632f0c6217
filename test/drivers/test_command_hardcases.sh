# test_command_hardcases.sh: `flesh hardcases`: what the default solver guarantees, how other settings fail, its files.
set -u
. "$(dirname -- "$0")/../shared/command.sh"

# The column NAME of the rows of FOLDER/hardcases.csv whose case, energy, poisson and solver are given.
value() {
  awk -F , -v name="$1" -v row="$2" -v energy="$3" -v poisson="$4" -v solver="${5:-default}" '
    NR == 1 { for (c = 1; c <= NF; c++) column[$c] = c; next }
    $column["case"] == row && $column["energy"] == energy && $column["poisson"] == poisson &&
    $column["solver"] == solver { print $column[name] }' out/hardcases.csv
}

# all_are COLUMN VALUE: every row says so.
all_are() {
  awk -F , -v name="$1" -v wanted="$2" '
    NR == 1 { for (c = 1; c <= NF; c++) column[$c] = c; next }
    $column[name] != wanted { print $0; bad = 1 }
    END { exit bad || NR < 2 }' out/hardcases.csv
}

battery() { expect 0 "$flesh" hardcases --quick --out out --max-seconds 60 "$@"; }

hard_starts_recover() {
  battery --energies S,E --poisson 0.3,0.49 \
    --cases 'jitter20,jitter50,plane,plane_noise,line,mirrored,invert_one,stretch10,squash100,shrink0.6,single_*' || return 1
  all_are outcome recovered && all_are finite 1 && all_are potential_rises 0 && all_are unconverged 0 &&
    all_are inverted_end 0 && [ "$(lines out/hardcases.csv)" -eq 53 ] && has out/verdict.txt 'Promised.*52 of 52 do\.'
}

violent_loads_recover() {
  battery --energies S --poisson 0.45 --cases 'tear,spin_*,!spin_h*,crash,drag1e6,gravity1000,static_stretch4' &&
    all_are outcome recovered && [ "$(lines out/hardcases.csv)" -eq 7 ]
}

collapsed_bodies_are_named_as_the_equilibria_they_are() {
  battery --energies S,E --poisson 0.45 --cases point_free,line_free && all_are outcome equilibrium &&
    [ "$(value end_is point_free E 0.45)" = minimum ] && [ "$(value end_shape point_free E 0.45)" = point ] &&
    [ "$(value end_is point_free S 0.45)" = degenerate ]
}

# Forms without a value behind J = 0 say so, and alone they end the same way.
undefined_forms_stop_with_a_statement() {
  battery --energies Neo,B --poisson 0.45 --cases mirrored,invert_one && all_are outcome stopped &&
    all_are exit_code 4 && all_are status FLESH_UNDEFINED && has out/hardcases.csv 'undefined.*J.*tet' &&
    expect 4 "$flesh" run out/cases/invert_one_B_0.45_default/scene.yaml && has stderr.txt 'smallest J = -'
}

# D rests deflated: at its own rest shape, not at the mesh's.
d_returns_to_its_own_rest() {
  battery --energies D --poisson 0.45 --cases jitter20,twist1 && all_are outcome recovered
}

a_run_repeats_alone() {
  battery --energies S --poisson 0.45 --cases jitter50,gravity1000 --seeds 2 || return 1
  [ "$(value outcome jitter50 S 0.45)" = "$(printf 'recovered\nrecovered')" ] || return 1
  for name in jitter50_seed2 gravity1000; do
    folder=out/cases/${name}_S_0.45_default
    expect 0 "$flesh" run "$folder/scene.yaml" --out again --no-frames --quiet &&
      cmp again/state.txt "$folder/out/state.txt" || return 1
  done
  expect 0 "$flesh" run "$folder/release.yaml" --out again --no-frames --quiet &&
    cmp again/state.txt "$folder/release/state.txt"
}

# The stock ways break what the default survives, or take far longer, and it shows.
other_solvers_are_found_out() {
  battery --energies S --poisson 0.49 --cases stretch10,plane,twist2 --solvers all --max-seconds 600 || return 1
  [ "$(value outcome plane S 0.49)" = recovered ] && [ "$(value outcome stretch10 S 0.49)" = recovered ] || return 1
  [ "$(value outcome stretch10 S 0.49 plain)" != recovered ] &&
    [ "$(value outcome stretch10 S 0.49 never-projected)" != recovered ] &&
    [ "$(value newton twist2 S 0.49 kinsol-line-search)" -gt "$((2 * $(value newton twist2 S 0.49)))" ] &&
    [ "$(lines out/hardcases.csv)" -eq 28 ] || { cat out/hardcases.csv; return 1; }
}

# Ten-node tets of the same meshes: their nodes on edges start elsewhere too, and what is run alone is the same.
bodies_of_ten_node_tets_recover() {
  battery --energies S --poisson 0.49 --cases jitter50,stretch5,invert_one --elements tet4,tet10,tet10-mean &&
    all_are outcome recovered && all_are inverted_end 0 && all_are tets 324 || return 1
  [ "$(value element stretch5 S 0.49)" = "$(printf 'tet4\ntet10\ntet10-mean')" ] &&
    [ "$(value linear stretch5 S 0.49 | sort -u | wc -l)" -eq 3 ] || return 1 # three problems, not one thrice
  [ "$(value max_inverted invert_one S 0.49)" = "$(printf '1\n1\n1')" ] || return 1
  folder=out/cases/jitter50_seed1_S_0.49_tet10-mean_default
  has "$folder/scene.yaml" 'element: tet10-mean' && has out/verdict.txt 'S 0.49 tet10-mean default *3 of 3' &&
    [ "$(grep -c '' "$folder/start.txt")" -gt "$(grep -c '' out/cases/jitter50_seed1_S_0.49_default/start.txt)" ] &&
    expect 0 "$flesh" run "$folder/scene.yaml" --out again --no-frames --quiet &&
    cmp again/state.txt "$folder/out/state.txt"
}

# A body that has had no time to come back is not called recovered, and what its end is, is found out.
an_early_end_is_no_recovery() {
  battery --energies S --poisson 0.45 --cases stretch10,jitter20 --set time.end=1/60 &&
    [ "$(value outcome stretch10 S 0.45)" = 'not recovered' ] && [ "$(value end_is stretch10 S 0.45)" = untangles ] &&
    [ -z "$(value recovered_at stretch10 S 0.45)" ]
}

# A process that dies is a row, and the battery goes on.
a_death_is_a_row() {
  "$flesh" hardcases --out killed --jobs 1 --energies S --poisson 0.49 --cases static_shear,single_plane >log.txt 2>&1 &
  process=$!
  tries=0
  until [ -s killed/cases/static_shear_S_0.495_default/out/result.json ] || [ "$tries" -ge 300 ]; do
    sleep 0.1
    tries=$((tries + 1))
  done
  children=$(cat "/proc/$process/task/$process/children") # the one that --jobs 1 lets run
  kill -KILL ${children:?no child found}
  wait "$process" || { cat log.txt; return 1; }
  has killed/hardcases.csv '^static_shear,.*,crashed or hung,' && has killed/hardcases.csv '^single_plane,.*,recovered,'
}

# A rise of the incremental potential and unconverged solves are seen where they happen.
rises_are_seen() {
  battery --energies E --poisson 0.3 --cases squash2,twist2,gravity1000 --solvers plain &&
    awk -F , 'NR == 1 { for (c = 1; c <= NF; c++) column[$c] = c; next }
      { rises += $column["potential_rises"]; unconverged += $column["unconverged"] }
      END { exit !(rises > 0 && unconverged > 0) }' out/hardcases.csv
}

a_setting_of_ones_own_is_kept_in_the_scene() {
  battery --energies S --poisson 0.45 --cases jitter20 --set solver.max_newton=3 --set solver.max_cutbacks=1 || return 1
  [ "$(value outcome jitter20 S 0.45)" = stopped ] &&
    has out/cases/jitter20_seed1_S_0.45_default/scene.yaml 'max_newton: 3' &&
    expect 4 "$flesh" run out/cases/jitter20_seed1_S_0.45_default/scene.yaml
}

the_table_has_the_promised_columns() {
  battery --energies S --poisson 0.45 --cases squash2 --steps 1/60,1/1000 || return 1
  has out/hardcases.csv '^case,group,seed,energy,constants,poisson,step,solver,tets,outcome,status,exit_code,steps,solves,retried,unconverged,at_rounding,untanglings,untangled_nodes,potential_rises,' &&
    has out/hardcases.csv '^squash2,starts,1,S,matched,0.45,0.001,default,324,recovered,FLESH_OK,0,220,' &&
    [ -s out/cases/squash2_S_0.45_h0.001_default/release.yaml ] && has out/verdict.txt 'S 0.45 h=0.001 default *1 of 1'
}

pictures_are_drawn() {
  command -v gnuplot >/dev/null || { echo 'no gnuplot'; return 0; }
  for picture in matrix frames_starts; do
    [ "$(wc -c <"out/$picture.png")" -gt 5000 ] || { echo "$picture"; ls -l out; return 1; }
  done
}

# The frames need no gnuplot; what is not drawn is said.
without_gnuplot_the_frames_are_drawn() {
  mkdir -p bare
  PATH=$work/bare expect 0 "$flesh" hardcases --quick --out undrawn --energies S --poisson 0.45 --cases single_plane || return 1
  has stderr.txt 'matrix.png is not drawn: gnuplot is not installed' && [ "$(lines stderr.txt)" -eq 1 ] &&
    has stdout.txt 'what could be drawn of the pictures' && [ ! -e undrawn/matrix.png ] && [ -s undrawn/matrix.gp ] &&
    [ "$(wc -c <undrawn/frames_meshes.png)" -gt 1000 ]
}

a_spent_budget_is_a_row() {
  expect 0 "$flesh" hardcases --quick --out out --energies S --poisson 0.45 --cases swing --max-seconds 1e-6 &&
    all_are outcome 'out of budget' && all_are exit_code 6 && has out/verdict.txt 'budget' &&
    ! grep -w nan out/verdict.txt # too few steps for a median
}

an_interrupted_battery_keeps_what_was_done() {
  "$flesh" hardcases --out interrupted --jobs 1 --energies S --poisson 0.49 --cases 'point_free,static_*' >log.txt 2>&1 &
  process=$!
  tries=0
  until [ -s interrupted/cases/static_shrink0.3_S_0.495_default/out/result.json ] || [ "$tries" -ge 300 ]; do
    sleep 0.1
    tries=$((tries + 1))
  done
  kill -TERM "$process"
  wait "$process"
  [ $? -eq 143 ] || { cat log.txt; return 1; }
  has interrupted/hardcases.csv '^point_free.*,equilibrium,' && has interrupted/hardcases.csv '^static_shear.*,not run,'
}

# The profiles of Newton iterations at 1 and 2 times the least, computed anew from the table's rows.
profiles_from_rows() {
  awk -F , -v element="$1" 'NR == 1 { for (c = 1; c <= NF; c++) column[$c] = c; next }
    $column["element"] == element {
      problem = $column["case"] " " $column["poisson"] " " $column["mesh"] " " $column["seed"]
      filter = $column["solver"]; problems[problem] = 1; filters[filter] = 1
      cost[problem, filter] = $column["outcome"] == "recovered" ? $column["newton"] : 1e300
      if (!(problem in least) || cost[problem, filter] < least[problem]) least[problem] = cost[problem, filter] }
    END { for (p in problems) total++
      for (f in filters) for (tau = 1; tau <= 2; tau++) { count = 0
        for (p in problems) count += cost[p, f] < 1e300 && cost[p, f] <= tau * least[p]
        printf "%s,newton,%s,%d,%.6f\n", element, f, tau, count / total } }' out/hardcases.csv | sort
}

compare_filters() {
  expect 0 "$flesh" hardcases --filters --quick --out out --elements tet4,tet10-mean --poisson 0.49 --seeds 2 "$@"
}

filters_are_compared() {
  compare_filters || return 1
  [ "$(lines out/hardcases.csv)" -eq 129 ] && all_are mesh 4x2x2 && all_are unconverged 0 || return 1
  has out/cases/4x2x2_twist_seed2_S_0.49_tet10-mean_clamped-always/scene.yaml 'eigenvalue_filter: clamp, project: always' ||
    { cat out/cases/4x2x2_twist_seed2_S_0.49_tet10-mean_clamped-always/scene.yaml; return 1; }
  for element in tet4 tet10-mean; do
    profiles_from_rows "$element" >expected.txt
    [ "$(lines expected.txt)" -eq 16 ] || return 1
    awk -F , -v element="$element" '$1 == element && $2 == "newton" && ($4 == 1 || $4 == 2) {
      printf "%s,newton,%s,%d,%.6f\n", $1, $3, $4, $5 }' out/profiles.csv | sort >written.txt
    cmp expected.txt written.txt || { cat written.txt; return 1; }
    has out/verdict.txt "^$element: 8 of 8 problems run with all filters" &&
      has out/verdict.txt '^  solved of  *nu 0.49: 8$' || return 1
  done
  # In statics auto is absolute.
  awk -F , 'NR == 1 { for (c = 1; c <= NF; c++) column[$c] = c; next }
    { k = $column["case"] $column["seed"] $column["poisson"] $column["element"]; f = $column["solver"]
      if (f == "default") newton[k] = $column["linear"]
      if (f == "absolute" && newton[k] != $column["linear"]) bad = 1 } END { exit bad }' out/hardcases.csv || return 1
  command -v gnuplot >/dev/null || return 0
  [ "$(wc -c <out/profiles.png)" -gt 5000 ]
}

# What was run stands; what was not, or with another budget, is run.
a_comparison_goes_on_where_it_was() {
  compare_filters --solvers clamped,absolute || return 1
  cp out/hardcases.csv before.csv
  rm out/cases/4x2x2_noise_seed2_S_0.49_absolute/kept.txt
  compare_filters --solvers clamped,absolute || return 1
  cut -d , -f 1-37 before.csv >before.txt # without times
  cut -d , -f 1-37 out/hardcases.csv | cmp - before.txt || return 1
  [ "$(diff before.csv out/hardcases.csv | grep -c '^>')" -le 1 ] || { diff before.csv out/hardcases.csv; return 1; }
  printf 'half a l' >out/cases/4x2x2_twist_seed1_S_0.49_clamped/kept.txt
  compare_filters --solvers clamped,absolute && cut -d , -f 1-37 out/hardcases.csv | cmp - before.txt || return 1
  compare_filters --solvers clamped,absolute --max-seconds 14 || return 1
  [ "$(diff before.csv out/hardcases.csv | grep -c '^>')" -gt 20 ] # all times anew
}

# A file's mesh takes the place of the cases' own: its flat face is held, its length is the block's.
meshes_can_be_given() {
  expect 0 "$flesh" hardcases --filters --quick --out out --elements tet4 --solvers default --cases squash \
    --meshes "2x2x2,$source_folder/../data/meshes/limb.msh" || return 1
  [ "$(lines out/hardcases.csv)" -eq 3 ] && all_are outcome recovered &&
    [ "$(awk -F , 'NR == 1 { for (c = 1; c <= NF; c++) column[$c] = c; next } $column["mesh"] == "limb" {
      print $column["tets"] }' out/hardcases.csv | sort -u)" = 2968 ] && has out/verdict.txt 'No verdict: 2 problems'
}

the_list_names_every_case() {
  expect 0 "$flesh" hardcases --list && [ "$(lines stdout.txt)" -ge 60 ] && has stdout.txt '^starts *scramble '
}

bad_options_are_refused() {
  expect 2 "$flesh" hardcases --poisson 0.3,0.5 && has stderr.txt "'0.5'.*(-1, 0.5)" &&
    expect 2 "$flesh" hardcases --energies S,X && has stderr.txt "X" &&
    expect 2 "$flesh" hardcases --energies S.as_f && has stderr.txt 'as_f' &&
    expect 2 "$flesh" hardcases --solvers fast && has stderr.txt 'kinsol-line-search' &&
    expect 2 "$flesh" hardcases --meshes 4x0x2 && has stderr.txt "'4x0x2'.*1 to 200 cells" &&
    expect 2 "$flesh" hardcases --meshes 4x2x2,4x2x2 && has stderr.txt "two that are called '4x2x2'" &&
    expect 3 "$flesh" hardcases --meshes no_such.msh && has stderr.txt 'no_such.msh' &&
    expect 2 "$flesh" hardcases --filters --cases scramble && has stderr.txt "'scramble'" &&
    expect 2 "$flesh" hardcases --elements hex8 && has stderr.txt "'hex8'.*tet4, tet10 and tet10-mean" &&
    expect 2 "$flesh" hardcases --cases nonsense && has stderr.txt "'nonsense'.*--list" &&
    expect 2 "$flesh" hardcases --steps 0 && has stderr.txt "'0'.*positive" &&
    expect 2 "$flesh" hardcases --cases '' && has stderr.txt 'empty' &&
    expect 2 "$flesh" hardcases --cases '!*' && has stderr.txt 'leaves none' &&
    expect 2 "$flesh" hardcases --seeds 1e9 && has stderr.txt '1000000000 seeds.*at most 1000000' &&
    expect 2 "$flesh" hardcases --seeds 0 && expect 2 "$flesh" hardcases scene.yaml &&
    expect 3 "$flesh" hardcases --out /dev/null/here --cases single_plane && [ ! -e out/hardcases ]
}

the_old_name_tells_the_new() {
  expect 2 "$flesh" stress --list && has stderr.txt '^flesh: the command stress has been renamed; write flesh hardcases$' &&
    [ ! -s stdout.txt ]
}

run_tests hard_starts_recover bodies_of_ten_node_tets_recover violent_loads_recover collapsed_bodies_are_named_as_the_equilibria_they_are \
  undefined_forms_stop_with_a_statement d_returns_to_its_own_rest a_run_repeats_alone other_solvers_are_found_out \
  rises_are_seen an_early_end_is_no_recovery a_death_is_a_row \
  a_setting_of_ones_own_is_kept_in_the_scene the_table_has_the_promised_columns pictures_are_drawn \
  without_gnuplot_the_frames_are_drawn a_spent_budget_is_a_row an_interrupted_battery_keeps_what_was_done the_list_names_every_case \
  filters_are_compared a_comparison_goes_on_where_it_was meshes_can_be_given \
  bad_options_are_refused the_old_name_tells_the_new
