# TEST full memory program seconds=180 needs=flesh
# test_command_hardcases.sh: `flesh hardcases`: what the default solver guarantees, its files and refusals.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
. "$(dirname -- "$0")/../shared/hardcases.sh"

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

# Runs of forms that are undefined for J <= 0 stop and say so, and `flesh run` of such a case ends in the same way.
undefined_forms_stop_with_a_statement() {
  battery --energies Neo,B --poisson 0.45 --cases mirrored,invert_one && all_are outcome stopped &&
    all_are exit_code 4 && all_are status FLESH_UNDEFINED && has out/hardcases.csv 'undefined.*J.*tet' &&
    expect 4 "$flesh" run out/cases/invert_one_B_0.45_default/scene.yaml && has stderr.txt 'smallest J = -'
}

# Bodies of form D return to their own rest, which is smaller than the mesh.
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

# The end of a body of ten-node tets, with 1470 free unknowns, is judged, too.
ends_of_ten_node_bodies_are_judged() {
  battery --energies S --poisson 0.49 --cases scramble_static --elements tet10-mean --meshes 5x3x3 \
    --set 'solver.techniques=[-untangle,-softened_steps]' && all_are outcome 'stressed at rest' && all_are end_is minimum
}

# A body that has had no time to come back is not called recovered, and its end is classified all the same.
an_early_end_is_no_recovery() {
  battery --energies S --poisson 0.45 --cases stretch10,jitter20 --set time.end=1/60 &&
    [ "$(value outcome stretch10 S 0.45)" = 'not recovered' ] && [ "$(value end_is stretch10 S 0.45)" = untangles ] &&
    [ -z "$(value recovered_at stretch10 S 0.45)" ]
}

# A case whose process dies is a row, and the battery goes on. The killed case would take many seconds.
a_death_is_a_row() {
  "$flesh" hardcases --out killed --jobs 1 --energies S --poisson 0.49 --cases static_shear,single_plane \
    --set body.refine=1 --max-seconds 600 >log.txt 2>&1 &
  wait_until $! [ -s killed/cases/static_shear_S_0.495_default/out/result.json ] || return 1
  children=$(cat "/proc/$process/task/$process/children") # one child, as --jobs is 1
  kill -KILL ${children:?no child found}
  wait "$process" || { cat log.txt; return 1; }
  has killed/hardcases.csv '^static_shear,.*,crashed or hung,' && has killed/hardcases.csv '^single_plane,.*,recovered,'
}

# Rises of the incremental potential and unconverged solves are counted.
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

# Without gnuplot the frames are drawn, and a message names the picture that is not. Files that a killed process left
# half-written are removed.
without_gnuplot_the_frames_are_drawn() {
  left=undrawn/cases/single_plane_S_0.45_default/start.txt.part-99999999-1
  mkdir -p bare "${left%/*}" && : >"$left" || return 1
  PATH=$work/bare expect 0 "$flesh" hardcases --quick --out undrawn --energies S --poisson 0.45 --cases single_plane || return 1
  has stderr.txt 'matrix.png is not drawn: gnuplot is not installed' && [ "$(lines stderr.txt)" -eq 1 ] &&
    has stdout.txt 'what could be drawn of the pictures' && [ ! -e undrawn/matrix.png ] && [ -s undrawn/matrix.gp ] &&
    [ "$(wc -c <undrawn/frames_meshes.png)" -gt 1000 ] && [ -s "${left%/*}/start.txt" ] && [ ! -e "$left" ]
}

# If a signal ends gnuplot and the command, as ^C does, the command's end is that of the signal.
an_interrupted_picture_is_reported() {
  printf '#!/bin/sh\nkill -TERM $PPID $$\n' >bare/gnuplot && chmod +x bare/gnuplot || return 1
  PATH=$work/bare:$PATH expect 143 "$flesh" hardcases --quick --out unfinished --energies S --poisson 0.45 --cases single_plane &&
    has stderr.txt 'matrix.png is not drawn: interrupted by SIGTERM' && [ ! -e unfinished/matrix.log ]
}

