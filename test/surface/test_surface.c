// TEST quick
/* test_surface.c: surfaces from OBJ, PLY and STL files, valid and invalid ones; their triangles; writing. */
#include "mesh_files.h"

#include "flesh/surface.h"

static int corner(const flesh_surface *s, int face, int k)
{
  return flesh_surface_corners(s)[flesh_surface_starts(s)[face] + k];
}

static int corners_of(const flesh_surface *s, int face)
{
  return flesh_surface_starts(s)[face + 1] - flesh_surface_starts(s)[face];
}

static const char box_obj[] = "# a comment\r\n"
                              "mtllib none.mtl\no thing\n"
                              "f 1 2 3\n" /* before its vertices */
                              "v 0 0 0\nv 1 0 0 0.5 0.5 0.5\nv 1 1 0 1\nv 0 1 0\n"
                              "vt 0 0\nvt 1 0 0\nvt 1 1\nvn 0 0 1\ng a b\nusemtl x\ns off\n"
                              "f 1/1/1 2/2/1 3/3/1 4/1/1\n"
                              "f -4 -3 \\\n -2//1 # joined\n"
                              "f 1/2 2/2 4/3\nl 1 2\n";

static void obj_forms(void)
{
  flesh_surface *s = NULL;
  CHECK_OK(flesh_surface_read(write_text("a.obj", box_obj), &s));
  if (!s) return;
  CHECK(flesh_surface_vertex_count(s) == 4 && flesh_surface_face_count(s) == 4);
  const int counts[] = {3, 4, 3, 3}, expected[4][4] = {{0, 1, 2}, {0, 1, 2, 3}, {0, 1, 2}, {0, 1, 3}};
  for (int f = 0; f < 4; f++) {
    CHECK(corners_of(s, f) == counts[f]);
    for (int k = 0; k < counts[f]; k++) CHECK(corner(s, f, k) == expected[f][k]);
  }
  const double *x = flesh_surface_positions(s);
  CHECK(x[3] == 1 && x[4] == 0 && x[10] == 1);
  int count;
  flesh_surface_triangles(s, &count);
  CHECK(count == 5);
  flesh_surface_destroy(&s);
  CHECK(!s);
}

/* A pyramid over a square as PLY in every form, with properties and elements to ignore. */
static void put(unsigned char **at, int big, uint64_t bits, int bytes)
{
  for (int b = 0; b < bytes; b++) *(*at)++ = (unsigned char)(bits >> 8 * (big ? bytes - 1 - b : b));
}

static size_t pyramid_ply(unsigned char data[4096], int big)
{
  static const float x[5][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5f, 0.5f, -2}};
  static const int faces[5][5] = {{4, 3, 2, 1, 0}, {3, 0, 1, 4}, {3, 1, 2, 4}, {3, 2, 3, 4}, {3, 3, 0, 4}};
  int head = sprintf((char *)data,
                     "ply\nformat binary_%s_endian 1.0\ncomment end_header\nelement extra 2\n"
                     "property list uchar short some\nproperty double a\nelement vertex 5\n"
                     "property float x\nproperty uchar red\nproperty double y\nproperty float z\n"
                     "element face 5\nproperty uchar flag\nproperty list uchar int vertex_indices\n"
                     "end_header\n",
                     big ? "big" : "little");
  unsigned char *at = data + head;
  for (int k = 0; k < 2; k++) {
    put(&at, big, 3, 1);
    put(&at, big, 0x000100020003, 6);
    put(&at, big, 0, 8);
  }
  for (int v = 0; v < 5; v++) {
    uint32_t word;
    uint64_t bits;
    double y = x[v][1];
    memcpy(&word, &x[v][0], 4);
    put(&at, big, word, 4);
    put(&at, big, 200, 1);
    memcpy(&bits, &y, 8);
    put(&at, big, bits, 8);
    memcpy(&word, &x[v][2], 4);
    put(&at, big, word, 4);
  }
  for (int f = 0; f < 5; f++) {
    put(&at, big, 7, 1);
    put(&at, big, (uint64_t)faces[f][0], 1);
    for (int k = 0; k < faces[f][0]; k++) put(&at, big, (uint64_t)faces[f][k + 1], 4);
  }
  return (size_t)(at - data);
}

