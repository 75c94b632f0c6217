// TEST quick seconds=60
/* test_quadratic_files.c: meshes of ten-node tets in every format: what is written is read back unchanged, and files
 * written by the formats' own programs are understood, straight and curved. */
#include "mesh_files.h"

/* Checks for the same positions, nodes and regions, bit for bit. */
static int same(const flesh_mesh *a, const flesh_mesh *b)
{
  int nodes = flesh_mesh_node_count(a), tets = flesh_mesh_tet_count(a);
  return nodes == flesh_mesh_node_count(b) && tets == flesh_mesh_tet_count(b) && flesh_mesh_order(a) == 2 &&
         flesh_mesh_order(b) == 2 &&
         !memcmp(flesh_mesh_positions(a), flesh_mesh_positions(b), 3 * (size_t)nodes * sizeof(double)) &&
         !memcmp(flesh_mesh_tets(a), flesh_mesh_tets(b), 4 * (size_t)tets * sizeof(int)) &&
         !memcmp(flesh_mesh_tet_edges(a), flesh_mesh_tet_edges(b), 6 * (size_t)tets * sizeof(int)) &&
         !memcmp(flesh_mesh_regions(a), flesh_mesh_regions(b), (size_t)tets * sizeof(int));
}

/* A box with bent edges, alternating regions of either sign and an unused node. */
static flesh_mesh *motley_mesh(double bend)
{
  flesh_mesh *grid, *raised, *mesh;
  CHECK_OK(flesh_mesh_box((int[]){3, 2, 2}, (double[]){3, 2, 2}, (double[]){0, 0, 0}, &grid));
  CHECK_OK(flesh_mesh_raise_order(grid, &raised));
  int nodes = flesh_mesh_node_count(raised), tets = flesh_mesh_tet_count(raised);
  double *x = malloc(3 * ((size_t)nodes + 1) * sizeof *x);
  int *ten = malloc(10 * (size_t)tets * sizeof *ten), regions[72];
  unsigned long long seed = 3;
  CHECK(nodes == 7 * 5 * 5 && tets == 72);
  for (int i = 0; i < 3 * nodes; i++)
    x[i] = (flesh_mesh_positions(raised)[i] + bend * test_uniform(&seed)) * 1e-3;
  for (int d = 0; d < 3; d++) x[3 * nodes + d] = (double[]){-1e300, 5e-324, 1. / 3}[d];
  for (int t = 0; t < tets; t++) {
    regions[t] = t < 30 ? 5 : t % 3 == 0 ? 0 : t % 3 == 1 ? -2147483647 : 1 << 30;
    memcpy(ten + 10 * t, flesh_mesh_tets(raised) + 4 * t, 4 * sizeof *ten);
    memcpy(ten + 10 * t + 4, flesh_mesh_tet_edges(raised) + 6 * t, 6 * sizeof *ten);
  }
  CHECK_OK(flesh_mesh_create_quadratic(nodes + 1, x, tets, ten, regions, &mesh));
  flesh_mesh_destroy(&grid);
  flesh_mesh_destroy(&raised);
  free(x), free(ten);
  return mesh;
}

static void written_meshes_read_back_the_same(void)
{
  static const char *const names[] = {"a.msh", "b.mesh", "c.node", "d.ele"};
  for (int bent = 0; bent < 2; bent++) {
    flesh_mesh *mesh = motley_mesh(0.1 * bent), *back;
    for (int f = 0; f < 4; f++) {
      CHECK_OK(flesh_mesh_write(mesh, in_work_folder(names[f])));
      CHECK_OK(flesh_mesh_read(in_work_folder(names[f]), &back));
      CHECK(back && same(mesh, back));
      flesh_mesh_destroy(&back);
    }
    flesh_mesh_destroy(&mesh);
  }
}

/* Ten nodes with mid-edge nodes off their middles by different amounts, so that no two can be confused. */
static const double bent[30] = {0,    0,    0,    1,    0,    0,    0,    1.5,  0,    0,    0,    1,    0.51, 0.02, 0,
                                0.5,  0.77, 0.03, 0.02, 0.75, 0.01, 0.04, 0.01, 0.52, 0.53, 0.02, 0.5,  0.01, 0.76, 0.54};

#define POINTS(before, after)                                                                                   \
  before(1) "0 0 0" after before(2) "1 0 0" after before(3) "0 1.5 0" after before(4) "0 0 1" after before(5)   \
  "0.51 0.02 0" after before(6) "0.5 0.77 0.03" after before(7) "0.02 0.75 0.01" after before(8)                \
  "0.04 0.01 0.52" after before(9) "0.53 0.02 0.5" after before(10) "0.01 0.76 0.54" after
#define NOTHING(n) ""
#define NUMBER(n)  #n " "
#define NUMBERED(n) #n ", "

