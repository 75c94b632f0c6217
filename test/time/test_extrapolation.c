// TEST quick seconds=60
/* test_extrapolation.c: first iterates from the last steps' velocities: exact for parabolas and vibrations, none if the
 * state has no history, and fewer iterations on a smooth swing. */
#include "body.h"
#include "math/mat3.h"
#include "time/extrapolation.h"
#include "time/rigid_guess.h"
#include "newton/newton.h"
#include "test.h"

enum { N = 6, STATE = 7 /* a serial number */ };

static double velocity(int d, double t) { return 1 + d - 3 * t + (2 + d) * t * t; }

static void find_velocities(double t, double *v)
{
  for (int d = 0; d < N; d++) v[d] = velocity(d, t);
}

/* A step of backward Euler, by h v. */
static void remember(flesh_extrapolation *e, const double *v, double t, double h, int easy)
{
  double u[N];
  for (int d = 0; d < N; d++) u[d] = h * v[d];
  flesh_extrapolation_remember(e, u, STATE, t, h, easy);
}

static void parabolas_are_exact(void)
{
  const double h = 0.1;
  double v[N], u[N];
  flesh_extrapolation e;
  CHECK_OK(flesh_extrapolation_create(N, N, NULL, &e));
  CHECK(!flesh_extrapolation_guess(&e, STATE, 0, h, u));
  for (int k = 1; k <= 5; k++) {
    find_velocities(k * h, v);
    remember(&e, v, k * h, h, 1);
    CHECK(flesh_extrapolation_guess(&e, STATE, k * h, h, u));
    for (int d = 0; d < N && k >= 3; d++) CHECK_NEAR(u[d], h * velocity(d, (k + 1) * h), 1e-14);
  }
  CHECK(!flesh_extrapolation_guess(&e, STATE, 5 * h, h / 2, u)); /* another step */
  CHECK(!flesh_extrapolation_guess(&e, STATE + 1, 5 * h, h, u)); /* another state */
  /* After a hard step only its own velocity is used. */
  find_velocities(6 * h, v);
  remember(&e, v, 6 * h, h, 0);
  CHECK(flesh_extrapolation_guess(&e, STATE, 6 * h, h, u));
  for (int d = 0; d < N; d++) CHECK_NEAR(u[d], h * velocity(d, 6 * h), 1e-15);
  flesh_extrapolation_clear(&e);
}

/* Two damped vibrations at once, mixed differently in each dof: after 4 + 2 of their velocities the next ones are
 * predicted, while polynomials are far off; after a change of the motion they are again, once the old velocities are
 * gone. */
static void vibrations_are_predicted(void)
{
  const double h = 0.1;
  double v[N], u[N];
  flesh_extrapolation e;
  CHECK_OK(flesh_extrapolation_create(N, N, NULL, &e));
  for (int k = 1; k <= 40; k++) {
    const double t = k * h, quick = k < 20 ? 9 : 6;
    double next[N];
    for (int d = 0; d < N; d++) {
      v[d] = (1 + d) * exp(-0.1 * t) * cos(5 * t + d) + (2 + d * d % 5) * exp(-0.3 * t) * sin(quick * t + 3 * d);
      next[d] = (1 + d) * exp(-0.1 * (t + h)) * cos(5 * (t + h) + d) +
                (2 + d * d % 5) * exp(-0.3 * (t + h)) * sin(quick * (t + h) + 3 * d);
    }
    remember(&e, v, t, h, 1);
    CHECK(flesh_extrapolation_guess(&e, STATE, t, h, u));
    double off = 0, size = 0;
    for (int d = 0; d < N; d++) {
      off = fmax(off, fabs(u[d] / h - next[d]));
      size = fmax(size, fabs(next[d]));
    }
    CHECK(!(k >= 6 && k < 19) || off < 1e-4 * size);
    CHECK(!(k >= 26) || off < 1e-4 * size);
  }
  flesh_extrapolation_clear(&e);
}

