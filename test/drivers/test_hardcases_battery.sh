# TEST full program seconds=900 needs=flesh
# test_hardcases_battery.sh: the default solver keeps its promises on every case of the quick battery, and
# each promise breaks without the technique that keeps it.
set -u
. "$(dirname -- "$0")/../shared/command.sh"

battery() { expect 0 "$flesh" hardcases --quick --out out --max-seconds 120 "$@"; }

# rows_where CONDITION: prints case, seed, energy, ratio, solver and outcome of the rows of out/hardcases.csv
# for which the awk condition holds; columns are named v["NAME"].
rows_where() {
  awk -F , 'NR == 1 { for (c = 1; c <= NF; c++) name[c] = $c; next }
    { for (c = 1; c <= NF; c++) v[name[c]] = $c
      if ('"$1"') print v["case"], v["seed"], v["energy"], v["poisson"], v["solver"], v["outcome"] }' \
    out/hardcases.csv
}

# none CONDITION: there are rows, and none meets the condition.
none() {
  bad=$(rows_where "$1")
  [ -z "$bad" ] && [ "$(grep -c '' out/hardcases.csv)" -gt 1 ] && return
  echo "not expected: $1"
  echo "$bad"
  return 1
}

# some CONDITION: a row meets the condition.
some() { [ -n "$(rows_where "$1")" ] || { echo "no row is: $1"; cat out/hardcases.csv; return 1; }; }

good='v["outcome"] ~ /^(recovered|untangled|equilibrium)$/'
orderly='v["finite"] == 1 && v["potential_rises"] == 0 && v["worst_rise"] + 0 <= 1e-12 &&
  v["outcome"] !~ /^(non-finite|crashed or hung|not run)$/'
collapses='v["case"] ~ /^(line|point)_free$/'
scrambled='v["case"] ~ /^(scramble|point|two_bodies)/'

# Every case of S and E up to nu = 0.49 ends, with finite numbers, falling potentials and converged solves, back at rest and
# without inverted tets.
every_case_comes_back() {
  battery --energies S,E --poisson "$@" || return 1
  none "!($good)" && none "!($orderly)" && none 'v["unconverged"] > 0' &&
    none "!($collapses) && !(v[\"distance_from_rest\"] < 1e-3 && v[\"volume_error\"] < 1e-3 &&
      v[\"inverted_end\"] == 0 && v[\"recovered_at\"] != \"\" || v[\"step\"] == \"\")" &&
    none "$collapses && v[\"outcome\"] != \"equilibrium\"" && has out/verdict.txt 'Promised.* do\.$'
}
compressible_bodies_come_back() { every_case_comes_back 0,0.3; }
bodies_of_0_45_come_back() { every_case_comes_back 0.45; }
# With the quick battery's few tets, rounding decides whether E twisted by 5 turns ends in a true local minimum (2 times of
# 10); with the whole battery's tets it never does.
bodies_of_0_49_come_back() {
  every_case_comes_back 0.49 --seeds 2 --cases '!twist5' &&
    expect 0 "$flesh" hardcases --energies S,E --poisson 0.49 --cases twist5 --out out && none "!($good)"
}

# Closer to 1/2, bodies come back from all cases, except for some with scrambled nodes, or that were crushed into points. On
# graded meshes conjugate gradients stall, and a direct factorisation takes their place.
nearly_incompressible_bodies_come_back() {
  battery --energies S,E --poisson 0.499 --cases 'starts,loads,obstacles,meshes,steps,materials' || return 1
  none "!($orderly)" && none 'v["unconverged"] > 0' &&
    none "!($scrambled) && !($good)"
}
the_closest_to_incompressible_stay_in_order() {
  battery --energies S,E --poisson 0.4999 \
    --cases 'jitter*,plane*,line*,mirrored,invert_one,stretch?,stretch10,squash*,shrink0.6,twist1,slivers*,graded_jitter,fan*,single*,crash*,scramble' || return 1
  none "!($orderly)" && none "!($scrambled) && !($good)" && some 'v["case"] == "graded_jitter" && v["direct"] > 0'
}

# Runs of form D are orderly from any start; if D has a shape at rest, bodies come back to it, except from scrambled and
# collapsed starts.
d_is_in_order() {
  battery --energies D --poisson 0.3 --cases starts || return 1
  none "!($orderly)" && none 'v["unconverged"] > 0' || return 1
  battery --energies D --poisson 0.45 --cases 'starts,meshes,obstacles,loads,materials' || return 1
  none "!($orderly)" && none 'v["unconverged"] > 0' &&
    none "v[\"case\"] !~ /^(scramble|line|point)/ && !($good)"
}

# Runs of forms that are undefined for J <= 0 recover, or stop with a sentence that says where.
undefined_forms_stop_in_order() {
  battery --energies Neo,A,B,C --poisson 0.45 --cases 'starts,meshes,obstacles,tear,spin_body,crash,drag1e6' || return 1
  none 'v["finite"] != 1 || v["outcome"] ~ /^(non-finite|crashed or hung|not run)$/' &&
    none 'v["unconverged"] > 0' && some 'v["outcome"] == "stopped"' &&
    none 'v["outcome"] == "stopped" && !(v["exit_code"] == 4 &&
      /at t = [0-9.e-]+ s with h = .*smallest J = .* in tet [0-9]+ at|nodes are in the plane that/)' &&
    none 'v["case"] == "mirrored" && v["status"] != "FLESH_UNDEFINED"'
}

