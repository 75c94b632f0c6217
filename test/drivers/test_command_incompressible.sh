# TEST quick program seconds=120 needs=flesh
# test_command_incompressible.sh: `flesh run` at a Poisson's ratio of 1/2: its messages, pressures in states, runs from
# states, and refusals.
# FLESH names the program.
set -u
. "$(dirname -- "$0")/../shared/command.sh"

"$flesh" mesh box --cells 4,1,1 --size 2,0.5,0.5 --out bar.msh >/dev/null || exit 1
cat >bar.yaml <<'EOF'
body:
  mesh: bar.msh
  element: tet10-mean
  material: {energy: S, young: 1e5, poisson: 0.5}
effects:
  - inertia: {}
  - gravity: {}
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}
time: {method: newmark, step: 1/100, end: 0.1}
solver: {newton_tolerance: 1e-9}
EOF

a_run_keeps_pressures_in_its_state() {
  expect 0 "$flesh" run bar.yaml --out whole --no-frames || return 1
  has stdout.txt 'small strain: young 100000 Pa, poisson 0.5$' &&
    has stdout.txt 'updates of the pressures of incompressible tets' &&
    has whole/result.json '"multiplier_updates": [1-9]' && has whole/state.txt '^# multipliers 24$' || return 1
  sed '1,/multipliers/d' whole/state.txt | awk '$1 != "#" || NF != 2 { bad = 1 } END { exit bad || NR != 24 }'
}

# A run goes on from a state with pressures and from one without, within the method's error (some 1e-3 m here): Newmark's
# first step finds its pressures itself, and those of the state are only a first iterate.
runs_go_on_from_states() {
  expect 0 "$flesh" run bar.yaml --set time.end=0.05 --out half --no-frames --quiet || return 1
  expect 0 "$flesh" run bar.yaml --start-state half/state.txt --out rest --no-frames --quiet || return 1
  grep -v '^#' half/state.txt >bare.txt
  { echo '# t 0.05'; cat bare.txt; } >without.txt
  expect 0 "$flesh" run bar.yaml --start-state without.txt --out without --no-frames --quiet || return 1
  for run in rest without; do
    grep -v '^#' whole/state.txt >one.txt
    grep -v '^#' $run/state.txt | paste -d ' ' one.txt - | awk '
      { for (c = 1; c <= 3; c++) { d = $c - $(c + 6); if (d < 0) d = -d; if (d > worst) worst = d } }
      END { print worst }' >$run.txt
  done
  awk 'NR == 1 { rest = $1 } NR == 2 { print rest, $1; d = $1 - rest; exit !(rest < 5e-6 && d < 1e-8 && -d < 1e-8) }' rest.txt without.txt
}

a_state_of_another_mesh_is_refused() {
  sed 's/^# multipliers 24/# multipliers 23/' whole/state.txt >other.txt
  expect 3 "$flesh" run bar.yaml --start-state other.txt --out bad &&
    has stderr.txt 'other.txt:[0-9]*: .*23 multipliers; a state has one for each of the mesh.s 24 tets' || return 1
  sed '$d' whole/state.txt >other.txt
  expect 3 "$flesh" run bar.yaml --start-state other.txt --out bad &&
    has stderr.txt 'the file has only 23 of its 24 multipliers'
}

# For compressible bodies, the same state is one of positions and velocities alone.
states_serve_compressible_bodies() {
  expect 0 "$flesh" run bar.yaml --start-state whole/state.txt --set body.material.poisson=0.49 --set time.end=0.12 \
    --out other --no-frames --quiet && ! grep multipliers other/state.txt
}

what_cannot_be_is_refused() {
  for element in tet4 tet10; do
    expect 2 "$flesh" run bar.yaml --set body.element=$element --out bad &&
      has stderr.txt "bar.yaml:4:46: body.material.poisson is 0.5, which the element $element cannot hold; set body.element to tet10-mean" ||
      return 1
  done
  expect 2 "$flesh" run bar.yaml --set body.material.energy=C --out bad &&
    has stderr.txt 'poisson is 0.5 with energy C, which has no volume term' || return 1
  expect 2 "$flesh" run bar.yaml --set time.method=ida --out bad &&
    has stderr.txt "time.method is ida, .*must be adaptive or a method of fixed steps" || return 1
  [ ! -e bad ]
}

# Young's modulus is 3 mu, and colours its tets.
pictures_show_the_modulus() {
  expect 0 "$flesh" snap bar.yaml --colour young --width 100 --out young.png &&
    has stdout.txt "colours: Young's modulus \[kPa\] from 0 to 100; there is 100 to 100"
}

# Studies take a Poisson's ratio of 1/2 like any other for tet10-mean and forms with a volume term; other cases are refused
# with the reason.
campaigns_take_a_half() {
  expect 0 "$flesh" drift bar.yaml --poisson 0.5 --energies S,C --solvers guarded --out drift &&
    has drift/drift.csv ',S,0.5,.*,complete,' && has drift/drift.csv ',C,0.5,.*,refused,' &&
    has drift/verdict.txt 'refused: .*poisson is 0.5 with energy C, which has no volume term' || return 1
  expect 0 "$flesh" hardcases --meshes 2x1x1 --elements tet4,tet10-mean --energies S --poisson 0.5 --cases twist2 --out hard &&
    has stdout.txt '0.5 tet10-mean default *1 of 1' && has stdout.txt 'which the element tet4 cannot hold'
}

run_tests campaigns_take_a_half a_run_keeps_pressures_in_its_state runs_go_on_from_states a_state_of_another_mesh_is_refused \
  states_serve_compressible_bodies pictures_show_the_modulus what_cannot_be_is_refused
