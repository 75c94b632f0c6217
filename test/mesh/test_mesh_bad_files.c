// TEST quick seconds=60
/* test_mesh_bad_files.c: every kind of bad file has its message; truncated and damaged files do no harm. */
#include "mesh_files.h"

#define GMSH22   "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
#define GMSH41   "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
#define NODES22  "$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n"
#define NODES41  "$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n"
#define MEDIT    "MeshVersionFormatted 2\nDimension 3\n"
#define VERTICES "Vertices\n4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n"
#define NODE     "4 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n"
#define ELE      "1 4 0\n0 0 1 2 3\n"

#define SOLIDS "solid elements that are not tets (hexahedra, prisms, pyramids):"

typedef struct bad_file {
  const char *name, *text;
  const char *partner; /* TetGen: the text of the other file */
  const char *expected[2];
} bad_file;

static const bad_file any_format[] = {
    {"a.txt", "", NULL, {"a.txt: the file is empty"}},
    {"a.txt", " \n\n# nothing\n", NULL, {"the file is empty"}},
    {"a.stl", "solid a\n", NULL, {"a.stl: the format is STL", "without tets"}},
    {"a.vtk", "# vtk DataFile Version 2.0\nbar\n", NULL, {"a.vtk: the format is VTK's legacy one; save the grid as .vtu"}},
    {"a.mesh", "v 0 0 0\n", NULL, {"a.mesh:1: 'v' begins no known mesh format", "$MeshFormat"}},
    {"a.obj", "v 0 0 0\n", NULL, {"a.obj: this is a surface without tets; Gmsh"}},
    {"a.STL", "binary", NULL, {"a.STL: this is a surface without tets; Gmsh, TetGen and fTetWild fill it"}},
    {"a", "solid x\n", NULL, {"a: the format is STL, a surface without tets; Gmsh"}},
    {"a.xml", "<?xml version=\"1.0\"?>\n", NULL, {"the format is XML", "files named .vtu"}},
    {"a.txt", "*NODE\n", NULL, {"the format is one of keywords after a *", ".inp, VegaFEM's from .veg"}},
    {"a.msh", "$NOD\n1\n", NULL, {"Gmsh's format 1; save it as 2.2 or 4.1"}},
    {"a.txt", "4 3 0 0\n", NULL, {"a.txt:1: the file begins with a number", ".node nor .ele"}},
    {"a.txt",
     "abcdefghijklmnopqrstuvwxyz0123456789\x01\n",
     NULL,
     {"'abcdefghijklmnopqrstuvwxyz012345...'"}},
};