static const char pyramid_ascii[] =
    "ply\r\nformat ascii 1.0\r\ncomment x y z\r\nelement vertex 5\r\nproperty float32 x\r\n"
    "property float y\r\nproperty double z\r\nproperty float quality\r\nelement face 5\r\n"
    "property list uint8 int32 vertex_index\r\nend_header\r\n0 0 0 nan\r\n1 0 0 1\r\n1 1 0 2\r\n"
    "0 1 0 3\r\n.5 5e-1 -2 4\r\n4 3 2 1 0\r\n3 0 1 4\r\n3 1 2 4\r\n3 2 3 4\r\n3 3 0 4\r\n";

static void check_pyramid(const char *path)
{
  flesh_surface *s = NULL;
  CHECK_OK(flesh_surface_read(path, &s));
  if (!s) return;
  CHECK(flesh_surface_vertex_count(s) == 5 && flesh_surface_face_count(s) == 5);
  CHECK(corners_of(s, 0) == 4 && corner(s, 0, 0) == 3 && corner(s, 4, 2) == 4);
  CHECK(flesh_surface_positions(s)[14] == -2 && flesh_surface_positions(s)[12] == 0.5);
  int count;
  const int *t = flesh_surface_triangles(s, &count);
  double volume = 0; /* by the divergence theorem: 1/3 of base times height */
  for (int k = 0; k < count; k++) {
    const double *x = flesh_surface_positions(s), *a = x + 3 * t[3 * k], *b = x + 3 * t[3 * k + 1],
                 *c = x + 3 * t[3 * k + 2];
    volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
               a[2] * (b[0] * c[1] - b[1] * c[0])) / 6;
  }
  CHECK(count == 6);
  CHECK_NEAR(fabs(volume), 2. / 3, 1e-15);
  flesh_surface_destroy(&s);
}

static void ply_forms(void)
{
  unsigned char data[4096];
  for (int big = 0; big < 2; big++) check_pyramid(write_bytes("p.ply", data, pyramid_ply(data, big)));
  check_pyramid(write_text("p.ply", pyramid_ascii));
}

/* A pyramid over a square as binary STL, in triangles; the header begins like a text file. */
static size_t pyramid_stl(unsigned char data[4096])
{
  static const float x[5][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5f, 0.5f, -2}};
  static const int faces[6][3] = {{3, 2, 1}, {3, 1, 0}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  unsigned char *at = data + 80;
  memset(data, ' ', 80);
  memcpy(data, "solid", 5);
  put(&at, 0, 6, 4);
  for (int f = 0; f < 6; f++) {
    put(&at, 0, 0xffffffff, 4); /* a normal of NaN */
    put(&at, 0, 0, 8);
    for (int k = 0; k < 9; k++) {
      const float value = x[faces[f][k / 3]][k % 3];
      const float signed_zero = value == 0 && f % 2 ? -0.f : value;
      uint32_t word;
      memcpy(&word, &signed_zero, 4);
      put(&at, 0, word, 4);
    }
    put(&at, 0, 0xffff, 2);
  }
  return (size_t)(at - data);
}

static const char pyramid_text[] =
    "SOLID a # name\r\n facet normal nan 0 0\n  outer loop\n vertex 0 0 0\n vertex 1 0 0\n vertex .5 .5 -2\n endloop\n"
    " endfacet\nendsolid a\nsolid\nfacet normal 0 0 0 outer loop vertex 1 0 0 vertex 1 1 0 vertex 5e-1 0.5 -2.0 endloop "
    "endfacet\nfacet normal 0 0 0\nOUTER LOOP\nvertex 1 1 0\nvertex 1 1 0\nvertex 0.5 0.5 -2\nENDLOOP\nendfacet\nendsolid\n";

