// TEST quick
/* test_named_bad_files.c: every kind of bad .inp, .vtu and .veg has its message; truncated and damaged files do no
 * harm. */
#include "mesh_files.h"

typedef struct bad_file {
  const char *name, *text, *expected;
} bad_file;

#define NODES "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n"
#define TET   "*ELEMENT, TYPE=C3D4, ELSET=all\n1,1,2,3,4\n"

static const bad_file decks[] = {
    {"b.inp", "", "there are no nodes; *NODE with rows is expected"},
    {"b.inp", "** nothing\n*NODE\n", "there are no nodes"},
    {"b.inp", NODES, "there are no tets beside 0 other elements; *ELEMENT with TYPE=C3D4 or C3D10"},
    {"b.inp", NODES "*ELEMENT, TYPE=C3D8\n1,1,2,3,4,1,2,3,4\n", "no tets beside 1 other elements"},
    {"b.inp", NODES TET "*ELEMENT, TYPE=C3D6\n2,1,2,3,4,1,2\n", "not tets (hexahedra, prisms, pyramids): 1; a body has only tets"},
    {"b.inp", NODES "*ELEMENT\n1,1,2,3,4\n", "b.inp:6: *ELEMENT has no TYPE; `*ELEMENT, TYPE=C3D4` or C3D10"},
    {"b.inp", NODES "*ELEMENT, TYPE=C3D4, ELSET=\n1,1,2,3,4\n", "b.inp:6: ELSET names no set; `ELSET=NAME`"},
    {"b.inp", NODES "*ELEMENT, TYPE=C3D4\n1,1,2,3,9\n", "b.inp:7: tet 1 uses node 9, which is not among the 4"},
    {"b.inp", NODES "*ELEMENT, TYPE=C3D4\n1,1,2,3\n", "b.inp:7: element 1: the row ends too early; `number, a, b, c, d`"},
    {"b.inp", NODES "*ELEMENT, TYPE=C3D4\n1,1,2,3,4,1\n", "element 1: '1' stands behind the row's end"},
    {"b.inp", NODES TET "1,1,2,4,3\n", "b.inp:8: element 1 is given twice; each must have its own number"},
    {"b.inp", NODES "*ELEMENT, TYPE=C3D10\n1,1,2,3,4,\n", "`number, a, b, c, d, ab, bc, ac, ad, bd, cd`"},
    {"b.inp", NODES "*ELEMENT, TYPE=C3D4\n1,1,2,3,3\n", "b.inp:7: tet 1 uses node 3 twice"},
    {"b.inp", "*NODE\n1,0,0,0\n1,1,0,0\n" TET, "b.inp:3: node 1 is given twice"},
    {"b.inp", "*NODE\n1,0,0\n", "b.inp:2: node 1: the row ends too early; `number, x, y, z`"},
    {"b.inp", "*NODE\n1,,0,0,0\n", "b.inp:2: a number is left out between two commas"},
    {"b.inp", "*NODE\n1,0,x,0\n", "b.inp:2: node 1: 'x' is not a number"},
    {"b.inp", "*NODE\n1,0,nan,0\n", "'nan' is not finite"},
    {"b.inp", "*NODE, SYSTEM=C\n1,0,0,0\n", "b.inp:1: *NODE has the parameter SYSTEM"},
    {"b.inp", "*INCLUDE, INPUT=nodes.inp\n", "b.inp:1: *INCLUDE is not supported"},
    {"b.inp", NODES "*NGEN\n1,4\n", "b.inp:6: *NGEN is not supported"},
    {"b.inp", NODES TET "*INSTANCE, NAME=a, PART=b\n1,0,0\n", "b.inp:8: *INSTANCE moves its part"},
    {"b.inp", NODES TET "*NSET\n1\n", "b.inp:8: the set has no name; `*NSET, NSET=NAME`"},
    {"b.inp", NODES TET "*NSET, NSET=a\n1, 7\n", "b.inp:9: node 7 is not in the deck"},
    {"b.inp", NODES TET "*ELSET, ELSET=a\n2\n", "b.inp:9: element 2 is not in the deck"},
    {"b.inp", NODES TET "*ELSET, ELSET=a\nb\n", "b.inp:9: 'b' names no set; so far the mesh has the sets 'all' and 'a'"},
    {"b.inp", NODES TET "*NSET, NSET=a, GENERATE\n4, 1\n", "b.inp:9: the range 4, 1, 1 is empty"},
    {"b.inp", NODES TET "*SOLID SECTION, ELSET=rubber\n", "*SOLID SECTION is of the set 'rubber', which is not in the deck"},
    {"b.inp", NODES TET "*SURFACE\n1, S1\n", "b.inp:8: the surface has no name; `*SURFACE, NAME=NAME` is expected"},
    {"b.inp", NODES TET "*SURFACE, NAME=\n1, S1\n", "b.inp:8: NAME names no set; `NAME=NAME`"},
    {"b.inp", NODES TET "*SURFACE, NAME=All\n1, S1\n", "b.inp:8: the surface 'all' has the name of a set of nodes or elements"},
    {"b.inp", NODES TET "*SURFACE, NAME=a, COMBINE=UNION\nb, c\n", "b.inp:8: *SURFACE has the parameter COMBINE"},
    {"b.inp", NODES TET "*SURFACE, NAME=a\n1\n", "b.inp:9: the end of the row stands where the face of a tet"},
    {"b.inp", NODES TET "*SURFACE, NAME=a\nall, S5\n", "b.inp:9: 'S5' stands where the face of a tet is expected, S1, S2, S3 or S4"},
    {"b.inp", NODES TET "*SURFACE, NAME=a\n2, S1\n", "b.inp:9: element 2 is not in the deck"},
    {"b.inp", NODES TET "*SURFACE, NAME=a\nb, S1\n", "b.inp:9: 'b' names no set of elements; the mesh has the sets 'all' and 'a'"},
    {"b.inp", NODES TET "*SURFACE, NAME=a, TYPE=NODE\n5\n", "b.inp:9: node 5 is not in the deck"},
    {"b.inp", NODES TET "*SURFACE, NAME=a, TYPE=NODE\nb\n", "b.inp:9: 'b' names no set"},
    {"b.inp", NODES TET "*NSET, NSET=a\033[31m\n1\n", "b.inp:8: the name of a set has a control character (27)"},
};

