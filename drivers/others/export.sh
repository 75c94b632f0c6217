#!/bin/sh
# Writes the frozen cases (data/hardcases/frozen.txt has their checksums) below a folder:
#   sh drivers/others/export.sh FOLDER [path of the flesh program]
set -eu
top=$(CDPATH='' cd -- "$(dirname -- "$0")/../.." && pwd)
flesh=${2:-$top/build/drivers/flesh}
"$flesh" hardcases --filters --quick --export --energies S,E,B --poisson 0.49 --elements tet4,tet10 --solvers default \
  --cases stretch,twist,squash,noise --out "$1/filters"
"$flesh" hardcases --quick --export --energies S,B --poisson 0.49 --out "$1/battery"
"$flesh" hardcases --shapes --export --meshes "$top/data/meshes/graded_block.msh" --energies S,B --poisson 0.495 \
  --out "$1/shapes"
