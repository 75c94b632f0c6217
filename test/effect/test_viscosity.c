// TEST quick seconds=60
/* test_viscosity.c: viscosity has no torque, does not act on rigid steps, and always dissipates; under every method a
 * freely spinning body conserves what it conserves without viscosity: its angular momentum exactly with the midpoint
 * rule. */
#include <stdlib.h>

#include "body.h"
#include "test.h"

static const double spin_rate = 3.7; /* rad/s */

/* A free bar with or without elasticity; inertia only with it. */
static void make_bar(int inertia, double shear, double bulk, test_body *b)
{
  flesh_effect *effect = NULL;
  CHECK_OK(test_body_create(test_box(8, 2, 2, 4, 1, 1), test_material(FLESH_ENERGY_S, 0.45), 1000, FLESH_MASS_LUMPED,
                            1, b));
  if (!inertia) {
    flesh_system_destroy(&b->system);
    CHECK_OK(flesh_system_create(b->mesh, &b->system));
  }
  if (shear + bulk > 0) {
    CHECK_OK(flesh_effect_viscosity(&b->body, shear, bulk, &effect));
    CHECK_OK(flesh_system_add_effect(b->system, &effect));
  }
  CHECK_OK(flesh_system_finalize(b->system));
}

/* Turns the body by `angle` about an axis that is none of the mesh's, and moves it. */
static void turn(int n, double angle, const double *x, double *y)
{
  const double axis[3] = {1. / 3, 2. / 3, -2. / 3}, c = cos(angle), s = sin(angle);
  for (int i = 0; i < n; i += 3) {
    double along = 0;
    for (int k = 0; k < 3; k++) along += axis[k] * x[i + k];
    for (int k = 0; k < 3; k++) {
      const int l = (k + 1) % 3, m = (k + 2) % 3;
      y[i + k] = c * x[i + k] + s * (axis[l] * x[i + m] - axis[m] * x[i + l]) + (1 - c) * along * axis[k] + 0.3;
    }
  }
}

/* A rigid step of any length causes no stress: with backward Euler's frozen start and at the midpoint. */
static void rigid_steps_are_not_felt(void)
{
  test_body b;
  make_bar(0, 300, 700, &b);
  const double h = 0.01, angles[] = {0.01, 0.3, 1, 2.5};
  double *end = malloc((size_t)b.n * sizeof *end), *middle = malloc((size_t)b.n * sizeof *middle),
         *r = malloc((size_t)b.n * sizeof *r);
  test_jitter(b.n, 0.1, 3, b.state.x);
  for (int k = 0; k < 5; k++) { /* the last step is not rigid */
    turn(b.n, k < 4 ? angles[k] : 0.01, b.state.x, end);
    if (k == 4) test_jitter(b.n, 0.01, 4, end);
    for (int d = 0; d < b.n; d++) {
      b.state.v[d] = (end[d] - b.state.x[d]) / h;
      middle[d] = (end[d] + b.state.x[d]) / 2;
    }
    flesh_point points[] = {flesh_point_at(0, end, b.state.v, r), flesh_point_at(0, middle, b.state.v, r)};
    points[0].frozen = (flesh_frozen){b.state.x, NULL};
    for (int p = 0; p < 2; p++) {
      CHECK_OK(flesh_system_residual(b.system, &points[p], r));
      printf("# step %d, %s: %.2g N\n", k, p ? "midpoint" : "backward Euler", test_norm(b.n, r));
      if (k < 4) CHECK_BELOW(test_norm(b.n, r), 1e-8);
      else CHECK(test_norm(b.n, r) > 100);
    }
  }
  free(end);
  free(middle);
  free(r);
  test_body_destroy(&b);
}

static void momentum_of(int n, const double *x, const double *p, double moment[3])
{
  moment[0] = moment[1] = moment[2] = 0;
  for (int i = 0; i < n; i += 3)
    for (int k = 0; k < 3; k++)
      moment[k] += x[i + (k + 1) % 3] * p[i + (k + 2) % 3] - x[i + (k + 2) % 3] * p[i + (k + 1) % 3];
}

/* With any frozen state there is no torque, and the potential is not negative; with the point's own state, or a step's
 * start at rest, the power is twice the potential. */
