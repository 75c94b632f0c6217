// TEST quick seconds=60
/* test_joint.c: ball joints and hinges: which rotations are free, momenta, and the period of a pendulum. */
#include <stdlib.h>

#include "body.h"
#include "flesh/effects.h"
#include "methods.h"
#include "test.h"

/* Two blocks, of 1 m each, with a gap of 0.2 m from z = 1; the joint is in the middle of the gap. */
static const double middle[3] = {0.5, 0.5, 1.1};

static void make(double young, int inertia, test_body *b)
{
  flesh_mesh *part[2] = {NULL}, *mesh = NULL;
  flesh_material material;
  double X[2 * 27 * 3];
  int tets[2 * 48 * 4];
  for (int k = 0; k < 2; k++) {
    CHECK_OK(flesh_mesh_box((int[]){2, 2, 2}, (double[]){1, 1, 1}, (double[]){0, 0, 1.2 * k}, &part[k]));
    memcpy(X + 81 * k, flesh_mesh_positions(part[k]), 81 * sizeof *X);
    for (int i = 0; i < 192; i++) tets[192 * k + i] = 27 * k + flesh_mesh_tets(part[k])[i];
    flesh_mesh_destroy(&part[k]);
  }
  CHECK_OK(flesh_mesh_create(54, X, 96, tets, NULL, &mesh));
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, young, 0.3, &material));
  CHECK_OK(test_body_create(mesh, material, 1000, FLESH_MASS_LUMPED, inertia, b));
}

/* Joins the lower block's upper half and the upper one's lower half. */
static flesh_effect *join(const test_body *b, const double axis[3], double stiffness)
{
  int nodes[2][18];
  flesh_effect *effect = NULL;
  for (int k = 0; k < 18; k++) nodes[0][k] = 9 + k, nodes[1][k] = 27 + k;
  CHECK_OK(flesh_effect_joint(&b->body, (flesh_nodes){18, nodes[0]}, (flesh_nodes){18, nodes[1]}, middle, axis, stiffness, &effect));
  return effect;
}

/* Returns the energy after the upper block has turned by an angle about the axis `a` (0 x, 1 y, 2 z) through the
 * middle. */
static double energy_of_turn(test_body *b, const flesh_effect *effect, int a, double angle)
{
  const double *X = flesh_mesh_positions(b->mesh);
  const int p = (a + 1) % 3, q = (a + 2) % 3;
  double energy;
  const flesh_point point = flesh_point_at(0, b->state.x, NULL, NULL);
  for (int i = 0; i < b->n / 3; i++) {
    double d[3];
    for (int c = 0; c < 3; c++) d[c] = X[3 * i + c] - middle[c];
    const double turned = i < 27 ? 0 : angle;
    b->state.x[3 * i + a] = middle[a] + d[a];
    b->state.x[3 * i + p] = middle[p] + cos(turned) * d[p] - sin(turned) * d[q];
    b->state.x[3 * i + q] = middle[q] + sin(turned) * d[p] + cos(turned) * d[q];
  }
  CHECK_OK(effect->operations->energy(effect, &point, &energy));
  return energy;
}

static void joints_turn_where_they_should(void)
{
  test_body b;
  const double k = 5000, length = 0.3;
  make(1e5, 0, &b);
  flesh_effect *ball = join(&b, NULL, k), *hinge = join(&b, (double[]){0, length, 0}, k);
  for (int a = 0; a < 3; a++) {
    const double free = energy_of_turn(&b, ball, a, 1.3), held = energy_of_turn(&b, hinge, a, 1.3);
    /* Ends at half of the length move along chords: 2 * (k/2)/2 * (length sin(angle/2))^2. */
    const double wanted = a == 1 ? 0 : k / 2 * pow(length * sin(0.65), 2);
    printf("# about %c: ball %.3g J, hinge %.6g J of %.6g J\n", 'x' + a, free, held, wanted);
    CHECK_BELOW(fabs(free), 1e-9 * k);
    CHECK_NEAR(held, wanted, 1e-9 * k);
  }
  /* Separated by 0.1 m. */
  energy_of_turn(&b, ball, 0, 0);
  for (int d = 81; d < b.n; d += 3) b.state.x[d] += 0.1;
  double energy;
  const flesh_point point = flesh_point_at(0, b.state.x, NULL, NULL);
  CHECK_OK(ball->operations->energy(ball, &point, &energy));
  CHECK_NEAR(energy, k / 2 * 0.01, 1e-9 * k);
  flesh_effect_destroy(&ball);
  flesh_effect_destroy(&hinge);
  test_body_destroy(&b);
}

static void forces_and_torques_balance(void)
{
  for (int kind = 0; kind < 2; kind++) {
    test_body b;
    double sums[6];
    flesh_derivative_report report;
    make(1e5, 0, &b);
    flesh_effect *effect = join(&b, kind ? (double[]){0.2, 0.1, -0.3} : NULL, 700);
    test_jitter(b.n, 0.3, 5, b.state.x);
    double *r = calloc((size_t)b.n, sizeof *r);
    const flesh_point point = flesh_point_at(0, b.state.x, NULL, NULL);
    CHECK_OK(effect->operations->residual(effect, &point, r));
    const double size = test_sums(&b, r, sums);
    CHECK(size > 1);
    for (int c = 0; c < 6; c++) CHECK_BELOW(fabs(sums[c]), 1e-12 * size);
    CHECK_OK(flesh_effect_check_derivatives(effect, b.mesh, 0, b.state.x, 3, &report));
    CHECK(flesh_derivative_report_passes(&report, 1e-8));
    free(r);
    flesh_effect_destroy(&effect);
    test_body_destroy(&b);
  }
}

