// TEST quick
/* test_skin.c: surfaces bound to tets: the right tet, exact weights, saved and read back. */
#include "mesh_files.h"

#include <math.h>

#include "flesh/flesh.h"
#include "skin/locator.h"

static void sub(const double a[3], const double b[3], double c[3])
{
  for (int d = 0; d < 3; d++) c[d] = a[d] - b[d];
}

static double dot(const double a[3], const double b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Returns the distance of p from the hull of `count` corners, if its projection on their plane lies within; else
 * infinite. Uses least squares by elimination, independent of the library. */
static double within_hull(const double p[3], int count, const double *const corners[4])
{
  double e[3][3], q[3], A[3][4], w[3] = {0, 0, 0}, sum = 0, squares = 0;
  int m = count - 1;
  for (int i = 0; i < m; i++) sub(corners[i + 1], corners[0], e[i]);
  sub(p, corners[0], q);
  for (int i = 0; i < m; i++) {
    for (int j = 0; j < m; j++) A[i][j] = dot(e[i], e[j]);
    A[i][m] = dot(e[i], q);
  }
  for (int i = 0; i < m; i++)
    for (int r = 0; r < m; r++) {
      if (r == i) continue;
      double f = A[r][i] / A[i][i];
      for (int c = 0; c <= m; c++) A[r][c] -= f * A[i][c];
    }
  for (int i = 0; i < m; i++) {
    w[i] = A[i][m] / A[i][i];
    sum += w[i];
    if (w[i] < -1e-9) return INFINITY;
  }
  if (sum > 1 + 1e-9) return INFINITY;
  for (int d = 0; d < 3; d++) {
    double left = q[d];
    for (int i = 0; i < m; i++) left -= w[i] * e[i][d];
    squares += left * left;
  }
  return sqrt(squares);
}

/* Returns the least distance from all tets, over every subset of every tet's corners. */
static double distance_by_all(const flesh_mesh *mesh, const double p[3])
{
  double least = INFINITY;
  for (int t = 0; t < flesh_mesh_tet_count(mesh); t++)
    for (int subset = 1; subset < 16; subset++) {
      const double *corners[4];
      int count = 0;
      for (int k = 0; k < 4; k++)
        if (subset >> k & 1)
          corners[count++] = flesh_mesh_positions(mesh) + 3 * flesh_mesh_tets(mesh)[4 * t + k];
      least = fmin(least, within_hull(p, count, corners));
    }
  return least;
}

static flesh_mesh *read_mesh(const char *path)
{
  flesh_mesh *mesh = NULL;
  CHECK_OK(flesh_mesh_read(path, &mesh));
  if (!mesh) exit(1);
  return mesh;
}

/* Chooses a point in the mesh's bounding box, enlarged. */
static void random_point(const flesh_mesh_info *info, double widened, unsigned long long *seed,
                         double p[3])
{
  for (int d = 0; d < 3; d++) {
    double size = info->high[d] - info->low[d];
    p[d] = info->low[d] - widened * size + (1 + 2 * widened) * size * test_uniform(seed);
  }
}

static void nearest_tets_are_found(void)
{
  static const char *const paths[] = {"../data/meshes/finger_coarse.msh",
                                      "../data/meshes/bar_8x2x2.mesh",
                                      "../data/meshes/two_tets_sharing_a_node.mesh",
                                      "../data/meshes/one_sliver_tet.mesh"};
  unsigned long long seed = 1;
  for (size_t k = 0; k < sizeof paths / sizeof *paths; k++) {
    flesh_mesh *mesh = read_mesh(paths[k]);
    flesh_mesh_info info;
    flesh_locator *locator = NULL;
    flesh_mesh_inspect(mesh, &info);
    CHECK_OK(flesh_locator_create(mesh, &locator));
    for (int trial = 0; trial < 60 && locator; trial++) {
      double p[3];
      flesh_place place, other;
      random_point(&info, 0.3, &seed, p);
      flesh_locator_find(locator, p, -1, &place);
      CHECK_NEAR(place.distance, distance_by_all(mesh, p), 1e-9 * info.edge_max);
      double least = INFINITY;
      for (int i = 0; i < 4; i++) least = fmin(least, place.weights[i]);
      CHECK((place.distance > 0) == (least < 0));
      flesh_locator_find(locator, p, (int)(info.tets * test_uniform(&seed)), &other);
      CHECK(place.tet == other.tet && !memcmp(place.weights, other.weights, sizeof place.weights));
    }
    flesh_locator_destroy(&locator);
    flesh_mesh_destroy(&mesh);
  }
}

/* A vertex at a node of the mesh is shared by many tets: it is inside whichever it is bound to. */
static void nodes_are_inside(void)
{
  flesh_mesh *mesh = read_mesh("../data/meshes/hand_coarse.msh");
  flesh_surface *surface = NULL;
  flesh_skin *skin = NULL;
  flesh_skin_info info;
  CHECK_OK(flesh_surface_of_mesh(mesh, &surface));
  CHECK_OK(flesh_skin_bind(mesh, surface, &skin));
  flesh_skin_inspect(skin, &info);
  CHECK(info.outside == 0 && info.farthest == -1 && info.distance_max == 0);
  CHECK(info.weight_min > -1e-12);
  flesh_skin_destroy(&skin);
  flesh_surface_destroy(&surface);
  flesh_mesh_destroy(&mesh);
}

/* Makes a skin of random single triangles around the mesh. */
static flesh_surface *scattered(const flesh_mesh *mesh, int triangles, double widened,
                                unsigned long long seed)
{
  flesh_mesh_info info;
  flesh_mesh_inspect(mesh, &info);
  double *x = malloc(sizeof *x * 9 * (size_t)triangles);
  int *corners = malloc(sizeof *corners * 3 * (size_t)triangles);
  int *starts = malloc(sizeof *starts * ((size_t)triangles + 1));
  flesh_surface *surface = NULL;
  for (int v = 0; v < 3 * triangles; v++) {
    random_point(&info, widened, &seed, x + 3 * v);
    corners[v] = v;
  }
  for (int f = 0; f <= triangles; f++) starts[f] = 3 * f;
  CHECK_OK(flesh_surface_create(3 * triangles, x, triangles, starts, corners, &surface));
  free(x), free(corners), free(starts);
  return surface;
}

static void weights_sum_to_one_and_give_the_vertex_back(void)
{
  static const char *const paths[] = {"../data/meshes/hand_coarse.msh",
                                      "../data/meshes/one_sliver_tet.mesh"};
  for (int k = 0; k < 2; k++) {
    flesh_mesh *mesh = read_mesh(paths[k]);
    flesh_surface *surface = scattered(mesh, 1000, 0.1, 5);
    flesh_skin *skin = NULL;
    flesh_mesh_info info;
    flesh_mesh_inspect(mesh, &info);
    CHECK_OK(flesh_skin_bind(mesh, surface, &skin));
    double worst_sum = 0, worst_place = 0, size = info.edge_max;
    for (int v = 0; v < 3000; v++) {
      const double *w = flesh_skin_weights(skin) + 4 * v, *p = flesh_surface_positions(surface) + 3 * v;
      const int *n = flesh_mesh_tets(mesh) + 4 * flesh_skin_tets(skin)[v];
      double scale = fabs(w[0]) + fabs(w[1]) + fabs(w[2]) + fabs(w[3]);
      worst_sum = fmax(worst_sum, fabs(w[0] + w[1] + w[2] + w[3] - 1) / scale);
      for (int d = 0; d < 3; d++) {
        double sum = 0;
        for (int i = 0; i < 4; i++) sum += w[i] * flesh_mesh_positions(mesh)[3 * n[i] + d];
        worst_place = fmax(worst_place, fabs(sum - p[d]) / (scale * (size + fabs(p[d]))));
      }
    }
    CHECK_BELOW(worst_sum, 4.5e-16);
    CHECK_BELOW(worst_place, 4e-16);
    flesh_skin_destroy(&skin);
    flesh_surface_destroy(&surface);
    flesh_mesh_destroy(&mesh);
  }
}

/* A rotation about an axis, and a translation. */
static void move(const double turn[9], const double shift[3], const double p[3], double q[3])
{
  for (int i = 0; i < 3; i++) q[i] = dot(turn + 3 * i, p) + shift[i];
}

static void rigid_motions_move_the_skin_exactly_along(void)
{
  flesh_mesh *mesh = read_mesh("../data/meshes/hand_coarse.msh");
  flesh_surface *surface = scattered(mesh, 700, 0.05, 9);
  flesh_skin *skin = NULL;
  CHECK_OK(flesh_skin_bind(mesh, surface, &skin));
  double c = cos(2.1), s = sin(2.1), far[] = {0, 1, 1000};
  double turn[9] = {c, -s * 0.6, s * 0.8, s * 0.6, c + 0.64 * (1 - c), 0.48 * (1 - c),
                    -s * 0.8, 0.48 * (1 - c), c + 0.36 * (1 - c)};
  /* Rodrigues' formula about (0, 0.8, 0.6): the same entries by hand. */
  CHECK_NEAR(dot(turn, turn), 1, 1e-15);
  CHECK_NEAR(dot(turn, turn + 3), 0, 1e-15);
  CHECK_NEAR(dot(turn + 3, turn + 6), 0, 1e-15);
  int nodes = flesh_mesh_node_count(mesh), vertices = flesh_surface_vertex_count(surface);
  double *x = malloc(sizeof *x * 3 * (size_t)nodes), *y = malloc(sizeof *y * 3 * (size_t)vertices);
  for (int k = 0; k < 3; k++) {
    double shift[3] = {far[k], -far[k], 0.3 * far[k]}, worst = 0;
    for (int i = 0; i < nodes; i++)
      move(turn, shift, flesh_mesh_positions(mesh) + 3 * i, x + 3 * i);
    flesh_skin_apply(skin, 3, 0, x, y);
    for (int v = 0; v < vertices; v++) {
      double q[3], scale = 0;
      move(turn, shift, flesh_surface_positions(surface) + 3 * v, q);
      for (int i = 0; i < 4; i++) scale += fabs(flesh_skin_weights(skin)[4 * v + i]);
      for (int d = 0; d < 3; d++) worst = fmax(worst, fabs(y[3 * v + d] - q[d]) / scale);
    }
    CHECK_BELOW(worst, 4e-16 * (0.3 + far[k])); /* of its position, at most 0.3 m + the distance from the origin */
  }
  free(x), free(y);
  flesh_skin_destroy(&skin);
  flesh_surface_destroy(&surface);
  flesh_mesh_destroy(&mesh);
}

/* With clamped weights a field stays within its range outside the body; a constant one stays constant. */
static void clamped_weights_only_interpolate(void)
{
  flesh_mesh *mesh = read_mesh("../data/meshes/bar_8x2x2.mesh");
  flesh_surface *surface = scattered(mesh, 200, 0.5, 2);
  flesh_skin *skin = NULL;
  CHECK_OK(flesh_skin_bind(mesh, surface, &skin));
  int nodes = flesh_mesh_node_count(mesh);
  double *field = malloc(sizeof *field * (size_t)nodes), low = 1, high = 0, loose = 0, on_skin[600];
  unsigned long long seed = 4;
  for (int i = 0; i < nodes; i++) field[i] = test_uniform(&seed);
  flesh_skin_apply(skin, 1, 1, field, on_skin);
  for (int v = 0; v < 600; v++) low = fmin(low, on_skin[v]), high = fmax(high, on_skin[v]);
  flesh_skin_apply(skin, 1, 0, field, on_skin);
  for (int v = 0; v < 600; v++) loose = fmax(loose, on_skin[v]);
  CHECK(low >= 0 && high <= 1 && high > 0.5 && loose > 1);
  free(field);
  flesh_skin_destroy(&skin);
  flesh_surface_destroy(&surface);
  flesh_mesh_destroy(&mesh);
}

/* Beyond a face, an edge or a node of a tet, the nodes that do not bear the nearest point have weight 0, and the others
 * keep the ratios of theirs: w_i = max(w_i, 0) / sum of them. */
static void clamped_shares_are_those_of_the_positive_weights(void)
{
  static const double corners[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  /* Points with the weights 1-x-y-z, x, y, z, and the clamped weights. */
  static const struct {
    double point[3], share[4];
  } rows[] = {{{.25, .25, -.5}, {2. / 3, 1. / 6, 1. / 6, 0}},
              {{-.5, -.25, .25}, {6. / 7, 0, 0, 1. / 7}},
              {{3, -1, -.5}, {0, 1, 0, 0}},
              {{.5, .75, .25}, {0, 1. / 3, 1. / 2, 1. / 6}},
              {{.25, .5, .125}, {.125, .25, .5, .125}}};
  enum { ROWS = sizeof rows / sizeof *rows };
  double points[3 * ROWS];
  int starts[2] = {0, ROWS}, face[ROWS];
  for (int k = 0; k < ROWS; k++) memcpy(points + 3 * k, rows[k].point, sizeof rows[k].point), face[k] = k;
  flesh_mesh *mesh = NULL;
  flesh_surface *surface = NULL;
  flesh_skin *skin = NULL;
  CHECK_OK(flesh_mesh_create(4, corners, 1, (int[]){0, 1, 2, 3}, NULL, &mesh));
  CHECK_OK(flesh_surface_create(ROWS, points, 1, starts, face, &surface));
  CHECK_OK(flesh_skin_bind(mesh, surface, &skin));
  for (int node = 0; node < 4; node++) {
    double field[4] = {0}, on_skin[ROWS];
    field[node] = 1;
    flesh_skin_apply(skin, 1, 1, field, on_skin);
    for (int k = 0; k < ROWS; k++) CHECK_NEAR(on_skin[k], rows[k].share[node], 4e-16);
  }
  flesh_skin_destroy(&skin);
  flesh_surface_destroy(&surface);
  flesh_mesh_destroy(&mesh);
}

static void bindings_are_saved_and_checked(void)
{
  flesh_mesh *mesh = read_mesh("../data/meshes/bar_8x2x2.mesh"), *other = NULL, *fine = NULL;
  flesh_surface *surface = scattered(mesh, 100, 0.2, 3), *elsewhere = scattered(mesh, 100, 0.2, 4);
  flesh_skin *skin = NULL, *again = NULL;
  CHECK_OK(flesh_mesh_box((int[]){8, 2, 2}, (double[]){4, 1, 1.01}, (double[]){0, 0, 0}, &other));
  CHECK_OK(flesh_mesh_box((int[]){8, 2, 3}, (double[]){4, 1, 1}, (double[]){0, 0, 0}, &fine));
  CHECK_OK(flesh_skin_bind(mesh, surface, &skin));
  const char *path = in_work_folder("binding.txt");
  CHECK_OK(flesh_skin_write(skin, path));
  CHECK_OK(flesh_skin_read(path, mesh, surface, &again));
  CHECK(!memcmp(flesh_skin_tets(skin), flesh_skin_tets(again), 300 * sizeof(int)));
  CHECK(!memcmp(flesh_skin_weights(skin), flesh_skin_weights(again), 1200 * sizeof(double)));
  flesh_skin_info info, info_again;
  flesh_skin_inspect(skin, &info), flesh_skin_inspect(again, &info_again);
  CHECK(info.outside > 0 && info.vertices == info_again.vertices && info.outside == info_again.outside);
  CHECK(info.distance_max == info_again.distance_max && info.farthest == info_again.farthest &&
        info.weight_min == info_again.weight_min);
  flesh_skin_destroy(&again);

  CHECK(flesh_skin_read(path, fine, surface, &again) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "binding.txt:2: the binding is for a mesh of 81 nodes and 192 tets; "
                                 "this mesh has 108 and 288");
  CHECK(flesh_skin_read(path, other, surface, &again) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "binding.txt:2: the binding is for another mesh of the same size");
  CHECK(flesh_skin_read(path, mesh, elsewhere, &again) == FLESH_ERR_FILE && !again);
  CHECK_TEXT(flesh_error_text(), "binding.txt:3: the binding is for another surface");

  size_t size;
  char *text = read_bytes(path, &size), *head = malloc(4096);
  int lines = 0, length = 0;
  while (lines < 4) lines += text[length++] == '\n';
  static const struct {
    const char *row, *expected;
  } rows[] = {{"192 1 0 0 0 0\n", "bad.txt:5: vertex 0: the tet is 192; it must be 0 to 191"},
              {"-1 1 0 0 0 0\n", "the tet is -1"},
              {"0 1 0 0 0.5 0\n", "bad.txt:5: vertex 0: the weights sum to 1.5; it must be 1"},
              {"0 1 0 0 nan 0\n", "'nan' is not finite"},
              {"0 1 0 0 0 -1\n", "the distance is -1"},
              {"0 1 0 0 0\n", "bad.txt:5: vertex 0: the row ends too early"},
              {"0 1 0 0 0 0\n", "bad.txt:6: vertex 1: the file ends too early; it has a row per vertex"}};
  for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
    snprintf(head, 4096, "%.*s%s", length, text, rows[k].row);
    CHECK(flesh_skin_read(write_text("bad.txt", head), mesh, surface, &again) == FLESH_ERR_FILE);
    CHECK_TEXT(flesh_error_text(), rows[k].expected);
  }
  CHECK(flesh_skin_read(write_text("bad.txt", "flesh skin 2\n"), mesh, surface, &again) < 0);
  CHECK_TEXT(flesh_error_text(), "bad.txt:1: the binding's version is 2; only 1 can be read");
  CHECK(flesh_skin_read(write_text("bad.txt", "v 0 0 0\n"), mesh, surface, &again) < 0);
  CHECK_TEXT(flesh_error_text(), "bad.txt:1: this is no binding of a skin");
  CHECK(flesh_skin_read(write_bytes("bad.txt", text, size / 2), mesh, surface, &again) < 0);
  text = realloc(text, size + 16);
  strcpy(text + size, "0 1 0 0 0 0\n");
  CHECK(flesh_skin_read(write_text("bad.txt", text), mesh, surface, &again) < 0);
  CHECK_TEXT(flesh_error_text(), "'0' stands behind the last of 300 rows");
  free(text), free(head);
  flesh_skin_destroy(&skin);
  flesh_surface_destroy(&surface), flesh_surface_destroy(&elsewhere);
  flesh_mesh_destroy(&mesh), flesh_mesh_destroy(&other), flesh_mesh_destroy(&fine);
}

/* Five vertices on every boundary triangle, displaced by up to half a millimetre. */
static flesh_surface *refined_boundary(const flesh_mesh *mesh)
{
  int count, corners[3] = {0, 1, 2}, starts[2] = {0, 3};
  const int *triangles = flesh_mesh_surface(mesh, &count);
  double *x = malloc(sizeof *x * 15 * (size_t)count);
  unsigned long long seed = 8;
  flesh_surface *surface = NULL;
  for (int v = 0; v < 5 * count; v++) {
    double a = test_uniform(&seed), b = test_uniform(&seed) * (1 - a), w[3] = {a, b, 1 - a - b};
    for (int d = 0; d < 3; d++) {
      x[3 * v + d] = 1e-3 * (test_uniform(&seed) - 0.5);
      for (int k = 0; k < 3; k++)
        x[3 * v + d] += w[k] * flesh_mesh_positions(mesh)[3 * triangles[3 * (v / 5) + k] + d];
    }
  }
  CHECK_OK(flesh_surface_create(5 * count, x, 1, starts, corners, &surface));
  free(x);
  return surface;
}

/* None is farther from the tet found than it was displaced from its triangle. */
static void fifty_thousand_on_fifty_thousand(void)
{
  flesh_mesh *mesh = read_mesh("../data/meshes/hand_fine.msh");
  flesh_surface *surface = refined_boundary(mesh);
  flesh_skin *skin = NULL;
  flesh_skin_info info;
  CHECK_OK(flesh_skin_bind(mesh, surface, &skin));
  flesh_skin_inspect(skin, &info);
  printf("# %d vertices on %d tets: %d outside, at most %g m\n", info.vertices,
         flesh_mesh_tet_count(mesh), info.outside, info.distance_max);
  CHECK(info.vertices > 50000 && flesh_mesh_tet_count(mesh) > 49000);
  CHECK(info.outside > info.vertices / 4 && info.outside < info.vertices * 3 / 4);
  CHECK_BELOW(info.distance_max, 0.5e-3 * sqrt(3));
  flesh_skin_destroy(&skin);
  flesh_surface_destroy(&surface);
  flesh_mesh_destroy(&mesh);
}

/* A point on the edge that six tets share is equally well in each of them: it is bound to the first, wherever the
 * search begins. */
static void of_equals_the_first_is_taken(void)
{
  flesh_mesh *box = NULL;
  flesh_locator *locator = NULL;
  CHECK_OK(flesh_mesh_box((const int[]){1, 1, 1}, (const double[]){1, 1, 1}, (const double[]){0, 0, 0}, &box));
  CHECK_OK(flesh_locator_create(box, &locator));
  for (int hint = -1; hint < 6; hint++) {
    flesh_place place;
    flesh_locator_find(locator, (const double[]){0.5, 0.5, 0.5}, hint, &place);
    CHECK(place.tet == 0 && place.distance == 0);
  }
  flesh_locator_destroy(&locator);
  flesh_mesh_destroy(&box);
}

int main(int argc, char **argv)
{
  if (!make_work_folder()) return 1;
  return RUN_TESTS(argc, argv, TEST(nearest_tets_are_found), TEST(nodes_are_inside),
                   TEST(weights_sum_to_one_and_give_the_vertex_back),
                   TEST(rigid_motions_move_the_skin_exactly_along),
                   TEST(clamped_weights_only_interpolate),
                   TEST(clamped_shares_are_those_of_the_positive_weights),
                   TEST(bindings_are_saved_and_checked),
                   TEST(of_equals_the_first_is_taken), TEST(fifty_thousand_on_fifty_thousand));
}
