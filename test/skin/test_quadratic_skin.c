// TEST quick
/* test_quadratic_skin.c: skins on ten-node tets: they follow curved edges, at rest and deformed. */
#include "mesh_files.h"

#include <math.h>

#include "flesh/flesh.h"

/* A smooth quadratic map of space, moderate on the unit cube. */
static void bend(const double X[3], double x[3])
{
  x[0] = X[0] + 0.15 * X[1] * X[1] - 0.1 * X[0] * X[2];
  x[1] = 0.9 * X[1] + 0.12 * X[0] * X[0] + 0.05 * X[2] * X[2];
  x[2] = X[2] + 0.1 * X[0] * X[1] - 0.08 * X[2] * X[2];
}

/* Makes a unit cube of ten-node tets; `curved`: mapped. */
static flesh_mesh *cube(int cells, int curved)
{
  flesh_mesh *box, *straight, *mesh;
  CHECK_OK(flesh_mesh_box((int[]){cells, cells, cells}, (double[]){1, 1, 1}, (double[]){0, 0, 0}, &box));
  CHECK_OK(flesh_mesh_raise_order(box, &straight));
  flesh_mesh_destroy(&box);
  if (!curved) return straight;
  int nodes = flesh_mesh_node_count(straight), tets = flesh_mesh_tet_count(straight);
  double *x = malloc(3 * (size_t)nodes * sizeof *x);
  int *ten = malloc(10 * (size_t)tets * sizeof *ten);
  for (int n = 0; n < nodes; n++) bend(flesh_mesh_positions(straight) + 3 * n, x + 3 * n);
  for (int t = 0; t < tets; t++) {
    memcpy(ten + 10 * t, flesh_mesh_tets(straight) + 4 * t, 4 * sizeof *ten);
    memcpy(ten + 10 * t + 4, flesh_mesh_tet_edges(straight) + 6 * t, 6 * sizeof *ten);
  }
  CHECK_OK(flesh_mesh_create_quadratic(nodes, x, tets, ten, NULL, &mesh));
  free(x), free(ten);
  flesh_mesh_destroy(&straight);
  return mesh;
}

/* Makes single triangles with the given corners [3*count]. */
static flesh_surface *surface_of(int count, const double *x)
{
  int *corners = malloc(sizeof *corners * (size_t)count), *starts = malloc(sizeof *starts * ((size_t)count / 3 + 1));
  flesh_surface *surface = NULL;
  for (int v = 0; v < count; v++) corners[v] = v;
  for (int f = 0; f <= count / 3; f++) starts[f] = 3 * f;
  CHECK_OK(flesh_surface_create(count, x, count / 3, starts, corners, &surface));
  free(corners), free(starts);
  return surface;
}

/* Returns the largest distance of the skin's vertices from y [3*count] with the nodes at x. */
static double off_by(const flesh_skin *skin, int count, const double *x, const double *y)
{
  double *at = malloc(3 * sizeof *at * (size_t)count), worst = 0;
  flesh_skin_apply(skin, 3, 0, x, at);
  for (int i = 0; i < 3 * count; i++) worst = fmax(worst, fabs(at[i] - y[i]));
  free(at);
  return worst;
}

/* Points in the cube, and their images under the map: a quadratic motion is followed exactly, which four nodes cannot
 * do. */
static void quadratic_motions_are_followed_exactly(void)
{
  enum { COUNT = 300 };
  double X[3 * COUNT], y[3 * COUNT];
  unsigned long long seed = 2;
  for (int i = 0; i < 3 * COUNT; i++) X[i] = test_uniform(&seed);
  for (int v = 0; v < COUNT; v++) bend(X + 3 * v, y + 3 * v);
  flesh_surface *surface = surface_of(COUNT, X);
  flesh_mesh *mesh = cube(2, 0), *moved = cube(2, 1), *lowered, *lowered_moved;
  flesh_skin *skin, *linear;
  flesh_skin_info info;
  CHECK_OK(flesh_skin_bind(mesh, surface, &skin));
  flesh_skin_inspect(skin, &info);
  CHECK(info.outside == 0);
  CHECK_BELOW(off_by(skin, COUNT, flesh_mesh_positions(mesh), X), 4e-16);
  CHECK_BELOW(off_by(skin, COUNT, flesh_mesh_positions(moved), y), 1e-15);
  CHECK_OK(flesh_mesh_lower_order(mesh, &lowered));
  CHECK_OK(flesh_mesh_lower_order(moved, &lowered_moved));
  CHECK_OK(flesh_skin_bind(lowered, surface, &linear));
  CHECK(off_by(linear, COUNT, flesh_mesh_positions(lowered_moved), y) > 0.005);
  flesh_skin_destroy(&skin), flesh_skin_destroy(&linear);
  flesh_surface_destroy(&surface);
  flesh_mesh_destroy(&mesh), flesh_mesh_destroy(&moved);
  flesh_mesh_destroy(&lowered), flesh_mesh_destroy(&lowered_moved);
}