static const bad_file plain[] = {
    {"p.mesh", "nodes\n", NULL, {"p.mesh:1: number of nodes: the row ends too early"}},
    {"p.mesh", "nodes 0\n", NULL, {"p.mesh:1: number of nodes is 0; it must be 1 to"}},
    {"p.mesh", "nodes -4\n", NULL, {"number of nodes is -4"}},
    {"p.mesh", "nodes 4.5\n", NULL, {"'4.5' is not an integer"}},
    {"p.mesh", "nodes 99999999999999999999\n", NULL, {"does not fit into 64 bits"}},
    {"p.mesh",
     "nodes 1000000000\n0 0 0\n",
     NULL,
     {"number of nodes is 1000000000; it must be 1 to 536870911"}},
    {"p.mesh",
     "nodes 500000000\n0 0 0\n",
     NULL,
     {"number of nodes is 500000000, but only 7 bytes", "enough for 1"}},
    {"p.mesh",
     "nodes 2\n0 0 0\n0 0 1\ntets10 1\n0 1 2 3 4 5 6 7 8 9\n",
     NULL,
     {"p.mesh:5: tet 0 uses node 2; the nodes are 0 to 1"}},
    {"p.mesh",
     "nodes 2\n0 0 0\n0 0 1\ntets10 9\n0 1 0 1 0 1 0 1 0 \n",
     NULL,
     {"p.mesh:4: number of tets is 9, but only"}},
    {"p.mesh",
     "nodes 2\n0 0 0\n0 0 1\ntets10 1\n0 1 0 1 0 1 0 1 0\n# to have bytes enough\n",
     NULL,
     {"p.mesh:5: tet 0: the row ends too early; `a b c d ab bc ac ad bd cd`"}},
    {"p.mesh",
     "nodes 2\n0 0 0\n0 0 1\ntets20 1\n",
     NULL,
     {"p.mesh:4: 'tets20' stands where `tets N` is expected"}},
    {"p.mesh", "nodes 1 4\n0 0 0\n", NULL, {"'4' stands behind the row's end"}},
    {"p.mesh",
     "nodes 2\n0 0 0\n0 0 \n",
     NULL,
     {"p.mesh:3: node 1: the row ends too early; `x y z`"}},
    {"p.mesh",
     "nodes 2\n0 0 0\n0 0 0 0\n",
     NULL,
     {"p.mesh:3: node 1: '0' stands behind the row's end"}},
    {"p.mesh", "nodes 2\n0 0 0\n0 1,5 0\n", NULL, {"p.mesh:3: node 1: '1,5' is not a number"}},
    {"p.mesh", "nodes 2\n0 0 0\n0 nan 0\n", NULL, {"p.mesh:3: node 1: 'nan' is not finite"}},
    {"p.mesh", "nodes 2\n0 0 0\n0 1e999 0\n", NULL, {"p.mesh:3: node 1: '1e999' is not finite"}},
    {"p.mesh", "nodes 2\n0 0 0\n0 -inf 0\n", NULL, {"'-inf' is not finite"}},
    {"p.mesh", "nodes 2\n0 0 0\n\n", NULL, {"p.mesh:4: node 1: the file ends too early"}},
    {"p.mesh", "nodes 1\n0 0 0\n", NULL, {"the file ends where `tets N` is expected"}},
    {"p.mesh",
     "nodes 1\n0 0 0\n0 0 0\n",
     NULL,
     {"p.mesh:3: '0' stands where `tets N` is expected"}},
    {"p.mesh",
     "nodes 4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\ntets 1\n0 1 2 4\n",
     NULL,
     {"p.mesh:7: tet 0 uses node 4; the nodes are 0 to 3"}},
    {"p.mesh",
     "nodes 4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\ntets 1\n0 1 2 -1\n",
     NULL,
     {"tet 0 uses node -1"}},
    {"p.mesh",
     "nodes 4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\ntets 1\n0 1 2 2\n",
     NULL,
     {"p.mesh:7: tet 0 uses node 2 twice"}},
    {"p.mesh",
     "nodes 4\n0 0 0\n1 0 0\n0 1 0\n0 0 0\n#\ntets 1\n0 1 2 3\n",
     NULL,
     {"p.mesh:8: tet 0 (nodes 0 1 2 3) is flat: 6 * volume is 0 m^3"}},
    {"p.mesh",
     "nodes 4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\ntets 2\n0 1 2 3\n1 0 2 3\n",
     NULL,
     {"p.mesh:8: tet 1 has the same nodes as tet 0"}},
    {"p.mesh",
     "nodes 4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\ntets 1\n0 1 2 3\nfaces 0\n",
     NULL,
     {"p.mesh:8: 'faces' stands behind the last of 1 tets"}},
};

