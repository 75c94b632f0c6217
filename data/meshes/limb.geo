// limb.geo: flesh grown together with a bone, for gmsh (4.8 or newer, OpenCASCADE kernel), lengths in metres.
// Along x from its flat cut (x = 0) to its round tip (x = 0.3), 56 mm thick; the bone, 22 mm thick, ends at x = 0.16.
// Region tags: flesh 1, bone 2.
// Size of the elements: gmsh -3 -setnumber size 0.011 limb.geo
SetFactory("OpenCASCADE");
DefineConstant[ size = {0.011, Name "Element size"} ];

Cylinder(1) = {0, 0, 0, 0.272, 0, 0, 0.028};
Sphere(2) = {0.272, 0, 0, 0.028};
whole[] = BooleanUnion{ Volume{1}; Delete; }{ Volume{2}; Delete; };
Cylinder(11) = {0, 0, 0, 0.149, 0, 0, 0.011};
Sphere(12) = {0.149, 0, 0, 0.011};
bone[] = BooleanUnion{ Volume{11}; Delete; }{ Volume{12}; Delete; };
flesh[] = BooleanDifference{ Volume{whole[]}; Delete; }{ Volume{bone[]}; };
parts[] = BooleanFragments{ Volume{flesh[]}; Delete; }{ Volume{bone[]}; Delete; };
Physical Volume("flesh", 1) = {flesh[]};
Physical Volume("bone", 2) = {bone[]};

Mesh.MeshSizeMin = 0.6 * size;
Mesh.MeshSizeMax = size;
Mesh.MeshSizeExtendFromBoundary = 1;
Mesh.Algorithm = 6;
Mesh.Algorithm3D = 1;
Mesh.Optimize = 1;
Mesh.OptimizeThreshold = 0.6;
Mesh.MshFileVersion = 4.1;
Mesh.Binary = 1;