#define VERTICES "*VERTICES\n4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n"
#define ELEMENTS "*ELEMENTS\nTET\n1 4 0\n1 1 2 3 4\n"

static const bad_file vegas[] = {
    {"b.veg", "", "b.veg:1: the file ends where *VERTICES is expected"},
    {"b.veg", "# x\n*ELEMENTS\n", "b.veg:2: '*ELEMENTS' stands where *VERTICES is expected"},
    {"b.veg", "*VERTICES\n900 3 0 0\n1 0 0 0\n", "number of vertices is 900, but only"},
    {"b.veg", "*VERTICES\n2 3 0 0\n5 0 0 0\n", "b.veg:3: the first vertex has number 5; it must be 0 or 1"},
    {"b.veg", "*VERTICES\n2 3 0 0\n1 0 0 0\n3 0 0 0\n", "b.veg:4: vertex 3 stands where vertex 2 is expected"},
    {"b.veg", "*VERTICES\n1 3 0 0\n1 0 0\n*ELEMENTS\n", "b.veg:3: vertex 1: the row ends too early; `number x y z`"},
    {"b.veg", VERTICES "5 0 0 0\n", "b.veg:7: '5' stands where *ELEMENTS is expected"},
    {"b.veg", VERTICES "*ELEMENTS\nCUBIC\n1 8 0\n", "b.veg:8: 'CUBIC' stands where the kind of elements TET"},
    {"b.veg", VERTICES "*ELEMENTS\nTET\n1 4 0\n1 1 2 3 5\n", "b.veg:10: tet 1 uses vertex 5; the vertices are 1 to 4"},
    {"b.veg", VERTICES ELEMENTS "*SET\n1\n", "stands where the set's name"},
    {"b.veg", VERTICES ELEMENTS "*SET a\n2\n", "b.veg:12: the set has tet 2; the tets are 1 to 1"},
    {"b.veg", VERTICES ELEMENTS "*SET a\nx\n", "b.veg:12: set: 'x' is not an integer"},
    {"b.veg", VERTICES ELEMENTS "*REGION\nb, soft\n*SET a\n1\n", "b.veg:12: the region names the set 'b', which is not in the file; the mesh has the set 'a'"},
    {"b.veg", VERTICES ELEMENTS "*REGION\n*SET a\n1\n", "stands where the region's row `set, material`"},
    {"b.veg", VERTICES ELEMENTS "*INCLUDE a.veg\n", "b.veg:11: *INCLUDE is not supported"},
    {"b.veg", VERTICES ELEMENTS ELEMENTS, "a second list of vertices or elements"},
};

#define HEAD   "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\">\n"
#define PIECE  "<Piece NumberOfPoints=\"4\" NumberOfCells=\"1\">\n"
#define POINTS "<Points>\n<DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points>\n"
#define ARRAY(name, values) "<DataArray type=\"Int32\" Name=\"" name "\" format=\"ascii\">" values "</DataArray>\n"
#define CELLS(connectivity, offsets, types) \
  "<Cells>" ARRAY("connectivity", connectivity) ARRAY("offsets", offsets) ARRAY("types", types) "</Cells>\n"
