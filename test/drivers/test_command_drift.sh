# TEST full program seconds=180 needs=flesh
# test_command_drift.sh: `flesh drift`: its table, its pictures, and rows of runs that fail.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
scenes=$source_folder/../data/scenes

# value NAME ENERGY CONSTANTS POISSON SOLVER: prints the value of column NAME in this row.
value() {
  awk -F , -v name="$1" -v energy="$2" -v constants="$3" -v poisson="$4" -v solver="$5" '
    NR == 1 { for (c = 1; c <= NF; c++) column[$c] = c; next }
    $column["energy"] == energy && $column["constants"] == constants && $column["poisson"] == poisson &&
    $column["solver"] == solver { print $column[name] }' out/drift.csv
}

# between LOW VALUE HIGH
between() {
  awk -v low="$1" -v value="$2" -v high="$3" 'BEGIN { exit !(value != "" && low + 0 <= value + 0 && value + 0 <= high + 0) }' ||
    { echo "$2 is not between $1 and $3"; return 1; }
}

the_comparison_ends_well() {
  expect 0 "$flesh" drift "$scenes/finger_pull_coarse.yaml" --energies B,D,S --poisson 0.45 --set time.end=1 --out out
  [ ! -s stderr.txt ] || { cat stderr.txt; return 1; }
}

the_table_has_the_promised_columns() {
  has out/drift.csv '^scene,energy,poisson,constants,tets,status,max_volume_drift,final_volume_drift,rest_volume_ratio,rest_volume_ratio_theory,J_min,max_inverted,newton_per_step,linear_per_newton,wall_s,failed_at' &&
    [ "$(lines out/drift.csv)" -eq 9 ] && # B, D raw, D as_e, S; guarded and plain
    [ "$(value tets S matched 0.45 guarded)" = 1474 ]
}

guarded_runs_survive() {
  for form in 'B matched' 'D raw' 'D as_e' 'S matched'; do
    # shellcheck disable=SC2086
    [ "$(value status $form 0.45 guarded)" = complete ] || { echo "$form"; cat out/drift.csv; return 1; }
  done
}

# Form B is undefined for J <= 0, where a full step leads when the finger snaps back: that run fails and is a row.
a_failed_run_is_a_row() {
  [ "$(value status B matched 0.45 plain)" = undefined ] &&
    between 0.79 "$(value failed_at B matched 0.45 plain)" 0.85 &&
    has out/verdict.txt 'B *plain *ends at t = 0.8 s, step 48: undefined'
}

# While pulled, S keeps the volume best and B worst of the matched forms; D shrinks to the theory's J*.
the_figures_are_physical() {
  between 0.02 "$(value max_volume_drift S matched 0.45 guarded)" 0.06 &&
    between 0.07 "$(value max_volume_drift B matched 0.45 guarded)" 0.11 &&
    between 0.999999 "$(value rest_volume_ratio S matched 0.45 guarded)" 1.000001 &&
    between 0.884 "$(value rest_volume_ratio_theory D raw 0.45 guarded)" 0.8845 &&
    between 0.884 "$(value rest_volume_ratio D raw 0.45 guarded)" 0.886 &&
    between 0.896 "$(value rest_volume_ratio_theory D as_e 0.45 guarded)" 0.8965 &&
    between -0.12 "$(value final_volume_drift D raw 0.45 guarded)" -0.11 &&
    between -0.01 "$(value final_volume_drift S matched 0.45 guarded)" 0.01
}

pictures_are_drawn() {
  command -v gnuplot >/dev/null || { echo 'no gnuplot'; return 0; }
  for picture in volume_finger_pull_coarse_0.45 worst_finger_pull_coarse_B_matched \
    worst_finger_pull_coarse_D_as_e shapes_finger_pull_coarse_0.45_guarded shapes_finger_pull_coarse_0.45_plain; do
    [ "$(wc -c <"out/$picture.png")" -gt 10000 ] || { echo "$picture"; ls -l out; return 1; }
  done
}

