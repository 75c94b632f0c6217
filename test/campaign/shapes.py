"""shapes.py: bodies by gmsh for error_bars.py."""
import subprocess

KERNEL = "SetFactory(\"OpenCASCADE\");\n"
NEAR, FAR = -1e-6, 1e-6
THIN = ["angle", "clip", "strip", "tube", "arch"]


def less(last, solids):
    """Returns the first solid minus those up to `last`, as volume 8."""
    return f"{solids}\nBooleanDifference(8) = {{ Volume{{1}}; Delete; }}{{ Volume{{2:{last}}}; Delete; }};\n"


def half(y, z, high):
    """Returns the part of volume 8 with 0 < x < `high`, above y and z."""
    return (f"Box(9) = {{0, {y}, {z}, {high}, 18, 18}};\n"
            "BooleanIntersection(10) = { Volume{8}; Delete; }{ Volume{9}; Delete; };\n")


def angle(length, thick, fillet):
    """Returns a leg along z and an arm along x; the corner between them is round if `fillet` > 0."""
    inner = thick + fillet
    points = [(0, 0), (length, 0), (length, thick), (inner, thick), (thick, inner), (thick, 1.2), (0, 1.2)]
    if not fillet:
        del points[4]
    count = len(points)
    text = "".join(f"Point({k + 1}) = {{{x}, 0, {z}}};\n" for k, (x, z) in enumerate(points))
    for k in range(1, count + 1):
        ends = f"{k}, {k % count + 1}"
        text += f"Line({k}) = {{{ends}}};\n" if not (fillet and k == 4) else (
            f"Point(8) = {{{inner}, 0, {inner}}};\nCircle(4) = {{4, 8, 5}};\n")
    return text + (f"Curve Loop(1) = {{1:{count}}}; Plane Surface(1) = {{1}}; Extrude {{0, .5, 0}} {{ Surface{{1}}; }}\n"
                   + ("Delete { Point{8}; }\n" if fillet else ""))


def draw_thin(kind, rng):
    """Returns the same as `draw`, for a body one or two tets across."""
    thick, wide = rng.uniform(.06, .1), rng.uniform(.2, .35)
    root, end = [[NEAR, -9, -9], [FAR, 9, 9]], lambda x: [[x + NEAR, -9, -9], [9, 9, 9]]
    if kind == "angle":
        high, hole = rng.uniform(.6, .9), rng.uniform(.18, .28) * wide
        solids = (f"Box(4) = {{0, 0, 0, 1, {wide}, {thick}}}; Box(5) = {{0, 0, 0, {thick}, {wide}, {high}}};\n"
                  f"BooleanUnion(1) = {{ Volume{{4}}; Delete; }}{{ Volume{{5}}; Delete; }};\n"
                  f"Cylinder(2) = {{.7, {wide / 2}, -1, 0, 0, 2, {hole}}};")
        return (less(2, solids), [[-9, -9, high + NEAR], [9, 9, 9]], end(1), [.97, .45 * wide, .45 * thick],
                [.4, .45 * wide, .4 * thick], 1 + high, thick, .9 * thick)
    if kind == "clip":
        length, high = rng.uniform(.6, .8), rng.uniform(.18, .3) + 2 * thick
        return (f"Box(4) = {{0, 0, 0, {length}, {wide}, {thick}}}; Box(5) = {{0, 0, 0, {thick}, {wide}, {high}}};\n"
                f"Box(6) = {{0, 0, {high - thick}, {length}, {wide}, {thick}}};\n"
                "BooleanUnion(8) = { Volume{4}; Delete; }{ Volume{5:6}; Delete; };\n",
                [[length + NEAR, -9, -9], [9, 9, thick + FAR]], [[length + NEAR, -9, high - thick + NEAR], [9, 9, 9]],
                [.97 * length, .45 * wide, high - .45 * thick], [.4 * thick, .45 * wide, .5 * high], 2 * length + high, thick,
                .95 * thick)
    if kind == "strip":
        length, wide = rng.uniform(.9, 1.2), 1.8 * wide
        solids = (f"Box(1) = {{0, 0, 0, {length}, {wide}, {thick}}};"
                  f"Cylinder(2) = {{{.35 * length}, {.5 * wide}, -1, 0, 0, 2, {rng.uniform(.2, .3) * wide}}};"
                  f"Cylinder(3) = {{{.72 * length}, {.6 * wide}, -1, 0, 0, 2, {rng.uniform(.12, .2) * wide}}};")
        return (less(3, solids), root, end(length), [.97 * length, .3 * wide, .45 * thick], [.1 * length, .4 * wide, .4 * thick],
                length, thick, 1.35 * thick)
    if kind == "tube":
        length, r = rng.uniform(.9, 1.3), rng.uniform(.2, .28)
        solids = (f"Cylinder(1) = {{0, 0, 0, {length}, 0, 0, {r}}};"
                  f"Cylinder(2) = {{0, 0, 0, {length}, 0, 0, {r - thick}}};")
        return (less(2, solids), root, end(length), [.97 * length, .0002, r - .5 * thick], [.4 * length, .0002, r - .5 * thick],
                length, thick, 1.6 * thick)
    r = .5
    solids = f"Cylinder(1) = {{0, 0, 0, 0, {wide}, 0, {r}}}; Cylinder(2) = {{0, 0, 0, 0, {wide}, 0, {r - thick}}};"
    return (less(2, solids) + half(-9, -9, 9), [[NEAR, -9, -9], [FAR, 9, 0]], [[NEAR, -9, 0], [FAR, 9, 9]],
            [.02, .45 * wide, r - .55 * thick], [r - .5 * thick, .45 * wide, .01], 3.14 * r, thick, 1.25 * thick)


