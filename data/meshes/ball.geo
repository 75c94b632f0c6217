// ball.geo: a ball of radius 0.05 around the origin for gmsh (4.8 or newer, OpenCASCADE kernel), lengths in metres.
// Size of the elements: gmsh -3 -setnumber size 0.02 ball.geo
SetFactory("OpenCASCADE");
DefineConstant[ size = {0.02, Name "Element size"} ];

Sphere(1) = {0, 0, 0, 0.05};
Physical Volume("ball", 1) = {1};

Mesh.MeshSizeMin = size;
Mesh.MeshSizeMax = size;
Mesh.MshFileVersion = 4.1;
Mesh.Binary = 1;