# Runs with the same curve are drawn as one line with both names; a run that stops has a cross at its end.
volumes_say_what_they_show() {
  command -v gnuplot >/dev/null || { echo 'no gnuplot'; return 0; }
  script=out/volume_finger_pull_coarse_0.45.gp
  has $script 'title "S, guarded; S, plain"' && has $script 'title "B, plain (stops at 0.8 s)"' || return 1
  [ "$(grep -c 'with points pt 2' $script)" -eq 3 ] && [ "$(grep -c 'volume_ratio' $script)" -eq 7 ] || { cat $script; return 1; }
}

nothing_is_minus_zero() {
  expect 0 "$flesh" drift "$scenes/finger_pull_coarse.yaml" --energies M,S --poisson 0.45 --solvers guarded --set time.end=1 \
    --out zeros || return 1
  ! grep -E -e '[+-]0\.?0*( |$)' stdout.txt && ! grep -E -e '-[0-9.]+e-[0-9]+' stdout.txt
}

# If the theory has no free shape at rest, its field is empty.
no_free_rest_is_an_empty_field() {
  expect 0 "$flesh" drift "$scenes/finger_pull_coarse.yaml" --energies D --poisson 0.3 --solvers guarded \
    --set time.end=1/30 --out out || return 1
  [ "$(value status D raw 0.3 guarded)" = complete ] &&
    [ -z "$(value rest_volume_ratio_theory D raw 0.3 guarded)" ] &&
    between 0.49 "$(value rest_volume_ratio_theory D as_e 0.3 guarded)" 0.5
}

materials_of_regions_are_told_apart() {
  "$flesh" mesh convert "$scenes/../meshes/two_regions.mesh" regions.msh >/dev/null || return 1
  cat >regions.yaml <<'END'
body:
  mesh: regions.msh
  material: {energy: S, young: 1e5, poisson: 0.4}
  regions: [{tags: [2], material: {energy: E, young: 1e6, poisson: 0.4}}]
effects: [inertia, gravity]
time: {step: 1/60, end: 1/60}
END
  expect 0 "$flesh" drift regions.yaml --energies S --poisson 0.4 --solvers guarded --out regions || return 1
  has stdout.txt "^runs: [0-9]*; scenes: 1, energies: 1, Poisson's ratios: 1, solvers: 1; [0-9]* at a time$" || return 1
  has stdout.txt 'regions.yaml: body.material alone is varied; the materials of its regions stay'
}

# The verdict is that of ten-node tets on the finer mesh, as with four-node tets on this mesh S changes far too much.
meshes_and_elements_are_told_apart() {
  "$flesh" mesh box --cells 4,1,1 --size 0.4,0.1,0.1 --out beam.msh >/dev/null || return 1
  cat >beam.yaml <<'END'
body:
  mesh: beam.msh
  material: {energy: S, young: 1e4, poisson: 0.4}
effects:
  - inertia: {}
  - gravity: {acceleration: [0, 0, -9.81]}
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}
time: {step: 1/30, end: 1/6}
END
  expect 0 "$flesh" drift beam.yaml --energies B,S,D --poisson 0.49 --solvers guarded --elements tet4,tet10-mean \
    --refine 0,1 --out meshes || return 1
  [ "$(lines meshes/drift.csv)" -eq 17 ] && has meshes/drift.csv 'stressed_rest_J,element,nodes,finest,mesh_part,mesh_unsure$' &&
    has meshes/verdict.txt '^beam_tet10-mean_refined1 (tet10-mean, 192 tets), the finest of 4; .* by comparison with beam_tet10-mean_refined0 (tet10-mean, 24 tets)$' &&
    has meshes/verdict.txt 'confirmed order: ' && has meshes/verdict.txt 'beam_tet4_refined0 (tet4, 24 tets) [0-9.]* (+' || return 1
  # The mesh's part is 0 in rows of the finest mesh, and in other rows the difference from it.
  awk -F , 'NR == 1 { for (c = 1; c <= NF; c++) at[$c] = c; next }
    { key = $at["energy"] $at["constants"] }
    $at["finest"] == 1 { best[key] = $at["max_volume_drift"]; n += $at["mesh_part"] == 0 && $at["mesh_unsure"] > 0 &&
                         $at["element"] == "tet10-mean" && $at["nodes"] == 425 }
    { drift[NR] = $at["max_volume_drift"]; part[NR] = $at["mesh_part"]; of[NR] = key }
    END { for (r in drift) { d = drift[r] - best[of[r]] - part[r]; if (d * d > 1e-20) exit 1 } exit n != 4 }' meshes/drift.csv ||
    { cat meshes/drift.csv; return 1; }
  # With one mesh alone, the verdict claims no accuracy.
  expect 0 "$flesh" drift beam.yaml --energies S --poisson 0.49 --solvers guarded --out alone || return 1
  has alone/verdict.txt 'One mesh and one element' && has alone/verdict.txt 'Four-node tets lock at poisson 0.49' &&
    ! grep -q '±' alone/verdict.txt || return 1
  ! grep -q 'single nodes' alone/verdict.txt || return 1
  # A spring that pulls at a single tet does not converge with finer meshes, and a warning says so; with a radius it converges.
  sed 's|^time|  - spring: {point: [0.36, 0.01, 0.02], radius: 0, stiffness: 10, target: [{time: 0, position: [1, 0, 0]}]}\ntime|' \
    beam.yaml >pulled.yaml
  expect 0 "$flesh" drift pulled.yaml --energies S --poisson 0.4 --solvers guarded --out pulled || return 1
  has pulled/verdict.txt 'pulled has a load at single nodes' || return 1
  expect 0 "$flesh" drift pulled.yaml --energies S --poisson 0.4 --solvers guarded --set effects.spring.radius=0.02 --out wide &&
    ! grep -q 'single nodes' wide/verdict.txt
}

