// TEST full needs=ranks ranks=1,2,3,5,8
/* test_shared_contact.c: a block that slides on a slope with its contact divided among ranks, or entirely on one of
 * them, and a bar of which one rank has only pinned nodes: within the bounds that hold on one rank. */
#include "ranks.h"

#include "body.h"
#include "effect/effect.h"
#include "geometry/obstacle.h"
#include "time/integrator.h"

/* The whole body, which every rank has, and this rank's part of it. */
typedef struct bodies {
  flesh_mesh *mesh;
  flesh_rank_part *part;
  test_body whole, own;
} bodies;

/* Returns the rank of a tet by the position of its middle along an axis, from 0 to 1. */
typedef int (*cut)(const double middle[3], int count);

static int cut_along_x(const double middle[3], int count) { return (int)(middle[0] * count); }

/* The first rank has the lowest of four layers, on which the block lies. */
static int cut_off_below(const double middle[3], int count)
{
  if (count == 1) return 0;
  return middle[2] < 0.25 ? 0 : 1 + (int)(middle[0] * (count - 1));
}

/* The first rank has an eighth of the bar. */
static int cut_off_the_end(const double middle[3], int count)
{
  if (count == 1) return 0;
  return middle[0] < 0.125 ? 0 : 1 + (int)((middle[0] - 0.125) / 0.875 * (count - 1));
}

static int *assign(const flesh_mesh *mesh, const double size[3], cut rank_of)
{
  const int tets = flesh_mesh_tet_count(mesh), *nodes = flesh_mesh_tets(mesh);
  int *assigned = malloc((size_t)tets * sizeof *assigned);
  for (int t = 0; t < tets; t++) {
    double middle[3] = {0};
    for (int k = 0; k < 12; k++)
      middle[k % 3] += flesh_mesh_positions(mesh)[3 * nodes[4 * t + k / 3] + k % 3] / 4 / size[k % 3];
    assigned[t] = rank_of(middle, flesh_communicator_size(ranks));
  }
  return assigned;
}

static void open_bodies(const int cells[3], const double size[3], flesh_material material, cut rank_of, bodies *b)
{
  *b = (bodies){0};
  CHECK_OK(flesh_mesh_box(cells, size, (const double[]){0, 0, 0}, &b->mesh));
  int *assigned = assign(b->mesh, size, rank_of);
  CHECK_OK(flesh_rank_part_create(ranks, b->mesh, assigned, &b->part));
  free(assigned);
  CHECK_OK(test_body_create(b->mesh, material, 1000, FLESH_MASS_LUMPED, 1, &b->whole));
  CHECK_OK(test_body_create((flesh_mesh *)flesh_rank_part_mesh(b->part), material, 1000, FLESH_MASS_LUMPED, 1, &b->own));
  CHECK_OK(flesh_system_set_part(b->own.system, b->part));
}

static void gravity(bodies *b, const double g[3])
{
  CHECK_OK(test_body_gravity(&b->whole, g[0], g[1], g[2]));
  CHECK_OK(test_body_gravity(&b->own, g[0], g[1], g[2]));
}

static void finish_bodies(bodies *b)
{
  CHECK_OK(flesh_system_finalize(b->whole.system));
  CHECK_OK(flesh_system_finalize(b->own.system));
}

static void close_bodies(bodies *b)
{
  b->own.mesh = NULL; /* the part's */
  test_body_destroy(&b->own);
  test_body_destroy(&b->whole);
  flesh_rank_part_destroy(&b->part);
}

/* A plane with friction beneath both. */
static void add_plane(bodies *b, double z, double friction)
{
  flesh_contact_options options;
  flesh_obstacle *plane = NULL;
  flesh_effect *effect = NULL, *own = NULL;
  flesh_contact_options_default(&options);
  options.thickness = 0.02;
  options.friction = friction;
  options.slip_speed = 1e-3;
  CHECK_OK(flesh_obstacle_plane((const double[]){0, 0, z}, (const double[]){0, 0, 1}, &plane));
  CHECK_OK(flesh_effect_obstacle_contact(&b->whole.body, &options, &plane, &effect));
  CHECK_OK(flesh_effect_private_of(effect)->ranks->restrict_to_part(effect, b->part, &b->own.body, &own));
  CHECK_OK(flesh_system_add_effect(b->own.system, &own));
  CHECK_OK(flesh_system_add_effect(b->whole.system, &effect));
}

/* Computes mean position and velocity along x of the whole. */
static void middle_of(const bodies *b, double *x, double *v)
{
  const int n = b->whole.n;
  *x = *v = 0;
  CHECK_OK(flesh_rank_part_gather(b->part, b->own.state.x, b->whole.state.x));
  CHECK_OK(flesh_rank_part_gather(b->part, b->own.state.v, b->whole.state.v));
  for (int d = 0; d < n; d += 3) *x += 3 * b->whole.state.x[d] / n, *v += 3 * b->whole.state.v[d] / n;
}

static void step(flesh_integrator *integrator, bodies *b, int steps)
{
  int status = FLESH_OK;
  for (int k = 0; k < steps && !status; k++) status = flesh_integrator_step(integrator, &b->own.state, 1. / 60, NULL);
  CHECK_OK(status);
}