/* Points of the curved body are found inside it, at their origin, and are followed back to the straight cube. */
static void points_of_curved_tets_are_found(void)
{
  enum { COUNT = 300 };
  double X[3 * COUNT], y[3 * COUNT];
  unsigned long long seed = 4;
  for (int i = 0; i < 3 * COUNT; i++) X[i] = test_uniform(&seed);
  for (int v = 0; v < COUNT; v++) bend(X + 3 * v, y + 3 * v);
  flesh_surface *surface = surface_of(COUNT, y);
  flesh_mesh *mesh = cube(2, 0), *curved = cube(2, 1);
  flesh_skin *skin, *again;
  flesh_skin_info info;
  CHECK_OK(flesh_skin_bind(curved, surface, &skin));
  flesh_skin_inspect(skin, &info);
  CHECK(info.outside == 0 && info.weight_min > -1e-12);
  CHECK_BELOW(off_by(skin, COUNT, flesh_mesh_positions(curved), y), 2e-14);
  CHECK_BELOW(off_by(skin, COUNT, flesh_mesh_positions(mesh), X), 5e-14);
  /* A skin saved and read back is the same, for this mesh only. */
  CHECK_OK(flesh_skin_write(skin, in_work_folder("skin")));
  CHECK_OK(flesh_skin_read(in_work_folder("skin"), curved, surface, &again));
  CHECK(!memcmp(flesh_skin_weights(skin), flesh_skin_weights(again), 4 * COUNT * sizeof(double)));
  CHECK(off_by(again, COUNT, flesh_mesh_positions(mesh), X) == off_by(skin, COUNT, flesh_mesh_positions(mesh), X));
  flesh_skin_destroy(&again);
  CHECK(flesh_skin_read(in_work_folder("skin"), mesh, surface, &again) == FLESH_ERR_FILE);
  flesh_skin_destroy(&skin);
  flesh_surface_destroy(&surface);
  flesh_mesh_destroy(&mesh), flesh_mesh_destroy(&curved);
}

/* Makes evenly spread directions (Fibonacci's spiral), and their points at a radius. */
static void on_sphere(int count, double radius, double *x)
{
  for (int v = 0; v < count; v++) {
    double z = 1 - (2 * v + 1.) / count, angle = 2.399963229728653 * v;
    x[3 * v] = radius * sqrt(1 - z * z) * cos(angle);
    x[3 * v + 1] = radius * sqrt(1 - z * z) * sin(angle);
    x[3 * v + 2] = radius * z;
  }
}

/* Around a ball of curved tets: the skin's vertices are reproduced at rest, and follow an affine motion, inside and
 * outside; those on the sphere are near its curved faces, but far from flat ones. */
