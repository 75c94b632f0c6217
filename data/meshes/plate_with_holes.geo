// plate_with_holes.geo: a thick plate with three holes that leave thin webs, for gmsh (4.8 or newer, OpenCASCADE
// kernel), lengths in metres: 0.2 x 0.1 x 0.025.
// Size of the elements: gmsh -3 -setnumber size 0.013 plate_with_holes.geo
SetFactory("OpenCASCADE");
DefineConstant[ size = {0.013, Name "Element size"} ];

Box(1) = {0, 0, 0, 0.2, 0.1, 0.025};
Cylinder(2) = {0.04, 0.05, -0.1, 0, 0, 0.2, 0.02};
Cylinder(3) = {0.1, 0.03, -0.1, 0, 0, 0.2, 0.015};
Cylinder(4) = {0.15, 0.06, -0.1, 0, 0, 0.2, 0.03};
whole[] = BooleanDifference{ Volume{1}; Delete; }{ Volume{2, 3, 4}; Delete; };
Physical Volume("flesh", 1) = {whole[]};

Mesh.MeshSizeMax = size;
Mesh.MeshSizeFromCurvature = 12;
