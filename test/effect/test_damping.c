// TEST quick seconds=60
/* test_damping.c: decay rates of damped modes; viscosity does not act on rigid motion, and damping never adds
 * energy. */
#include <gsl/gsl_eigen.h>
#include <stdlib.h>

#include "body.h"
#include "test.h"

enum { RAYLEIGH_REST, RAYLEIGH_CURRENT, KELVIN_VOIGT, UNDAMPED };

static flesh_material soft(void)
{
  flesh_material material;
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.4, &material));
  return material;
}

/* Makes inertia, elasticity and one kind of damping with coefficients of mass and stiffness; viscosities in proportion
 * to the moduli damp small motion like the stiffness. */
static void make(flesh_mesh *mesh, flesh_mass mass_kind, int kind, double mass, double stiffness, test_body *b)
{
  CHECK_OK(test_body_create(mesh, soft(), 1000, mass_kind, 1, b));
  flesh_effect *effect = NULL;
  double mu, lambda;
  CHECK_OK(flesh_material_small_strain(&b->material, &mu, &lambda, NULL));
  if (kind == KELVIN_VOIGT)
    CHECK_OK(flesh_effect_viscosity(&b->body, stiffness * mu, stiffness * (lambda + 2 * mu / 3), &effect));
  else if (kind != UNDAMPED)
    CHECK_OK(flesh_effect_damping(&b->body, mass, stiffness,
                                  kind == RAYLEIGH_REST ? FLESH_STIFFNESS_REST : FLESH_STIFFNESS_CURRENT, &effect));
  if (effect) CHECK_OK(flesh_system_add_effect(b->system, &effect));
}

static flesh_integrator *adaptive(const flesh_system *system, double tolerance)
{
  flesh_integrator *integrator = NULL;
  flesh_solver_options options;
  flesh_adaptive_options steps;
  flesh_solver_options_default(&options);
  flesh_adaptive_options_default(&steps);
  options.linear_solver = FLESH_LINEAR_KLU;
  steps.tolerance = tolerance;
  CHECK_OK(flesh_integrator_create(system, FLESH_METHOD_IDA, &options, &integrator));
  CHECK_OK(flesh_integrator_set_adaptive(integrator, &steps));
  return integrator;
}

/* Computes the lowest mode of the clamped bar, phi [n], and its angular frequency. */
static double lowest_mode(const test_body *b, double *phi)
{
  int n = b->n;
  uint8_t *fixed = malloc((size_t)n);
  double *mass = calloc((size_t)n, sizeof *mass), *zero = calloc((size_t)n, sizeof *zero), low;
  flesh_block_matrix *K = NULL;
  flesh_system_fixed(b->system, 0, fixed);
  flesh_mesh_lumped_mass(b->mesh, b->density, mass);
  CHECK_OK(flesh_system_matrix_create(b->system, &K));
  const flesh_point rest = flesh_point_at(0, flesh_mesh_positions(b->mesh), zero, zero);
  CHECK_OK(flesh_system_jacobian(b->system, &rest, &(flesh_shift){.x = 1}, K));
  double *dense = test_dense(K);
  gsl_matrix *A = gsl_matrix_alloc((size_t)n, (size_t)n), *vectors = gsl_matrix_alloc((size_t)n, (size_t)n);
  gsl_vector *values = gsl_vector_alloc((size_t)n);
  gsl_eigen_symmv_workspace *work = gsl_eigen_symmv_alloc((size_t)n);
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++) {
      double k = fixed[i] || fixed[j] ? (i == j) * 1e12 : dense[i * n + j] / sqrt(mass[i / 3] * mass[j / 3]);
      gsl_matrix_set(A, (size_t)i, (size_t)j, k);
    }
  gsl_eigen_symmv(A, values, vectors, work);
  gsl_eigen_symmv_sort(values, vectors, GSL_EIGEN_SORT_VAL_ASC);
  low = gsl_vector_get(values, 0);
  for (int d = 0; d < n; d++) phi[d] = gsl_matrix_get(vectors, (size_t)d, 0) / sqrt(mass[d / 3]);
  gsl_eigen_symmv_free(work);
  gsl_vector_free(values);
  gsl_matrix_free(vectors);
  gsl_matrix_free(A);
  flesh_block_matrix_destroy(&K);
  free(dense);
  free(zero);
  free(mass);
  free(fixed);
  return sqrt(low);
}

