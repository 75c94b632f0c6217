// TEST quick
/* test_own_effects.c: what a system reports of an effect from outside the library: its refusals are messages that name
 * it, one that changes smoothly with time counts as moving, and its events lie ahead. */
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "body.h"
#include "flesh/derivative_check.h"
#include "flesh/integrator.h"
#include "test.h"

typedef enum refuses { NOTHING, RESIDUAL, JACOBIAN, POTENTIAL, ENERGY, CHECK_OF_PLACES, UPDATE } refuses;

/* Which operation refuses, and whether with a message of the library. */
static refuses refusing;
static int speaks;
static int only, calls; /* the call that refuses, and the number of calls so far; 0: all refuse */

static int answer(refuses operation)
{
  if (refusing != operation || (only && ++calls != only)) return FLESH_OK;
  return speaks ? flesh_mesh_read("nowhere.mesh", &(flesh_mesh *){NULL}) : FLESH_ERR_BUDGET;
}

static int residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  (void)effect, (void)point, (void)r;
  return answer(RESIDUAL);
}

static int jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, flesh_block_matrix *K,
                    const int *slots)
{
  (void)effect, (void)point, (void)shift, (void)K, (void)slots;
  return answer(JACOBIAN);
}

static int potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *phi,
                     double *magnitude)
{
  (void)effect, (void)point, (void)shift, (void)phi, (void)magnitude;
  return answer(POTENTIAL);
}

static int energy(const flesh_effect *effect, const flesh_point *point, double *value)
{
  (void)effect, (void)point, (void)value;
  return answer(ENERGY);
}

static int check(const flesh_effect *effect, const double *internal, double t, const double *x)
{
  (void)effect, (void)internal, (void)t, (void)x;
  return answer(CHECK_OF_PLACES);
}

static int count(const flesh_effect *effect) { return (void)effect, 1; }

static int update(const flesh_effect *effect, const flesh_point *point, double *internal, int *changed)
{
  (void)effect, (void)point, (void)internal, (void)changed;
  return answer(UPDATE);
}

static const flesh_effect_operations operations = {
    .name = "gust", .residual = residual, .jacobian = jacobian, .potential = potential, .energy = energy,
    .barrier = &(const flesh_effect_barrier){.check = check},
    .internal = &(const flesh_effect_internal){.count = count, .update = update}};