/* Slides on a slope of this angle: computes the displacement between .5 and 1 s, and the acceleration. */
static void slide(cut rank_of, double angle, double friction, flesh_method method, double *way, double *acceleration)
{
  bodies b;
  flesh_material material;
  flesh_integrator *settling = NULL, *integrator = NULL;
  const flesh_solver_options options = test_options(1e-6);
  double x[2], v[2];
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e7, 0.45, &material));
  open_bodies((const int[]){8, 2, 4}, (const double[]){2, 0.5, 0.5}, material, rank_of, &b);
  add_plane(&b, -0.0197, friction);
  gravity(&b, (const double[]){9.81 * sin(angle), 0, -9.81 * cos(angle)});
  finish_bodies(&b);
  CHECK_OK(flesh_integrator_create(b.own.system, FLESH_METHOD_BACKWARD_EULER, &options, &settling));
  step(settling, &b, 60);
  CHECK_OK(flesh_integrator_create(b.own.system, method, &options, &integrator));
  step(integrator, &b, 30);
  middle_of(&b, &x[0], &v[0]);
  step(integrator, &b, 30);
  middle_of(&b, &x[1], &v[1]);
  *way = x[1] - x[0];
  *acceleration = (v[1] - v[0]) / 0.5;
  flesh_integrator_destroy(&settling);
  flesh_integrator_destroy(&integrator);
  close_bodies(&b);
}

/* The block behaves as on one rank (test_contact_motion): it sticks below mu, and slips above with g (sin - mu cos), to
 * 1 %. */
static void check_coulomb(cut rank_of, flesh_method method)
{
  const double g = 9.81, mu = 0.5, far = atan(2 * mu), fast = g * (sin(far) - mu * cos(far));
  double way, acceleration;
  slide(rank_of, atan(0.99 * mu), mu, method, &way, &acceleration);
  CHECK(way < 1e-3 * 0.5);
  slide(rank_of, far, mu, method, &way, &acceleration);
  CHECK_NEAR(acceleration, fast, 0.01 * fast);
  if (flesh_communicator_rank(ranks) == 0)
    printf("# method %d, tan = 2 mu: %.6g m/s^2, expected %.6g\n", (int)method, acceleration, fast);
}

static void a_cut_goes_through_the_contact(void)
{
  check_coulomb(cut_along_x, FLESH_METHOD_BACKWARD_EULER);
  check_coulomb(cut_along_x, FLESH_METHOD_BDF2);
}

static void one_rank_has_all_of_the_contact(void) { check_coulomb(cut_off_below, FLESH_METHOD_BACKWARD_EULER); }

/* Nothing moves in the first rank's part of the bar. */
static void a_rank_has_a_pinned_part_only(void)
{
  static const flesh_method methods[] = {FLESH_METHOD_STATIC, FLESH_METHOD_BACKWARD_EULER, FLESH_METHOD_MIDPOINT,
                                         FLESH_METHOD_NEWMARK, FLESH_METHOD_BDF2, FLESH_METHOD_HHT,
                                         FLESH_METHOD_GENERALIZED_ALPHA};
  for (size_t k = 0; k < sizeof methods / sizeof *methods; k++) {
    bodies b;
    test_body *both[2];
    const flesh_solver_options options = test_options(1e-10);
    open_bodies((const int[]){16, 2, 2}, (const double[]){2, 0.25, 0.25}, test_material(FLESH_ENERGY_S, 0.4), cut_off_the_end,
                &b);
    gravity(&b, (const double[]){0, 1, -5});
    both[0] = &b.whole, both[1] = &b.own;
    for (int s = 0; s < 2; s++) CHECK_OK(test_body_clamp(both[s], 0.25));
    finish_bodies(&b);
    for (int s = 0; s < 2; s++) {
      flesh_integrator *integrator = NULL;
      CHECK_OK(flesh_integrator_create(both[s]->system, methods[k], &options, &integrator));
      for (int i = 0; i < (methods[k] == FLESH_METHOD_STATIC ? 1 : 6); i++)
        CHECK_OK(flesh_integrator_step(integrator, &both[s]->state, 1. / 60, NULL));
      flesh_integrator_destroy(&integrator);
    }
    double *gathered = malloc((size_t)b.whole.n * sizeof *gathered), deflection = 0, worst = 0;
    CHECK_OK(flesh_rank_part_gather(b.part, b.own.state.x, gathered));
    for (int d = 0; d < b.whole.n; d++) {
      worst = fmax(worst, fabs(gathered[d] - b.whole.state.x[d]));
      deflection = fmax(deflection, fabs(b.whole.state.x[d] - flesh_mesh_positions(b.mesh)[d]));
    }
    CHECK_BELOW(worst, 1e-7 * deflection);
    CHECK(deflection > 1e-3);
    free(gathered);
    close_bodies(&b);
  }
}

/* Remaining clearance also spares ranks the computation of feasible steps. */
static void what_is_far_limits_no_step(void)
{
  bodies b;
  flesh_integrator *integrator = NULL;
  const flesh_solver_options options = test_options(1e-6);
  open_bodies((const int[]){8, 2, 4}, (const double[]){2, 0.5, 0.5}, test_material(FLESH_ENERGY_S, 0.3), cut_along_x, &b);
  add_plane(&b, -100, 0);
  gravity(&b, (const double[]){0, 0, -10});
  finish_bodies(&b);
  CHECK_OK(flesh_integrator_create(b.own.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  step(integrator, &b, 3);
  const flesh_clearance *clearance = &integrator->evaluation->clearance;
  CHECK(clearance->stays_far && clearance->moved_most > 0 && clearance->moved_most < clearance->least_left);
  flesh_integrator_destroy(&integrator);
  close_bodies(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS_ON_RANKS(argc, argv, TEST(a_cut_goes_through_the_contact), TEST(one_rank_has_all_of_the_contact),
                            TEST(a_rank_has_a_pinned_part_only), TEST(what_is_far_limits_no_step));
}
