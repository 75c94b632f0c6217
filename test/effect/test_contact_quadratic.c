// TEST full memory seconds=60
/* test_contact_quadratic.c: contact and friction of ten-node tets, whose faces are four triangles each: the nodes'
 * shares add up to the area, and blocks rest and slide as they should. */
#include "body.h"
#include "test.h"

/* Makes a cube of side 1 m of tets of `order`. */
static void make(int cells, int order, int inertia, double poisson, test_body *b)
{
  flesh_mesh *mesh = test_box(cells, cells, cells, 1, 1, 1), *raised;
  if (order == 2) {
    CHECK_OK(flesh_mesh_raise_order(mesh, &raised));
    flesh_mesh_destroy(&mesh);
    mesh = raised;
  }
  CHECK_OK(test_body_create(mesh, test_material(FLESH_ENERGY_S, poisson), 1000, FLESH_MASS_LUMPED, inertia, b));
}

static void add_floor(test_body *b, double z, double friction)
{
  flesh_contact_options options;
  flesh_obstacle *floor = NULL;
  flesh_effect *effect = NULL;
  flesh_contact_options_default(&options);
  options.thickness = 0.03;
  options.friction = friction;
  CHECK_OK(flesh_obstacle_plane((const double[]){0, 0, z}, (const double[]){0, 0, 1}, &floor));
  CHECK_OK(flesh_effect_obstacle_contact(&b->body, &options, &floor, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
}

/* At a uniform distance forces are proportional to areas: that of the bottom, and half of the lowest row of triangles
 * of the four sides, which are half as high at order 2. Each node bears a share. */
static void areas_add_up(void)
{
  double total[2];
  for (int order = 1; order <= 2; order++) {
    test_body b;
    make(2, order, 0, 0.45, &b);
    add_floor(&b, -0.01, 0);
    const flesh_effect *contact = flesh_system_effect(b.system, 1);
    double *r = calloc((size_t)b.n, sizeof *r);
    const flesh_point point = flesh_point_at(0, b.state.x, b.state.v, b.state.v);
    CHECK_OK(contact->operations->residual(contact, &point, r));
    total[order - 1] = 0;
    for (int i = 0; i < b.n / 3; i++) {
      if (flesh_mesh_positions(b.mesh)[3 * i + 2] == 0) CHECK(r[3 * i + 2] < 0);
      else CHECK(r[3 * i + 2] == 0);
      total[order - 1] -= r[3 * i + 2];
    }
    total[order - 1] /= 1 + 4 * (0.5 / order) / 2; /* m^2 */
    free(r);
    test_body_destroy(&b);
  }
  printf("# %.12g Pa and %.12g Pa\n", total[0], total[1]);
  CHECK(total[0] > 1);
  CHECK_NEAR(total[1], total[0], 1e-12 * total[0]);
}

/* Computes the mean velocity along x, m/s, at 1 and 2 s of a block on a slope of tan 0.3, with friction, and its
 * displacement in 2 s, m. */
static double slide(double friction, double speed[2])
{
  test_body b;
  flesh_effect *effect = NULL;
  flesh_integrator *integrator = NULL;
  const flesh_solver_options options = test_options(1e-6);
  const double slope = atan(0.3);
  make(2, 2, 1, 0.45, &b);
  CHECK_OK(test_body_gravity(&b, 9.81 * sin(slope), 0, -9.81 * cos(slope)));
  CHECK_OK(flesh_effect_viscosity(&b.body, 2000, 2000, &effect));
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  add_floor(&b, -0.01, friction);
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  double *mass = malloc((size_t)b.n / 3 * sizeof *mass), whole = 0, way = 0;
  flesh_mesh_lumped_mass(b.mesh, b.density, mass);
  for (int i = 0; i < b.n / 3; i++) whole += mass[i];
  for (int k = 1; k <= 240; k++) {
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 120, NULL));
    for (int i = 0; i < b.n / 3 && k % 120 == 0; i++) {
      if (!i) speed[k / 120 - 1] = 0;
      speed[k / 120 - 1] += mass[i] / whole * b.state.v[3 * i];
    }
  }
  CHECK(flesh_mesh_jacobians(b.mesh, b.state.x, NULL, NULL, NULL) > 0.5);
  for (int i = 0; i < b.n / 3; i++) way += mass[i] / whole * (b.state.x[3 * i] - flesh_mesh_positions(b.mesh)[3 * i]);
  free(mass);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return way;
}

static void blocks_rest_and_slide(void)
{
  double speed[2];
  const double slope = atan(0.3);
  /* It vibrates about its sheared position, and creeps at the slip speed at most. */
  const double swayed = 1000 * 9.81 * sin(slope) / (2 * 1e5 / 2.9), way = slide(0.5, speed);
  printf("# sticks: %.3g m after 2 s, where shear alone would take it %.3g m\n", way, swayed);
  CHECK(way > 0 && way < 2 * swayed + 2 * 1e-3);
  for (int k = 0; k < 2; k++) {
    const double friction = 0.15 * k, wanted = 9.81 * (sin(slope) - friction * cos(slope));
    slide(friction, speed);
    printf("# friction %g: accelerates by %.5g m/s^2 of %.5g\n", friction, speed[1] - speed[0], wanted);
    CHECK_NEAR(speed[1] - speed[0], wanted, 0.02 * wanted);
  }
}

/* Computes the position after 0.5 s of a nearly incompressible cube thrown obliquely on a floor, where it sticks and
 * slides: the volume projection also works in systems stiffened by contact. */
static void throw_cube(flesh_preconditioner kind, flesh_solve_stats *stats, double *x)
{
  test_body b;
  flesh_solver_options options = test_options(1e-8);
  flesh_integrator *integrator = NULL;
  options.preconditioner = kind;
  make(4, 2, 1, 0.499, &b);
  add_floor(&b, -0.05, 0.4);
  CHECK_OK(test_body_gravity(&b, 0, 0, -9.81));
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  for (int d = 0; d < b.n; d += 3) b.state.v[d] = 1, b.state.v[d + 2] = -1;
  for (int k = 0; k < 30; k++) {
    flesh_solve_stats step = {0};
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 60, &step));
    stats->newton += step.newton;
    stats->linear += step.linear;
  }
  memcpy(x, b.state.x, (size_t)b.n * sizeof *x);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

static void projections_land_where_grids_do(void)
{
  enum { NODES = 729 };
  static double x[2][3 * NODES];
  flesh_solve_stats stats[2] = {{0}};
  double apart = 0, moved = 0;
  throw_cube(FLESH_PRECONDITIONER_TWO_LEVEL, &stats[0], x[0]);
  throw_cube(FLESH_PRECONDITIONER_VOLUME_PROJECTION, &stats[1], x[1]);
  for (int d = 0; d < 3 * NODES; d++) {
    apart = fmax(apart, fabs(x[0][d] - x[1][d]));
    moved = fmax(moved, x[1][d]);
  }
  for (int k = 0; k < 2; k++)
    printf("# %s: %d Newton, %d linear iterations\n", k ? "projected" : "two levels", (int)stats[k].newton,
           (int)stats[k].linear);
  printf("# up to %.4g m, %.2g m apart\n", moved, apart);
  CHECK(moved > 1.1); /* it has slid */
  CHECK_BELOW(apart, 1e-6);
  CHECK_BELOW(stats[1].linear, 12 * stats[1].newton);
  CHECK_BELOW(3 * stats[1].linear, stats[0].linear);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(areas_add_up), TEST(blocks_rest_and_slide),
                   TEST(projections_land_where_grids_do));
}