static void add(test_body *b, const flesh_effect_operations *kind, int with_inertia)
{
  flesh_effect *effect = NULL;
  CHECK_OK(test_body_create(test_box(1, 1, 1, 1, 1, 1), test_material(FLESH_ENERGY_S, 0.3), 1000, FLESH_MASS_LUMPED, with_inertia, b));
  CHECK_OK(flesh_effect_create(kind, b->mesh, NULL, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
  CHECK_OK(flesh_system_finalize(b->system));
}

static int ask(const test_body *b, refuses operation)
{
  double r[24], phi = 0, magnitude = 0, energies[8], internal[1] = {0};
  int changed = 0;
  const flesh_shift shift = {.x = 1};
  const flesh_point point = flesh_point_at(0, b->state.x, b->state.v, b->state.v);
  flesh_block_matrix *K = NULL;
  refusing = operation;
  switch (operation) {
  case RESIDUAL: return flesh_system_residual(b->system, &point, r);
  case POTENTIAL: return flesh_system_potential(b->system, &point, &shift, &phi, &magnitude);
  case ENERGY: return flesh_system_energies(b->system, &point, energies);
  case CHECK_OF_PLACES: return flesh_system_check(b->system, 0, b->state.x);
  case UPDATE: return flesh_system_update_internal(b->system, &point, internal, &changed);
  default: break;
  }
  int status = flesh_system_matrix_create(b->system, &K);
  if (!status) status = flesh_system_jacobian(b->system, &point, &shift, K);
  flesh_block_matrix_destroy(&K);
  return status;
}

static void refusals_name_the_effect(void)
{
  test_body b;
  add(&b, &operations, 0);
  for (refuses operation = RESIDUAL; operation <= UPDATE; operation++)
    for (speaks = 0; speaks <= 1; speaks++) {
      flesh_fail(FLESH_ERR_ARGUMENT, "of something else");
      CHECK(ask(&b, operation) == (speaks ? FLESH_ERR_FILE : FLESH_ERR_BUDGET));
      printf("# %s\n", flesh_error_text());
      CHECK(strstr(flesh_error_text(), speaks ? "nowhere.mesh" : "effect gust returned FLESH_ERR_BUDGET"));
    }
  speaks = 0;
  test_body_destroy(&b);
}

static void the_audit_names_it_too(void)
{
  test_body b;
  flesh_derivative_report report;
  flesh_effect *effect = NULL;
  add(&b, &operations, 0);
  CHECK_OK(flesh_effect_create(&operations, b.mesh, NULL, &effect));
  for (refusing = RESIDUAL; refusing <= POTENTIAL; refusing++) {
    flesh_fail(FLESH_ERR_ARGUMENT, "of something else");
    CHECK(flesh_effect_check_derivatives(effect, b.mesh, 0, b.state.x, 1, &report) == FLESH_ERR_BUDGET);
    CHECK(strstr(flesh_error_text(), "effect gust returned FLESH_ERR_BUDGET"));
  }
  refusing = NOTHING;
  flesh_effect_destroy(&effect);
  test_body_destroy(&b);
}

/* Also a refusal that would not be repeated, and whichever function asked. */
static void a_fatal_status_ends_the_step(void)
{
  const flesh_effect_operations twitch = {.name = "twitch", .residual = residual, .jacobian = jacobian, .potential = potential};
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  for (int k = 0; flesh_method_name((flesh_method)k); k++)
    for (refuses operation = RESIDUAL; operation <= (k == FLESH_METHOD_IDA ? RESIDUAL : POTENTIAL); operation++) {
      test_body b;
      flesh_integrator *integrator;
      add(&b, &twitch, 1);
      for (int d = 0; d < 24; d++) b.state.v[d] = sin(d), b.state.x[d] *= 1 + 0.01 * cos(d);
      CHECK_OK(flesh_integrator_create(b.system, (flesh_method)k, &options, &integrator));
      refusing = operation;
      only = operation == JACOBIAN ? 1 : 3;
      calls = 0;
      const int status = flesh_integrator_step(integrator, &b.state, 0.01, NULL);
      if (status != FLESH_ERR_BUDGET) printf("# %s, operation %d: %d\n", flesh_method_name((flesh_method)k), (int)operation, status);
      CHECK(status == FLESH_ERR_BUDGET && calls >= only && b.state.t == 0);
      CHECK(strstr(flesh_error_text(), "effect twitch returned FLESH_ERR_BUDGET"));
      flesh_integrator_destroy(&integrator);
      test_body_destroy(&b);
    }
  refusing = NOTHING;
  only = 0;
}

/* Statics repeat their equilibria if something moves. */
static void smooth_effects_move(void)
{
  const flesh_effect_operations still = {.name = "still", .residual = residual},
                                smooth = {.name = "smooth", .residual = residual, .time = &(const flesh_effect_time){0}};
  test_body b;
  add(&b, &still, 0);
  CHECK(!flesh_system_moves(b.system));
  test_body_destroy(&b);
  add(&b, &smooth, 0);
  CHECK(flesh_system_moves(b.system) && flesh_system_next_event(b.system, 0) == INFINITY);
  test_body_destroy(&b);
}

static double nothing_is_feasible(const flesh_effect *effect, void *near, const double *internal, double t_from,
                                  const double *x_from, double t_to, const double *x_to)
{
  (void)effect, (void)near, (void)internal, (void)t_from, (void)x_from, (void)t_to, (void)x_to;
  return 0;
}

/* A step that fails before anything is evaluated reports the start, the body at rest, with every method. */
static void a_start_that_bars_all_ways_is_told(void)
{
  const flesh_effect_operations wall = {
      .name = "wall", .residual = residual, .potential = potential,
      .barrier = &(const flesh_effect_barrier){.max_feasible_step = nothing_is_feasible}};
  const flesh_solver_options options = test_options(1e-6);
  for (int m = 0; m < FLESH_METHOD_IDA; m++) {
    test_body b;
    flesh_integrator *integrator = NULL;
    add(&b, &wall, 0);
    b.state.v[0] = 1;
    CHECK_OK(flesh_integrator_create(b.system, (flesh_method)m, &options, &integrator));
    CHECK(flesh_integrator_step(integrator, &b.state, 1. / 60, NULL) == FLESH_ERR_SOLVE);
    const flesh_failure *failure = flesh_integrator_failure(integrator);
    CHECK(failure->worst_tet >= 0 && fabs(failure->worst_J - 1) < 0.2);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

static double event_at; /* s, whatever the time for which it is asked */

static double same_event(const flesh_effect *effect, double t) { return (void)effect, (void)t, event_at; }

/* An effect that names a time that has passed, or none, has no event there: a run would otherwise stop at it for ever. */
static void past_events_are_none(void)
{
  test_body b;
  add(&b, &(const flesh_effect_operations){.name = "bell", .residual = residual, .potential = potential,
                                           .time = &(const flesh_effect_time){.next_event = same_event}}, 1);
  event_at = 0.05;
  CHECK(flesh_system_next_event(b.system, 0) == 0.05);
  CHECK(flesh_system_next_event(b.system, 0.05) == INFINITY && flesh_system_next_event(b.system, 1) == INFINITY);
  event_at = NAN;
  CHECK(flesh_system_next_event(b.system, 0) == INFINITY && !flesh_system_moves(b.system));
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(refusals_name_the_effect), TEST(the_audit_names_it_too), TEST(a_fatal_status_ends_the_step),
                   TEST(smooth_effects_move), TEST(past_events_are_none), TEST(a_start_that_bars_all_ways_is_told));
}