/* Facets share the vertices at their corners, numbered by first appearance. */
static void stl_forms(void)
{
  unsigned char data[4096];
  flesh_surface *s = NULL;
  CHECK_OK(flesh_surface_read(write_bytes("no_suffix", data, pyramid_stl(data)), &s));
  if (!s) return;
  CHECK(flesh_surface_vertex_count(s) == 5 && flesh_surface_face_count(s) == 6);
  static const int expected[6][3] = {{0, 1, 2}, {0, 2, 3}, {3, 2, 4}, {2, 1, 4}, {1, 0, 4}, {0, 3, 4}};
  for (int f = 0; f < 6; f++)
    for (int k = 0; k < 3; k++) CHECK(corner(s, f, k) == expected[f][k]);
  const double *x = flesh_surface_positions(s);
  CHECK(x[0] == 0 && x[1] == 1 && x[2] == 0 && x[14] == -2);
  flesh_surface_destroy(&s);
  CHECK_OK(flesh_surface_read(write_text("no_suffix", pyramid_text), &s));
  if (!s) return;
  int count;
  flesh_surface_triangles(s, &count);
  CHECK(flesh_surface_vertex_count(s) == 4 && flesh_surface_face_count(s) == 3 && count == 2);
  CHECK(corner(s, 0, 2) == 2 && corner(s, 1, 0) == 1 && corner(s, 1, 2) == 2 && corner(s, 1, 1) == 3);
  flesh_surface_destroy(&s);
}

/* Concave polygons in any plane: the triangles' areas add up, none is turned over. */
static void concave_faces_are_cut_without_overlap(void)
{
  enum { MOST = 64 };
  unsigned long long seed = 7;
  for (int trial = 0; trial < 200; trial++) {
    int n = 4 + (int)(60 * test_uniform(&seed)), corners[MOST], starts[2] = {0, n};
    double x[3 * MOST], u[3], v[3], dot = 0, area = 0, axis[3];
    for (int d = 0; d < 3; d++) u[d] = test_uniform(&seed) - 0.5, v[d] = test_uniform(&seed) - 0.5;
    double uu = u[0] * u[0] + u[1] * u[1] + u[2] * u[2];
    for (int d = 0; d < 3; d++) dot += u[d] * v[d];
    for (int d = 0; d < 3; d++) v[d] -= u[d] * dot / uu;
    for (int d = 0; d < 3; d++) axis[d] = u[(d + 1) % 3] * v[(d + 2) % 3] - u[(d + 2) % 3] * v[(d + 1) % 3];
    double unit = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]), last[2] = {0, 0};
    double first[2] = {0, 0};
    for (int k = 0; k < n; k++) { /* a star with random rays, turned over in every other trial */
      double angle = 2 * acos(-1) * k / n * (trial & 1 ? -1 : 1), r = 0.2 + test_uniform(&seed);
      double p[2] = {r * cos(angle), r * sin(angle)};
      corners[k] = k;
      for (int d = 0; d < 3; d++) x[3 * k + d] = p[0] * u[d] + p[1] * v[d];
      if (k) area += 0.5 * (last[0] * p[1] - last[1] * p[0]);
      else memcpy(first, p, sizeof p);
      memcpy(last, p, sizeof p);
    }
    area += 0.5 * (last[0] * first[1] - last[1] * first[0]);
    flesh_surface *s = NULL;
    CHECK_OK(flesh_surface_create(n, x, 1, starts, corners, &s));
    if (!s) return;
    int count, turned = 0;
    const int *t = flesh_surface_triangles(s, &count);
    double sum = 0;
    for (int k = 0; k < count; k++) {
      const double *a = x + 3 * t[3 * k], *b = x + 3 * t[3 * k + 1], *c = x + 3 * t[3 * k + 2];
      double part = 0;
      for (int d = 0; d < 3; d++) {
        int i = (d + 1) % 3, j = (d + 2) % 3;
        part += 0.5 * ((b[i] - a[i]) * (c[j] - a[j]) - (b[j] - a[j]) * (c[i] - a[i])) * axis[d] / unit;
      }
      turned += part * area < -1e-12;
      sum += part;
    }
    CHECK(count == n - 2 && !turned);
    CHECK_NEAR(sum / unit, area, 1e-12);
    flesh_surface_destroy(&s);
  }
}