# Statics with large changes of volume at nu = 0.495 reach a tolerance of 1e-8, with at most 1.2 times the iterations of the
# best filter.
statics_reach_their_tolerance() {
  battery --energies S,E --poisson 0.495 --cases statics --solvers default,clamped,absolute,trust-region || return 1
  none 'v["solver"] == "default" && (v["outcome"] != "recovered" || v["unconverged"] > 0 || v["at_rounding"] > 0)' &&
    has out/cases/static_shear_S_0.495_default/scene.yaml 'newton_tolerance: 1e-8' &&
    awk -F , 'NR == 1 { for (c = 1; c <= NF; c++) name[$c] = c; next }
      { n = $name["newton"]; k = $name["case"] " " $name["energy"]; cases[k] = 1
        if ($name["solver"] == "default") mine[k] = n
        if ($name["outcome"] == "recovered" && (!(k in best) || n < best[k])) best[k] = n }
      END { for (k in cases) { count++; print k, mine[k], best[k]; if (mine[k] > 1.2 * best[k]) bad = 1 }
        exit bad || count != 10 }' out/hardcases.csv
}

# The following tests take away what a promise rests on. Without untangling, all bodies at nu = 0.3 and all mirrored ones still
# come back.
without_untangling_scrambled_bodies_may_stay_tangled() {
  battery --energies S,E --poisson 0.3,0.49 --cases scramble,mirrored --seeds 6 --solvers without-untangle &&
    none "(v[\"poisson\"] == 0.3 || v[\"case\"] == \"mirrored\") && !($good)" &&
    some 'v["outcome"] == "stressed at rest" && v["end_is"] == "minimum"'
}
without_projection_solves_fail() {
  battery --energies S --poisson 0.49 --cases stretch10,scramble --solvers never-projected &&
    none "$good"
}
without_the_guard_the_potential_rises() {
  battery --energies S --poisson 0.45 --cases gravity1000,halves1e6 --solvers plain && some 'v["potential_rises"] > 0'
}
without_budget_nothing_is_lost() {
  expect 0 "$flesh" hardcases --quick --out out --energies S --poisson 0.49 --cases twist5 --max-seconds 0.01 &&
    none 'v["outcome"] != "out of budget" || v["exit_code"] != 6 || v["finite"] != 1'
}

run_tests compressible_bodies_come_back bodies_of_0_45_come_back bodies_of_0_49_come_back \
  nearly_incompressible_bodies_come_back the_closest_to_incompressible_stay_in_order d_is_in_order \
  undefined_forms_stop_in_order statics_reach_their_tolerance without_untangling_scrambled_bodies_may_stay_tangled \
  without_projection_solves_fail without_the_guard_the_potential_rises without_budget_nothing_is_lost
