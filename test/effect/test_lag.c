// TEST quick
/* test_lag.c: effects always see a frozen state, and the lagged state that they see is the last one at which forces
 * balance: that of the previous step in every time-stepping method, of the previous stage in later stages of a
 * Runge-Kutta step, of the last load increment in statics, and the point itself where no step is taken. */
#include <nvector/nvector_serial.h>
#include <stdlib.h>

#include "body.h"
#include "flesh/kinsol.h"
#include "test.h"

enum { MOST = 96 }; /* unknowns */

/* Counts an effect's calls, and whether the lagged state ever differs from the expected one. */
typedef struct witness {
  int n, calls, wrong;
  int energies, unfrozen; /* calls of the energy; points without a frozen state */
  int own;                /* 1: it must be the point's state; 0: it must be t, x and v */
  double t, tolerance;
  const double *x, *v;
  struct {
    double t, x[MOST], v[MOST];
  } seen[2]; /* the last points at the present time and at the previous one, for methods with stages */
  int stages, later; /* calls in stages that lag behind another stage of the step */
} witness;

static void see(witness *w, const flesh_point *point)
{
  if (point->t != w->seen[0].t) w->seen[1] = w->seen[0]; /* stages are not in the order of time */
  w->seen[0].t = point->t;
  memcpy(w->seen[0].x, point->x, (size_t)w->n * sizeof *point->x);
  memcpy(w->seen[0].v, point->v, (size_t)w->n * sizeof *point->v);
}

static int look(const flesh_effect *effect, const flesh_point *point)
{
  witness *w = effect->data;
  if (w->stages) see(w, point);
  const int later = w->stages && w->seen[1].t > w->t;
  const double t = w->own ? point->t : later ? w->seen[1].t : w->t, tolerance = later ? 1e-9 : w->tolerance;
  const double *x = w->own ? point->x : later ? w->seen[1].x : w->x, *v = w->own ? point->v : later ? w->seen[1].v : w->v;
  int wrong = !point->lagged.x || !point->lagged.v || !(fabs(point->lagged.t - t) <= tolerance);
  for (int d = 0; d < w->n && !wrong; d++)
    wrong = !(fabs(point->lagged.x[d] - x[d]) <= tolerance && fabs(point->lagged.v[d] - v[d]) <= 1e3 * tolerance);
  w->later += later;
  w->calls++;
  w->unfrozen += !point->frozen.x;
  w->wrong += wrong;
  return FLESH_OK;
}

static int look_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  (void)r;
  return look(effect, point);
}

static int look_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                         flesh_block_matrix *K, const int *slots)
{
  (void)shift, (void)K, (void)slots;
  return look(effect, point);
}

static int look_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                          double *phi, double *magnitude)
{
  (void)shift, (void)phi, (void)magnitude;
  return look(effect, point);
}

/* An energy that may depend on time at a fixed position: its work is counted at the ends of steps, at separate
 * points. */
static int look_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  witness *w = effect->data;
  w->energies++;
  w->unfrozen += !point->frozen.x || !point->lagged.x || !point->lagged.v;
  *energy = 0;
  return FLESH_OK;
}

static const flesh_effect_operations operations = {.name = "witness", .residual = look_residual,
                                                   .jacobian = look_jacobian, .potential = look_potential,
                                                   .energy = look_energy};