a_spent_budget_is_a_row() {
  expect 0 "$flesh" hardcases --quick --out out --energies S --poisson 0.45 --cases swing --max-seconds 1e-6 &&
    all_are outcome 'out of budget' && all_are exit_code 6 && has out/verdict.txt 'budget' &&
    ! grep -w nan out/verdict.txt # too few steps for a median
}

an_interrupted_battery_keeps_what_was_done() {
  "$flesh" hardcases --out interrupted --jobs 1 --energies S --poisson 0.49 --cases 'point_free,static_*' \
    --set body.refine=1 --max-seconds 600 >log.txt 2>&1 &
  wait_until $! [ -s interrupted/cases/static_shrink0.3_S_0.495_default/out/result.json ] || return 1
  kill -TERM "$process"
  wait "$process"
  [ $? -eq 143 ] || { cat log.txt; return 1; }
  has interrupted/hardcases.csv '^point_free.*,equilibrium,' && has interrupted/hardcases.csv '^static_shear.*,not run,' &&
    has log.txt 'interrupted after [1-9][0-9]* of 6 cases; --resume goes on'
}

# A battery that is run in shards, joined and extended by further cases has the figures of one that is run at once.
a_battery_is_shared_out_and_extended() {
  set -- --energies S --poisson 0.45 --max-seconds 60 --quick
  battery "$@" --cases 'single_*,point_free' && mv out whole || return 1
  for shard in 1 2; do
    expect 0 "$flesh" hardcases "$@" --cases 'single_*' --out "shard$shard" --shard $shard/2 &&
      [ "$("$flesh" sweep export shard$shard/hardcases.db --columns id | grep -c .)" -eq $((4 - shard)) ] || return 1
  done # a header, and cases 1 and 3; a header, and case 2
  mkdir -p joined &&
    expect 0 "$flesh" sweep merge joined/hardcases.db shard1/hardcases.db shard2/hardcases.db &&
    has stdout.txt '3 of 3 cases are done' || return 1
  "$flesh" sweep export joined/hardcases.db --columns started --where 1 >before
  expect 0 "$flesh" hardcases "$@" --cases 'single_*,point_free' --out joined --resume || return 1
  "$flesh" sweep export joined/hardcases.db --columns started --where "case_name LIKE 'single%'" | cmp before - || return 1
  for folder in whole joined; do # without times
    cut -d , -f 1-37 $folder/hardcases.csv >$folder.txt
  done
  # A case that could not write its files is run again, and no other case.
  python3 -c 'import sqlite3; sqlite3.connect("joined/hardcases.db", isolation_level=None).execute(
    "UPDATE cases SET exit_code = 3 WHERE id = 2")' && "$flesh" sweep export joined/hardcases.db --columns id,started >before &&
    expect 0 "$flesh" hardcases "$@" --cases 'single_*,point_free' --out joined --resume &&
    "$flesh" sweep export joined/hardcases.db --columns id,started >after &&
    [ "$(diff before after | grep '^>' | cut -d , -f 1)" = '> 2' ] || return 1
  cmp whole.txt joined.txt && [ "$("$flesh" sweep export whole/hardcases.db --columns 'sum(newton)' | tail -n 1)" -gt 3 ] &&
    expect 2 "$flesh" hardcases "$@" --set solver.max_newton=50 --cases 'single_*' --out joined --resume &&
    has stderr.txt 'is of another hardcases: its runs had another .* (there nothing, here solver.max_newton=50)$'
}

the_list_names_every_case() {
  expect 0 "$flesh" hardcases --list && [ "$(lines stdout.txt)" -ge 60 ] && has stdout.txt '^starts *scramble '
}