/* Finds the damping ratio of a run: samples of a damped oscillation satisfy q_{k+1} = c q_k + d q_{k-1} with d =
 * -exp(-2 decay dt), c = 2 exp(-decay dt) cos(w_d dt). */
static void measure(int count, const double *q, double dt, double *ratio, double *frequency)
{
  double aa = 0, ab = 0, bb = 0, ay = 0, by = 0;
  for (int k = 1; k + 1 < count; k++) {
    aa += q[k] * q[k];
    ab += q[k] * q[k - 1];
    bb += q[k - 1] * q[k - 1];
    ay += q[k] * q[k + 1];
    by += q[k - 1] * q[k + 1];
  }
  double det = aa * bb - ab * ab, c = (ay * bb - by * ab) / det, d = (by * aa - ay * ab) / det;
  double decay = -log(-d) / (2 * dt), damped = acos(c / (2 * sqrt(-d))) / dt;
  *frequency = sqrt(damped * damped + decay * decay);
  *ratio = decay / *frequency;
}

static void check_decay(int kind, double a_over_w, double b_times_w)
{
  enum { SAMPLES = 40 };
  test_body b;
  make(test_box(6, 2, 2, 3, 1, 1), FLESH_MASS_LUMPED, UNDAMPED, 0, 0, &b);
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_system_finalize(b.system));
  double *phi = malloc((size_t)b.n * sizeof *phi), *mass = calloc((size_t)b.n, sizeof *mass), q[SAMPLES], ratio,
         frequency, w = lowest_mode(&b, phi);
  test_body_destroy(&b);
  make(test_box(6, 2, 2, 3, 1, 1), FLESH_MASS_LUMPED, kind, a_over_w * w, b_times_w / w, &b);
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_mesh_lumped_mass(b.mesh, b.density, mass);
  flesh_integrator *integrator = adaptive(b.system, 1e-8);
  double largest = 0, dt = 2 * acos(-1) / w / 20, expected = a_over_w / 2 + b_times_w / 2;
  for (int d = 0; d < b.n; d++) largest = fmax(largest, fabs(phi[d]));
  for (int d = 0; d < b.n; d++) b.state.x[d] += 1e-4 / largest * phi[d];
  for (int k = 0; k < SAMPLES; k++) {
    q[k] = 0;
    for (int d = 0; d < b.n; d++)
      q[k] += mass[d / 3] * phi[d] * (b.state.x[d] - flesh_mesh_positions(b.mesh)[d]);
    CHECK_OK(flesh_integrator_step(integrator, &b.state, dt, NULL));
  }
  measure(SAMPLES, q, dt, &ratio, &frequency);
  printf("# kind %d: ratio %.6g, expected %.6g; w %.6g, of the mode %.6g\n", kind, ratio, expected, frequency, w);
  CHECK_NEAR(ratio, expected, 0.01 * expected);
  CHECK_NEAR(frequency, w, 0.001 * w);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  free(phi);
  free(mass);
}

static void the_lowest_mode_decays_as_rayleigh_says(void)
{
  check_decay(RAYLEIGH_REST, 0.06, 0.08);
  check_decay(RAYLEIGH_CURRENT, 0, 0.1);
  check_decay(KELVIN_VOIGT, 0, 0.1);
}

/* Sets y = R (X + strain) about the z axis through the body, and v = rate times the direction selected by `stretch`. */
static void turned(const test_body *b, double angle, int stretch, double rate, double *x, double *v)
{
  const double *X = flesh_mesh_positions(b->mesh), c = cos(angle), s = sin(angle);
  for (int i = 0; i < b->n / 3; i++) {
    x[3 * i] = c * X[3 * i] - s * X[3 * i + 1];
    x[3 * i + 1] = s * X[3 * i] + c * X[3 * i + 1];
    x[3 * i + 2] = X[3 * i + 2];
    v[3 * i] = stretch ? rate * c * X[3 * i] : -rate * x[3 * i + 1];
    v[3 * i + 1] = stretch ? rate * s * X[3 * i] : rate * x[3 * i];
    v[3 * i + 2] = 0;
  }
}