#define BASE64(attributes, data) "<Points>\n<DataArray type=\"Float32\" NumberOfComponents=\"3\" " attributes ">" data "</DataArray></Points>\n"
#define GOOD_CELLS CELLS("0 1 2 3", "4", "10")

static const bad_file grids[] = {
    {"b.vtu", "", "b.vtu:1: the file does not begin with <VTKFile>"},
    {"b.vtu", "<Piece/>", "does not begin with <VTKFile>"},
    {"b.vtu", "<VTKFile type=\"PolyData\">", "b.vtu:1: the file's type is not UnstructuredGrid"},
    {"b.vtu", "<VTKFile type=\"UnstructuredGrid\" compressor=\"vtkLZ4DataCompressor\">", "compressed by something else than vtkZLibDataCompressor"},
    {"b.vtu", HEAD, "b.vtu: there is no <Piece>"},
    {"b.vtu", HEAD PIECE PIECE, "b.vtu:3: a second <Piece>"},
    {"b.vtu", HEAD "<Piece NumberOfPoints=\"-4\" NumberOfCells=\"1\">", "b.vtu:2: NumberOfPoints or NumberOfCells"},
    {"b.vtu", HEAD PIECE POINTS, "there is no array connectivity in <Cells>"},
    {"b.vtu", HEAD PIECE GOOD_CELLS, "there is no <DataArray> in <Points>"},
    {"b.vtu", HEAD PIECE "<Points><DataArray type=\"Float32\" format=\"ascii\">0</DataArray></Points>" GOOD_CELLS, "the points have 1 coordinates; they must have 3"},
    {"b.vtu", HEAD PIECE POINTS CELLS("0 1 2 3 0 1 2", "3", "5"), "stands behind the last of 3 numbers of the array connectivity"},
    {"b.vtu", HEAD PIECE POINTS CELLS("0 1 2", "3", "5"), "there are no tets (VTK_TETRA or VTK_QUADRATIC_TETRA) among its 1 cells"},
    {"b.vtu", HEAD PIECE POINTS CELLS("0 1 2", "3", "10"), "cell 0 has 3 points; its type 10 has 4"},
    {"b.vtu", HEAD PIECE POINTS CELLS("0 1 2 4", "4", "10"), "b.vtu:5: cell 0 uses point 4; the points are 0 to 3"},
    {"b.vtu", HEAD PIECE POINTS CELLS("0 1 2", "4", "10"), "the file ends too early"},
    {"b.vtu", HEAD PIECE POINTS CELLS("0 1 2 3", "-4", "10"), "offset 0 is -4; offsets must rise"},
    {"b.vtu", HEAD PIECE POINTS CELLS("0 1 2 3", "400000", "10"), "the array connectivity should have 400000 numbers, but only"},
    {"b.vtu", HEAD "<Piece NumberOfPoints=\"90000000\" NumberOfCells=\"1\">" POINTS GOOD_CELLS, "should have 270000000 numbers, but only"},
    {"b.vtu", HEAD "<Piece NumberOfPoints=\"4\" NumberOfCells=\"2\">" POINTS CELLS("0 1 2 3 0 1 2 3 0 1", "4 10", "10 13"), "not tets (hexahedra, prisms, pyramids): 1; a body has only tets"},
    {"b.vtu", HEAD PIECE "<Points><DataArray type=\"Float16\" format=\"ascii\">", "the array of points has no known type"},
    {"b.vtu", HEAD PIECE "<Points><DataArray type=\"Float32\" format=\"xml\">", "the array of points has no known format"},
    {"b.vtu", HEAD PIECE "<Points><DataArray type=\"Float32\" format=\"appended\">", "is appended, but its offset is no number"},
    {"b.vtu", HEAD PIECE BASE64("format=\"binary\"", "MAAAAA=*") GOOD_CELLS, "only 8 bytes of the file are left"},
    {"b.vtu", HEAD PIECE BASE64("format=\"binary\"", "MAAAAA==AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA*") GOOD_CELLS, "b.vtu:4: the data of the array of points end too early, or are not base 64"},
    {"b.vtu", HEAD PIECE BASE64("format=\"binary\"", "LAAAAA==AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA") GOOD_CELLS, "has 44 bytes; it must have 48, for 12 numbers of 4 bytes"},
    {"b.vtu", HEAD PIECE BASE64("format=\"appended\" offset=\"0\"", "") GOOD_CELLS, "is appended, but there is no <AppendedData>"},
    {"b.vtu", HEAD PIECE BASE64("format=\"appended\" offset=\"99\"", "") GOOD_CELLS "<AppendedData encoding=\"raw\">_ab", "has the offset 99; only 2 bytes are appended"},
    {"b.vtu", HEAD PIECE "<AppendedData encoding=\"gzip\">_ab", "<AppendedData> has no known encoding"},
    {"b.vtu", HEAD PIECE "<CellData><DataArray Name=\"region\" type=\"Float64\" format=\"ascii\">0.5</DataArray></CellData>" POINTS GOOD_CELLS, "cell 0 has the region 0.5; it must be an integer of 32 bits"},
};

