#!/bin/sh
# demo.sh: goes from a bare Debian to a comparison of volume drift: installs missing packages, builds and runs.
#
#   sh drivers/demo.sh          results go to out/ at the top of the tree
set -eu

root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
. "$root/drivers/setup.sh"

[ $# -eq 0 ] || die "unknown argument '$1'; demo.sh takes none."

install_missing build_packages
cd "$root"
# The program alone: no tests, no examples.
targets=drivers/flesh
build build || die "the build failed; the compiler's words are above."

# First figures within seconds: one Poisson's ratio on the coarse mesh.
build/drivers/flesh drift data/scenes/finger_pull_coarse.yaml --poisson 0.49 --solvers guarded --out out/first

# The pulled finger on two meshes, to tell the mesh's error from the material's effect.
build/drivers/flesh drift data/scenes/finger_pull_coarse.yaml data/scenes/finger_pull_fine.yaml \
  --out out

# Near nu = 1/2 four-node tets lock; comparison with ten-node tets shows how much of the figures that is.
build/drivers/flesh drift data/scenes/finger_pull_coarse.yaml --poisson 0.49 --solvers guarded \
  --elements tet4,tet10-mean --out out/elements

build/drivers/flesh report out out/elements --title 'A finger pulled and let go: what the energies do to its volume' \
  --out out/report.html

printf '\nThe folder: %s/out. Open, in this order:\n' "$root"
printf '  %s\n' 'report.html                                all of it in a browser, with the finger in 3D' \
  'shapes_finger_pull_fine_0.49_guarded.png   the finger pulled and let go, in every energy' \
  'volume_finger_pull_fine_0.49.png           its volume against time' \
  'verdict.txt                                the comparison in words' \
  'elements/verdict.txt                       how much of it is due to the mesh at 0.49'
