// hand.geo: a stylised left hand for gmsh (4.8 or newer, OpenCASCADE kernel), lengths in metres.
// Palm down: x across (thumb towards +x), y from the cut wrist (y = 0) to the finger tips, z up.
// Size of the elements: gmsh -3 -setnumber size 0.0064 hand.geo
SetFactory("OpenCASCADE");
DefineConstant[ size = {0.0064, Name "Element size"} ];

// Wrist and palm: a loft through ellipses (y, z of the centre, half-width, half-thickness).
palm_y[] = {0, 0.022, 0.045, 0.070, 0.090, 0.101, 0.107, 0.110};
palm_a[] = {0.0272, 0.0270, 0.0345, 0.0405, 0.0420, 0.0400, 0.0370, 0.0335};
palm_b[] = {0.0190, 0.0184, 0.0170, 0.0155, 0.0140, 0.0115, 0.0085, 0.0055};
palm_loops[] = {};
For i In {0 : #palm_y[] - 1}
  curve = newl;
  // Its seam lies in the middle of the palm, where no other part crosses it.
  Ellipse(curve) = {0, 0, 0, palm_a[i], palm_b[i], -Pi / 2, 3 * Pi / 2};
  Rotate {{1, 0, 0}, {0, 0, 0}, Pi / 2} { Curve{curve}; }
  Translate {0, palm_y[i], 0} { Curve{curve}; }
  loop = newll;
  Curve Loop(loop) = {curve};
  palm_loops[] += loop;
EndFor
palm = newv;
ThruSections(palm) = {palm_loops[]};
// A finger along +y from the origin: a spline with slight bulges at the joints, turned about y.
// Arguments: length, radius, spread (about z), bend (about x), at_x, at_y, at_z.
Macro Finger
  p = newp;
  Point(p) = {0, -1.2 * radius, 0};
  Point(p + 1) = {0.98 * radius, 0, 0};
  Point(p + 2) = {0.99 * radius, 0.20 * length, 0};
  Point(p + 3) = {1.03 * radius, 0.40 * length, 0};
  Point(p + 4) = {0.93 * radius, 0.57 * length, 0};
  Point(p + 5) = {0.92 * radius, 0.72 * length, 0};
  Point(p + 6) = {0.82 * radius, 0.88 * length, 0};
  Point(p + 7) = {0.50 * radius, length - 0.16 * radius, 0};
  Point(p + 8) = {0, length, 0};
  Point(p + 9) = {0.98 * radius, -1.2 * radius, 0};
  l = newl;
  Spline(l) = {p + 1 : p + 8};
  Line(l + 1) = {p + 8, p};
  Line(l + 2) = {p, p + 9};
  Line(l + 3) = {p + 9, p + 1};
  Curve Loop(newll) = {l : l + 3};
  face = news;
  Plane Surface(face) = {newll - 1};
  turned[] = Extrude {{0, 1, 0}, {0, 0, 0}, 2 * Pi} { Surface{face}; };
  Recursive Delete { Surface{face}; }
  finger = turned[1];
  Rotate {{1, 0, 0}, {0, 0, 0}, -bend} { Volume{finger}; }
  Rotate {{0, 0, 1}, {0, 0, 0}, -spread} { Volume{finger}; }
  Translate {at_x, at_y, at_z} { Volume{finger}; }
  parts[] += finger;
Return

parts[] = {};
degree = Pi / 180;
// index, middle, ring, little
at_z = 0;
length = 0.0700; radius = 0.0093; at_x = 0.0300; at_y = 0.099; spread = 8 * degree; bend = 4 * degree;
Call Finger;
length = 0.0770; radius = 0.0095; at_x = 0.0100; at_y = 0.103; spread = 1 * degree; bend = 2 * degree;
Call Finger;
length = 0.0710; radius = 0.0091; at_x = -0.0100; at_y = 0.101; spread = -5 * degree; bend = 4 * degree;
Call Finger;
length = 0.0560; radius = 0.0080; at_x = -0.0295; at_y = 0.095; spread = -13 * degree; bend = 7 * degree;
Call Finger;
// thumb
length = 0.0680; radius = 0.0110; at_x = 0.0270; at_y = 0.042; at_z = -0.004;
spread = 46 * degree; bend = 10 * degree;
Call Finger;
// The ball of the thumb.
ball = newv;
Sphere(ball) = {0, 0, 0, 1};
Dilate {{0, 0, 0}, {0.0165, 0.0270, 0.0145}} { Volume{ball}; }
Rotate {{0, 0, 1}, {0, 0, 0}, -30 * degree} { Volume{ball}; }
Translate {0.0215, 0.0430, -0.0045} { Volume{ball}; }
parts[] += ball;

hand[] = BooleanUnion { Volume{palm}; Delete; } { Volume{parts[]}; Delete; };
Physical Volume("hand", 1) = {hand[]};

Mesh.MeshSizeMin = size;
Mesh.MeshSizeMax = size;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.Algorithm = 6;
Mesh.Algorithm3D = 1;
Mesh.Optimize = 1;
Mesh.OptimizeThreshold = 0.6;
Mesh.MshFileVersion = 4.1;
Mesh.Binary = 1;
