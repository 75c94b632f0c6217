// tentacle.geo: a tentacle, for gmsh (4.8 or newer, OpenCASCADE kernel), lengths in metres. Along z from its flat base
// (z = 0), 50 mm thick, to its round tip (z = 0.3), 20 mm thick.
// Size of the elements: gmsh -3 -setnumber size 0.014 tentacle.geo
SetFactory("OpenCASCADE");
DefineConstant[ size = {0.014, Name "Element size"} ];

Cone(1) = {0, 0, 0, 0, 0, 0.29, 0.025, 0.01};
Sphere(2) = {0, 0, 0.29, 0.01};
whole[] = BooleanUnion{ Volume{1}; Delete; }{ Volume{2}; Delete; };
Physical Volume("tentacle", 1) = {whole[]};

Mesh.MeshSizeMin = 0.5 * size;
Mesh.MeshSizeMax = size;
Mesh.MeshSizeExtendFromBoundary = 1;
Mesh.Algorithm = 6;
Mesh.Algorithm3D = 1;
Mesh.Optimize = 1;
Mesh.OptimizeThreshold = 0.6;
Mesh.MshFileVersion = 4.1;
Mesh.Binary = 1;
