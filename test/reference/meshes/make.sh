#!/bin/sh
# make.sh: writes the meshes of gmsh in this folder again, by gmsh 4.8.4.
set -eu
cd "$(dirname -- "$0")"

# mesh GEOMETRY DIMENSION NAME OPTIONS...
mesh() {
  geometry=$1 dimension=$2 name=$3
  shift 3
  gmsh "-$dimension" "$geometry.geo" -o "$name" "$@"
}
text='-setnumber Mesh.Binary 0' bytes='-setnumber Mesh.Binary 1'

# shellcheck disable=SC2086
{
  mesh two_boxes 3 two_boxes_22_ascii.msh -format msh22 $text
  mesh two_boxes 3 two_boxes_22_binary.msh -format msh22 $bytes
  mesh two_boxes 3 two_boxes_41_ascii.msh -format msh41 $text
  mesh two_boxes 3 two_boxes_41_binary.msh -format msh41 $bytes
  mesh two_boxes 3 two_boxes_41_parts.msh -format msh41 -part 3
  mesh two_boxes 3 two_boxes_41_untagged_parts.msh -format msh41 -part 3 -setnumber tagged 0 $bytes
  mesh two_boxes 3 two_boxes_22_untagged.msh -format msh22 -setnumber tagged 0 $bytes
  mesh two_boxes 3 two_boxes_order2.msh -format msh41 -order 2
  mesh two_boxes 2 two_boxes_surface.msh -format msh41 -setnumber Mesh.SaveAll 1
  mesh ball 3 ball_22_ascii.msh -setnumber h 2 -order 2 -format msh22 $text
  mesh ball 3 ball_22_binary.msh -setnumber h 2 -order 2 -format msh22 $bytes
  mesh ball 3 ball_41_ascii.msh -setnumber h 2 -order 2 -format msh41 $text
  mesh ball 3 ball_41_binary.msh -setnumber h 2 -order 2 -format msh41 $bytes
  mesh ball 3 ball.mesh -setnumber h 2 -order 2 -format mesh
  mesh ball 3 ball_finer.msh -setnumber h 1 -order 2 -format msh41 $bytes
  mesh ball 3 ball_order3.msh -setnumber h 2 -order 3 -format msh41 $text
  mesh sphere_octant 3 sphere_octant_132.msh -setnumber h 0.45 -setnumber inner 0.3 -order 2 -format msh41 $bytes
  mesh sphere_octant 3 sphere_octant_336.msh -setnumber h 0.28 -setnumber inner 0.17 -order 2 -format msh41 $bytes
  mesh limbs 3 limbs.msh -format msh41 $bytes
}