/* Returns the Newton iterations of thirty steps of a swinging bar, by one integrator or by a new one for every step. */
static int iterations(int forgetful, double *end)
{
  test_body b;
  flesh_solver_options options;
  flesh_solve_stats stats = {0};
  flesh_integrator *integrator = NULL;
  const flesh_material material = test_material(FLESH_ENERGY_S, 0.45);
  CHECK_OK(test_body_create(test_box(12, 4, 4, 1, 0.3, 0.3), material, 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(test_body_gravity(&b, 0, 0, -2));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_solver_options_default(&options);
  options.newton_tolerance = 1e-6;
  for (int k = 0; k < 30; k++) {
    if (!integrator)
      CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 60, &stats));
    if (forgetful) flesh_integrator_destroy(&integrator);
  }
  *end = b.state.x[b.n - 1];
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return stats.newton;
}

static void calm_swings_take_fewer_iterations(void)
{
  double with, without;
  const int few = iterations(0, &with), many = iterations(1, &without);
  printf("# %d Newton iterations, %d without what came before; the end differs by %.2g m\n", few, many, with - without);
  CHECK_BELOW(few, 0.85 * many);
  CHECK(few <= 70); /* 84 if linear tolerances do not follow Newton's convergence */
  CHECK_NEAR(with, without, 1e-6);
}

/* Whether a preconditioner made and used at the first stage is reused at another one. */
static int serves(flesh_newton *newton, const flesh_state *state, double h, double t, int continues)
{
  flesh_stage stage = {.t = 0, .load = 1, .prescribed_fraction = 1, .shift = {.x = 1, .v = 8, .a = 64}, .x0 = state->x};
  const int n = newton->equations.n;
  double *b = malloc(2 * (size_t)n * sizeof *b), *p = b + n;
  for (int d = 0; d < n; d++) b[d] = newton->equations.constrained.is[d] ? 0 : sin(d);
  flesh_newton_set_stage(newton, &stage);
  CHECK_OK(flesh_newton_matrix(newton, newton->u, NULL));
  CHECK_OK(flesh_matrix_policy_refresh(&newton->policy));
  flesh_direction_kind kind;
  const flesh_direction_request request = {.tolerance = 1e-6, .max_iterations = 100};
  CHECK_OK(flesh_direction_solve(&newton->direction, &request, b, p, &kind));
  const double *per_decade = newton->direction.iterations_per_decade, rate = per_decade[0] + per_decade[1];
  CHECK(rate > 0);
  newton->policy.stage_continues = continues;
  stage.t = t;
  stage.shift.a = 1 / (h * h);
  flesh_newton_set_stage(newton, &stage);
  CHECK(!newton->policy.stage_continues); /* it has to be said every time */
  CHECK_OK(flesh_newton_matrix(newton, newton->u, NULL));
  CHECK_OK(flesh_matrix_policy_prepare(&newton->policy));
  free(b);
  return per_decade[0] + per_decade[1] == rate; /* unknown for a new one */
}