static const bad_file tetgen[] = {
    {"t.node", NODE, NULL, {"t.node holds only the nodes; ", "t.ele: cannot be opened"}},
    {"t.ele", ELE, NULL, {"t.ele holds only the tets; ", "t.node: cannot be opened"}},
    {"t.node",
     "4 2 0 0\n0 0 0\n1 1 0\n2 0 1\n3 0 0\n",
     ELE,
     {"t.node:1: the nodes have dimension 2; it must be 3"}},
    {"t.node", "4 3 0 2\n0 0 0 0\n", ELE, {"t.node:1: number of nodes is 4, but only"}},
    {"t.node",
     "1 3 0 2\n0 0 0 0\n",
     ELE,
     {"the number of boundary markers is 2; it must be 0 or 1"}},
    {"t.node",
     "1 3 -1 0\n0 0 0 0\n",
     ELE,
     {"t.node:1: the header has -1 where `nodes 3 attributes markers`"}},
    {"t.node", "1 3 1000000 0\n0 0 0 0\n", ELE, {"t.node:2: node 0: the row ends too early"}},
    {"t.node", "0 3 0 0\n", ELE, {"t.node:1: number of nodes is 0"}},
    {"t.node",
     "1 3 0 0\n2 0 0 0\n",
     ELE,
     {"t.node:2: the first node has index 2; it must be 0 or 1"}},
    {"t.node",
     "2 3 0 0\n1 0 0 0\n1 0 0 0\n",
     ELE,
     {"t.node:3: node 1 stands where node 2 is expected"}},
    {"t.node", "2 3 0 0\n1 0 0 0\n2 0 x 0\n", ELE, {"t.node:3: node 2: 'x' is not a number"}},
    {"t.node",
     "2 3 0 0\n1 0 0 0\n2 0 0 0 7\n",
     ELE,
     {"t.node:3: node 2: '7' stands behind the row's end"}},
    {"t.node", "2 3 1 0\n1 0 0 0 5\n2 0 0 0\n", ELE, {"t.node:3: node 2: the row ends too early"}},
    {"t.node", NODE "4 0 0 2\n", ELE, {"t.node:6: '4' stands behind the last of 4 nodes"}},
    {"t.ele",
     "1 10 0\n0 0 1 2 3 4 5 6 7 8 9\n",
     NODE,
     {"t.ele:2: tet 0 uses node 4; the nodes are 0 to 3"}},
    {"t.ele",
     "1 10 0\n0 0 1 2 3 0 1 2 3 0\n",
     NODE,
     {"t.ele:2: tet 0: the row ends too early; `index a b c d cd ad ab bc bd ac region`"}},
    {"t.ele",
     "1 10 0\n0 0 1 2 3 3 3 3 3 3 3\n",
     NODE,
     {"t.ele:2: tet 0 has node 3 on the edge of nodes 0 and 1, but it is the corner of a tet"}},
    {"t.ele", "1 8 0\n0 0 1 2 3\n", NODE, {"t.ele:1: the tets have 8 nodes; they must have 4 or 10"}},
    {"t.ele", "1 4 0\n1 1 2 3 4\n", NODE, {"t.ele:2: tet 1 stands where tet 0 is expected"}},
    {"t.ele", "1 4 0\n0 1 2 3 4\n", NODE, {"t.ele:2: tet 0 uses node 4; the nodes are 0 to 3"}},
    {"t.node",
     "4 3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n",
     "1 4\n1 0 1 2 3\n",
     {"t.ele:2: tet 1 uses node 0; the nodes are 1 to 4"}},
    {"t.node",
     "4 3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 1 1 0\n",
     "1 4\n1 1 2 3 4\n",
     {"t.ele:2: tet 1 (nodes 1 2 3 4) is flat"}},
    {"t.ele",
     "1 4 1\n0 0 1 2 3\n",
     NODE,
     {"t.ele:2: tet 0: the row ends too early; `index a b c d region`"}},
    {"t.ele",
     "1 4 1\n0 0 1 2 3 1.5\n",
     NODE,
     {"t.ele:2: tet 0 has the region attribute 1.5; it must be an integer"}},
    {"t.ele", "1 4 1\n0 0 1 2 3 1e10\n", NODE, {"region attribute 10000000000"}},
    {"t.ele", "2 4 0\n0 0 1 2 3\n", NODE, {"t.ele:3: tet 1: the file ends too early"}},
    {"t.ele", "3000000 4 0\n0 0 1 2 3\n", NODE, {"t.ele:1: number of tets is 3000000, but only"}},
    {"t.ele", ELE "1 0 1 2 3\n", NODE, {"t.ele:3: '1' stands behind the last of 1 tets"}},
};

#define P2_ROW "TetrahedraP2\n1\n1 2 3 4 1 2 3 4 1 2 0\n"

