#!/bin/sh
# contact_cost.sh: measures the cost of contact between two slabs of 28 800 tets each, with 61 x 41 nodes face to face.
#   sh test/campaign/contact_cost.sh [flesh [steps [cells along the slabs]]]
# swing: the slabs lie on each other, are clamped at one end and swing down. press: the upper slab falls and slides on the
# lower one, whose underside is held, so that nearly all nodes touch. Prints a table of runs with and without contact:
# means over the steps, CPU time of one thread, and the part of it in contact's forces and Hessians (with their searches,
# without continuous collision detection).
set -eu
flesh=${1:-build/drivers/flesh} steps=${2:-30} cells=${3:-60}
case $flesh in */*) flesh=$(cd "$(dirname "$flesh")" && pwd)/$(basename "$flesh") ;; esac
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
across=$((cells * 2 / 3))
for slab in bottom top; do
  "$flesh" mesh box --cells "$cells,$across,2" --size "1,$across/$cells,2/$cells" --out $slab.mesh >mesh.log
done

# scene NAME EFFECTS VELOCITY: runs a scene with these effects beside inertia and gravity and this velocity of the upper
# slab, and prints its row.
scene() {
  cat >"$1.yaml" <<END
body:
  name: bottom
  mesh: bottom.mesh
  density: 1000
  material: {energy: S, constants: matched, young: 1e6, poisson: 0.45}
bodies:
  - name: top
    mesh: top.mesh
    translation: [0, 0.003, $(awk "BEGIN {print 2.048 / $cells}")]
    density: 1000
    material: {energy: S, constants: matched, young: 2e5, poisson: 0.45}
    velocity: $3
effects: [{inertia: {}}, {gravity: {}}, $2]
time: {method: backward-euler, step: 1/60, end: $steps/60}
END
  "$flesh" run "$1.yaml" --no-frames --profile --out "$1" >"$1.log"
  cpu=$(sed -n 's/.*"cpu_s": \([0-9.e+-]*\).*/\1/p' "$1/result.json" | head -1)
  contact=$(awk '$1 == "contact" { print $NF }' "$1.log")
  awk -F, -v name="$1" -v cpu="$cpu" -v contact="${contact:-0}" '
    NR == 1 { for (k = 1; k <= NF; k++) column[$k] = k; next }
    $column["step"] > 0 {
      steps++; newton += $column["newton"]; linear += $column["linear"]
      if ("contact_pairs" in column) pairs += $column["contact_pairs"] }
    END { printf "| %s | %d | %.1f | %.1f | %.0f | %.0f %% |\n", name, pairs / steps, newton / steps, linear / newton,
                 1e3 * cpu / steps, 100 * contact / cpu }' "$1/history.csv"
}

echo '| scene | pairs | Newton a step | linear a Newton | ms a step | forces of contact |'
echo '|---|---|---|---|---|---|'
held='{pin: {box: [[-1, -1, -1], [1e-9, 1, 1]]}}' underside='{pin: {box: [[-1, -1, -1], [2, 1, 1e-9]]}}'
scene swing "$held, {contact: {between: all}}" '[0, 0, 0]'
scene swing_soft "$held, {contact: {between: all, stiffness: 1000}}" '[0, 0, 0]'
scene swing_adaptive "$held, {contact: {between: all, adaptive: true}}" '[0, 0, 0]'
scene swing_without "$held" '[0, 0, 0]'
scene press "$underside, {contact: {between: all}}" '[0.3, 0, -0.2]'
scene press_soft "$underside, {contact: {between: all, stiffness: 1000}}" '[0.3, 0, -0.2]'
scene press_adaptive "$underside, {contact: {between: all, adaptive: true}}" '[0.3, 0, -0.2]'
scene press_without "$underside" '[0.3, 0, -0.2]'
