// graded_block.geo: a block whose edges grow from a corner by 1 : 100, for gmsh (4.8 or newer, OpenCASCADE kernel),
// lengths in metres: 0.2 x 0.1 x 0.1.
// Size of the largest elements: gmsh -3 -setnumber size 0.04 graded_block.geo
SetFactory("OpenCASCADE");
DefineConstant[ size = {0.04, Name "Element size"} ];

Box(1) = {0, 0, 0, 0.2, 0.1, 0.1};
Physical Volume("flesh", 1) = {1};
MeshSize {:} = size;
MeshSize {1} = size / 100;
Mesh.MeshSizeMax = size;