static const bad_file medit[] = {
    {"m.mesh", MEDIT "End\n", NULL, {"m.mesh: there is no list `Vertices`"}},
    {"m.mesh", MEDIT VERTICES "End\n", NULL, {"m.mesh: there is no list `Tetrahedra`"}},
    {"m.mesh",
     "MeshVersionFormatted 2\nDimension 2\n",
     NULL,
     {"m.mesh:2: Dimension is 2; it must be 3"}},
    {"m.mesh",
     "MeshVersionFormatted 2\nDimension x\n",
     NULL,
     {"m.mesh:2: Dimension: 'x' is not an integer"}},
    {"m.mesh",
     MEDIT VERTICES "TetrahedraP2\n1\n1 2 3 4 5 6 7 8 9 10 0\n",
     NULL,
     {"m.mesh:11: tet 1 uses node 5; the nodes are 1 to 4"}},
    {"m.mesh",
     MEDIT VERTICES "TetrahedraP2\n1\n1 2 3 4 0\nEnd\n",
     NULL,
     {"m.mesh:11: tet 1 uses node 0"}},
    {"m.mesh",
     MEDIT VERTICES P2_ROW "Tetrahedra\n1\n1 2 3 4 0\nEnd\n",
     NULL,
     {"m.mesh: there are lists `Tetrahedra` and `TetrahedraP2`"}},
    {"m.mesh",
     MEDIT VERTICES P2_ROW "TetrahedraP2Ordering\n9\n2 0 0 0 1 1 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 "
                           "0 0 0 0 0 0 0 0 0\n",
     NULL,
     {"m.mesh:13: TetrahedraP2Ordering has 9 rows; it must have 10"}},
    {"m.mesh",
     MEDIT VERTICES P2_ROW "TetrahedraP2Ordering\n10\n2 0 0 0\n0 2 0 0\n0 2 0 0\n2 0 0 0\n2 0 0 0\n2 0 0 0\n"
                           "2 0 0 0\n2 0 0 0\n2 0 0 0\n2 0 0 0\n",
     NULL,
     {"m.mesh:16: row 3 of TetrahedraP2Ordering names no node of a tet, or one that has been"}},
    {"m.mesh",
     MEDIT VERTICES P2_ROW "TetrahedraP2Ordering\n10\n2 0 0 0\n0 3 -1 0\n0 2 0 0\n2 0 0 0\n2 0 0 0\n2 0 0 0\n"
                           "2 0 0 0\n2 0 0 0\n2 0 0 0\n2 0 0 0\n",
     NULL,
     {"m.mesh:15: row 2 of TetrahedraP2Ordering names no node"}},
    {"m.mesh", MEDIT VERTICES VERTICES, NULL, {"m.mesh:9: a second list of Vertices"}},
    {"m.mesh", MEDIT "Vertices\n-1\nTetrahedra\n1\n", NULL, {"m.mesh:4: number of Vertices is -1"}},
    {"m.mesh",
     MEDIT "Vertices\n400000000\nTetrahedra\n1\n",
     NULL,
     {"number of Vertices is 400000000, but only"}},
    {"m.mesh",
     MEDIT "Vertices\n2\n0 0 0 0\n0 0\nTetrahedra\n1\n",
     NULL,
     {"m.mesh:7: vertex 2: 'Tetrahedra' is not a number"}},
    {"m.mesh",
     MEDIT "Vertices\n1\n0 0 0 0\n0 0 0 1\nTetrahedra\n1\n",
     NULL,
     {"m.mesh:6: '0' stands behind the last of 1 Vertices"}},
    {"m.mesh",
     MEDIT "Vertices\n1\n0 0 nan 0\nTetrahedra\n1\n",
     NULL,
     {"vertex 1: 'nan' is not finite"}},
    {"m.mesh",
     MEDIT VERTICES "Tetrahedra\n1\n1 2 3 5 0\n",
     NULL,
     {"m.mesh:11: tet 1 uses node 5; the nodes are 1 to 4"}},
    {"m.mesh", MEDIT VERTICES "Tetrahedra\n1\n0 1 2 3 0\n", NULL, {"m.mesh:11: tet 1 uses node 0"}},
    {"m.mesh",
     MEDIT VERTICES "Tetrahedra\n1\n1 2 3 3 0\n",
     NULL,
     {"m.mesh:11: tet 1 uses node 3 twice"}},
    {"m.mesh",
     MEDIT VERTICES "Tetrahedra\n1\n1 2 3 4\n",
     NULL,
     {"m.mesh:12: tet 1: the file ends too early"}},
    {"m.mesh",
     MEDIT VERTICES "Tetrahedra\n1\n1 2 3 4 9999999999\n",
     NULL,
     {"tet 1: the reference 9999999999 does not fit"}},
    {"m.mesh",
     MEDIT VERTICES "Tetrahedra\n1\n1 2 3 4 0\n1 2 3 4 0\n",
     NULL,
     {"stands behind the last of 1 Tetrahedra"}},
    {"m.mesh", MEDIT VERTICES "Tetrahedra\n1\n1 2 3 4 0\nPrisms\n2\nPyramids\n1\nHexahedra\n4\n", NULL, {SOLIDS " 7;"}},
};

