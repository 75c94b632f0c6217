// TEST quick seconds=60
/* test_press_bodies.c: two equal blocks face to face, pressed together by prescribed motion, have the force of one
 * block of their total height, up to the thickness of the barrier between them. Statics, and then every method of fixed
 * steps, which stays in that equilibrium. */
#include "barrier_gap.h"
#include "grids.h"
#include "methods.h"
#include "press.h"

static const double THICKNESS = 0.02, STIFFNESS = 1e5, APART = 0.025, DEPTH = 0.125;

static void raise(const void *height, double x[3]) { x[2] += *(const double *)height; }

/* Blocks of 1 m, the second APART (more than the thickness) above the first, with this many cells along x and y and two
 * along z; one of 2 m if the second has none. */
static flesh_mesh *make_blocks(int first, int second)
{
  const double low = 0, up = 1 + APART;
  flesh_body_part parts[2];
  if (!second) return test_box(first, first, 2, 1, 1, 2);
  return grids_join(grid_of(first, first, 2, raise, &low), grid_of(second, second, 2, raise, &up), parts);
}

/* Returns the downward force of the body on the support of its base. */
static double force_on_base(const test_body *b)
{
  double *r = calloc((size_t)b->n, sizeof *r), sum = 0;
  const flesh_state *s = &b->state;
  const flesh_point point = flesh_point_at(s->t, s->x, s->v, s->v);
  CHECK_OK(flesh_system_residual(b->system, &point, r));
  for (int d = 2; d < b->n; d += 3)
    if (flesh_mesh_positions(b->mesh)[d] < 1e-9) sum += r[d];
  free(r);
  return sum;
}

/* Makes a scene with gliding ends and free sides: the stress is uniform. `keys` must live as long as the body. */
static void make_press(flesh_mesh *mesh, double high, double depth, flesh_keyframe keys[2], test_body *b)
{
  keys[0] = (flesh_keyframe){.t = 0};
  keys[1] = (flesh_keyframe){.t = 1, .translation = {0, 0, -depth}};
  const flesh_motion motion = {.count = 2, .keyframes = keys};
  CHECK_OK(test_body_create(mesh, test_material(FLESH_ENERGY_S, 0.3), 1000, FLESH_MASS_LUMPED, 1, b));
  CHECK_OK(test_body_hold(b, 0, 0, FLESH_AXIS_X, NULL, -INFINITY, INFINITY));
  CHECK_OK(test_body_hold(b, 1, 0, FLESH_AXIS_Y, NULL, -INFINITY, INFINITY));
  CHECK_OK(test_body_hold(b, 2, 0, FLESH_AXIS_Z, NULL, -INFINITY, INFINITY));
  CHECK_OK(test_body_hold(b, 2, high, FLESH_AXIS_Z, &motion, -INFINITY, INFINITY));
}

/* Returns the force of one block, 2 m high, that is shortened by this much. */
static double force_of_one(double depth)
{
  test_body b;
  flesh_keyframe keys[2];
  flesh_solve_stats stats = {0};
  make_press(make_blocks(1, 0), 2, depth, keys, &b);
  CHECK_OK(flesh_system_finalize(b.system));
  solve_statics(&b, 1e-10, 1, &stats);
  const double force = force_on_base(&b);
  test_body_destroy(&b);
  return force;
}

static void press_pair(int first, int second, double thickness, test_body *b, flesh_keyframe keys[2])
{
  flesh_contact_options options;
  flesh_effect *contact = NULL;
  flesh_solve_stats stats = {0};
  make_press(make_blocks(first, second), 2 + APART, DEPTH, keys, b);
  flesh_contact_options_default(&options);
  options.thickness = thickness;
  options.stiffness = STIFFNESS;
  CHECK_OK(flesh_effect_surface_contact(&b->body, &options, 0, NULL, &contact));
  CHECK_OK(flesh_system_add_effect(b->system, &contact));
  CHECK_OK(flesh_system_finalize(b->system));
  solve_statics(b, 1e-10, 1, &stats);
}

/* The force is that of one block with the gap that the barrier's law gives for the pressure. Nodes of rims also have
 * areas of side faces, which here double the total area: the gap is at most that of half the pressure. Forces on nodes
 * that face no node, and those of rims, dent the faces: less than 0.2 % of the force, and less on finer meshes. */
static void two_blocks_are_one_to_the_thickness(void)
{
  const int cells[][2] = {{2, 2}, {2, 3}, {4, 5}};
  const double depth = DEPTH - APART, dents = 2e-3;
  for (int k = 0; k < 3; k++)
    for (double thickness = THICKNESS; thickness > THICKNESS / 20; thickness /= 4) {
      test_body b;
      flesh_keyframe keys[2];
      press_pair(cells[k][0], cells[k][1], thickness, &b, keys);
      const double force = force_on_base(&b), least = force_of_one(depth + barrier_gap(force, STIFFNESS, thickness)),
                   most = force_of_one(depth + barrier_gap(force / 2, STIFFNESS, thickness));
      printf("# %d and %d cells, thickness %g m: %.7g N; one block with the law's gap %.7g N, that of half the pressure "
             "%.7g N\n",
             cells[k][0], cells[k][1], thickness, force, least, most);
      CHECK(force > (1 - dents) * least && force < (1 + dents) * most);
      test_body_destroy(&b);
    }
}

/* An equilibrium of contact is an equilibrium for every method. */
static void every_method_stays_at_rest(void)
{
  for_every_method(method, TEST_FIXED_STEPS | TEST_STATIC) {
    const flesh_solver_options options = test_options(1e-8);
    test_body b;
    flesh_keyframe keys[2];
    flesh_integrator *integrator = NULL;
    press_pair(2, 3, THICKNESS, &b, keys);
    double *x = malloc((size_t)b.n * sizeof *x), most = 0;
    memcpy(x, b.state.x, (size_t)b.n * sizeof *x);
    CHECK_OK(flesh_integrator_create(b.system, method, &options, &integrator));
    for (int step = 0; step < 5; step++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.01, NULL));
    for (int d = 0; d < b.n; d++) most = fmax(most, fabs(b.state.x[d] - x[d]));
    printf("# %s: a node moves by %.2g m\n", flesh_method_name(method), most);
    CHECK_BELOW(most, 1e-6 * DEPTH);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
    free(x);
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(two_blocks_are_one_to_the_thickness), TEST(every_method_stays_at_rest));
}
