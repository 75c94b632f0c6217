#!/bin/sh
# demo.sh: from a bare Debian to the drift comparison: installs what is missing, builds, runs.
#
#   sh drivers/demo.sh          results go to out/ at the top of the tree
set -eu

root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
. "$root/drivers/setup.sh"

[ $# -eq 0 ] || die "unknown argument '$1'; demo.sh takes none."

install_missing build_packages
cd "$root"
build build || die "the build failed; the compiler's words are above."

# The pulled finger on two meshes, so that the mesh is not taken for the material.
build/drivers/flesh drift data/scenes/finger_pull_coarse.yaml data/scenes/finger_pull_fine.yaml \
  --out out

printf '\nThe folder: %s/out (first look at shapes_*.png and volume_*.png)\n' "$root"