static const bad_file gmsh[] = {
    {"g.msh",
     "$MeshFormat\n1.0 0 8\n",
     NULL,
     {"g.msh:2: the format is Gmsh's 1; 2.2 and 4.1 can be read"}},
    {"g.msh", "$MeshFormat\n4 0 8\n", NULL, {"Gmsh's 4; 2.2 and 4.1"}},
    {"g.msh", "$MeshFormat\n2.2 7 8\n", NULL, {"the file type is 7; it must be 0 (ASCII) or 1"}},
    {"g.msh", "$MeshFormat\n4.1 1 4\n", NULL, {"the data size is 4; it must be 8"}},
    {"g.msh", "$MeshFormat\n4.1 1 8\n", NULL, {"g.msh: byte 20: the file ends inside"}},
    {"g.msh",
     "$MeshFormat\n4.1 1 8\nabcd",
     NULL,
     {"g.msh: byte 24: the int that shows the byte order"}},
    {"g.msh", "$MeshFormat\n2.2 0 8\n", NULL, {"the file ends where $EndMeshFormat is expected"}},
    {"g.msh",
     "$MeshFormat\n2.2 0 8\nx",
     NULL,
     {"g.msh:3: 'x' stands where $EndMeshFormat is expected"}},
    {"g.msh", GMSH22 GMSH22, NULL, {"g.msh:5: a second $MeshFormat"}},
    {"g.msh", GMSH22, NULL, {"g.msh: there is no section $Nodes"}},
    {"g.msh", GMSH22 NODES22, NULL, {"g.msh: there is no section $Elements"}},
    {"g.msh", GMSH22 NODES22 NODES22, NULL, {"a second section $Nodes"}},
    {"g.msh",
     GMSH22 "$Elements\n1\n1 4 0 1 2 3 4\n$EndElements\n",
     NULL,
     {"$Elements comes before $Nodes"}},
    {"g.msh",
     GMSH22 "$Stuff\n1\n2\n",
     NULL,
     {"g.msh:7: the section $Stuff does not end with $EndStuff"}},
    {"g.msh", GMSH22 "stuff\n", NULL, {"g.msh:4: 'stuff' stands where a section"}},
    {"g.msh",
     GMSH22 "$Nodes\n0\n$EndNodes\n",
     NULL,
     {"g.msh:5: the number of nodes is 0; it must be 1"}},
    {"g.msh",
     GMSH22 "$Nodes\n300000000\n$EndNodes\n",
     NULL,
     {"the number of nodes is 300000000, but only"}},
    {"g.msh",
     GMSH22 "$Nodes\n2\n1 0 0 0\n1 0 0 0\n$EndNodes\n",
     NULL,
     {"g.msh:7: node 1 is given twice"}},
    {"g.msh",
     GMSH22 "$Nodes\n2\n1 0 0 0\n2 0 0\n$EndNodes\n",
     NULL,
     {"g.msh:7: row 2: the row ends too early; `node x y z`"}},
    {"g.msh",
     GMSH22 "$Nodes\n2\n1 0 0 0\n$EndNodes\n",
     NULL,
     {"g.msh:7: row 2: '$EndNodes' is not an integer"}},
    {"g.msh",
     GMSH22 "$Nodes\n1\n1 0 0 0\n2 0 0 0\n$EndNodes\n",
     NULL,
     {"g.msh:7: '2' stands where $EndNodes is expected"}},
    {"g.msh", GMSH22 "$Nodes\n1\n1 0 0 inf\n$EndNodes\n", NULL, {"'inf' is not finite"}},
    {"g.msh",
     GMSH22 NODES22 "$Elements\n1\n1 4 0 1 2 3 9\n$EndElements\n",
     NULL,
     {"g.msh:13: tet 1 uses node 9, which is not among the 4 of $Nodes"}},
    {"g.msh",
     GMSH22 NODES22 "$Elements\n1\n1 4 0 1 2 3 -4\n$EndElements\n",
     NULL,
     {"tet 1 uses node -4"}},
    {"g.msh",
     GMSH22 NODES22 "$Elements\n1\n8 4 0 1 2 3 3\n$EndElements\n",
     NULL,
     {"g.msh:13: tet 8 uses node 3 twice"}},
    {"g.msh",
     GMSH22 NODES22 "$Elements\n1\n1 4 2 1 2 3 4\n$EndElements\n",
     NULL,
     {"row 1: the row ends too early"}},
    {"g.msh",
     GMSH22 NODES22 "$Elements\n1\n1 4 1 5000000000 1 2 3 4\n$EndElements\n",
     NULL,
     {"tet 1 has the tag 5000000000"}},
    {"g.msh",
     GMSH22 NODES22 "$Elements\n1\n1 11 0 1 2 3 4 5 6 7 8 9 10\n$EndElements\n",
     NULL,
     {"g.msh:13: tet 1 uses node 5, which is not among the 4 of $Nodes"}},
    {"g.msh",
     GMSH22 NODES22 "$Elements\n1\n1 11 0 1 2 3 4 1 2 3 4 1\n$EndElements\n",
     NULL,
     {"g.msh:13: row 1: the row ends too early"}},
    {"g.msh",
     GMSH22 NODES22 "$Elements\n1\n1 29 0 1 2 3 4 1 2 3 4 1\n$EndElements\n",
     NULL,
     {"g.msh:13: element 1 is a tet of 20 nodes", "run gmsh with -order 1 or 2"}},
    {"g.msh",
     GMSH22 NODES22 "$Elements\n2\n1 4 0 1 2 3 4\n2 11 0 1 2 3 4 1 2 3 4 1 2\n$EndElements\n",
     NULL,
     {"g.msh: there are tets of 4 nodes and tets of 10; all must have the same number"}},
    {"g.msh",
     GMSH22 NODES22 "$Elements\n1\n1 11 0 1 2 3 4 1 2 3 4 1 2\n$EndElements\n",
     NULL,
     {"g.msh:13: tet 1 has node 1 on the edge of nodes 1 and 2, but it is the corner of a tet"}},
    {"g.msh",
     GMSH22 NODES22 "$Elements\n1\n1 2 0 1 2 3\n$EndElements\n",
     NULL,
     {"there are no tets among its 1 elements"}},
    {"g.msh",
     GMSH22 NODES22 "$Elements\n2\n1 2 0 1 2 3\n$EndElements\n",
     NULL,
     {"row 2: '$EndElements' is not an integer"}},
    {"g.msh",
     GMSH41 "$Nodes\n1 4 1 4\n3 1 0 3\n1\n2\n3\n0 0 0\n0 0 0\n0 0 0\n$EndNodes\n",
     NULL,
     {"the blocks hold 3 nodes, but $Nodes says 4"}},
    {"g.msh",
     GMSH41 "$Nodes\n1 4 1 4\n3 1 0 5\n1\n2\n3\n4\n0 0 0\n0 0 0\n",
     NULL,
     {"g.msh:6: a block has 5 nodes; it must be 0 to the remaining 4"}},
    {"g.msh",
     GMSH41 "$Nodes\n1 4 1 4\n9 1 1 4\n1\n2\n3\n4\n0 0 0\n0 0 0\n",
     NULL,
     {"a block of nodes has dimension 9"}},
    {"g.msh", GMSH41 "$Nodes\n90000 4 1 4\n", NULL, {"the number of blocks is 90000, but only"}},
    {"g.msh",
     GMSH41 "$Nodes\n1 100000000 1 4\n",
     NULL,
     {"the number of nodes is 100000000, but only"}},
    {"g.msh",
     GMSH41 "$Entities\n0 0 0 99999999\n",
     NULL,
     {"the number of entities is 99999999, but only"}},
    {"g.msh",
     GMSH41 "$Entities\n0 0 0 1\n1 0 0 0 1 1 1 70000 3\n",
     NULL,
     {"the number of physical tags of an entity is 70000, but only"}},
    {"g.msh",
     GMSH41 "$Entities\n0 0 0 1\n1 0 0 0 1 1 1 1 9000000000 0\n$EndEntities\n",
     NULL,
     {"physical tag 9000000000 of volume 1"}},
    {"g.msh",
     GMSH41 NODES41 "$Elements\n1 1 1 1\n3 1 4 1\n1 1 2 3 5\n$EndElements\n",
     NULL,
     {"g.msh:19: tet 1 uses node 5"}},
    {"g.msh",
     GMSH41 NODES41 "$Elements\n1 2 1 2\n3 1 4 1\n1 1 2 3 4\n$EndElements\n",
     NULL,
     {"the blocks hold 1 elements, but $Elements says 2"}},
    {"g.msh",
     GMSH41 NODES41 "$Elements\n1 1 1 1\n3 1 11 1\n7 1 2 3 4 5 6 7 8 9 10\n$EndElements\n",
     NULL,
     {"g.msh:19: tet 7 uses node 5, which is not among the 4"}},
    {"g.msh",
     GMSH41 NODES41 "$Elements\n1 9000 1 1\n3 1 11 9000\n7 1 2 3 4 1 2 3 4 1 2\n$EndElements\n",
     NULL,
     {"the number of elements is 9000, but only"}},
    {"g.msh",
     GMSH41 NODES41 "$Elements\n1 1 1 1\n3 1 4 1\n1 1 2 3 3\n$EndElements\n",
     NULL,
     {"g.msh:19: tet 1 uses node 3 twice"}},
    {"g.msh", GMSH22 NODES22 "$Elements\n2\n1 4 0 1 2 3 4\n2 6 0 1 2 3 4 1 2\n$EndElements\n", NULL, {SOLIDS " 1;"}},
    {"g.msh", GMSH41 NODES41 "$Elements\n1 1 1 1\n3 1 6 1\n1 1 2 3 4 1 2\n$EndElements\n", NULL, {SOLIDS " 1;"}},
};

