# TEST quick program seconds=120 needs=flesh
# test_command_effects.sh: the first steps of the effects' example scenes run, and a run reports the cost of each effect and
# nothing of absent ones. FLESH names the program.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
scenes=$source_folder/../data/scenes

# short NAME SECONDS: runs the beginning of an example scene.
short() { expect 0 "$flesh" run "$scenes/$1.yaml" --no-frames --set "time.end=$2" --out "out/$1" --quiet; }

the_example_scenes_run() {
  short damped_bar 1/20 && short viscous_spin 1/40 && short settling_drop 1/10 && short loaded_bar 1/5 &&
    short two_bodies 1/20 || return 1
  for name in damped_bar viscous_spin settling_drop loaded_bar two_bodies; do
    has "out/$name/result.json" '"status": "complete"' || return 1
  done
  has out/loaded_bar/history.csv 'energy_traction,energy_force,energy_elasticity,energy_total' &&
    has out/damped_bar/history.csv 'energy_inertia,energy_gravity,energy_elasticity,energy_total'
}

calls_are_told_always_and_times_on_request() {
  short damped_bar 1/20 || return 1
  has out/damped_bar/result.json '"residuals": [1-9]' && has out/damped_bar/result.json '"memory_bytes": [1-9]' &&
    has out/damped_bar/result.json '"cpu_s": null' || return 1
  expect 0 "$flesh" run "$scenes/damped_bar.yaml" --no-frames --set time.end=1/20 --out out/profile --profile ||
    return 1
  has stdout.txt '^damping  *[1-9]' && has stdout.txt '^elasticity  *[1-9]' || return 1
  # The profile's times are numbers: only figures that do not apply may be null.
  sed -n '/"effects": \[/,/^  \]/p' out/profile/result.json >effects.txt
  [ "$(grep -c '"cpu_s": [0-9]' effects.txt)" -eq 4 ] || { cat effects.txt; return 1; }
}

absent_effects_appear_nowhere() {
  short settling_drop 1/20 || return 1
  sed -n '/"effects": \[/,/^  \]/p' out/settling_drop/result.json | grep -o '"name": "[a-z_]*"' >names.txt
  printf '"name": "%s"\n' inertia gravity settling_damping elasticity >expected.txt
  cmp names.txt expected.txt || { cat names.txt; return 1; }
  # Looks for these words as names only, because the path of the scene may have them.
  ! grep -E -q '[",_](spring|contact|pressure|viscosity)' out/settling_drop/history.csv out/settling_drop/result.json
}

run_tests the_example_scenes_run calls_are_told_always_and_times_on_request absent_effects_appear_nowhere
