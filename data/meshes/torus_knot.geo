// torus_knot.geo: a tube along a trefoil knot that is cut open, for gmsh (4.8 or newer, OpenCASCADE kernel), lengths in
// metres. The knot, r = 0.1 + 0.04 cos 3t, turns by 2t about z at the height 0.04 sin 3t; the tube's radius is 13 mm.
// Size of the elements: gmsh -3 -setnumber size 0.012 torus_knot.geo
SetFactory("OpenCASCADE");
DefineConstant[ size = {0.012, Name "Element size"} ];

For k In {0 : 38}
  t = 2 * Pi * k / 40;
  r = 0.1 + 0.04 * Cos(3 * t);
  Point(k + 1) = {r * Cos(2 * t), r * Sin(2 * t), 0.04 * Sin(3 * t)};
EndFor
BSpline(1) = {1 : 39};
Wire(1) = {1};
// The tube begins square to the curve, whose direction is (0, 0.28, 0.12) there.
Disk(1) = {0, 0, 0, 0.013};
Rotate{ {1, 0, 0}, {0, 0, 0}, -Atan2(0.28, 0.12) }{ Surface{1}; }
Translate{0.14, 0, 0}{ Surface{1}; }
tube[] = Extrude{ Surface{1}; }Using Wire {1};
Physical Volume("flesh", 1) = {tube[]};

Mesh.MeshSizeMin = 0.6 * size;
Mesh.MeshSizeMax = size;