static void check_bent(const char *path, int region)
{
  flesh_mesh *mesh, *expected;
  CHECK_OK(flesh_mesh_read(path, &mesh));
  CHECK_OK(flesh_mesh_create_quadratic(10, bent, 1, (int[]){0, 1, 2, 3, 4, 5, 6, 7, 8, 9}, &region, &expected));
  CHECK(mesh && same(mesh, expected));
  flesh_mesh_destroy(&mesh);
  flesh_mesh_destroy(&expected);
}

/* One tet, with each format's order of the edges. */
static void each_format_has_its_order(void)
{
  check_bent(write_text("t.txt", "nodes 10\n" POINTS(NOTHING, "\n") "tets10 1\n0 1 2 3 4 5 6 7 8 9\n"), 0);
  check_bent(write_text("t.mesh", "MeshVersionFormatted 2 Dimension 3 TetrahedraP2 1 1 2 3 4 5 6 7 8 9 10 -3 "
                                  "Vertices 10\n" POINTS(NOTHING, " 0\n")), -3);
  /* Edges 23, 13, 03, 02, 12, 01, then the corners, as defined by TetrahedraP2Ordering. */
  check_bent(write_text("o.mesh", "MeshVersionFormatted 2\nDimension 3\nVertices 10\n" POINTS(NOTHING, " 0\n")
                                  "TetrahedraP2Ordering\n10\n0 0 1 1\n0 1 0 1\n1 0 0 1\n1 0 1 0\n0 1 1 0\n1 1 0 0\n"
                                  "2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 2\n"
                                  "TetrahedraP2\n1\n10 9 8 7 6 5 1 2 3 4 -3\nEnd\n"), -3);
  write_text("t.node", "10 3 0 0\n" POINTS(NUMBER, "\n"));
  check_bent(write_text("t.ele", "1 10 1\n1 1 2 3 4 10 8 5 6 9 7 -3\n"), -3);
  check_bent(write_text("t22.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n10\n" POINTS(NUMBER, "\n")
                                   "$EndNodes\n$Elements\n2\n1 9 2 1 1 1 2 3 5 6 7\n"
                                   "2 11 2 9 4 1 2 3 4 5 6 7 8 10 9\n$EndElements\n"), 9);
  check_bent(write_text("t41.msh", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 10 1 10\n3 4 0 10\n"
                                   "1\n2\n3\n4\n5\n6\n7\n8\n9\n10\n" POINTS(NOTHING, "\n")
                                   "$EndNodes\n$Elements\n2 2 1 2\n2 1 9 1\n1 1 2 3 5 6 7\n"
                                   "3 4 11 1\n2 1 2 3 4 5 6 7 8 10 9\n$EndElements\n"), 4);
}

/* Abaqus's C3D10 and VTK's quadratic tetra have the edges 12, 23, 13, 14, 24, 34 (Abaqus Analysis User's Guide, "Three-
 * dimensional solid element library"; vtkQuadraticTetra.h). */
static void formats_that_go_by_their_name_have_their_order(void)
{
  check_bent(write_text("t.inp", "*NODE\n" POINTS(NUMBERED, "\n") "*ELEMENT, TYPE=C3D10, ELSET=one\n"
                                 "7, 1, 2, 3, 4, 5, 6, 7,\n  8, 9, 10\n"), 1);
  check_bent(write_text("t.vtu", "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid>\n"
                                 "<Piece NumberOfPoints='10' NumberOfCells='2'><CellData>\n"
                                 "<DataArray Name=\"region\" type=\"Int32\" format=\"ascii\"> 5 -3 </DataArray></CellData>\n"
                                 "<Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">\n"
                                 POINTS(NOTHING, "\n") "</DataArray></Points><Cells>"
                                 "<DataArray Name=\"connectivity\" type=\"Int32\" format=\"ascii\">0 1 2 0 1 2 3 4 5 6 7 8 9"
                                 "</DataArray><DataArray Name=\"offsets\" type=\"Int32\" format=\"ascii\">3 13</DataArray>"
                                 "<DataArray Name=\"types\" type=\"UInt8\" format=\"ascii\">5 24</DataArray></Cells></Piece>"
                                 "</UnstructuredGrid></VTKFile>\n"), -3);
}