/* The lower block hangs from the upper one, which is held: the period of small oscillations about the middle of a stiff
 * cube's hinge is 2 pi sqrt(I / (m g l)), l = 0.6 m, with the moment of inertia I of the lumped masses. Backward Euler
 * reduces the amplitude by 1/sqrt(1 + (w h)^2) in each step. */
static void check_pendulum(flesh_method method)
{
  test_body b;
  const double g = 9.81, tilt = 0.02, l = 0.6;
  make(1e8, 1, &b);
  const double *X = flesh_mesh_positions(b.mesh);
  double *mass = malloc((size_t)b.n * sizeof *mass), I = 0, m = 0, angle = 0;
  flesh_mesh_lumped_mass(b.mesh, b.density, mass);
  for (int i = 0; i < 27; i++) {
    const double dx = X[3 * i] - middle[0], dz = X[3 * i + 2] - middle[2];
    I += mass[i] * (dx * dx + dz * dz), m += mass[i];
    b.state.x[3 * i] = middle[0] + cos(tilt) * dx - sin(tilt) * dz;
    b.state.x[3 * i + 2] = middle[2] + sin(tilt) * dx + cos(tilt) * dz;
  }
  flesh_effect *effect = join(&b, (double[]){0, 0.5, 0}, 1e8);
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  CHECK_OK(test_body_gravity(&b, 0, 0, -g));
  int held[27];
  for (int k = 0; k < 27; k++) held[k] = 27 + k;
  CHECK_OK(flesh_system_add_pin(b.system, 27, held, FLESH_AXES_ALL, -INFINITY, INFINITY));
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_solver_options options = test_options(1e-9);
  flesh_integrator *integrator = NULL;
  CHECK_OK(flesh_integrator_create(b.system, method, &options, &integrator));
  const double period = 2 * acos(-1) * sqrt(I / (m * g * l));
  for (int s = 0; s < 100; s++) CHECK_OK(flesh_integrator_step(integrator, &b.state, period / 100, NULL));
  const double *low = b.state.x, *high = b.state.x + 3 * 18; /* one above the other at rest */
  angle = -atan2(high[0] - low[0], high[2] - low[2]);
  const double kept = flesh_method_order(method) == 1 ? pow(1 + pow(2 * acos(-1) / 100, 2), -50) : 1;
  printf("# %s: after a period of %.4f s it is back at %.6f of %.6f\n", flesh_method_name(method), period, angle, tilt);
  CHECK_NEAR(angle, kept * tilt, 5e-3 * tilt);
  CHECK_BELOW(flesh_integrator_energy_balance(integrator)->gain, 1e-2);
  free(mass);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

static void a_hanging_block_swings_as_a_pendulum(void)
{
  for_every_method(method, TEST_FIXED_STEPS) check_pendulum(method);
}

/* Between the halves of a block some 4e6 m from the origin: separated by 1/8 m, with the same accuracy as near it. */
static void joints_hold_far_from_the_origin(void)
{
  const double at[3] = {1048576, -3145728, 2097152}, point[3] = {at[0] + 0.75, at[1] + 0.25, at[2] + 0.5}, k = 2e4;
  flesh_mesh *mesh = NULL;
  flesh_material material;
  flesh_effect *effect = NULL;
  test_body b;
  int nodes[36];
  for (int i = 0; i < 36; i++) nodes[i] = i;
  CHECK_OK(flesh_mesh_box((int[]){2, 2, 3}, (double[]){1, 1, 1}, at, &mesh));
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.3, &material));
  CHECK_OK(test_body_create(mesh, material, 1000, FLESH_MASS_LUMPED, 0, &b));
  CHECK_OK(flesh_effect_joint(&b.body, (flesh_nodes){18, nodes}, (flesh_nodes){18, nodes + 18}, point, NULL, k, &effect));
  for (int d = 54; d < b.n; d += 3) b.state.x[d] += 0.125;
  double energy;
  const flesh_point there = flesh_point_at(0, b.state.x, NULL, NULL);
  CHECK_OK(effect->operations->energy(effect, &there, &energy));
  CHECK_NEAR(energy, k / 2 * 0.125 * 0.125, 1e-6 * k);
  flesh_effect_destroy(&effect);
  test_body_destroy(&b);
}

static void nonsense_is_refused(void)
{
  test_body b;
  flesh_effect *effect = NULL;
  make(1e5, 0, &b);
  const int low[9] = {0, 1, 2, 3, 4, 5, 6, 7, 8}, high[3] = {51, 52, 53}, far[1] = {54};
#define REFUSED(text, n, some, m, others, ...)                                                                        \
  CHECK(flesh_effect_joint(&b.body, (flesh_nodes){n, some}, (flesh_nodes){m, others}, __VA_ARGS__, &effect) ==         \
            FLESH_ERR_ARGUMENT && !effect);                                                                            \
  CHECK_TEXT(flesh_error_text(), text)
  REFUSED("cannot carry", 9, low, 3, high, middle, NULL, 1);
  REFUSED("given 0 and 3 nodes", 0, low, 3, high, middle, NULL, 1);
  REFUSED("given node 54", 9, low, 1, far, middle, NULL, 1);
  REFUSED("stiffness is 0", 9, low, 3, high, middle, NULL, 0);
  REFUSED("axis is (0, 0, 0)", 9, low, 3, high, middle, ((double[]){0, 0, 0}), 1);
  REFUSED("point is", 9, low, 3, high, ((double[]){NAN, 0, 0}), NULL, 1);
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(joints_turn_where_they_should), TEST(forces_and_torques_balance),
                   TEST(a_hanging_block_swings_as_a_pendulum), TEST(joints_hold_far_from_the_origin), TEST(nonsense_is_refused));
}