/* Reads the file, which must fail with FLESH_ERR_FILE, naming its folder and what is expected. */
static void check_bad(const bad_file *file)
{
  flesh_mesh *mesh;
  char partner[32];
  snprintf(partner, sizeof partner, "%.*s%s", (int)(strrchr(file->name, '.') - file->name),
           file->name, strstr(file->name, ".node") ? ".ele" : ".node");
  unlink(in_work_folder("t.node"));
  unlink(in_work_folder("t.ele"));
  if (file->partner) write_text(partner, file->partner);
  int status = flesh_mesh_read(write_text(file->name, file->text), &mesh);
  if (status != FLESH_ERR_FILE) printf("# this file was not refused:\n# %s\n", file->text);
  CHECK(status == FLESH_ERR_FILE);
  CHECK(mesh == NULL);
  for (int i = 0; i < 2 && file->expected[i]; i++)
    CHECK_TEXT(flesh_error_text(), file->expected[i]);
  CHECK_TEXT(flesh_error_text(), work_folder);
}

#define CHECK_ALL_BAD(table)                                                                       \
  for (size_t i = 0; i < sizeof(table) / sizeof *(table); i++) check_bad(&(table)[i])

static void bad_files_are_refused(void) { CHECK_ALL_BAD(any_format); }
static void bad_plain_lists_are_refused(void) { CHECK_ALL_BAD(plain); }
static void bad_tetgen_files_are_refused(void) { CHECK_ALL_BAD(tetgen); }
static void bad_medit_files_are_refused(void) { CHECK_ALL_BAD(medit); }
static void bad_gmsh_files_are_refused(void) { CHECK_ALL_BAD(gmsh); }

