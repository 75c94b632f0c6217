# TEST full program seconds=300 needs=flesh
# test_hardcases_compared.sh: `flesh hardcases` with other solvers, elements, filters and meshes beside the default.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
. "$(dirname -- "$0")/../shared/hardcases.sh"

# Standard solvers fail where the default one succeeds, or take far more iterations, and the table shows it.
other_solvers_are_found_out() {
  battery --energies S --poisson 0.49 --cases stretch10,plane,twist2 --solvers all --max-seconds 600 || return 1
  [ "$(value outcome plane S 0.49)" = recovered ] && [ "$(value outcome stretch10 S 0.49)" = recovered ] || return 1
  [ "$(value outcome stretch10 S 0.49 plain)" != recovered ] &&
    [ "$(value outcome stretch10 S 0.49 never-projected)" != recovered ] &&
    [ "$(value newton twist2 S 0.49 kinsol-line-search)" -gt "$((2 * $(value newton twist2 S 0.49)))" ] &&
    [ "$(lines out/hardcases.csv)" -eq 25 ] || { cat out/hardcases.csv; return 1; }
}

# Bodies of ten-node tets on the same meshes recover; their nodes on edges are displaced at the start, too, and `flesh run` of
# a case gives the same bits.
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

# profiles_from_rows ELEMENT: prints the profiles of Newton iterations at 1 and 2 times the least, from the table's rows.
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
  expect 0 "$flesh" hardcases --filters --quick --out out --elements tet4,tet10-mean --poisson 0.49 --seeds 2 \
    --cases stretch,twist,squash,noise "$@"
}

# Loads and motions are judged separately, by whether they were solved, with techniques and without. SHA-256 chooses the
# problems, which all solvers run.
a_share_of_loads_and_motions() {
  compare_filters --cases sag,let_go --elements tet4 --solvers clamped,absolute,clamped-bare,absolute-bare \
    --seeds 20 --steps 1e-2,1 --energies S,E --share 0.2:0.45 || return 1
  python3 -c 'import hashlib
for case in "sag", "let_go":
  for seed in range(1, 21):
    for energy in "S", "E":
      for step in ("0",) if case == "sag" else ("0.01", "1"):
        problem = f"{case} 4x2x2 {seed} {energy} matched 0.49 {step}"
        if 0.2 <= int(hashlib.sha256(problem.encode()).hexdigest()[:8], 16) / 2**32 < 0.45:
          for solver in "clamped", "absolute", "clamped-bare", "absolute-bare":
            print(case, energy, seed, "" if case == "sag" else step, solver)' | sort >expected.txt
  awk -F , 'NR == 1 { for (c = 1; c <= NF; c++) column[$c] = c; next } { print $column["case"], $column["energy"],
    $column["seed"], $column["step"], $column["solver"] }' out/hardcases.csv | sort | cmp - expected.txt || return 1
  loads=$(grep -c '^sag .* absolute$' expected.txt) motions=$(grep -c '^let_go .* absolute$' expected.txt)
  [ "$loads" -gt 3 ] && [ "$motions" -gt 3 ] && all_are unconverged 0 && has out/hardcases.csv ',not recovered,' || return 1
  for bare in '' ' bare'; do
    has out/verdict.txt "^tet4 load$bare: $loads of $loads problems run with all filters; 0 solved by none" &&
      has out/verdict.txt "^tet4 motion$bare: $motions of $motions problems run with all filters" || return 1
  done
  has "$(find out/cases -path '*sag*clamped-bare/scene.yaml' | head -n 1)" \
    'eigenvalue_filter: clamp, techniques: \[balanced_target, approximate_wolfe\]' &&
    has out/profiles.csv '^tet4 load,budget,clamped,131072' &&
    expect 2 "$flesh" hardcases --filters --quick --out out --share 0.5:0.5 && has stderr.txt "'0.5:0.5'; it must be LOW:HIGH"
}

# The filters' profiles are those of the table's rows, and the verdict counts the problems.
filters_are_compared() {
  compare_filters || return 1
  [ "$(lines out/hardcases.csv)" -eq 129 ] && all_are mesh 4x2x2 && all_are unconverged 0 || return 1
  has out/cases/4x2x2_twist_seed2_S_0.49_tet10-mean_clamped-always/scene.yaml 'eigenvalue_filter: clamp-always' ||
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
  # In statics the default filter is `absolute`.
  awk -F , 'NR == 1 { for (c = 1; c <= NF; c++) column[$c] = c; next }
    { k = $column["case"] $column["seed"] $column["poisson"] $column["element"]; f = $column["solver"]
      if (f == "default") newton[k] = $column["linear"]
      if (f == "absolute" && newton[k] != $column["linear"]) bad = 1 } END { exit bad }' out/hardcases.csv || return 1
  command -v gnuplot >/dev/null || return 0
  [ "$(wc -c <out/profiles.png)" -gt 5000 ]
}

# forget CONDITION: marks these cases as not run.
forget() {
  python3 -c 'import sqlite3, sys; sqlite3.connect("out/hardcases.db", isolation_level=None).execute(
    "UPDATE cases SET status = ?, result = NULL WHERE " + sys.argv[1], ("planned",))' "$1"
}

