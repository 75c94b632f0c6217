// A ball of radius 1, its surface curved at order 2.
SetFactory("OpenCASCADE");
Sphere(1) = {0, 0, 0, 1};
Physical Volume(7) = {1};
Mesh.MeshSizeMin = h;
Mesh.MeshSizeMax = h;