# A file of cases replaces the program's own. A resumed study runs a changed case again.
a_battery_of_ones_own_is_run() {
  cat >own.yaml <<'E'
title: a dent
cases:
  - {name: dent, group: mine, doc: squashed a little, start: {kind: scale-x, amount: 9/10}, seconds: 2, poisson: 0.3}
E
  battery own.yaml --energies S --poisson 0.45,0.49 && all_are outcome recovered && [ "$(lines out/hardcases.csv)" -eq 2 ] &&
    [ "$(value group dent S 0.3)" = mine ] && has out/cases/dent_S_0.3_default/scene.yaml '^# dent: squashed a little' &&
    expect 0 "$flesh" hardcases own.yaml --list && [ "$(cat stdout.txt)" = 'mine       dent                 squashed a little' ] &&
    expect 2 "$flesh" hardcases own.yaml --cases tear && has stderr.txt "'tear'" || return 1
  battery own.yaml --shapes --meshes 2x1x1 --energies S --out shapes && mv shapes/hardcases.csv first.csv || return 1
  battery own.yaml --shapes --meshes 2x1x1 --energies S --out shapes --resume && cmp shapes/hardcases.csv first.csv || return 1
  sed 's|9/10|8/10|' own.yaml >changed.yaml &&
    battery changed.yaml --shapes --meshes 2x1x1 --energies S --out shapes --resume &&
    ! cmp -s shapes/hardcases.csv first.csv || return 1
  sed 's|poisson: 0.3|scale: 2|' own.yaml >scaled.yaml && expect 2 "$flesh" hardcases scaled.yaml &&
    has stderr.txt 'dent has a scale or an offset, which apply to bodies of --meshes'
}

bad_options_are_refused() {
  expect 2 "$flesh" hardcases --poisson 0.3,0.6 && has stderr.txt "'0.6'.*(-1, 0.5\\]" &&
    expect 2 "$flesh" hardcases --energies S,X && has stderr.txt "X" &&
    expect 2 "$flesh" hardcases --energies S.as_f && has stderr.txt 'as_f' &&
    expect 2 "$flesh" hardcases --solvers fast && has stderr.txt 'kinsol-line-search' &&
    expect 2 "$flesh" hardcases --meshes 4x0x2 && has stderr.txt "'4x0x2'.*1 to 200 cells" &&
    expect 2 "$flesh" hardcases --meshes 4x2x2,4x2x2 && has stderr.txt "two meshes called '4x2x2'" &&
    expect 3 "$flesh" hardcases --meshes no_such.msh && has stderr.txt 'no_such.msh' &&
    expect 2 "$flesh" hardcases --filters --cases scramble && has stderr.txt "'scramble'" &&
    expect 2 "$flesh" hardcases --elements hex8 && has stderr.txt "'hex8'.*tet4, tet10, tet10-mean" &&
    expect 2 "$flesh" hardcases --cases nonsense && has stderr.txt "'nonsense'.*--list" &&
    expect 2 "$flesh" hardcases --poisson 0.45,0.450 && has stderr.txt '0.450 twice; once is enough' &&
    expect 2 "$flesh" hardcases --energies S,S.matched && has stderr.txt 'S.matched twice' &&
    expect 2 "$flesh" hardcases --steps 0 && has stderr.txt "'0'.*positive" &&
    expect 2 "$flesh" hardcases --cases '' && has stderr.txt 'empty' &&
    expect 2 "$flesh" hardcases --cases '!*' && has stderr.txt 'leaves none' &&
    expect 2 "$flesh" hardcases --seeds 1e9 && has stderr.txt '1000000000 seeds.*at most 1000000' &&
    expect 2 "$flesh" hardcases --seeds 0 && expect 3 "$flesh" hardcases none.yaml &&
    expect 3 "$flesh" hardcases --out /dev/null/here --cases single_plane && [ ! -e out/hardcases ]
}