static void what_is_no_file_is_refused(void)
{
  flesh_mesh *mesh;
  CHECK(flesh_mesh_read(in_work_folder("nothing.msh"), &mesh) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "nothing.msh: cannot be opened: No such file or directory");
  CHECK(flesh_mesh_read(work_folder, &mesh) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "not a regular file");
  CHECK(flesh_mesh_read("/dev/zero", &mesh) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "not a regular file");
  CHECK(flesh_mesh_read("reference/meshes/ball_order3.msh", &mesh) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "tet of 20 nodes (order 3 or above)");
  CHECK(flesh_mesh_read("reference/meshes/two_boxes_surface.msh", &mesh) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "there are no tets among its 76 elements");
  /* A Medit .meshb begins with the int 1. */
  CHECK(flesh_mesh_read(write_bytes("b.meshb", "\1\0\0\0\2\0\0\0", 8), &mesh) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "binary Medit .meshb");
}

static void bad_binary_numbers_are_refused(void)
{
  flesh_mesh *mesh;
  for (int swap = 0; swap < 2; swap++) {
    byte_writer w;
    double nan = NAN;
    make_gmsh41(&w, swap);
    /* Node 7 is the last but one: six numbers before the end. */
    char *end = memmem(w.bytes, w.size, "\n$EndNodes", 10);
    byte_writer patch = {.swap = swap};
    put_bytes(&patch, &nan, sizeof nan);
    memcpy(end - 48, patch.bytes, 8);
    CHECK(flesh_mesh_read(write_bytes("n.msh", w.bytes, w.size), &mesh) == FLESH_ERR_FILE);
    CHECK_TEXT(flesh_error_text(), "node 7: a number before here is nan");
    CHECK_TEXT(flesh_error_text(), "n.msh: byte ");
  }
}

/* A valid file of some format; it remains valid without up to `spare` of its last bytes. */
typedef struct sample {
  const char *name;
  const char *bytes;
  size_t size;
  size_t spare; /* closing lines, and the digits that can be cut off the last number */
} sample;