def draw(kind, rng):
    """Returns the geometry, clamped box, loaded box, tip, a point inside, length, thickness and gmsh's edge length."""
    thick = rng.uniform(.2, .35)
    root, end = [[NEAR, -9, -9], [FAR, 9, 9]], lambda x: [[x + NEAR, -9, -9], [9, 9, 9]]
    if kind in ("bracket", "corner"):
        length = rng.uniform(1.2, 1.8)
        return (angle(length, thick, rng.uniform(.12, .25) if kind == "bracket" else 0), [[-9, -9, 1.2 + NEAR], [9, 9, 9]],
                end(length), [.98 * length, .25, .5 * thick], [.6 * length, .21, .4 * thick], length + 1, thick, .5)
    if kind == "shell":
        solids = f"Cylinder(1) = {{0, 0, 0, 0, .8, 0, 1}}; Cylinder(2) = {{0, 0, 0, 0, .8, 0, {1 - thick}}};"
        inside = .66 * (1 - thick / 2)
        return (less(2, solids) + half(-9, 0, 9), root, [[-9, -9, NEAR], [9, 9, FAR]], [1 - thick / 2, .4, .04],
                [inside, .4, inside], 1.4, thick, .45)
    if kind == "dome":
        solids = f"Sphere(1) = {{0, 0, 0, 1}}; Sphere(2) = {{0, 0, 0, {1 - thick}}};"
        return less(2, solids) + half(0, -9, .8), root, end(.8), [.75, .1, .52], [.5, .1, .7], 1, thick, .6
    if kind == "torus":
        minor = thick / 2 + .1
        return (f"Torus(8) = {{0, 0, 0, 1, {minor}}};\n" + half(-9, -9, 9), [[NEAR, 0, -9], [FAR, 9, 9]],
                [[NEAR, -9, -9], [FAR, 0, 9]], [.05, -1, .02], [.95, .03, .02], 2.5, 2 * minor, .9)
    if kind == "limb":
        length, r = rng.uniform(2, 3), rng.uniform(.35, .5)
        return (f"Cone(1) = {{0, 0, 0, {length}, 0, 0, {r}, {r * rng.uniform(.4, .7)}}};\n", root, end(length),
                [.98 * length, .02, .03], [.4 * length, .02, .03], length, 1.5 * r, .6)
    length, wide = rng.uniform(1.8, 2.4), rng.uniform(.9, 1.2)
    solids = f"Box(1) = {{0, 0, 0, {length}, {wide}, {thick}}};"
    for k, (x, y) in enumerate([(length * .33, wide * .5), (length * .7, wide * .45)]):
        solids += f" Cylinder({2 + k}) = {{{x}, {y}, -1, 0, 0, 2, {rng.uniform(.18, .28) * wide}}};"
    return (less(3, solids), root, end(length), [.98 * length, .4, .5 * thick],
            [.51 * length, .5 * wide, .4 * thick], length, thick, .8)


def mesh(kind, rng, stem):
    """Writes stem.geo and stem.msh; returns the number of tets, and all that `draw` returns besides the geometry."""
    text, *rest, edge = (draw_thin if kind in THIN else draw)(kind, rng)
    with open(stem + ".geo", "w", encoding="utf-8") as file:
        file.write(f"{KERNEL}{text}Mesh.MeshSizeMax = {edge};\nMesh.MeshSizeMin = {edge};\nMesh.Optimize = 1;\n")
    subprocess.run(["gmsh", "-3", "-nopopup", stem + ".geo", "-o", stem + ".msh", "-v", "1"], check=True, capture_output=True)
    with open(stem + ".msh", encoding="utf-8") as file:
        lines = file.read().split("\n")
    blocks = [line.split() for line in lines[lines.index("$Elements") + 2:] if len(line.split()) == 4]
    return [sum(int(count) for dimension, _, kind, count in blocks if (dimension, kind) == ("3", "4")), *rest]
