// slivers.geo: a block of tets between scattered points, of radius ratios from 3e-7 to 1, as nothing optimises them;
// for gmsh (4.8 or newer, OpenCASCADE kernel), lengths in metres: 0.2 x 0.1 x 0.1.
// Number of points inside: gmsh -3 -setnumber size 250 slivers.geo
SetFactory("OpenCASCADE");
DefineConstant[ size = {250, Name "Points inside"} ];

Box(1) = {0, 0, 0, 0.2, 0.1, 0.1};
Physical Volume("flesh", 1) = {1};
// An additive recurrence in three dimensions (Roberts 2018), from the plastic number.
u = 0.5; v = 0.5; w = 0.5;
For k In {1 : size}
  u = Fmod(u + 0.8191725134, 1);
  v = Fmod(v + 0.6710436067, 1);
  w = Fmod(w + 0.5497004779, 1);
  Point(100 + k) = {0.2 * (0.02 + 0.96 * u), 0.1 * (0.02 + 0.96 * v), 0.1 * (0.02 + 0.96 * w), 1};
  Point{100 + k} In Volume{1};
EndFor
MeshSize {:} = 1;
Mesh.MeshSizeMax = 1;
Mesh.Optimize = 0;
Mesh.Algorithm3D = 1;