static void a_preconditioner_serves_in_stages_that_go_on(void)
{
  test_body b;
  flesh_solver_options options;
  flesh_newton newton;
  const flesh_material material = test_material(FLESH_ENERGY_S, 0.45);
  CHECK_OK(test_body_create(test_box(4, 2, 2, 1, 0.3, 0.3), material, 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(flesh_system_add_pin(b.system, 1, (int[]){3}, FLESH_AXES_ALL, -INFINITY, 0.5)); /* released at 0.5 s */
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_solver_options_default(&options);
  CHECK_OK(flesh_newton_init(b.system, &options, (flesh_stage_solver){0}, &newton));
  CHECK(serves(&newton, &b.state, 0.125, 0.1, 1));
  CHECK(!serves(&newton, &b.state, 0.125, 0.1, 0));
  CHECK(!serves(&newton, &b.state, 0.25, 0.1, 1)); /* another step */
  CHECK(!serves(&newton, &b.state, 0.125, 0.6, 1)); /* other constraints */
  flesh_newton_clear(&newton);
  test_body_destroy(&b);
}

/* Moves the rigid body x [3*n] to the least weighted distances to y (Horn 1987, by quaternions: the dominant
 * eigenvector of a 4x4 matrix), the centre of mass of both being the same. */
static void draw_rigidly(int n, const double *mass, const double *y, double *x)
{
  double centre[3] = {0}, total = 0, S[9] = {0}, q[4] = {1, 0, 0, 0};
  for (int i = 0; i < n; i++) total += mass[i];
  for (int d = 0; d < 3 * n; d++) centre[d % 3] += mass[d / 3] * x[d] / total;
  for (int i = 0; i < n; i++)
    for (int e = 0; e < 9; e++)
      S[e] += mass[i] * (x[3 * i + e / 3] - centre[e / 3]) * (y[3 * i + e % 3] - centre[e % 3]);
  const double N[4][4] = {{S[0] + S[4] + S[8], S[5] - S[7], S[6] - S[2], S[1] - S[3]},
                          {S[5] - S[7], S[0] - S[4] - S[8], S[1] + S[3], S[6] + S[2]},
                          {S[6] - S[2], S[1] + S[3], S[4] - S[0] - S[8], S[5] + S[7]},
                          {S[1] - S[3], S[6] + S[2], S[5] + S[7], S[8] - S[0] - S[4]}};
  double shift = fabs(N[0][0]) + fabs(N[1][1]) + fabs(N[2][2]) + fabs(N[3][3]);
  for (int k = 0; k < 2000; k++) {
    double p[4], square = 0;
    for (int r = 0; r < 4; r++) {
      p[r] = shift * q[r];
      for (int c = 0; c < 4; c++) p[r] += N[r][c] * q[c];
      square += p[r] * p[r];
    }
    for (int r = 0; r < 4; r++) q[r] = p[r] / sqrt(square);
  }
  for (int i = 0; i < n; i++) { /* q d q* */
    double d[3], t[3];
    for (int c = 0; c < 3; c++) d[c] = x[3 * i + c] - centre[c];
    for (int c = 0; c < 3; c++) {
      int u = (c + 1) % 3, w = (c + 2) % 3;
      t[c] = 2 * (q[1 + u] * d[w] - q[1 + w] * d[u]);
    }
    for (int c = 0; c < 3; c++) {
      int u = (c + 1) % 3, w = (c + 2) % 3;
      x[3 * i + c] += q[0] * t[c] + q[1 + u] * t[w] - q[1 + w] * t[u];
    }
  }
}

/* A free body so light that it is practically rigid, with nodes of uneven masses, turned by about half a radian in its
 * first step and by little less afterwards: backward Euler pulls it to x + h v. Its velocities lead straight on, and
 * from there, or from its position, Newton's steps would need hundreds of iterations. */
static void free_bodies_turn_on(void)
{
  test_body b;
  flesh_solver_options options;
  flesh_integrator *integrator = NULL;
  const flesh_material material = test_material(FLESH_ENERGY_S, 0.49);
  CHECK_OK(test_body_create(test_box(4, 2, 2, 0.2, 0.1, 0.1), material, 1e-3, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_solver_options_default(&options);
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  const double h = 1. / 60, *X = flesh_mesh_positions(b.mesh);
  const int nodes = b.n / 3;
  double *rigid = malloc(sizeof *rigid * (size_t)b.n), *y = malloc(sizeof *y * (size_t)b.n),
         *before = malloc(sizeof *before * (size_t)b.n), *mass = calloc((size_t)nodes, sizeof *mass);
  for (int t = 0; t < flesh_mesh_tet_count(b.mesh); t++) /* all of one volume */
    for (int a = 0; a < 4; a++) mass[flesh_mesh_tets(b.mesh)[4 * t + a]] += 1;
  for (int i = 0; i < nodes; i++) { /* about z through the centre of mass */
    b.state.v[3 * i] = -0.5 / h * (X[3 * i + 1] - 0.05);
    b.state.v[3 * i + 1] = 0.5 / h * (X[3 * i] - 0.1);
    b.state.v[3 * i + 2] = 0;
  }
  memcpy(rigid, X, sizeof *rigid * (size_t)b.n);
  for (int d = 0; d < b.n; d++) before[d] = X[d] - h * b.state.v[d];
  for (int step = 0; step < 8; step++) {
    flesh_solve_stats stats = {0};
    CHECK_OK(flesh_integrator_step(integrator, &b.state, h, &stats));
    CHECK(stats.newton <= 4);
    for (int d = 0; d < b.n; d++) y[d] = 2 * rigid[d] - before[d];
    memcpy(before, rigid, sizeof *rigid * (size_t)b.n);
    draw_rigidly(nodes, mass, y, rigid);
    CHECK_BELOW(test_distance(b.n, rigid, b.state.x), 1e-6);
    if (stats.newton > 4) printf("# step %d: %d Newton iterations\n", step, stats.newton);
  }
  CHECK(test_distance(b.n, X, rigid) > 0.1); /* it did turn */
  flesh_integrator_destroy(&integrator);
  free(rigid);
  free(y);
  free(before);
  free(mass);
  test_body_destroy(&b);
}

/* A free body that noise has enlarged twentyfold shrinks about its centre to a tenth of the size at which the root mean
 * square of its tets' J is 1; one enlarged fivefold, or a held one, does not. */
static void bodies_far_too_large_shrink(void)
{
  test_body b;
  flesh_rigid_parts parts;
  CHECK_OK(test_body_create(test_box(4, 2, 2, 0.2, 0.1, 0.1), test_material(FLESH_ENERGY_S, 0.495), 1000,
                            FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK_OK(flesh_rigid_parts_create(b.system, FLESH_OK, &parts));
  const double *X = flesh_mesh_positions(b.mesh), middle[] = {7, 0.05, 0.05};
  double *u = malloc(sizeof *u * (size_t)b.n);
  uint8_t *fixed = calloc((size_t)b.n, 1);
  for (int k = 0; k < 3; k++) {
    const double size = k == 1 ? 5 : 20, left = k == 0 ? 0.1 : size;
    for (int d = 0; d < b.n; d++) b.state.x[d] = middle[d % 3] + size * (X[d] - (d % 3 ? 0.05 : 0.1));
    fixed[4] = k == 2;
    CHECK(flesh_rigid_guess(&parts, fixed, &b.state, 1. / 60, 1, u) == (k < 2));
    for (int d = 0; d < b.n; d++)
      CHECK_NEAR(b.state.x[d] + u[d], middle[d % 3] + left * (X[d] - (d % 3 ? 0.05 : 0.1)), 1e-12);
  }
  test_jitter(b.n, 10, 3, b.state.x);
  CHECK(flesh_rigid_guess(&parts, NULL, &b.state, 1. / 60, 1, u) == 1);
  double squares = 0;
  for (int t = 0; t < flesh_mesh_tet_count(b.mesh); t++) { /* all of one volume */
    const int *tet = flesh_mesh_tets(b.mesh) + 4 * t;
    double edges[9];
    for (int c = 0; c < 9; c++) {
      const int p = 3 * tet[1 + c / 3] + c % 3, q = 3 * tet[0] + c % 3;
      edges[c] = b.state.x[p] + u[p] - b.state.x[q] - u[q];
    }
    const double J = flesh_mat3_determinant(edges) / (6 * flesh_mesh_tet_volumes(b.mesh)[t]);
    squares += J * J;
  }
  CHECK_NEAR(1e6 * squares / flesh_mesh_tet_count(b.mesh), 1, 1e-9);
  free(u), free(fixed);
  flesh_rigid_parts_clear(&parts);
  test_body_destroy(&b);
}

/* All nodes of a strained body that flies on without turning move by the same amount, to the last bit. */
static void flights_leave_no_rounding(void)
{
  test_body b;
  flesh_rigid_parts parts;
  CHECK_OK(test_body_create(test_box(4, 4, 4, 0.1, 0.1, 0.1), test_material(FLESH_ENERGY_S, 0.45), 1000, FLESH_MASS_LUMPED, 1,
                            &b));
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK_OK(flesh_rigid_parts_create(b.system, FLESH_OK, &parts));
  double *u = malloc(sizeof *u * (size_t)b.n);
  for (int way = 0; way < 2; way++) {
    if (way) test_jitter(b.n, 0.01, 3, b.state.x);
    for (int d = 0; d < b.n; d++) b.state.v[d] = (double[]){1, 0.5, 0.25}[d % 3];
    CHECK(flesh_rigid_guess(&parts, NULL, &b.state, 1. / 60, 1, u) == 1);
    for (int d = 0; d < b.n; d++) CHECK(u[d] == u[d % 3] && fabs(u[d] - b.state.v[d] / 60) < 1e-15);
  }
  free(u);
  flesh_rigid_parts_clear(&parts);
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(parabolas_are_exact), TEST(vibrations_are_predicted),
                   TEST(calm_swings_take_fewer_iterations), TEST(free_bodies_turn_on),
                   TEST(bodies_far_too_large_shrink), TEST(flights_leave_no_rounding),
                   TEST(a_preconditioner_serves_in_stages_that_go_on));
}