static void faces_begin_at_the_first_corner(void)
{
  flesh_surface *s = NULL;
  const double x[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const int corners[] = {0, 1, 2}, starts[] = {-3, 0};
  CHECK(flesh_surface_create(3, x, 1, starts, corners + 3, &s) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "starts[0] is -3; it must be 0");
}

static void degenerate_triangles_are_left_out(void)
{
  flesh_surface *s = NULL;
  CHECK_OK(flesh_surface_read(write_text("d.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 2\nf 1 2 3\n"), &s));
  int count = 0;
  if (s) flesh_surface_triangles(s, &count);
  CHECK(count == 1);
  flesh_surface_destroy(&s);
}

static void writing_reads_back(void)
{
  flesh_surface *s = NULL, *again = NULL;
  CHECK_OK(flesh_surface_read(write_text("a.obj", box_obj), &s));
  if (!s) return;
  double x[12];
  for (int d = 0; d < 12; d++) x[d] = (float)(d / 7.);
  for (int form = 0; form < 2; form++) {
    const char *path = in_work_folder(form ? "out.ply" : "out.obj");
    CHECK_OK(flesh_surface_write(s, form ? x : NULL, path));
    CHECK_OK(flesh_surface_read(path, &again));
    if (!again) break;
    const double *expected = form ? x : flesh_surface_positions(s);
    CHECK(!memcmp(flesh_surface_positions(again), expected, sizeof x));
    CHECK(flesh_surface_face_count(again) == 4 && corners_of(again, 1) == 4);
    CHECK(!memcmp(flesh_surface_corners(again), flesh_surface_corners(s), 13 * sizeof(int)));
    flesh_surface_destroy(&again);
  }
  /* Texture coordinates are kept: a file written from a written file is the same. */
  CHECK_OK(flesh_surface_read(in_work_folder("out.obj"), &again));
  if (again) CHECK_OK(flesh_surface_write(again, NULL, in_work_folder("again.obj")));
  size_t size, size_again;
  char *text = read_bytes(in_work_folder("out.obj"), &size);
  char *text_again = read_bytes(in_work_folder("again.obj"), &size_again);
  CHECK(size == size_again && !memcmp(text, text_again, size));
  text[size < 1 << 20 ? size : 0] = 0;
  CHECK_TEXT(text, "\nf 1/1 2/2 3/3 4/1\n");
  free(text);
  free(text_again);
  flesh_surface_destroy(&again);
  CHECK(flesh_surface_write(s, NULL, "a.stl") == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "named .obj or .ply");
  flesh_surface_destroy(&s);
}

typedef struct bad_file {
  const char *name, *text, *expected;
} bad_file;

#define V3   "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
#define PLY  "ply\nformat ascii 1.0\n"
#define XYZ  "property float x\nproperty float y\nproperty float z\n"
#define LIST "property list uchar int vertex_indices\n"
#define HEAD PLY "element vertex 3\n" XYZ "element face 1\n" LIST "end_header\n0 0 0\n1 0 0\n0 1 0\n"

#define FACET "facet normal 0 0 1\nouter loop\nvertex 0 0 0 vertex 1 0 0 vertex 0 1 0\nendloop\nendfacet\n"

static const bad_file bad_files[] = {
    {"a.obj", "", "a.obj: the file is empty"},
    {"a.obj", V3, "a.obj: there is no face"},
    {"a.obj", "f 1 2 3\n", "a.obj:1: a face uses vertex 3; the file has 0"},
    {"a.obj", V3 "f 1 2 3\nf 1 2 4\n", "a.obj:5: a face uses vertex 4; the file has 3"},
    {"a.obj", V3 "f 1 2 0\n", "a.obj:4: face 1: the vertex index is 0"},
    {"a.obj", V3 "f -1 -2 -4\n", "a.obj:4: face 1: the vertex index is -4"},
    {"a.obj", V3 "f 1 2\n", "a.obj:4: face 1 has 2 corners; it must have 3 to 10000"},
    {"a.obj", V3 "f 1/ 2 3\n", "a.obj:4: face 1: '1/' is no corner"},
    {"a.obj", V3 "f 1 2 3x\n", "'3x' is no corner; it must be v, v/vt, v//vn or v/vt/vn"},
    {"a.obj", V3 "f 1/1 2/1 3/1\n", "a.obj:4: a face uses texture vertex 1; the file has 0"},
    {"a.obj", V3 "f 1 2 99999999999\n", "the vertex index 9999999999 is too large"},
    {"a.obj", "v 0 0 0\nv 0 1\n", "a.obj:2: vertex 2: the row ends too early; `v x y z`"},
    {"a.obj", "v 0 0 0\n v 0 \\\n 1\nx\n", "a.obj:2: vertex 2: the row ends too early"},
    {"a.obj", V3 "f 1 \\\n2 3\nwhat 3\n", "a.obj:6: 'what' is no statement of an OBJ"},
    {"a.obj", "v 0 0 1,5\n", "a.obj:1: vertex 1: '1,5' is not a number"},
    {"a.obj", "v 0 0 nan\n", "'nan' is not finite"},
    {"a.obj", "v 0 0 0 1 1 1 1 1\n", "'1' stands behind the row's end"},
    {"a.obj", "sold x\n", "a.obj:1: 'sold' is no statement of an OBJ; a surface is a Wavefront .obj"},
    {"a.stl", "", "a.stl: the file is empty"},
    {"a.stl", "solid x\n", "a.stl:2: the file ends too early; `endsolid` is expected"},
    {"a.stl", "solid x\nendsolid x\n", "a.stl: there is no face"},
    {"a", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0\nendloop\n",
     "a:5: facet 1: the row ends too early; `vertex x y z` is expected"},
    {"a", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\n",
     "a:6: facet 1: 'endloop' stands where `vertex` is expected"},
    {"a", "solid\n" FACET "facet normal 0 0 1\nouter loop\nvertex 0 0 inf\n", "a:9: facet 2: 'inf' is not finite"},
    {"a", "solid\n" FACET "facet normal 0 0 1\nouter\n", "a:9: facet 2: the file ends too early; `loop` is expected"},
    {"a", "solid\n" FACET "color 1 0 0\n", "a:7: 'color' stands where `facet` or `endsolid` is expected"},
    {"a", "solid\n" FACET "endsolid\nfacet\n", "a:8: 'facet' stands where `solid` is expected"},
    {"a.stl", "v 0 0 0\n", "a.stl: an STL begins with `solid` or, if it is binary, has 84 bytes or more; this has 8"},
    {"a.ply", "ply\n", "a.ply:2: the header does not end"},
    {"a.ply", "ply\nformat ascii 2.0\n", "a.ply:2: the format is 'ascii 2.0'; it must be ascii"},
    {"a.ply", "ply\nend_header\n", "the header names no format"},
    {"a.ply", "ply\nproperty float x\n", "a.ply:2: a property stands before any element"},
    {"a.ply", PLY "element vertex -1\n", "a.ply:3: element vertex: the count is -1"},
    {"a.ply", PLY "element vertex 1\nproperty half x\n", "a.ply:4: 'half' is no type of a property"},
    {"a.ply", PLY "element vertex 1\nproperty list float int x\n", "a list's length is float"},
    {"a.ply", PLY "vertices 3\n", "a.ply:3: 'vertices' begins no line of a header"},
    {"a.ply", PLY "element face 1\n" LIST "end_header\n3 0 1 2\n", "there is no element vertex"},
    {"a.ply", PLY "element vertex 1\n" XYZ "end_header\n0 0 0\n", "no element face with a list"},
    {"a.ply", PLY "element vertex 1\nproperty float x\nproperty float z\nend_header\n0 0\n",
     "a.ply: element vertex has no property y"},
    {"a.ply", PLY "element vertex 3\n" XYZ "element face 1\nproperty int vertex_index\nelement face 1\n" LIST
     "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 2\n", "a.ply: element face stands twice"},
    {"a.ply", PLY "element vertex 3\n" XYZ "element vertex 1\n" XYZ "element face 1\n" LIST
     "end_header\n0 0 0\n1 0 0\n0 1 0\n1 1 1\n3 0 1 2\n", "a.ply: element vertex stands twice"},
    {"a.ply", PLY "element vertex 1\n" XYZ "property double x\n" "element face 1\n" LIST "end_header\n0 0 0 0\n",
     "a.ply: element vertex has property x twice"},
    {"a.ply", HEAD "3 0 1 3\n", "a.ply:13: face 0 uses vertex 3; the vertices are 0 to 2"},
    {"a.ply", HEAD "2 0 1\n", "a.ply:13: face 0 has 2 corners"},
    {"a.ply", HEAD "3 0 1\n", "a.ply:13: face 0: the row ends too early"},
    {"a.ply", HEAD "3 0 1 2 2\n", "a.ply:13: face 0: '2' stands behind the row's end"},
    {"a.ply", HEAD, "a.ply:13: face 0: the file ends too early"},
    {"a.ply", PLY "element vertex 536870911\n" XYZ "element face 1\n" LIST "end_header\n0 0 0\n",
     "vertex 1: the file ends too early"},
};

static void bad_files_get_their_sentence(void)
{
  for (size_t k = 0; k < sizeof bad_files / sizeof *bad_files; k++) {
    flesh_surface *s = NULL;
    CHECK(flesh_surface_read(write_text(bad_files[k].name, bad_files[k].text), &s) == FLESH_ERR_FILE);
    CHECK(!s);
    CHECK_TEXT(flesh_error_text(), bad_files[k].expected);
  }
  flesh_surface *s = NULL;
  CHECK(flesh_surface_read(work_folder, &s) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "not a regular file");
  unsigned char data[4096];
  size_t size = pyramid_ply(data, 0);
  data[size - 1] = 1; /* the last index */
  CHECK(flesh_surface_read(write_bytes("b.ply", data, size), &s) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "byte");
  CHECK_TEXT(flesh_error_text(), "face 4 uses vertex 16777220; the vertices are 0 to 4");
  size = pyramid_stl(data);
  CHECK(flesh_surface_read(write_bytes("b.stl", data, size - 1), &s) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "b.stl: a binary STL of 6 facets has 384 bytes; this file has 383");
  memset(data + size - 6, 0xff, 4); /* the last coordinate */
  CHECK(flesh_surface_read(write_bytes("b.stl", data, size), &s) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "b.stl: byte 378: facet 6 has a coordinate that is not finite");
}

/* Whatever is changed in a file, it is read or refused. */
static void damaged_files_do_no_harm(void)
{
  unsigned char data[4096], harmed[4096];
  unsigned long long seed = 3;
  for (int kind = 0; kind < 5; kind++) {
    size_t size = kind == 2   ? sizeof box_obj - 1
                  : kind == 3 ? sizeof pyramid_text - 1
                  : kind == 4 ? pyramid_stl(data)
                              : pyramid_ply(data, kind);
    if (kind == 2 || kind == 3) memcpy(data, kind == 2 ? box_obj : pyramid_text, size);
    for (int trial = 0; trial < 300; trial++) {
      memcpy(harmed, data, size);
      for (int hits = 0; hits < 3; hits++)
        harmed[(size_t)(test_uniform(&seed) * (double)size)] = (unsigned char)(256 * test_uniform(&seed));
      size_t kept = trial & 1 ? size : (size_t)(test_uniform(&seed) * (double)size);
      flesh_surface *s = NULL;
      int status = flesh_surface_read(write_bytes(kind == 4 && trial & 2 ? "h.stl" : "h", harmed, kept), &s);
      CHECK(status == FLESH_OK || status == FLESH_ERR_FILE);
      CHECK(!s == (status != FLESH_OK));
      flesh_surface_destroy(&s);
    }
  }
}

int main(int argc, char **argv)
{
  if (!make_work_folder()) return 1;
  return RUN_TESTS(argc, argv, TEST(obj_forms), TEST(ply_forms), TEST(stl_forms),
                         TEST(concave_faces_are_cut_without_overlap),
                         TEST(faces_begin_at_the_first_corner), TEST(degenerate_triangles_are_left_out), TEST(writing_reads_back),
                         TEST(bad_files_get_their_sentence), TEST(damaged_files_do_no_harm));
}