static void vertices_outside_are_continued(void)
{
  enum { COUNT = 600 };
  static const double radii[4] = {0.9, 0.999, 1, 1.1};
  double x[3 * COUNT], y[3 * COUNT];
  flesh_mesh *mesh, *flat;
  CHECK_OK(flesh_mesh_read("reference/meshes/ball_finer.msh", &mesh));
  CHECK_OK(flesh_mesh_lower_order(mesh, &flat));
  int nodes = flesh_mesh_node_count(mesh);
  double *moved = malloc(3 * sizeof *moved * (size_t)nodes);
  const double A[9] = {1.2, 0.3, -0.1, 0.05, 0.8, 0.2, -0.3, 0.1, 1.5}, *X = flesh_mesh_positions(mesh);
  for (int n = 0; n < nodes; n++)
    for (int d = 0; d < 3; d++)
      moved[3 * n + d] = 5 + A[3 * d] * X[3 * n] + A[3 * d + 1] * X[3 * n + 1] + A[3 * d + 2] * X[3 * n + 2];
  for (int r = 0; r < 4; r++) {
    on_sphere(COUNT, radii[r], x);
    for (int v = 0; v < COUNT; v++)
      for (int d = 0; d < 3; d++)
        y[3 * v + d] = 5 + A[3 * d] * x[3 * v] + A[3 * d + 1] * x[3 * v + 1] + A[3 * d + 2] * x[3 * v + 2];
    flesh_surface *surface = surface_of(COUNT, x);
    flesh_skin *skin = NULL, *of_flat = NULL;
    flesh_skin_info info, flat_info;
    CHECK_OK(flesh_skin_bind(mesh, surface, &skin));
    CHECK_OK(flesh_skin_bind(flat, surface, &of_flat));
    flesh_skin_inspect(skin, &info);
    flesh_skin_inspect(of_flat, &flat_info);
    printf("# radius %g: %d outside, at most %g m; of flat faces %d, %g m\n", radii[r], info.outside,
           info.distance_max, flat_info.outside, flat_info.distance_max);
    CHECK(r ? info.outside > 0 : info.outside < flat_info.outside / 10);
    if (r == 2) CHECK(info.distance_max < 0.25 * flat_info.distance_max);
    if (r == 3) CHECK(info.outside == COUNT && info.distance_max > 0.1 && info.distance_max < 0.16);
    CHECK_BELOW(off_by(skin, COUNT, X, x), 1e-11);
    CHECK_BELOW(off_by(skin, COUNT, moved, y), 1e-10);
    flesh_skin_destroy(&skin), flesh_skin_destroy(&of_flat);
    flesh_surface_destroy(&surface);
  }
  /* Far away no tet can be extrapolated, or one can, and then reproduces the point. */
  on_sphere(COUNT, 40, x);
  flesh_surface *surface = surface_of(COUNT, x);
  flesh_skin *skin = NULL;
  int status = flesh_skin_bind(mesh, surface, &skin);
  if (status) CHECK_TEXT(flesh_error_text(), "of the skin is too far outside the body");
  else CHECK_BELOW(off_by(skin, COUNT, X, x), 1e-9);
  flesh_skin_destroy(&skin);
  flesh_surface_destroy(&surface);
  free(moved);
  flesh_mesh_destroy(&mesh), flesh_mesh_destroy(&flat);
}

static void clamped_values_stay_in_range(void)
{
  enum { COUNT = 300 };
  double x[3 * COUNT], value[COUNT];
  unsigned long long seed = 8;
  for (int i = 0; i < 3 * COUNT; i++) x[i] = -0.3 + 1.6 * test_uniform(&seed);
  flesh_surface *surface = surface_of(COUNT, x);
  flesh_mesh *mesh = cube(2, 0);
  flesh_skin *skin;
  CHECK_OK(flesh_skin_bind(mesh, surface, &skin));
  int nodes = flesh_mesh_node_count(mesh), beyond = 0;
  double *field = malloc(sizeof *field * (size_t)nodes);
  for (int n = 0; n < nodes; n++) field[n] = n % 2;
  flesh_skin_apply(skin, 1, 0, field, value);
  for (int v = 0; v < COUNT; v++) beyond += value[v] < 0 || value[v] > 1;
  flesh_skin_apply(skin, 1, 1, field, value);
  for (int v = 0; v < COUNT; v++) CHECK(value[v] >= 0 && value[v] <= 1);
  CHECK(beyond > 20);
  free(field);
  flesh_skin_destroy(&skin);
  flesh_surface_destroy(&surface);
  flesh_mesh_destroy(&mesh);
}

int main(int argc, char **argv)
{
  if (!make_work_folder()) return 1;
  return RUN_TESTS(argc, argv, TEST(quadratic_motions_are_followed_exactly), TEST(points_of_curved_tets_are_found),
                   TEST(vertices_outside_are_continued), TEST(clamped_values_stay_in_range));
}