static void viscosity_does_not_feel_rigid_motion(void)
{
  test_body b;
  CHECK_OK(test_body_create(test_box(3, 2, 2, 1, 1, 1), soft(), 1000, FLESH_MASS_LUMPED, 0, &b));
  flesh_system_destroy(&b.system);
  CHECK_OK(flesh_system_create(b.mesh, &b.system));
  flesh_effect *effect = NULL;
  CHECK_OK(flesh_effect_viscosity(&b.body, 300, 700, &effect));
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  CHECK_OK(flesh_system_finalize(b.system));
  double *r = malloc((size_t)b.n * sizeof *r), size[2];
  for (int stretch = 0; stretch < 2; stretch++) {
    turned(&b, 0.7, stretch, 5, b.state.x, b.state.v);
    const flesh_point point = flesh_point_at(0, b.state.x, b.state.v, b.state.v);
    CHECK_OK(flesh_system_residual(b.system, &point, r));
    size[stretch] = test_norm(b.n, r);
  }
  printf("# spin %.3g N, stretch %.3g N\n", size[0], size[1]);
  CHECK_BELOW(size[0], 1e-10 * size[1]);
  /* Uniaxial stretching at the rate 5/s: S_xx = 4/3 shear 5 + bulk 5 over faces of 1 m^2. */
  double pull = 0, expected = (4. / 3 * 300 + 700) * 5;
  for (int i = 0; i < b.n / 3; i++)
    if (flesh_mesh_positions(b.mesh)[3 * i] > 0.999) pull += cos(0.7) * r[3 * i] + sin(0.7) * r[3 * i + 1];
  CHECK_NEAR(pull, expected, 1e-10 * expected);
  free(r);
  test_body_destroy(&b);
}

static double energy_of(const test_body *b, const flesh_state *state, double *kinetic)
{
  double energies[4] = {0}, *zero = calloc((size_t)b->n, sizeof *zero);
  const flesh_point point = flesh_point_at(state->t, state->x, state->v, zero);
  CHECK_OK(flesh_system_energies(b->system, &point, energies));
  free(zero);
  *kinetic = energies[0];
  return energies[0] + energies[1] + energies[2];
}

/* Returns the change of the energy over its kinetic part while the body, at x and v, moves on for half a turn. */
static double spin(int kind, const test_body *from, double time)
{
  test_body b;
  make(test_box(2, 1, 1, 1, 0.5, 0.5), FLESH_MASS_CONSISTENT, kind, 0, 0.05, &b);
  CHECK_OK(flesh_system_finalize(b.system));
  memcpy(b.state.x, from->state.x, (size_t)b.n * sizeof(double));
  memcpy(b.state.v, from->state.v, (size_t)b.n * sizeof(double));
  double kinetic, ignored, before = energy_of(&b, &b.state, &kinetic);
  flesh_integrator *integrator = adaptive(b.system, 1e-7);
  CHECK_OK(flesh_integrator_step(integrator, &b.state, time, NULL));
  double change = (energy_of(&b, &b.state, &ignored) - before) / kinetic;
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return change;
}

/* Finds a steadily spinning body by letting viscosity damp all other motion. */
static void a_spinning_body_keeps_its_energy(void)
{
  test_body b;
  const double rate = 2;
  make(test_box(2, 1, 1, 1, 0.5, 0.5), FLESH_MASS_CONSISTENT, KELVIN_VOIGT, 0, 0.05, &b);
  CHECK_OK(flesh_system_finalize(b.system));
  for (int i = 0; i < b.n / 3; i++) {
    const double *X = flesh_mesh_positions(b.mesh) + 3 * i;
    b.state.v[3 * i] = -rate * (X[1] - 0.25);
    b.state.v[3 * i + 1] = rate * (X[0] - 0.5);
  }
  flesh_integrator *integrator = adaptive(b.system, 1e-6);
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 8, NULL));
  flesh_integrator_destroy(&integrator);
  double time = acos(-1) / rate, free_change = spin(UNDAMPED, &b, time), viscous = spin(KELVIN_VOIGT, &b, time),
         turned_away = spin(RAYLEIGH_REST, &b, time);
  printf("# half a turn: undamped %.3g, viscous %.3g, against the rest stiffness %.3g of the kinetic energy\n",
         free_change, viscous, turned_away);
  CHECK_BELOW(fabs(viscous - free_change), 1e-6);
  CHECK(turned_away < -0.1); /* a damping that acts on rotation shows */
  test_body_destroy(&b);
}

