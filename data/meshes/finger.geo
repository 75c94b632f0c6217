// finger.geo: a stylised finger for gmsh (4.8 or newer, OpenCASCADE kernel), lengths in metres.
// Along x from its flat base (x = 0) to the tip (x = 0.08), 18 mm thick, slightly bulged at the joints.
// Size of the elements: gmsh -3 -setnumber size 0.004 finger.geo
SetFactory("OpenCASCADE");
DefineConstant[ size = {0.004, Name "Element size"} ];

Point(1) = {0, 0, 0};
Point(2) = {0, 0.0090, 0};
Point(3) = {0.016, 0.0089, 0};
Point(4) = {0.032, 0.0093, 0};
Point(5) = {0.045, 0.0084, 0};
Point(6) = {0.057, 0.0083, 0};
Point(7) = {0.069, 0.0074, 0};
Point(8) = {0.0785, 0.0042, 0};
Point(9) = {0.08, 0, 0};
Spline(1) = {2 : 9};
Line(2) = {9, 1};
Line(3) = {1, 2};
Curve Loop(1) = {1 : 3};
Plane Surface(1) = {1};
turned[] = Extrude {{1, 0, 0}, {0, 0, 0}, 2 * Pi} { Surface{1}; };
Recursive Delete { Surface{1}; }
Physical Volume("finger", 1) = {turned[1]};

Mesh.MeshSizeMin = size;
Mesh.MeshSizeMax = size;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.Algorithm = 6;
Mesh.Algorithm3D = 1;
Mesh.Optimize = 1;
Mesh.OptimizeThreshold = 0.6;
Mesh.MshFileVersion = 4.1;
Mesh.Binary = 1;