# A run that cannot write its files is reported and gives no verdict, as its figures say nothing of the energy; it is run
# again when the comparison resumes.
a_run_that_cannot_write_is_reported() {
  set -- drift "$scenes/finger_pull_coarse.yaml" --energies S --poisson 0.45 --solvers guarded --set time.end=1/30 --out blocked
  mkdir blocked && echo file >blocked/runs || return 1
  expect 3 "$flesh" "$@" && has stderr.txt '1 of 1 cases could not write or read their files; the first: ' &&
    [ -s blocked/drift.csv ] && [ ! -e blocked/verdict.txt ] || return 1
  rm blocked/runs
  expect 0 "$flesh" "$@" --resume && [ -s blocked/verdict.txt ] && grep -q ',complete,' blocked/drift.csv
}

bad_lists_are_refused() {
  expect 2 "$flesh" drift "$scenes/finger_pull_coarse.yaml" --elements tet4,tet5 && has stderr.txt "--elements has 'tet5'" &&
    expect 2 "$flesh" drift "$scenes/finger_pull_coarse.yaml" --elements tet4,tet4 &&
    expect 2 "$flesh" drift "$scenes/finger_pull_coarse.yaml" --refine 0,9 && has stderr.txt "--refine has '9'" || return 1
  expect 2 "$flesh" drift "$scenes/finger_pull_coarse.yaml" --poisson 0.3,0.6 && has stderr.txt "'0.6'.*(-1, 0.5\\]" &&
    expect 2 "$flesh" drift "$scenes/finger_pull_coarse.yaml" --energies B,X &&
      has stderr.txt "--energies: energy is 'X'" &&
    expect 2 "$flesh" drift "$scenes/finger_pull_coarse.yaml" --energies B,S,B &&
      has stderr.txt '--energies has B twice' &&
    expect 2 "$flesh" drift "$scenes/finger_pull_coarse.yaml" --poisson 0.3,3/10 &&
      has stderr.txt '--poisson has 3/10 twice' &&
    expect 2 "$flesh" drift "$scenes/finger_pull_coarse.yaml" --solvers fast && has stderr.txt 'guarded, plain' &&
    expect 2 "$flesh" drift && expect 3 "$flesh" drift no_such_scene.yaml &&
    has stderr.txt no_such_scene.yaml
}

run_tests the_comparison_ends_well the_table_has_the_promised_columns guarded_runs_survive a_failed_run_is_a_row \
  the_figures_are_physical pictures_are_drawn volumes_say_what_they_show nothing_is_minus_zero no_free_rest_is_an_empty_field materials_of_regions_are_told_apart \
  meshes_and_elements_are_told_apart a_run_that_cannot_write_is_reported bad_lists_are_refused