static void it_has_no_torque_and_never_feeds(void)
{
  test_body b;
  make_bar(0, 3, 7, &b);
  const flesh_shift shift = {.x = 0.5, .v = 40};
  double *vectors[4];
  for (int k = 0; k < 4; k++) vectors[k] = malloc((size_t)b.n * sizeof **vectors);
  double *r = vectors[0], *x_frozen = vectors[1], *v_frozen = vectors[2], *w = vectors[3];
  for (unsigned trial = 0; trial < 60; trial++) {
    memcpy(b.state.x, flesh_mesh_positions(b.mesh), (size_t)b.n * sizeof(double));
    test_jitter(b.n, 0.02 * trial, trial, b.state.x); /* up to inverted and flat tets */
    memset(b.state.v, 0, (size_t)b.n * sizeof(double));
    test_jitter(b.n, 1, 100 + trial, b.state.v);
    memset(w, 0, (size_t)b.n * sizeof *w);
    test_jitter(b.n, 0.02, 200 + trial, w);
    const int own = trial % 3 == 0, start = trial % 3 == 1;
    for (int d = 0; d < b.n; d++) {
      x_frozen[d] = b.state.x[d] - shift.x * (start ? b.state.v[d] / shift.v : w[d]);
      v_frozen[d] = b.state.v[d] - shift.v * w[d];
    }
    flesh_point point = flesh_point_at(0, b.state.x, b.state.v, r);
    if (!own) point.frozen = (flesh_frozen){x_frozen, start ? NULL : v_frozen};
    double phi, magnitude, torque[3], power = 0, difference = 0;
    CHECK_OK(flesh_system_residual(b.system, &point, r));
    CHECK_OK(flesh_system_potential(b.system, &point, &shift, &phi, &magnitude));
    momentum_of(b.n, b.state.x, r, torque);
    for (int k = 0; k < 3; k++) CHECK_BELOW(fabs(torque[k]), 1e-12 * test_norm(b.n, r) * test_norm(b.n, b.state.x));
    CHECK(phi > 0);
    for (int d = 0; d < b.n; d++) power += r[d] * b.state.v[d];
    /* Over a step from its start, E' is the difference of the strains, E' = F_mean^T F'. */
    flesh_point from = flesh_point_at(0, x_frozen, b.state.v, r);
    from.frozen = (flesh_frozen){b.state.x, NULL};
    if (start) CHECK_OK(flesh_system_residual(b.system, &from, r));
    for (int d = 0; d < b.n && start; d++) difference += r[d] * b.state.v[d];
    if (own) CHECK_NEAR(2 * shift.v * phi, power, 1e-12 * power);
    if (start) CHECK_NEAR(2 * shift.v * phi, (power + difference) / 2, 1e-10 * phi * shift.v);
  }
  for (int k = 0; k < 4; k++) free(vectors[k]);
  test_body_destroy(&b);
}

/* Losses and gains of a spin: of the angular momentum at the end and at most, of the quantity that the trapezoidal rule
 * conserves, and the largest rise of the energy between samples over the kinetic energy. */
typedef struct lost {
  double momentum, largest, kept, rise, energy;
} lost;

static double energy_of(const test_body *b, double *kinetic)
{
  double energies[4] = {0}, *zero = calloc((size_t)b->n, sizeof *zero);
  const flesh_point point = flesh_point_at(b->state.t, b->state.x, b->state.v, zero);
  CHECK_OK(flesh_system_energies(b->system, &point, energies));
  free(zero);
  *kinetic = energies[0];
  return energies[0] + energies[1];
}

/* Computes L, and L + h^2/4 sum v x M a, which the trapezoidal rule conserves if forces have no torque: it is the
 * midpoint rule for x - h v/2 and v - h a/2 (Hairer, Lubich & Wanner 2006, VI.8). */
static void momenta_of(const test_body *b, double h, double *L, double *kept)
{
  double *p = malloc((size_t)b->n * sizeof *p), *zero = calloc((size_t)b->n, sizeof *zero), moment[3];
  test_body_mass_times(b, b->state.v, p);
  momentum_of(b->n, b->state.x, p, moment);
  *kept = *L = moment[2];
  const flesh_point point = flesh_point_at(b->state.t, b->state.x, b->state.v, zero);
  CHECK_OK(flesh_system_residual(b->system, &point, p));
  momentum_of(b->n, b->state.v, p, moment);
  *kept -= h * h / 4 * moment[2];
  free(p);
  free(zero);
}

