# sweep.sh: shared by the tests of sweeps: specs, and queries of databases.
# To be sourced after command.sh.
# shellcheck shell=sh disable=SC2154
data=$source_folder/../data

cat >tiny.yaml <<END
body: {mesh: $data/meshes/one_tet.mesh, material: {energy: S, young: 1e5, poisson: 0.4}}
effects: [inertia, gravity, spring: {point: [1, 0, 0], stiffness: 100, target: [{time: 0, position: [2, 0, 0]}]}]
time: {step: 1/60, end: 1/60}
END
# bar_spec END: 48 cases of a bar, each END seconds of simulated time.
bar_spec() {
  cat <<END
scene: $data/scenes/bar_gravity.yaml
set: {body.material: {energy: S, young: 1e5, poisson: 0.45}, body.mesh: $data/meshes/bar_8x2x2.mesh, time.end: $1}
axes:
  - {key: body.material.poisson, values: [0.3, 0.4, 0.45, 0.49]}
  - {key: body.density, from: 500, to: 2000, count: 12, spacing: logarithmic}
END
}
# Cases of some 50 ms each on any machine, long enough to be killed in the middle.
bar_cases() {
  bar_spec 1 >probe.yaml
  "$flesh" sweep probe.yaml --out probe --jobs 2 --quiet || return 1
  bar_spec "$(ask probe/sweep.db 'printf("%.3f", min(60, max(0.1, 0.05 * count(*) / sum(wall_s))))')" >bar.yaml
}

# spec LINES...: a sweep of tiny.yaml.
spec() {
  echo 'scene: tiny.yaml' >spec.yaml
  printf '%s\n' "$@" >>spec.yaml
}

same_figures=id,status,exit_code,message,steps,newton,linear,residuals,residual,max_volume_drift,J_min,energy_total
# figures DB: prints the columns that do not depend on time or machine, bit for bit.
figures() { "$flesh" sweep export "$1" --columns "$same_figures"; }
# ask DB COLUMNS [CONDITION]: without the header.
ask() { "$flesh" sweep export "$1" --columns "$2" --where "${3:-1}" | sed 1d; }

undisturbed() {
  [ -f whole/sweep.db ] || "$flesh" sweep bar.yaml --out whole --jobs 2 --quiet
}