static int make_samples(sample out[12], byte_writer binary[4])
{
  static char *copies[2];
  int count = 0;
  out[count++] = (sample){"s.txt", plain_text, strlen(plain_text), 11};
  out[count++] = (sample){"s.node", node_text, strlen(node_text), 23};
  out[count++] = (sample){"s.ele", ele_text, strlen(ele_text), 26};
  out[count++] = (sample){"s.mesh", medit_text, strlen(medit_text), 25};
  out[count++] = (sample){"s22.msh", gmsh22_text, strlen(gmsh22_text), 1};
  out[count++] = (sample){"s41.msh", gmsh41_text, strlen(gmsh41_text), 1};
  for (int b = 0; b < 4; b++) {
    (b < 2 ? make_gmsh22 : make_gmsh41)(&binary[b], b & 1);
    out[count++] = (sample){"sb.msh", binary[b].bytes, binary[b].size, 1};
  }
  for (int f = 0; f < 2; f++) {
    size_t size;
    free(copies[f]);
    copies[f] = read_bytes(f ? "reference/meshes/two_boxes_41_untagged_parts.msh"
                             : "reference/meshes/two_boxes_22_binary.msh",
                           &size);
    out[count++] = (sample){f ? "parts.msh" : "boxes.msh", copies[f], size, 1};
  }
  return count;
}

/* TetGen's sample files belong together: restores the one that a damaged copy replaced. */
static void restore_pair(void)
{
  write_text("s.node", node_text);
  write_text("s.ele", ele_text);
}

static void cut_files_are_refused(void)
{
  sample samples[12];
  byte_writer binary[4];
  int count = make_samples(samples, binary);
  for (int i = 0; i < count; i++) {
    const sample *s = &samples[i];
    restore_pair();
    size_t stride = s->size > 4096 ? 7 : 1, accepted = 0;
    for (size_t length = 0; length <= s->size; length += stride) {
      flesh_mesh *mesh;
      int status = flesh_mesh_read(write_bytes(s->name, s->bytes, length), &mesh);
      CHECK(status == FLESH_OK || status == FLESH_ERR_FILE);
      CHECK(status == FLESH_OK ? mesh != NULL : mesh == NULL);
      if (status) CHECK_TEXT(flesh_error_text(), work_folder);
      else if (length + s->spare < s->size) accepted++;
      flesh_mesh_destroy(&mesh);
    }
    if (accepted) printf("# %s: %zu cut files were accepted\n", s->name, accepted);
    CHECK(!accepted);
  }
}

static void damaged_files_do_no_harm(void)
{
  sample samples[12];
  byte_writer binary[4];
  static const char lively[] = "0123456789-+.eE \n#$\t\0\r\xff\x80\x7f";
  int count = make_samples(samples, binary);
  unsigned long long seed = 20;
  for (int i = 0; i < count; i++) {
    const sample *s = &samples[i];
    char *bytes = malloc(s->size);
    int refused = 0;
    restore_pair();
    for (int trial = 0; trial < 700; trial++) {
      flesh_mesh *mesh;
      memcpy(bytes, s->bytes, s->size);
      int changes = 1 + (int)(4 * test_uniform(&seed));
      for (int c = 0; c < changes; c++) {
        size_t at = (size_t)(test_uniform(&seed) * (double)s->size);
        double kind = test_uniform(&seed);
        if (kind < 0.4) bytes[at] ^= (char)(1 << (int)(8 * test_uniform(&seed)));
        else if (kind < 0.8) bytes[at] = lively[(int)((sizeof lively - 1) * test_uniform(&seed))];
        else memmove(bytes + at / 2, bytes + at, s->size - at); /* repeats or removes a part */
      }
      int status = flesh_mesh_read(write_bytes(s->name, bytes, s->size), &mesh);
      CHECK(status == FLESH_OK || status == FLESH_ERR_FILE); /* never out of memory */
      CHECK(status == FLESH_OK ? mesh != NULL : mesh == NULL);
      if (mesh) {
        flesh_mesh_info info;
        flesh_mesh_inspect(mesh, &info);
        CHECK(info.radius_ratio_min > 0 && info.volume > 0);
      }
      refused += status != FLESH_OK;
      flesh_mesh_destroy(&mesh);
    }
    CHECK(refused > 70); /* the damage is real */
    free(bytes);
  }
}

int main(int argc, char **argv)
{
  if (!make_work_folder()) return 1;
  return RUN_TESTS(argc, argv, TEST(bad_files_are_refused), TEST(bad_plain_lists_are_refused),
                   TEST(bad_tetgen_files_are_refused), TEST(bad_medit_files_are_refused),
                   TEST(bad_gmsh_files_are_refused), TEST(what_is_no_file_is_refused),
                   TEST(bad_binary_numbers_are_refused), TEST(cut_files_are_refused),
                   TEST(damaged_files_do_no_harm));
}