static void damping_never_feeds_energy(void)
{
  for (int kind = 0; kind < UNDAMPED; kind++) {
    test_body b;
    CHECK_OK(test_body_create(test_box(3, 2, 2, 1, 1, 1), soft(), 1000, FLESH_MASS_CONSISTENT, 0, &b));
    flesh_system_destroy(&b.system);
    CHECK_OK(flesh_system_create(b.mesh, &b.system));
    flesh_effect *effect = NULL;
    if (kind == KELVIN_VOIGT) CHECK_OK(flesh_effect_viscosity(&b.body, 3, 7, &effect));
    else CHECK_OK(flesh_effect_damping(&b.body, 0.1, 0.2, (flesh_stiffness)kind, &effect));
    CHECK_OK(flesh_system_add_effect(b.system, &effect));
    CHECK_OK(flesh_system_finalize(b.system));
    double *r = malloc((size_t)b.n * sizeof *r), least = INFINITY, phi, magnitude;
    for (unsigned trial = 0; trial < 100; trial++) {
      memcpy(b.state.x, flesh_mesh_positions(b.mesh), (size_t)b.n * sizeof(double));
      test_jitter(b.n, 0.01 * trial, trial, b.state.x); /* up to inverted and flat tets */
      memset(b.state.v, 0, (size_t)b.n * sizeof(double));
      test_jitter(b.n, 1, 1000 + trial, b.state.v);
      const flesh_point point = flesh_point_at(0, b.state.x, b.state.v, b.state.v);
      CHECK_OK(flesh_system_residual(b.system, &point, r));
      double power = 0;
      for (int d = 0; d < b.n; d++) power += r[d] * b.state.v[d];
      least = fmin(least, power);
      CHECK_OK(flesh_system_potential(b.system, &point, &(flesh_shift){.x = 1, .v = 4}, &phi, &magnitude));
      CHECK_NEAR(phi, power / 8, 1e-12 * power);
    }
    CHECK(least > 0);
    free(r);
    test_body_destroy(&b);
  }
}

/* Bars stretched in one step from rest along volume-preserving strains: the nearer Poisson's ratio is to 1/2, the
 * closer forces are to those at 1/2, for both stiffnesses, because the bulk part limits lambda to that of 0.45. */
static void near_incompressible_bodies_damp_as_incompressible_ones(void)
{
  static const double poisson[3] = {0.4999, 0.5, 0.45}, stretch = 1.2;
  const double side = 1 / sqrt(stretch), rate[3] = {stretch - 1, side - 1, side - 1}, beta = 0.05;
  for (int k = 0; k < 6; k++) {
    const double mu = 1e5 / (2 * (1 + poisson[k / 2]));
    const double expected = beta * mu * (2 * rate[0] + 9 * (rate[0] + 2 * rate[1]));
    const flesh_stiffness stiffness = k % 2 ? FLESH_STIFFNESS_CURRENT : FLESH_STIFFNESS_REST;
    flesh_mesh *linear = test_box(2, 1, 1, 1, 1, 1), *mesh = NULL;
    flesh_effect *effect = NULL;
    test_body b;
    CHECK_OK(flesh_mesh_raise_order(linear, &mesh));
    flesh_mesh_destroy(&linear);
    CHECK_OK(test_body_create(mesh, test_material(FLESH_ENERGY_S, poisson[k / 2]), 1000, FLESH_MASS_LUMPED, 0, &b));
    flesh_system_destroy(&b.system);
    CHECK_OK(flesh_system_create(b.mesh, &b.system));
    CHECK_OK(flesh_effect_damping(&b.body, 0, beta, stiffness, &effect));
    CHECK_OK(flesh_system_add_effect(b.system, &effect));
    CHECK_OK(flesh_system_finalize(b.system));
    const double *X = flesh_mesh_positions(b.mesh);
    for (int d = 0; d < b.n; d++) b.state.v[d] = rate[d % 3] * X[d];
    for (int d = 0; d < b.n; d++) b.state.x[d] += b.state.v[d];
    double *r = malloc((size_t)b.n * sizeof *r), pull = 0;
    flesh_point point = flesh_point_at(0, b.state.x, b.state.v, b.state.v);
    point.lagged = (flesh_lagged){0, X, b.state.v};
    CHECK_OK(flesh_system_residual(b.system, &point, r));
    for (int i = 0; i < b.n / 3; i++)
      if (X[3 * i] > 0.999) pull += r[3 * i];
    printf("# poisson %g: %.6g N, expected %.6g N\n", poisson[k / 2], pull, expected);
    CHECK_NEAR(pull, expected, 1e-9 * expected);
    free(r);
    test_body_destroy(&b);
  }
}