static void make(test_body *b, witness *w)
{
  flesh_material material;
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.4, &material));
  CHECK_OK(test_body_create(test_box(3, 1, 1, 3, 1, 1), material, 1000, FLESH_MASS_LUMPED, 1, b));
  CHECK_OK(test_body_gravity(b, 0, 0, -9.81));
  CHECK_OK(test_body_clamp(b, 0));
  flesh_effect *effect = NULL;
  *w = (witness){.n = b->n, .own = 1};
  CHECK_OK(flesh_effect_create(&operations, b->mesh, w, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
  CHECK_OK(flesh_system_finalize(b->system));
}

/* Fraction of the step at which the first step balances; BDF2's first step is one of the midpoint rule. */
static double stage_of(flesh_method method)
{
  if (method == FLESH_METHOD_GENERALIZED_ALPHA) return 1 / 1.8;
  return method == FLESH_METHOD_HHT ? 0.9 : method == FLESH_METHOD_MIDPOINT || method == FLESH_METHOD_BDF2 ? 0.5 : 1;
}

/* Methods of order 2 find the acceleration at the start of their first step, where the lagged state is the start
 * itself; the first step's end is checked by potentials alone, so the second step is tested. */
static void steps_lag_where_the_last_one_balances(void)
{
  for (int method = 0; method <= FLESH_METHOD_IDA; method++) {
    test_body b;
    witness w;
    make(&b, &w);
    flesh_integrator *integrator = NULL;
    flesh_solver_options options;
    flesh_solver_options_default(&options);
    CHECK_OK(flesh_integrator_create(b.system, (flesh_method)method, &options, &integrator));
    double *x = malloc((size_t)b.n * sizeof *x), *v = calloc((size_t)b.n, sizeof *v);
    const double part = stage_of((flesh_method)method);
    memcpy(x, b.state.x, (size_t)b.n * sizeof *x);
    if (method != FLESH_METHOD_STATIC) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.01, NULL));
    for (int d = 0; d < b.n; d++) x[d] = part == 1 ? b.state.x[d] : x[d] + part * (b.state.x[d] - x[d]);
    for (int d = 0; d < b.n; d++) v[d] = part * b.state.v[d]; /* it started at rest */
    w = (witness){.n = b.n, .own = method == FLESH_METHOD_IDA, .t = part * b.state.t,
                  .tolerance = part == 1 ? 0 : 1e-13, .x = x, .v = v,
                  .seen = {{.t = -1}, {.t = -1}}, .stages = method == FLESH_METHOD_RUNGE_KUTTA};
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.01, NULL));
    printf("# %s: %d calls, %d in later stages, %d wrong\n", flesh_method_name((flesh_method)method), w.calls, w.later,
           w.wrong);
    CHECK((w.later > 3) == w.stages);
    CHECK(w.calls > 3 && w.unfrozen == 0);
    CHECK(w.energies > 0 || method == FLESH_METHOD_STATIC);
    /* The midpoint rule asks whether the end of its step has an energy, at a separate point. */
    CHECK(w.wrong <= (part < 1 && method != FLESH_METHOD_BDF2));
    flesh_integrator_destroy(&integrator);
    free(x);
    free(v);
    test_body_destroy(&b);
  }
}

/* Computes the positions [n] to which `steps` steps to half a second take a bar whose end is pressed on one side (an
 * open surface) with increasing pressure or, if `damped`, a bar that sinks slowly with damping by its current
 * stiffness. */
