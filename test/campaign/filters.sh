#!/bin/sh
# filters.sh: compares the eigenvalue filters on a share of the problems of data/results/filters.md.
#
#   sh test/campaign/filters.sh OUT               a quick look: a share of 0.0005
#   sh test/campaign/filters.sh OUT SHARE         this share of the problems that are not held out; 1: all
#   sh test/campaign/filters.sh OUT SHARE --held  also this share of the held-out ones, 15 % of all: once, at the end
#
# A problem is a case (data/hardcases/filters.yaml), a seed, a form, a Poisson's ratio, a mesh and a step; a hash of these
# decides whether it is in the share. FLESH names the program, build/drivers/flesh by default. Problems that OUT already has
# are not run again, so that a share can grow. Runs have no limit of time, so that a busy machine changes no outcome.
# OUT/rest has the profiles of the page; filters.py makes its table.
set -eu

flesh=${FLESH:-build/drivers/flesh}
out=${1:?"usage: sh test/campaign/filters.sh OUT [SHARE [--held]]"}
share=${2:-0.0005}
filters=clamped,absolute,trust-region,clamped-always,absolute-always,trust-region-always
bare=$(echo "$filters" | sed 's/,/-bare,/g')-bare
small=8x4x2,data/meshes/graded_block.msh,data/meshes/finger_coarse.msh,data/meshes/plate_with_holes.msh

# part FACTOR: prints the hashes to run: of 0:0.85, or of 0.85:1 for held-out problems, the fraction share * FACTOR, or all
# if the share is 1.
part() {
  awk -v share="$share" -v held="$held" -v factor="$1" 'BEGIN {
    low = held ? 0.85 : 0
    part = share < 1 && share * factor < 1 ? share * factor : 1
    printf "%.9g:%.9g", low, low + part * (held ? 0.15 : 0.85) }'
}

# compare NAME FACTOR ELEMENTS SOLVERS [options]: compares into OUT/NAME, or OUT/NAME_held for held-out problems.
compare() {
  name=$1$suffix part=$(part "$2") elements=$3 solvers=$4
  shift 4
  "$flesh" hardcases --filters --resume --out "$out/$name" --share "$part" --seeds 20 --energies S,E,Neo --jobs "${JOBS:-1}" \
    --poisson 0.3,0.4,0.45,0.49,0.499,0.4999,0.49999,0.5 --elements "$elements" --solvers "$solvers" --max-seconds 1e6 \
    --set solver.max_newton=100 --set solver.max_linear=300 --set solver.max_cutbacks=0 "$@"
}

# kinds HOW FACTOR ELEMENTS SOLVERS: compares starts, three times as many loads, and half as many motions.
kinds() {
  how=$1 factor=$2
  shift 2
  compare "rest$how" "$factor" "$1" "$2" --cases rest --meshes "$small"
  compare "loads$how" "$(awk "BEGIN { print 3 * $factor }")" "$1" "$2" --cases load --meshes "$small"
  compare "motions$how" "$(awk "BEGIN { print $factor / 2 }")" "$1" "$2" --cases motion --steps 1e-3,1e-2,1e-1,1 --meshes "$small"
}

for held in 0 1; do
  [ "$held" = 0 ] || [ "${3:-}" = --held ] || break
  suffix=$([ "$held" = 0 ] || echo _held)
  kinds '' 1 tet4,tet10-mean "$filters"
  kinds _bare 0.25 tet4,tet10-mean "$bare" # a smaller share, as these and the following cost most
  kinds _tet10 0.25 tet10 "$filters"
  compare large 0.1 tet4,tet10,tet10-mean "$filters" --cases rest,load --meshes 24x12x12,data/meshes/finger_fine.msh
done