/* A free body in uniform motion slows as exp(-rate t), but no longer once it is slow or the time is over. */
static void settling_damping_winds_down_and_lets_be(void)
{
  for (int k = 0; k < 2; k++) {
    test_body b;
    make(test_box(1, 1, 1, 1, 1, 1), FLESH_MASS_LUMPED, UNDAMPED, 0, 0, &b);
    flesh_effect *effect = NULL;
    CHECK_OK(flesh_effect_settling_damping(&b.body, 3, k ? 0.4 : 0, -INFINITY, k ? INFINITY : 0.5, &effect));
    CHECK(!effect->operations->energy && effect->operations->time->next_event(effect, 0) == (k ? INFINITY : 0.5));
    CHECK_OK(flesh_system_add_effect(b.system, &effect));
    CHECK_OK(flesh_system_finalize(b.system));
    for (int d = 0; d < b.n; d++) b.state.v[d] = d % 3 == 0;
    flesh_integrator *integrator = adaptive(b.system, 1e-6);
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.25, NULL));
    CHECK_NEAR(b.state.v[0], exp(-0.75), 1e-4);
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 2.75, NULL));
    const double end = b.state.v[0];
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 1, NULL));
    printf("# %s: %.6g m/s after 3 s, %.6g m/s after 4 s\n", k ? "until slow" : "for a time", end, b.state.v[0]);
    if (k == 0) CHECK_NEAR(end, exp(-1.5), 1e-4);
    else CHECK(end > 0.2 && end < 0.25 && b.state.v[0] > 0.2);
    CHECK_NEAR(b.state.v[0], end, k ? 0.01 : 1e-6);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

static void bad_coefficients_are_sentences(void)
{
  test_body b;
  make(test_box(1, 1, 1, 1, 1, 1), FLESH_MASS_LUMPED, UNDAMPED, 0, 0, &b);
  flesh_effect *effect = NULL;
  CHECK(flesh_effect_damping(&b.body, -1, 0, FLESH_STIFFNESS_REST, &effect) == FLESH_ERR_ARGUMENT);
  CHECK(!strcmp(flesh_error_text(), "mass is -1 1/s; it must not be negative"));
  CHECK(flesh_effect_damping(&b.body, 1, NAN, FLESH_STIFFNESS_REST, &effect) == FLESH_ERR_ARGUMENT);
  CHECK(flesh_effect_damping(&b.body, 0, 0, FLESH_STIFFNESS_REST, &effect) == FLESH_ERR_ARGUMENT);
  CHECK(flesh_effect_viscosity(&b.body, 0, -3, &effect) == FLESH_ERR_ARGUMENT);
  CHECK(!strcmp(flesh_error_text(), "bulk is -3 Pa s; it must not be negative"));
  CHECK(flesh_effect_viscosity(&b.body, 0, 0, &effect) == FLESH_ERR_ARGUMENT);
  flesh_body bare = b.body;
  bare.materials = NULL;
  CHECK(flesh_effect_damping(&bare, 0, 1, FLESH_STIFFNESS_REST, &effect) == FLESH_ERR_ARGUMENT);
  CHECK_OK(flesh_effect_damping(&bare, 1, 0, FLESH_STIFFNESS_REST, &effect));
  flesh_effect_destroy(&effect);
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(the_lowest_mode_decays_as_rayleigh_says),
                   TEST(viscosity_does_not_feel_rigid_motion), TEST(a_spinning_body_keeps_its_energy),
                   TEST(damping_never_feeds_energy),
                   TEST(near_incompressible_bodies_damp_as_incompressible_ones), TEST(settling_damping_winds_down_and_lets_be),
                   TEST(bad_coefficients_are_sentences));
}
