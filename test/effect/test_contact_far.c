// TEST quick seconds=60
/* test_contact_far.c: boxes reported as far are far from every obstacle; a long capsule keeps faces off its axis all
 * along it. */
#include <stdlib.h>

#include "body.h"
#include "geometry/obstacle_bounds.h"
#include "test.h"

enum { SHAPES = 4 };
static const char *const names[SHAPES] = {"plane", "sphere", "capsule", "mesh"};

static flesh_obstacle *make(int shape)
{
  flesh_obstacle *o = NULL;
  const double a[3] = {-0.4, 0.2, 0.1}, b[3] = {0.7, 0.5, -0.3}, normal[3] = {0.3, -0.2, 0.9};
  if (shape == 0) CHECK_OK(flesh_obstacle_plane(a, normal, &o));
  if (shape == 1) CHECK_OK(flesh_obstacle_sphere(a, 0.5, &o));
  if (shape == 2) CHECK_OK(flesh_obstacle_capsule(a, b, 0.3, &o));
  if (shape == 3) {
    flesh_mesh *box = test_box(3, 2, 2, 1.2, 0.8, 0.5);
    int triangles;
    const int *corners = flesh_mesh_surface(box, &triangles);
    CHECK_OK(flesh_obstacle_mesh(flesh_mesh_node_count(box), flesh_mesh_positions(box), triangles, corners, &o));
    flesh_mesh_destroy(&box);
  }
  return o;
}

/* Random boxes of nodes, still and moving: if reported as far, no node has a barrier and no path between them meets the
 * obstacle; and most boxes that are twice as far are reported. */
static void what_is_far_is_not_felt(void)
{
  enum { NODES = 20, TRIALS = 4000 };
  unsigned long long random = 11;
  int nodes[NODES];
  for (int k = 0; k < NODES; k++) nodes[k] = k;
  for (int shape = 0; shape < SHAPES; shape++) {
    flesh_obstacle *o = make(shape);
    int far = 0, near = 0, missed = 0, ways = 0, wrong = 0;
    for (int trial = 0; trial < TRIALS; trial++) {
      const double size = 0.6 * test_uniform(&random), w = 0.01 + 0.3 * test_uniform(&random);
      double x[2][3 * NODES], y[2][3], clearance = INFINITY;
      flesh_keyframe keys[2] = {{.t = 0}, {.t = 1}};
      for (int k = 0; k < 2; k++)
        for (int c = 0; c < 3; c++) {
          keys[k].rotation[c] = 4 * test_uniform(&random) - 2;
          keys[k].translation[c] = test_uniform(&random) - 0.5;
        }
      const flesh_motion motion = {.count = 2, .keyframes = keys, .centre = {0.1, 0.2, 0.3}};
      if (trial % 2) CHECK_OK(flesh_obstacle_move(o, &motion));
      flesh_frame frame[2];
      flesh_bounds own[2];
      for (int k = 0; k < 2; k++) {
        double middle[3];
        for (int c = 0; c < 3; c++) middle[c] = 4 * test_uniform(&random) - 2;
        for (int d = 0; d < 3 * NODES; d++) x[k][d] = middle[d % 3] + size * (test_uniform(&random) - 0.5);
        flesh_obstacle_frame(o, k, &frame[k]);
        const flesh_bounds world = flesh_bounds_of(NODES, nodes, x[k]);
        own[k] = flesh_bounds_enter(&frame[k], &world);
      }
      const int said = flesh_obstacle_is_far(o, &own[0], w);
      const flesh_bounds both = flesh_bounds_join(&own[0], &own[1]);
      const int no_way = flesh_obstacle_is_far(o, &both, 0);
      for (int n = 0; n < NODES; n++) {
        flesh_barrier barrier, wide;
        for (int k = 0; k < 2; k++) flesh_frame_enter(&frame[k], x[k] + 3 * n, y[k]);
        flesh_obstacle_barrier(o, y[0], w, &barrier);
        flesh_obstacle_barrier(o, y[0], 4 * (w + size), &wide);
        clearance = fmin(clearance, wide.distance);
        wrong += said && barrier.distance < INFINITY;
        wrong += no_way && flesh_obstacle_max_feasible_step(o, y[0], y[1]) < 1;
      }
      far += said;
      ways += no_way;
      near += !said;
      missed += !said && clearance == INFINITY;
      x[0][7] = NAN; /* NaN is not far */
      const flesh_bounds none = flesh_bounds_of(NODES, nodes, x[0]), unknown = flesh_bounds_enter(&frame[0], &none);
      CHECK(!flesh_obstacle_is_far(o, &unknown, w));
    }
    printf("# %s: %d far, %d ways free, %d near, of which %d needlessly; %d wrong\n", names[shape], far, ways, near,
           missed, wrong);
    CHECK(wrong == 0);
    CHECK(far > TRIALS / 20 && near > TRIALS / 20 && ways > TRIALS / 50);
    CHECK(missed == 0);
    flesh_obstacle_destroy(&o);
  }
}

/* A cube moves up through a capsule whose axis crosses the middle of its top face, between all nodes. */
static void long_capsules_stop_faces(void)
{
  const double lengths[] = {3, 30, 300, 900};
  for (int l = 0; l < 4; l++)
    for (int place = 0; place < 7; place++) {
      test_body b;
      flesh_obstacle *o = NULL;
      flesh_effect *effect = NULL;
      CHECK_OK(test_body_create(test_box(1, 1, 1, 1, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000,
                                FLESH_MASS_LUMPED, 0, &b));
      const double radius = 0.02, along = 0.5 - lengths[l] * (0.1 + 0.8 * place / 6.);
      const double ends[2][3] = {{0.6, along, 1.5}, {0.6, along + lengths[l], 1.5}};
      CHECK_OK(flesh_obstacle_capsule(ends[0], ends[1], radius, &o));
      const flesh_contact_options options = {.stiffness = 1e5, .thickness = 0.005, .slip_speed = 1e-3};
      CHECK_OK(flesh_effect_obstacle_contact(&b.body, &options, &o, &effect));
      double *x = malloc((size_t)b.n * sizeof *x);
      for (int d = 0; d < b.n; d++) x[d] = b.state.x[d] + (d % 3 == 2);
      const double fraction = effect->operations->barrier->max_feasible_step(effect, NULL, NULL, 0, b.state.x, 0, x);
      if (place == 3) printf("# %g radii: fraction %.4g\n", lengths[l] / radius, fraction);
      CHECK(fraction < 0.5 && fraction > 0.45);
      CHECK(effect->operations->barrier->tunnelled(effect, 0, b.state.x, 0, x));
      free(x);
      flesh_effect_destroy(&effect);
      test_body_destroy(&b);
    }
  flesh_obstacle *o = NULL;
  CHECK(flesh_obstacle_capsule((const double[]){0, 0, 0}, (const double[]){2000, 0, 0}, 0.01, &o) ==
        FLESH_ERR_ARGUMENT && !o);
  CHECK_TEXT(flesh_error_text(), "2000 m long");
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(what_is_far_is_not_felt), TEST(long_capsules_stop_faces));
}
