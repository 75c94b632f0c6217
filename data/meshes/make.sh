#!/bin/sh
# Makes the meshes of this folder anew: by gmsh those that have a recipe (NAME.geo), by `flesh mesh box` bars, cubes and
# the strip. The other tiny meshes are written by hand.
#   sh data/meshes/make.sh [path of the flesh program]
set -eu
flesh=$(realpath "${1:-$(dirname "$0")/../../build/drivers/flesh}")
cd "$(dirname "$0")"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# make_mesh RECIPE SIZE MESH: meshes RECIPE.geo with its `size` (of elements, in m; of slivers, a number of points). gmsh
# also writes the surface; flesh keeps the tets.
make_mesh() {
  gmsh -3 -nt 1 -setnumber size "$2" "$1.geo" -o "$work/$3" > "$work/log" ||
    { cat "$work/log" >&2; exit 1; }
  "$flesh" mesh convert "$work/$3" "$3"
}
make_mesh hand 0.0064 hand_coarse.msh
make_mesh hand 0.0029 hand_fine.msh
make_mesh finger 0.0039 finger_coarse.msh
make_mesh finger 0.0022 finger_fine.msh
make_mesh sphere_shell 0.013 sphere_shell.msh
make_mesh limb 0.011 limb.msh
make_mesh limb 0.022 limb_coarse.msh
make_mesh ball 0.02 ball.msh
make_mesh spindle 0.007 spindle.msh
make_mesh tentacle 0.014 tentacle.msh
make_mesh tube 0.014 tube.msh
# Meshes of the hard cases.
make_mesh dumbbell 0.022 dumbbell.msh
make_mesh plate_with_holes 0.013 plate_with_holes.msh
make_mesh graded_block 0.04 graded_block.msh
make_mesh slivers 250 slivers.msh
make_mesh torus_knot 0.012 torus_knot.msh
make_mesh tree 0.01 tree.msh
"$flesh" mesh surface hand_fine.msh hand_skin.ply

"$flesh" mesh box --cells 8,2,2 --size 4,1,1 --out bar_8x2x2.mesh
"$flesh" mesh box --cells 16,4,4 --size 4,1,1 --out bar_16x4x4.mesh
"$flesh" mesh box --cells 6,6,6 --size 0.1,0.1,0.1 --origin 0.04,-0.05,0.05 --out jelly_cube.mesh
"$flesh" mesh box --cells 1,1,1 --size 1,1,1 --out cube_of_six_tets.mesh
"$flesh" mesh box --cells 3,3,3 --size 0.1,0.1,0.1 --out cube_3x3x3.mesh
"$flesh" mesh box --cells 40,4,1 --size 1,0.1,0.02 --out strip.mesh
