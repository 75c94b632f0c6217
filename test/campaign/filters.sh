#!/bin/sh
# filters.sh: the eigenvalue filters compared on hard cases; data/results/filters.md is of --full.
#
#   sh test/campaign/filters.sh OUT           a look: a small box, one Poisson's ratio, one seed
#   sh test/campaign/filters.sh OUT --full    the box of 384 tets and the finger, hours of CPU time
#   sh test/campaign/filters.sh OUT --box     of these the box with tet4 and tet10-mean, of which there is a picture
#
# FLESH is the program, build/drivers/flesh by default. What OUT has already is not run again.
set -eu

flesh=${FLESH:-build/drivers/flesh}
out=${1:?"usage: sh test/campaign/filters.sh OUT [--full | --box]"}

# compare NAME [options]: the six filters, into OUT/NAME.
compare() {
  name=$1
  shift
  "$flesh" hardcases --filters --resume --out "$out/$name" \
    --solvers clamped,absolute,trust-region,clamped-always,absolute-always,trust-region-always "$@"
}

if [ "${2:-}" = --full ] || [ "${2:-}" = --box ]; then
  compare box --meshes 8x4x2 --max-seconds 20 --elements tet4,tet10-mean
  [ "$2" = --full ] || exit 0
  compare box10 --meshes 8x4x2 --max-seconds 20 --elements tet10 --poisson 0.3,0.49,0.4999
  compare finger --meshes data/meshes/finger_coarse.msh --max-seconds 60 --elements tet4,tet10-mean \
    --poisson 0.49,0.4999 --seeds 2
else
  compare look --meshes 2x1x1 --max-seconds 20 --elements tet4 --poisson 0.45 --seeds 1
fi
