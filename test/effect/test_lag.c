/* test_lag.c: effects see a frozen state always, and the lagged state that they see is the last one at which forces
 * balance: that of the step before in every method that steps, the last load increment at rest in statics, the point's
 * own where nothing is stepped over. */
#include <nvector/nvector_serial.h>
#include <stdlib.h>

#include "body.h"
#include "flesh/kinsol.h"
#include "test.h"

/* What an effect saw: how often, and whether the lagged state was ever another than it should be. */
typedef struct witness {
  int n, calls, wrong;
  int energies, unfrozen; /* calls of the energy; points without a frozen state */
  int own;                /* 1: must be the point's; 0: must be t, x and v */
  double t, tolerance;
  const double *x, *v;
} witness;

static int look(const flesh_effect *effect, const flesh_point *point)
{
  witness *w = effect->data;
  const double *x = w->own ? point->x : w->x, *v = w->own ? point->v : w->v;
  int wrong = !point->x_lag || !point->v_lag || !(fabs(point->t_lag - (w->own ? point->t : w->t)) <= w->tolerance);
  for (int d = 0; d < w->n && !wrong; d++)
    wrong = !(fabs(point->x_lag[d] - x[d]) <= w->tolerance && fabs(point->v_lag[d] - v[d]) <= w->tolerance);
  w->calls++;
  w->unfrozen += !point->x_frozen;
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

/* An energy that may change with time at a place: its work is counted at the ends of steps, at points of their own. */
static int look_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  witness *w = effect->data;
  w->energies++;
  w->unfrozen += !point->x_frozen || !point->x_lag || !point->v_lag;
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

/* The first step balances at this part of it; that of BDF2 is one of the midpoint rule. */
static double stage_of(flesh_method method)
{
  return method == FLESH_METHOD_HHT ? 0.9 : method == FLESH_METHOD_MIDPOINT || method == FLESH_METHOD_BDF2 ? 0.5 : 1;
}

/* Methods of order 2 find the acceleration at the start of their first step, where the lagged state is the start's own
 * too; the first step's end is checked by potentials of it alone, so the second step is watched. */
static void steps_lag_where_the_last_one_balances(void)
{
  for (int method = 0; method < FLESH_METHOD_EULER_THEN_ADAPTIVE; method++) {
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
    for (int d = 0; d < b.n; d++) v[d] = part * b.state.v[d]; /* it began at rest */
    w = (witness){.n = b.n, .own = method == FLESH_METHOD_ADAPTIVE, .t = part * b.state.t,
                  .tolerance = part == 1 ? 0 : 1e-13, .x = x, .v = v};
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.01, NULL));
    printf("# %s: %d calls, %d wrong\n", flesh_method_name((flesh_method)method), w.calls, w.wrong);
    CHECK(w.calls > 3 && w.unfrozen == 0);
    CHECK(w.energies > 0 || method == FLESH_METHOD_STATIC);
    /* The midpoint rule asks whether the end of its step has an energy: a point of its own. */
    CHECK(w.wrong <= (method == FLESH_METHOD_MIDPOINT || method == FLESH_METHOD_HHT));
    flesh_integrator_destroy(&integrator);
    free(x);
    free(v);
    test_body_destroy(&b);
  }
}

/* A stage without a lagged state lags its base. */
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
  return RUN_TESTS(argc, argv, TEST(steps_lag_where_the_last_one_balances), TEST(stages_default_to_their_base));
}
