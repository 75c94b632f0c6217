# TEST quick program seconds=60 needs=flesh
# test_refined_scenes.sh: body.refine gives the same body on a finer mesh, from the same start.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
meshes=$source_folder/../data/meshes
scenes=$source_folder/../data/scenes

scene() {
  cat >"$1" <<END
body: {mesh: $2, refine: $3, density: 1000, material: {energy: S, young: 1e5, poisson: 0.4}}
effects:
  - gravity: {acceleration: [0, 0, -0.2]}
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}
solver: {newton_tolerance: 1e-12}
END
}

# The refined bar is the bar of twice the cells: the box of its pin holds new nodes, too.
a_refined_bar_is_the_finer_bar() {
  scene coarse.yaml "$meshes/bar_8x2x2.mesh" 1
  scene fine.yaml "$meshes/bar_16x4x4.mesh" 0
  expect 0 "$flesh" run coarse.yaml --out coarse --no-frames && has stdout.txt '425 nodes, 1536 tets' &&
    expect 0 "$flesh" run fine.yaml --out fine --no-frames || return 1
  [ "$(lines coarse/state.txt)" -eq "$(lines fine/state.txt)" ] || return 1
  for run in coarse fine; do grep -v '^#' $run/state.txt | awk '{ printf "%.7f %.7f %.7f\n", $1 + 1e-12, $2 + 1e-12, $3 + 1e-12 }' | sort >$run.txt; done
  cmp coarse.txt fine.txt && has coarse/scene.yaml 'refine: 1'
}

# A run starts again from the state that it has written; a state of the mesh before refinement is interpolated.
a_start_state_is_interpolated() {
  cp "$scenes/swing_coarse.yaml" "$scenes/swing_coarse_start.txt" .
  for setting in body.refine=1 body.element=tet10 'body.refine=1 --set body.element=tet10-mean'; do
    expect 0 "$flesh" run swing_coarse.yaml --set "body.mesh=$meshes/bar_8x2x2.mesh" --set $setting --set time.end=1/60 \
      --out swing --no-frames --quiet || return 1
  done
  # A linear field is interpolated exactly, on every mesh.
  grep -v '^#' "$meshes/bar_8x2x2.mesh" | awk '$1 == "Vertices" { getline n; n += 0; next } n-- > 0 {
    print $1 + 0.1 * $2, 1.02 * $2, $3 - 0.05 * $1, 0.3 * $1, 0, -$2 }' >linear.txt
  cat >linear.yaml <<END
body: {mesh: $meshes/bar_8x2x2.mesh, density: 1000}
effects: [inertia: {}]
start: {state: linear.txt}
time: {step: 1/60, end: 1/60}
END
  for setting in body.refine=2 body.element=tet10 'body.refine=1 --set body.element=tet10'; do
    expect 0 "$flesh" run linear.yaml --set $setting --out linear --no-frames --quiet || return 1
    # After a step without forces, positions are x + v/60 of the linear field; X and Y at rest follow from the velocities.
    grep -v '^#' linear/state.txt | awk '{ y = $2 * 1; Y = -$6; X = $4 / 0.3
      if (sqrt((Y + 0)^2) > 1.1 || sqrt((y - 1.02 * Y)^2) > 1e-9 || sqrt(($1 - X - 0.1 * Y - $4 / 60)^2) > 1e-9) { print; exit 1 } n++ }
      END { exit n < 400 }' || { echo "$setting"; return 1; }
    expect 0 "$flesh" run linear.yaml --set $setting --start-state linear/state.txt --set time.end=1/30 --out again \
      --no-frames --quiet || return 1
  done
}

what_does_not_fit_is_refused() {
  scene coarse.yaml "$meshes/bar_8x2x2.mesh" 11
  expect 2 "$flesh" run coarse.yaml && has stderr.txt '^flesh run: coarse.yaml:[0-9]*:[0-9]*: body.refine is 11; it must be 0 to 10' || return 1
  for refine in 8 10; do
    scene coarse.yaml "$meshes/bar_8x2x2.mesh" $refine
    expect 2 timeout 1800 "$flesh" run coarse.yaml && has stderr.txt "body.refine is $refine; the mesh's 192 tets become" || return 1
    expect 2 timeout 1800 "$flesh" mesh convert --refine $refine "$meshes/bar_8x2x2.mesh" finer.mesh &&
      has stderr.txt "refine $refine: the mesh's 192 tets become" && [ ! -e finer.mesh ] || return 1
  done
  scene coarse.yaml "$meshes/bar_8x2x2.mesh" -1
  expect 2 "$flesh" run coarse.yaml && has stderr.txt 'body.refine' || return 1
  head -n 50 "$scenes/swing_coarse_start.txt" >short.txt
  expect 3 "$flesh" run "$scenes/swing_coarse.yaml" --set body.refine=1 --start-state short.txt --out short &&
    has stderr.txt "short.txt.*one for each of the mesh's 425 nodes"
}

# A warning counts faces that stay as they are, here near a sphere that is not quite the ball's.
faces_that_are_left_are_told() {
  cat >ball.yaml <<END
body: {mesh: $meshes/limb.msh, element: tet10, curved: [{sphere: {centre: [0.272, 0, 0], radius: 0.028}}]}
effects: [gravity: {}, pin: {box: [[-1, -1, -1], [1, 1, 1]]}]
END
  expect 0 "$flesh" run ball.yaml --no-frames --out ball || return 1
  has stderr.txt 'warning: body.curved\[0\]: [0-9]* faces of the mesh near it stay as they are' &&
    has ball/result.json '"warning": "body.curved\[0\]: [0-9]* faces'
}

run_tests faces_that_are_left_are_told a_refined_bar_is_the_finer_bar a_start_state_is_interpolated what_does_not_fit_is_refused
