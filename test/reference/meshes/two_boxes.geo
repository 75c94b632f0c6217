// Two boxes that share a face, with the physical tags 7 and 9: for the tests of the .msh readers.
// Set `tagged` to 0 for volumes (3 and 5) without physical tags.
SetFactory("OpenCASCADE");
DefineConstant[ tagged = 1 ];
Box(3) = {0, 0, 0, 1, 1, 1};
Box(5) = {1, 0, 0, 0.5, 1, 1};
Coherence;
If (tagged)
  Physical Volume("left", 7) = {3};
  Physical Volume("right", 9) = {5};
EndIf
Mesh.MeshSizeMin = 1;
Mesh.MeshSizeMax = 1;
Mesh.FirstNodeTag = 100;
Mesh.FirstElementTag = 1000;