static void check_bad(const bad_file *files, size_t count)
{
  for (size_t i = 0; i < count; i++) {
    flesh_mesh *mesh;
    const int status = flesh_mesh_read(write_text(files[i].name, files[i].text), &mesh);
    if (status != FLESH_ERR_FILE) printf("# this file was not refused:\n# %s\n", files[i].text);
    CHECK(status == FLESH_ERR_FILE && mesh == NULL);
    CHECK_TEXT(flesh_error_text(), files[i].expected);
    CHECK_TEXT(flesh_error_text(), work_folder);
    flesh_mesh_destroy(&mesh);
  }
}

static void bad_decks_are_refused(void) { check_bad(decks, sizeof decks / sizeof *decks); }
static void bad_vega_files_are_refused(void) { check_bad(vegas, sizeof vegas / sizeof *vegas); }
static void bad_grids_are_refused(void) { check_bad(grids, sizeof grids / sizeof *grids); }

/* Truncated and damaged files are read, or refused with a message that names them; sanitizers and valgrind check the
 * rest. */
static void damaged_files_do_no_harm(void)
{
  static const char deck[] = NODES TET "*NSET, NSET=a, GENERATE\n1, 4, 2\n*ELSET, ELSET=\"b c\"\nall, 1\n*SOLID SECTION, ELSET=all\n"
                             "*SURFACE, NAME=s\n\"b c\", S1\n1, S3\n*SURFACE, NAME=n, TYPE=NODE\na, 1.\n";
  static const char vega[] = VERTICES ELEMENTS "*SET a\n1\n*REGION\na, soft\n";
  static const char grid[] = HEAD PIECE POINTS GOOD_CELLS "</Piece></VTKFile>\n";
  static const char *const kept[] = {"ball.inp", "ball_meshio.vtu", "ball_zlib.vtu", "ball_big_endian.vtu"};
  static const char lively[] = "0123456789-+.eE \n*,\"<>=/_#\t\0\r\xff\x80\x7f";
  unsigned long long seed = 7;
  for (int f = 0; f < 7; f++) {
    const char *const name = f == 0 ? "s.inp" : f == 1 ? "s.veg" : f == 2 ? "s.vtu" : kept[f - 3];
    char path[64], *bytes;
    size_t size;
    snprintf(path, sizeof path, "reference/meshes/%s", name);
    bytes = f < 3 ? strdup(f == 0 ? deck : f == 1 ? vega : grid) : read_bytes(path, &size);
    if (f < 3) size = strlen(bytes);
    char *damaged = malloc(size);
    int accepted = 0, refused = 0;
    for (int trial = 0; trial < 1000; trial++) {
      flesh_mesh *mesh;
      size_t length = size;
      memcpy(damaged, bytes, size);
      if (trial % 4 == 0 && trial) length = (size_t)(test_uniform(&seed) * (double)size);
      for (int k = 0; trial && trial % 4 && k < 1 + trial % 3; k++)
        damaged[(size_t)(test_uniform(&seed) * (double)size)] = lively[(size_t)(test_uniform(&seed) * (sizeof lively - 1))];
      const int status = flesh_mesh_read(write_bytes(name, damaged, length), &mesh);
      CHECK(status == FLESH_OK || status == FLESH_ERR_FILE);
      CHECK((status == FLESH_OK) == (mesh != NULL) && (trial || mesh));
      if (status) CHECK_TEXT(flesh_error_text(), work_folder);
      status ? refused++ : accepted++;
      flesh_mesh_destroy(&mesh);
    }
    CHECK(refused > 200 && accepted > 0);
    free(bytes);
    free(damaged);
  }
}

int main(int argc, char **argv)
{
  if (!make_work_folder()) return 1;
  return RUN_TESTS(argc, argv, TEST(bad_decks_are_refused), TEST(bad_vega_files_are_refused), TEST(bad_grids_are_refused),
                   TEST(damaged_files_do_no_harm));
}