static lost spin(flesh_method method, double viscosity, double h, double time, double tolerance)
{
  test_body b;
  make_bar(1, viscosity, viscosity, &b);
  for (int i = 0; i < b.n; i += 3) {
    const double *X = flesh_mesh_positions(b.mesh) + i;
    b.state.v[i] = -spin_rate * (X[1] - 0.5);
    b.state.v[i + 1] = spin_rate * (X[0] - 2);
  }
  flesh_solver_options options = test_options(tolerance);
  flesh_adaptive_options adaptive;
  flesh_integrator *integrator = NULL;
  flesh_adaptive_options_default(&adaptive);
  adaptive.tolerance = tolerance;
  CHECK_OK(flesh_integrator_create(b.system, method, &options, &integrator));
  if (method == FLESH_METHOD_IDA) CHECK_OK(flesh_integrator_set_adaptive(integrator, &adaptive));
  lost lost = {0};
  double kinetic, ignored, start, kept_start, L, kept, energy = energy_of(&b, &kinetic), first = energy;
  momenta_of(&b, h, &start, &kept_start);
  for (int k = 0; k < lround(time / h); k++) {
    CHECK_OK(flesh_integrator_step(integrator, &b.state, h, NULL));
    const double now = energy_of(&b, &ignored);
    lost.rise = fmax(lost.rise, (now - energy) / kinetic);
    energy = now;
    momenta_of(&b, h, &L, &kept);
    lost.momentum = L / start - 1;
    lost.largest = fmax(lost.largest, fabs(lost.momentum));
    lost.kept = fmax(lost.kept, fabs(kept / kept_start - 1));
  }
  lost.energy = (energy - first) / kinetic;
  printf("# %s, %g Pa s, h %g, tolerance %g: momentum %.2e (at most %.2e; %.2e), energy %.4f, largest rise %.1e\n",
         flesh_method_name(method), viscosity, h, tolerance, lost.momentum, lost.largest, lost.kept, lost.energy,
         lost.rise);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return lost;
}

enum { VISCOSITY = 1000 }; /* Pa s: the lowest modes are damped within a second */

static void midpoint_keeps_the_momentum(void)
{
  for (int k = 0; k < 2; k++) {
    const double h = k ? 0.02 : 0.005;
    const lost viscous = spin(FLESH_METHOD_MIDPOINT, VISCOSITY, h, 2, 1e-9);
    CHECK_BELOW(viscous.largest, 1e-10);
    CHECK_BELOW(viscous.rise, k ? 1e-3 : 1e-9); /* coarse steps of the rule gain energy after a violent start */
    CHECK(viscous.energy < -0.01); /* ringing and stretching are damped */
  }
}

/* These methods conserve another momentum, so that L fluctuates with h^2, as without viscosity. */
static void trapezoidal_rule_keeps_its_momentum(void)
{
  const double h[] = {0.02, 0.01, 0.005};
  double largest[3];
  for (int k = 0; k < 3; k++) {
    const lost viscous = spin(FLESH_METHOD_NEWMARK, VISCOSITY, h[k], 2, 1e-9);
    CHECK_BELOW(viscous.kept, 1e-8);
    CHECK_BELOW(viscous.rise, 1e-5);
    largest[k] = viscous.largest;
  }
  CHECK_NEAR(log2(largest[0] / largest[2]) / 2, 2, 0.3);
}

/* Other methods lose momentum by themselves; viscosity does not increase the loss. */
static void others_lose_what_they_lose_without(void)
{
  const struct {
    flesh_method method;
    double order;
  } methods[] = {{FLESH_METHOD_BACKWARD_EULER, 1}, {FLESH_METHOD_BDF2, 2}, {FLESH_METHOD_HHT, 2}};
  for (int m = 0; m < 3; m++) {
    const lost elastic = spin(methods[m].method, 0, 0.005, 2, 1e-8);
    const lost coarse = spin(methods[m].method, VISCOSITY, 0.01, 2, 1e-8);
    const lost viscous = spin(methods[m].method, VISCOSITY, 0.005, 2, 1e-8);
    CHECK_BELOW(viscous.largest, 1.1 * elastic.largest);
    CHECK_BELOW(viscous.rise, 1e-9);
    CHECK(log2(coarse.largest / viscous.largest) > 0.8 * methods[m].order);
  }
}

/* IDA's error falls with its tolerance. */
static void adaptive_loses_with_its_tolerance(void)
{
  const lost loose = spin(FLESH_METHOD_IDA, VISCOSITY, 0.02, 2, 1e-3);
  const lost tight = spin(FLESH_METHOD_IDA, VISCOSITY, 0.02, 2, 1e-5);
  CHECK_BELOW(loose.largest, 2e-2);
  CHECK_BELOW(tight.largest, loose.largest / 50);
  CHECK_BELOW(tight.rise, 1e-6);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(rigid_steps_are_not_felt), TEST(it_has_no_torque_and_never_feeds),
                   TEST(midpoint_keeps_the_momentum), TEST(trapezoidal_rule_keeps_its_momentum),
                   TEST(others_lose_what_they_lose_without), TEST(adaptive_loses_with_its_tolerance));
}
