// sphere_shell.geo: half of a thick-walled sphere (y >= 0) for gmsh (4.8 or newer, OpenCASCADE kernel), lengths in
// metres: outer radius 0.1, inner radius 0.07, cut by the plane y = 0.
// Size of the elements: gmsh -3 -setnumber size 0.013 sphere_shell.geo
SetFactory("OpenCASCADE");
DefineConstant[ size = {0.013, Name "Element size"} ];

Point(1) = {0, 0, 0};
Point(2) = {0.07, 0, 0};
Point(3) = {0.1, 0, 0};
Point(4) = {0, 0.1, 0};
Point(5) = {0, 0.07, 0};
Circle(1) = {3, 1, 4};
Circle(2) = {5, 1, 2};
Line(3) = {2, 3};
Line(4) = {4, 5};
Curve Loop(1) = {1, 4, 2, 3};
Plane Surface(1) = {1};
turned[] = Extrude {{0, 1, 0}, {0, 0, 0}, 2 * Pi} { Surface{1}; };
Recursive Delete { Surface{1}; }
Physical Volume("shell", 1) = {turned[1]};

Mesh.MeshSizeMin = size;
Mesh.MeshSizeMax = size;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.Algorithm = 6;
Mesh.Algorithm3D = 1;
Mesh.Optimize = 1;
Mesh.OptimizeThreshold = 0.6;
Mesh.MshFileVersion = 4.1;
Mesh.Binary = 1;
