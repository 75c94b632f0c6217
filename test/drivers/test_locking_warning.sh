# TEST full memory program seconds=60 needs=flesh
# test_locking_warning.sh: what `flesh run` says of four-node tets near nu = 1/2, and where its figure comes from; how
# far J at single points of ten-node tets departs from 1.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
meshes=$source_folder/../data/meshes

cat >bar.yaml <<END
body: {mesh: $meshes/bar_16x4x4.mesh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.49}}
effects:
  - inertia: {}
  - gravity: {acceleration: [0, 0, -0.2]}
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}
time: {step: 1/60, end: 60}
END

# said SETTING...: stdout.txt gets what a run with these settings says before its first steps, after which it is stopped.
said() {
  for setting; do set -- "$@" --set "$setting"; shift; done
  "$flesh" run bar.yaml "$@" --max-seconds 1e-3 --no-frames --out run >stdout.txt 2>stderr.txt
  [ $? -eq 6 ] || { cat stderr.txt; return 1; }
}

# The figure of a long run is from a linear solve. In statics this bar sinks by 65.6 % less than with fine ten-node tets
# (test_command_accuracy_mesh has such figures).
a_long_run_solves_for_the_figure() {
  said time.end=60 && has stdout.txt "^warning: .* at a Poisson's ratio of 0.49 (by a linear solve on this mesh, the body yields 6[4-6] % less to a small transverse load than with tet10-mean); set body.element: tet10-mean" || return 1
  said "body.mesh=$meshes/bar_8x2x2.mesh" && has stdout.txt 'yields \(79\|80\|81\|82\) % less' || return 1
  # The same constants given in another way, and those of a form with residual stress at rest.
  said 'body.material={energy: B, constants: raw, mu: 33557.05, lambda: 1644295.3}' && has stdout.txt 'yields 6[4-6] % less' &&
    said body.material.energy=D body.material.constants=as_e && has stdout.txt 'yields 7[2-6] % less'
}

# The figure is that of the direction in which the body bends.
a_plate_and_a_cube_differ() {
  "$flesh" mesh box --cells 5,5,5 --size 1,1,1 --out cube.mesh >/dev/null || return 1
  said body.mesh=cube.mesh || return 1
  cube=$(sed -n 's/.*body yields \([0-9]*\) %.*/\1/p' stdout.txt)
  echo "a cube yields $cube % less"
  [ -n "$cube" ] && [ "$cube" -lt 50 ] && [ "$cube" -gt 5 ]
}

# The figure of a short run is from a table, as a linear solve would cost too much of the run.
a_short_run_takes_the_table() {
  said time.end=1 && has stdout.txt 'at a Poisson.s ratio of 0.49 (from a table: at 0.49 a bar of 5 000 tets bends 51 % too little, one of 53 000 22 %; a linear solve on this mesh would cost more than a fifth of the run)' &&
    said time.end=1 body.material.poisson=0.4999 && has stdout.txt 'at 0.4999 a bar of 5 000 tets bends 91 % too little' || return 1
  # Nothing holds the body, so there is no load to which it would yield.
  said effects.pin=null && has stdout.txt 'a linear solve on this mesh gave no estimate'
}

what_does_not_lock_is_not_warned_of() {
  said body.material.poisson=0.46 && ! grep warning stdout.txt && said body.material.poisson=0.47 && grep -q warning stdout.txt &&
    said body.element=tet10-mean && ! grep warning stdout.txt
}

# In a pulled finger, the smallest J at points stays about as near to 1 as that of tet10, 0.64 (0.37 if points keep only twice
# the shear modulus).
points_of_the_mean_do_not_collapse() {
  "$flesh" run "$meshes/../scenes/finger_pull_coarse.yaml" --set body.element=tet10-mean --set body.material.poisson=0.49 \
    --set time.end=0.3 --no-frames --out finger >stdout.txt || return 1
  sed -n 's/.*smallest J \([-.0-9]*\).*/\1/p' stdout.txt | awk '{ print "smallest J", $1; good = $1 > 0.58 } END { exit !good }'
}

run_tests a_long_run_solves_for_the_figure a_plate_and_a_cube_differ a_short_run_takes_the_table \
  what_does_not_lock_is_not_warned_of points_of_the_mean_do_not_collapse
