// A body with four limbs and a head: irregular tets, thin necks.
SetFactory("OpenCASCADE");
DefineConstant[ h = {0.12} ];
Sphere(1) = {0, 0, 0, 0.5};
Dilate {{0, 0, 0}, {1.3, 1, 0.6}} { Volume{1}; }
Cylinder(2) = {0.3, 0.2, 0, 0.35, 0.5, -0.15, 0.11};
Cylinder(3) = {0.3, -0.2, 0, 0.35, -0.5, -0.15, 0.11};
Cylinder(4) = {-0.3, 0.2, 0, -0.35, 0.5, -0.15, 0.11};
Cylinder(5) = {-0.3, -0.2, 0, -0.35, -0.5, -0.15, 0.11};
Cylinder(6) = {0.4, 0, 0, 0.5, 0, 0.1, 0.12};
Sphere(7) = {0.95, 0, 0.12, 0.18};
BooleanUnion{ Volume{1}; Delete; }{ Volume{2:7}; Delete; }
Mesh.CharacteristicLengthMin = h;
Mesh.CharacteristicLengthMax = h;
