# sweep.sh: what the tests of sweeps share: two specs, and questions to databases.
# To be sourced after command.sh.
# shellcheck shell=sh disable=SC2154
data=$source_folder/../data

cat >tiny.yaml <<END
body: {mesh: $data/meshes/one_tet.mesh, material: {energy: S, young: 1e5, poisson: 0.4}}
effects: [inertia, gravity, drag: {point: [1, 0, 0], stiffness: 100, target: [{time: 0, position: [2, 0, 0]}]}]
time: {step: 1/60, end: 1/60}
END
# Cases long enough to be killed amidst.
cat >bar.yaml <<END
scene: $data/scenes/bar_gravity.yaml
set: {body.material: {energy: S, young: 1e5, poisson: 0.45}, body.mesh: $data/meshes/bar_8x2x2.mesh, time.end: 1/2}
axes:
  - {key: body.material.poisson, values: [0.3, 0.4, 0.45, 0.49]}
  - {key: body.density, from: 500, to: 2000, count: 12, spacing: logarithmic}
END

# spec LINES...: a sweep of tiny.yaml.
spec() {
  echo 'scene: tiny.yaml' >spec.yaml
  printf '%s\n' "$@" >>spec.yaml
}

same_figures=id,status,exit_code,message,steps,newton,linear,residuals,residual,max_volume_drift,min_J,energy_total
# figures DB: what does not depend on time or machine, bit for bit.
figures() { "$flesh" sweep export "$1" --columns "$same_figures"; }
# ask DB COLUMNS [CONDITION]: without the header.
ask() { "$flesh" sweep export "$1" --columns "$2" --where "${3:-1}" | sed 1d; }

undisturbed() {
  [ -f whole/sweep.db ] || "$flesh" sweep bar.yaml --out whole --jobs 2 --quiet
}
