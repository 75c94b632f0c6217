// spindle.geo: a spindle of muscle that hangs on a tendon and bears a weight on another, for gmsh (4.8 or newer,
// OpenCASCADE kernel), lengths in metres. Along z from the weight's base (z = -0.03) to the cut of the upper tendon
// (z = 0.2); the belly, up to 36 mm thick, from z = 0.04 to 0.16, the tendons 10 mm thick.
// Region tags: belly 1, tendons 2, weight 3.
// Size of the elements: gmsh -3 -setnumber size 0.007 spindle.geo
SetFactory("OpenCASCADE");
DefineConstant[ size = {0.007, Name "Element size"} ];

// The belly turns its profile about the z axis.
Point(1) = {0, 0, 0.04};
Point(2) = {0.005, 0, 0.04};
Point(3) = {0.014, 0, 0.07};
Point(4) = {0.018, 0, 0.1};
Point(5) = {0.014, 0, 0.13};
Point(6) = {0.005, 0, 0.16};
Point(7) = {0, 0, 0.16};
Line(1) = {1, 2};
Spline(2) = {2, 3, 4, 5, 6};
Line(3) = {6, 7};
Line(4) = {7, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
belly[] = Extrude{ {0, 0, 1}, {0, 0, 0}, 2 * Pi }{ Surface{1}; };
Cylinder(11) = {0, 0, 0, 0, 0, 0.04, 0.005};
Cylinder(12) = {0, 0, 0.16, 0, 0, 0.04, 0.005};
Cylinder(13) = {0, 0, -0.03, 0, 0, 0.03, 0.02};
parts[] = BooleanFragments{ Volume{belly[1]}; Delete; }{ Volume{11, 12, 13}; Delete; };
Physical Volume("belly", 1) = {belly[1]};
Physical Volume("tendons", 2) = {11, 12};
Physical Volume("weight", 3) = {13};

Mesh.MeshSizeMin = 0.6 * size;
Mesh.MeshSizeMax = size;
Mesh.MeshSizeExtendFromBoundary = 1;
Mesh.Algorithm = 6;
Mesh.Algorithm3D = 1;
Mesh.Optimize = 1;
Mesh.OptimizeThreshold = 0.6;
Mesh.MshFileVersion = 4.1;
Mesh.Binary = 1;
