// tube.geo: a tube with a flared mouth for gmsh (4.8 or newer, OpenCASCADE kernel), lengths in metres. Along z from the
// mouth (z = 0), whose opening is 58 mm in radius, to the end (z = 0.3); the bore is 40 mm in radius from z = 0.08 on,
// the wall 14 mm thick.
// Size of the elements: gmsh -3 -setnumber size 0.014 tube.geo
SetFactory("OpenCASCADE");
DefineConstant[ size = {0.014, Name "Element size"} ];

Point(1) = {0.058, 0, 0};
Point(2) = {0.052, 0, 0.025};
Point(3) = {0.043, 0, 0.055};
Point(4) = {0.04, 0, 0.08};
Point(5) = {0.04, 0, 0.3};
Point(6) = {0.054, 0, 0.3};
Point(7) = {0.054, 0, 0.08};
Point(8) = {0.057, 0, 0.055};
Point(9) = {0.066, 0, 0.025};
Point(10) = {0.072, 0, 0};
Spline(1) = {1, 2, 3, 4};
Line(2) = {4, 5};
Line(3) = {5, 6};
Line(4) = {6, 7};
Spline(5) = {7, 8, 9, 10};
Line(6) = {10, 1};
Curve Loop(1) = {1, 2, 3, 4, 5, 6};
Plane Surface(1) = {1};
tube[] = Extrude{ {0, 0, 1}, {0, 0, 0}, 2 * Pi }{ Surface{1}; };
Physical Volume("tube", 1) = {tube[1]};

Mesh.MeshSizeMin = size;
Mesh.MeshSizeMax = size;
Mesh.MshFileVersion = 4.1;
Mesh.Binary = 1;
