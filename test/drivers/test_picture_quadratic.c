// TEST quick needs=drivers
/* test_picture_quadratic.c: pictures of ten-node tets: their curved faces, and which J becomes colours. */
#include "mesh_files.h"

#include "flesh/flesh.h"
#include "picture/picture.h"
#include "picture/picture_body.h"

/* A mid-edge node moved by s along its edge makes J linear in a ten-node tet, 1 +- 4 s at the edge's ends. With s = 0.3
 * a corner has J = -0.2, which no quadrature point sees: the colour is the mean, 1, and nothing is black. With s = 0.6
 * the points see J < 0. */
static void what_no_point_sees_is_not_black(void)
{
  static const int ends[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}}, n[10] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
  double X[30] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, x[30], extremes[2], *values;
  flesh_mesh *mesh;
  for (int k = 0; k < 6; k++)
    for (int d = 0; d < 3; d++) X[3 * (4 + k) + d] = (X[3 * ends[k][0] + d] + X[3 * ends[k][1] + d]) / 2;
  CHECK_OK(flesh_mesh_create_quadratic(10, X, 1, n, NULL, &mesh));
  const flesh_body body = {.mesh = mesh};
  const flesh_picture_panel panel = {.body = &body, .x = x};
  for (int k = 0; k < 2; k++) {
    const double s = 0.3 * (k + 1), apart = sqrt(5) / 5; /* distance of a point from the others along an edge */
    memcpy(x, X, sizeof x);
    x[12] += s;
    CHECK_OK(flesh_picture_values(&panel, FLESH_PICTURE_J, &values, extremes));
    CHECK_NEAR(extremes[0], 1, 1e-14);
    for (int i = 0; i < 10; i++) CHECK_NEAR(values[i], 1, 1e-14);
    free(values);
    CHECK(flesh_picture_is_inverted(&panel) == k);
    CHECK_NEAR(flesh_mesh_jacobians(mesh, x, NULL, NULL, NULL), 1 - 4 * s * apart, 1e-14);
    CHECK_NEAR(flesh_mesh_jacobian_bounds(mesh, x, NULL, NULL, NULL), 1 - 4 * s, 0.05);
  }
  flesh_mesh_destroy(&mesh);
}

/* A ball of 50 ten-node tets, stretched: the curved surface is drawn, with only the mesh's edges. */
static void curved_faces_are_drawn(void)
{
  flesh_mesh *mesh;
  CHECK_OK(flesh_mesh_read("reference/meshes/ball_finer.msh", &mesh));
  int nodes = flesh_mesh_node_count(mesh), triangles, visible = 0;
  (void)flesh_mesh_surface(mesh, &triangles);
  double *x = malloc(3 * sizeof *x * (size_t)nodes);
  for (int i = 0; i < 3 * nodes; i++) x[i] = (i % 3 == 2 ? 2 : 1) * flesh_mesh_positions(mesh)[i];
  flesh_body body = {.mesh = mesh};
  flesh_picture_panel panel = {.body = &body, .x = x};
  flesh_picture_options options;
  flesh_picture_options_default(&options);
  options.field = FLESH_PICTURE_J, options.edges = 1;
  flesh_picture_frame frame = {.low = 0, .high = 4};
  flesh_picture_scene scene;
  CHECK_OK(flesh_picture_scene_make(&panel, &options, &frame, &scene));
  const flesh_render_surface *s = &scene.surfaces[0];
  CHECK(scene.count == 1 && s->triangles == 4 * triangles && s->edges && s->hidden);
  double worst = 0, volume = 0;
  for (int t = 0; t < s->triangles; t++) {
    const double *p[3];
    for (int k = 0; k < 3; k++) {
      p[k] = s->x + 3 * (size_t)s->corners[3 * t + k];
      const double *q = s->rest + 3 * (size_t)s->corners[3 * t + k];
      worst = fmax(worst, fabs(sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]) - 1));
      CHECK_NEAR(p[k][2], 2 * q[2], 1e-14);
      visible += !(s->hidden[t] >> k & 1);
    }
    for (int d = 0; d < 3; d++)
      volume += p[0][d] * (p[1][(d + 1) % 3] * p[2][(d + 2) % 3] - p[1][(d + 2) % 3] * p[2][(d + 1) % 3]) / 6;
  }
  printf("# drawn off the sphere by at most %g, volume %g of %g\n", worst, volume, flesh_mesh_volume(mesh, x));
  CHECK_BELOW(worst, 0.04);
  CHECK_NEAR(volume, flesh_mesh_volume(mesh, x), 0.02 * flesh_mesh_volume(mesh, x)); /* four flat triangles: 6 % */
  CHECK(visible == 12 * triangles / 4);
  flesh_arena_free(&scene.arena);
  options.width = 60;
  CHECK_OK(flesh_picture(in_work_folder("ball.png"), 1, &panel, &options, NULL));
  free(x);
  flesh_mesh_destroy(&mesh);
}

int main(int argc, char **argv)
{
  if (!make_work_folder()) return 1;
  return RUN_TESTS(argc, argv, TEST(what_no_point_sees_is_not_black), TEST(curved_faces_are_drawn));
}