# With scrambled nodes near nu = 1/2, the first step begins at the solution of softer materials, and needs no cutback.
chaos_is_entered_through_softer_materials() {
  battery --shapes --meshes 3x3x3 --energies S --poisson 0.4999 --cases scramble || return 1
  has out/hardcases.csv '^scramble,.*,\(recovered\|untangled\),FLESH_OK' &&
    has out/cases/3x3x3_scramble_seed1_S_0.4999_default/out/result.json '"convergence_failures": 0' &&
    has out/cases/3x3x3_scramble_seed1_S_0.4999_default/out/result.json '"solves_unconverged": 0'
}

# A body of form E and ratio 0 is crushed into a point, where it has no force; it is untangled there.
what_has_vanished_is_laid_out() {
  battery --energies E --poisson 0 --cases crash_plane && [ "$(value outcome crash_plane E 0)" = untangled ]
}

# A thousand km from the origin, the forces that bend a thin neck are only a few times those of round-off, which decides
# where a run ends: on average 0.0005 of the length from rest, and 0.002 if solves ended at four times as large residuals.
soft_parts_come_to_rest_far_away() {
  battery --shapes --meshes "$source_folder/../data/meshes/dumbbell.msh" --energies S --poisson 0.45 --cases far_away \
    --seeds 8 && all_are status FLESH_OK || return 1
  value distance_from_rest far_away S 0.45 >distances.txt
  awk '{ sum += $1 } END { print "# on average " sum / NR " from rest"; exit !(NR == 8 && sum / NR < 0.0013) }' distances.txt
}

# The table has the iterations of a run's longest step over those of its median step, and the verdict names runs in which
# they are 100 times as many: here a run whose record is changed so.
a_long_step_is_named() {
  battery --shapes --meshes 2x1x1 --energies S --poisson 0.45 --cases 'plane,squash0.3' || return 1
  longest=$(value longest_step_over_median plane S 0.45)
  echo "$longest" | awk '{ exit !($1 >= 1 && $1 < 100) }' && [ "$(value longest_step plane S 0.45)" -ge 1 ] &&
    has out/verdict.txt '100 times the iterations of their median step: 0$' || return 1
  python3 -c 'import sqlite3; sqlite3.connect("out/hardcases.db", isolation_level=None).execute("UPDATE cases SET result = "
    "json_set(result, \"$.figures.longest_ratio\", 100.5, \"$.figures.longest_cuts\", 2) WHERE case_name = \"plane\"")' || return 1
  battery --resume --shapes --meshes 2x1x1 --energies S --poisson 0.45 --cases 'plane,squash0.3' || return 1
  has out/verdict.txt '100 times the iterations of their median step: 1$' &&
    has out/verdict.txt 'cases/2x1x1_plane_S_0.45_default: step .* Newton and .* linear iterations, 100.5 times the median step, with cuts: 2$' &&
    [ "$(value longest_step_over_median plane S 0.45)" = 100.5 ]
}

run_tests ${long:+hard_starts_recover violent_loads_recover} collapsed_bodies_are_named_as_the_equilibria_they_are \
  undefined_forms_stop_with_a_statement d_returns_to_its_own_rest a_run_repeats_alone rises_are_seen \
  ${long:+ends_of_ten_node_bodies_are_judged} an_early_end_is_no_recovery ${long:+a_death_is_a_row} a_setting_of_ones_own_is_kept_in_the_scene \
  the_table_has_the_promised_columns pictures_are_drawn without_gnuplot_the_frames_are_drawn an_interrupted_picture_is_reported a_spent_budget_is_a_row \
  an_interrupted_battery_keeps_what_was_done a_battery_is_shared_out_and_extended the_list_names_every_case \
  a_battery_of_ones_own_is_run bad_options_are_refused \
  chaos_is_entered_through_softer_materials what_has_vanished_is_laid_out ${long:+soft_parts_come_to_rest_far_away} \
  a_long_step_is_named
