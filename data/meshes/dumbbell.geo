// dumbbell.geo: two balls on a thin neck, for gmsh (4.8 or newer, OpenCASCADE kernel), lengths in metres.
// Balls of radius 0.04 and 0.048, 0.128 apart; the neck has a radius of 6.4 mm.
// Size of the elements: gmsh -3 -setnumber size 0.022 dumbbell.geo
SetFactory("OpenCASCADE");
DefineConstant[ size = {0.022, Name "Element size"} ];

Sphere(1) = {0, 0, 0, 0.04};
Sphere(2) = {0.128, 0, 0, 0.048};
Cylinder(3) = {0, 0, 0, 0.128, 0, 0, 0.0064};
whole[] = BooleanUnion{ Volume{1}; Delete; }{ Volume{2, 3}; Delete; };
Physical Volume("flesh", 1) = {whole[]};

Mesh.MeshSizeMin = 0.2 * size;
Mesh.MeshSizeMax = size;
Mesh.MeshSizeFromCurvature = 8;