static double *move(int damped, flesh_method method, int steps, int *n)
{
  test_body b;
  flesh_effect *effect = NULL;
  flesh_integrator *integrator = NULL;
  flesh_solve_stats stats = {0};
  const flesh_amplitude rises = {2, (const flesh_curve_point[]){{0, 0}, {0.5, 1}}, 1, -INFINITY, INFINITY};
  const flesh_solver_options options = test_options(1e-10);
  CHECK_OK(test_body_create(test_box(4, 1, 1, 2, 1, 1), test_material(FLESH_ENERGY_S, 0.3), 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(test_body_clamp(&b, 0));
  int all, count = 0, pressed[3 * 64];
  const int *surface = flesh_mesh_surface(b.mesh, &all);
  const double *X = flesh_mesh_positions(b.mesh);
  for (int k = 0; k < all && count < 64; k++) {
    int inside = 1;
    for (int a = 0; a < 3; a++) inside &= X[3 * surface[3 * k + a]] >= 1 && X[3 * surface[3 * k + a] + 2] == 1;
    if (inside) memcpy(pressed + 3 * count++, surface + 3 * k, 3 * sizeof *surface);
  }
  if (damped) CHECK_OK(test_body_gravity(&b, 0, 0, -9.81));
  if (damped) CHECK_OK(flesh_effect_damping(&b.body, 0, 0.3, FLESH_STIFFNESS_CURRENT, &effect));
  else CHECK_OK(flesh_effect_pressure(&b.body, count, pressed, 8000, &rises, &effect));
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK_OK(flesh_integrator_create(b.system, method, &options, &integrator));
  for (int k = 0; k < steps; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.5 / steps, &stats));
  /* A stage's second solve reuses the matrix of the first, and the next stage that of the second. */
  CHECK(method != FLESH_METHOD_RUNGE_KUTTA || 10 * stats.assemblies < 7 * stats.solves);
  flesh_integrator_destroy(&integrator);
  double *x = b.state.x;
  *n = b.n;
  b.state.x = NULL;
  test_body_destroy(&b);
  return x;
}

/* The lag of the surface reduces no method's order. */
static void lag_keeps_the_order(int damped)
{
  for (int k = 0; flesh_method_name((flesh_method)k); k++) {
    const int order = flesh_method_order((flesh_method)k);
    double *x[3], apart[2] = {0};
    int n = 0;
    if (order == 0) continue; /* it takes no steps, or chooses them */
    for (int s = 0; s < 3; s++) x[s] = move(damped, (flesh_method)k, 80 << s, &n);
    for (int s = 0; s < 2; s++)
      for (int d = 0; d < n; d++) apart[s] = fmax(apart[s], fabs(x[s][d] - x[s + 1][d]));
    const double found = log2(apart[0] / apart[1]);
    printf("# %s: order %.2f, %.2e m\n", flesh_method_name((flesh_method)k), found, apart[1]);
    CHECK(found > order - 0.2);
    for (int s = 0; s < 3; s++) free(x[s]);
  }
}

static void methods_keep_their_order_under_an_open_pressure(void) { lag_keeps_the_order(0); }
static void methods_keep_their_order_by_current_damping(void) { lag_keeps_the_order(1); }

/* A stage without a lagged state uses its base. */
static void stages_default_to_their_base(void)
{
  test_body b;
  witness w;
  make(&b, &w);
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  flesh_problem *problem = NULL;
  CHECK_OK(flesh_problem_create(b.system, &options, &problem));
  double *zeros = calloc((size_t)b.n, sizeof *zeros), *other = malloc((size_t)b.n * sizeof *other);
  for (int d = 0; d < b.n; d++) other[d] = d;
  flesh_stage stage = {.load = 1, .prescribed_fraction = 1, .shift = {.x = 1, .v = 60, .a = 3600}, .x0 = b.state.x};
  for (int given = 0; given < 2; given++) {
    if (given) stage.x_lag = stage.v_lag = other;
    w = (witness){.n = b.n, .x = given ? other : b.state.x, .v = given ? other : zeros};
    CHECK_OK(flesh_problem_set_stage(problem, &stage));
    SUNContext context = NULL;
#if SUNDIALS_VERSION_MAJOR >= 7
    CHECK(!SUNContext_Create(SUN_COMM_NULL, &context));
#else
    CHECK(!SUNContext_Create(NULL, &context));
#endif
    N_Vector u = N_VNew_Serial(b.n, context), r = N_VNew_Serial(b.n, context);
    N_VConst(0.001, u);
    CHECK(flesh_kinsol_residual(u, r, problem) == 0);
    CHECK(w.calls == 1 && w.wrong == 0);
    N_VDestroy(u);
    N_VDestroy(r);
    SUNContext_Free(&context);
  }
  free(zeros);
  free(other);
  flesh_problem_destroy(&problem);
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(steps_lag_where_the_last_one_balances),
                   TEST(methods_keep_their_order_under_an_open_pressure),
                   TEST(methods_keep_their_order_by_current_damping), TEST(stages_default_to_their_base));
}