static void binary_gmsh_reads_in_either_byte_order(void)
{
  for (int swap = 0; swap < 2; swap++)
    for (int major = 2; major < 5; major += 2) {
      byte_writer w = {.swap = swap};
      put_text(&w, major == 2 ? "$MeshFormat\n2.2 1 8\n" : "$MeshFormat\n4.1 1 8\n");
      put_ints(&w, INTS(1));
      put_text(&w, major == 2 ? "\n$EndMeshFormat\n$Nodes\n10\n" : "\n$EndMeshFormat\n$Nodes\n");
      if (major == 4) {
        put_sizes(&w, SIZES(1, 10, 1, 10));
        put_ints(&w, INTS(3, 4, 0));
        put_sizes(&w, SIZES(10, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10));
      }
      for (int n = 0; n < 10; n++) {
        if (major == 2) put_ints(&w, INTS(n + 1));
        for (int d = 0; d < 3; d++) put_bytes(&w, &bent[3 * n + d], sizeof(double));
      }
      put_text(&w, major == 2 ? "\n$EndNodes\n$Elements\n2\n" : "\n$EndNodes\n$Elements\n");
      if (major == 2) {
        put_ints(&w, INTS(9, 1, 2, 1, 1, 1, 1, 2, 3, 5, 6, 7));
        put_ints(&w, INTS(11, 1, 2, 2, 0, 4, 1, 2, 3, 4, 5, 6, 7, 8, 10, 9));
      } else {
        put_sizes(&w, SIZES(2, 2, 1, 2));
        put_ints(&w, INTS(2, 1, 9));
        put_sizes(&w, SIZES(1, 1, 1, 2, 3, 5, 6, 7));
        put_ints(&w, INTS(3, 4, 11));
        put_sizes(&w, SIZES(1, 2, 1, 2, 3, 4, 5, 6, 7, 8, 10, 9));
      }
      put_text(&w, "\n$EndElements\n");
      check_bent(write_bytes("b.msh", w.bytes, w.size), 4);
      /* Cut anywhere, it is refused. */
      for (size_t size = 30; size + 14 < w.size; size += 7) {
        flesh_mesh *mesh;
        CHECK(flesh_mesh_read(write_bytes("cut.msh", w.bytes, size), &mesh) == FLESH_ERR_FILE && !mesh);
      }
    }
}

static void files_of_other_programs_agree(void)
{
  static const char *const files[] = {"ball_41_binary.msh", "ball_41_ascii.msh", "ball_22_binary.msh",
                                      "ball_22_ascii.msh",  "ball.mesh", "ball.inp", "ball_meshio.vtu",
                                      "ball_zlib.vtu",      "ball_big_endian.vtu"};
  flesh_mesh *first, *mesh;
  flesh_mesh_info info;
  char path[128];
  CHECK_OK(flesh_mesh_read("reference/meshes/ball_41_binary.msh", &first));
  for (int f = 0; f < 9; f++) {
    snprintf(path, sizeof path, "reference/meshes/%s", files[f]);
    CHECK_OK(flesh_mesh_read(path, &mesh));
    flesh_mesh_inspect(mesh, &info);
    CHECK(flesh_mesh_order(mesh) == 2 && info.tets == 10 && info.unused_nodes == 0);
    CHECK(!memcmp(flesh_mesh_tets(first), flesh_mesh_tets(mesh), 4 * 10 * sizeof(int)));
    CHECK(!memcmp(flesh_mesh_tet_edges(first), flesh_mesh_tet_edges(mesh), 6 * 10 * sizeof(int)));
    for (int i = 0; i < 3 * info.nodes; i++)
      CHECK_NEAR(flesh_mesh_positions(mesh)[i], flesh_mesh_positions(first)[i], 6e-15); /* Medit's: 14 digits */
    flesh_mesh_destroy(&mesh);
  }
  flesh_mesh_destroy(&first);
  /* All boundary nodes, including mid-edge nodes, are on the sphere; 50 tets have 99.1 % of its volume. */
  CHECK_OK(flesh_mesh_read("reference/meshes/ball_finer.msh", &mesh));
  flesh_mesh_inspect(mesh, &info);
  int triangles;
  const int *surface = flesh_mesh_surface(mesh, &triangles);
  for (int k = 0; k < 3 * triangles; k++) {
    const double *x = flesh_mesh_positions(mesh) + 3 * surface[k];
    CHECK_NEAR(sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]), 1, 1e-9);
  }
  CHECK_NEAR(info.volume, 4.18879020478639, 0.04);
  flesh_mesh_destroy(&mesh);
  /* Straight: TetGen's cube and Gmsh's boxes. */
  CHECK_OK(flesh_mesh_read("reference/meshes/cube_o2.ele", &mesh));
  flesh_mesh_inspect(mesh, &info);
  CHECK(info.tets == 6 && info.nodes == 27 && info.unused_nodes == 0);
  CHECK_NEAR(info.volume, 1, 1e-14);
  for (int t = 0; t < 6; t++) CHECK(!flesh_mesh_tet_curved(mesh)[t]);
  flesh_mesh_destroy(&mesh);
  CHECK_OK(flesh_mesh_read("reference/meshes/two_boxes_order2.msh", &mesh));
  flesh_mesh_inspect(mesh, &info);
  CHECK(flesh_mesh_order(mesh) == 2 && info.tets == 48 && info.regions == 2 && info.triangles == 160);
  CHECK_NEAR(info.volume, 1.5, 1e-14);
  for (int t = 0; t < 48; t++) CHECK(!flesh_mesh_tet_curved(mesh)[t]);
  flesh_mesh_destroy(&mesh);
}

int main(int argc, char **argv)
{
  if (!make_work_folder()) return 1;
  return RUN_TESTS(argc, argv, TEST(written_meshes_read_back_the_same), TEST(each_format_has_its_order),
                   TEST(formats_that_go_by_their_name_have_their_order),
                   TEST(binary_gmsh_reads_in_either_byte_order), TEST(files_of_other_programs_agree));
}