# --resume runs only cases that were not run; without it all cases run again.
a_comparison_goes_on_where_it_was() {
  compare_filters --solvers clamped,absolute || return 1
  cp out/hardcases.csv before.csv
  forget "case_name = 'noise' AND seed = 2 AND solver = 'absolute' AND element = 'tet4'" &&
    compare_filters --solvers clamped,absolute --resume || return 1
  cut -d , -f 1-37 before.csv >before.txt # without times
  cut -d , -f 1-37 out/hardcases.csv | cmp - before.txt || return 1
  [ "$(diff before.csv out/hardcases.csv | grep -c '^>')" -le 1 ] || { diff before.csv out/hardcases.csv; return 1; }
  expect 2 "$flesh" hardcases --filters --quick --out out --max-seconds 14 --resume &&
    has stderr.txt 'its runs had another' || return 1
  compare_filters --solvers clamped,absolute || return 1
  [ "$(diff before.csv out/hardcases.csv | grep -c '^>')" -gt 20 ] # all times are new
}

# A file's mesh replaces that of the cases: its flat face is held, and it has the block's length.
meshes_can_be_given() {
  expect 0 "$flesh" hardcases --filters --quick --out out --elements tet4 --solvers default --cases squash \
    --meshes "2x2x2,$source_folder/../data/meshes/limb.msh" || return 1
  [ "$(lines out/hardcases.csv)" -eq 3 ] && all_are outcome recovered &&
    [ "$(awk -F , 'NR == 1 { for (c = 1; c <= NF; c++) column[$c] = c; next } $column["mesh"] == "limb" {
      print $column["tets"] }' out/hardcases.csv | sort -u)" = 2968 ] && has out/verdict.txt 'No verdict: 2 problems'
}

# shapes OPTION...: runs cases of bodies of any shape, on irregular meshes.
shapes() {
  meshes=$source_folder/../data/meshes
  expect 0 "$flesh" hardcases --shapes --out out --max-seconds 300 --energies S --poisson 0.49 \
    --meshes "$meshes/graded_block.msh,$meshes/slivers.msh,$meshes/plate_with_holes.msh" \
    --cases 'half_turn,inside_out,plane,scramble,feet_scramble,feet_twist2,throw1,poses' "$@"
}

# Bodies of any shape come back from poses, turns and scattered nodes; --resume runs no case again.
shapes_come_back() {
  shapes || return 1
  awk -F , 'NR == 1 { for (c = 1; c <= NF; c++) column[$c] = c; next }
    $column["outcome"] !~ /^(recovered|untangled)$/ { print $0; bad = 1 } END { exit bad || NR < 37 }' out/hardcases.csv &&
    has out/hardcases.csv ',untangled,' || return 1
  cp out/hardcases.csv before.csv
  shapes --resume && cmp before.csv out/hardcases.csv && expect 2 "$flesh" hardcases --shapes --filters &&
    expect 0 "$flesh" hardcases --shapes --list && has stdout.txt '^free *half_turn '
}

# Every technique has a row with the figures of its runs, here also of a case that does not come back without one of them.
techniques_are_left_out() {
  set -- hardcases --ablation --quick --out out --elements tet4 --poisson 0.49 --cases scramble,static_shear --seeds 2
  expect 0 "$flesh" "$@" || return 1
  count=$("$flesh" schema solver | grep -o 'a list of some of [^;]*' | tr ',' '\n' | grep -c .)
  [ "$(sed 1d out/ablation.csv | cut -d , -f 1 | sort -u | grep -c .)" -eq "$count" ] &&
    [ "$(grep -c '^| [a-z_]* | ' out/verdict.txt)" -eq "$((count + 1))" ] &&
    has out/cases/static_shear_S_0.495_without-watchdog/scene.yaml 'techniques: \[-watchdog\]' || return 1
  # The row's figures are the sums over the rows of the runs.
  awk -F , 'NR == 1 { for (c = 1; c <= NF; c++) column[$c] = c; next }
    { s = $column["solver"]; newton[s, $column["case"]] += $column["newton"] }
    END { print newton["default", "static_shear"] "," newton["without-kept_matrices", "static_shear"] }' \
    out/hardcases.csv >sums.txt || return 1
  [ "$(grep '^kept_matrices,tet4,0.495,statics,' out/ablation.csv | cut -d , -f 8,9)" = "$(cat sums.txt)" ] || return 1
  cp out/ablation.csv before.csv
  expect 0 "$flesh" "$@" --resume && cmp before.csv out/ablation.csv && expect 2 "$flesh" hardcases --ablation --filters &&
    has stderr.txt '\-\-filters is a study of its own' || return 1
  # The study may have only some techniques.
  expect 0 "$flesh" hardcases --ablation --quick --out few --elements tet4 --poisson 0.49 --cases static_shear \
    --solvers default,without-watchdog && [ "$(sed 1d few/ablation.csv | cut -d , -f 1 | sort -u)" = watchdog ] &&
    [ "$(grep -c '^| [a-z_]* | ' few/verdict.txt)" -eq 2 ] || return 1
  expect 2 "$flesh" hardcases --ablation --quick --out few --solvers without-watchdog &&
    has stderr.txt "solvers is 'without-watchdog'; with --ablation it must have default and a without-TECHNIQUE"
}

run_tests techniques_are_left_out shapes_come_back other_solvers_are_found_out bodies_of_ten_node_tets_recover filters_are_compared \
  a_share_of_loads_and_motions a_comparison_goes_on_where_it_was meshes_can_be_given
