/* equilibrium.c: tangents, adjoints and gradients of an equilibrium. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/parallel_vector.h"
#include "sensitivity/stage_tangent.h"
#include "system/one_effect.h"
#include "system/system.h"

struct flesh_sensitivity {
  flesh_stage_tangent tangent;
  int n, is_set;
  flesh_state state; /* copied, like the next two */
  double *x_lag, *v_lag;
  double *room;      /* [6*n] */
};

int flesh_sensitivity_create(const flesh_system *system, const flesh_solver_options *options, double tolerance,
                             flesh_sensitivity **sensitivity)
{
  FLESH_NEED({sensitivity, "sensitivity"});
  *sensitivity = NULL;
  FLESH_NEED({system, "system"}, {options, "options"});
  if (!(tolerance >= 1e-13 && tolerance < 1))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the tolerance of sensitivities is %g; it must be in [1e-13, 1)", tolerance);
  flesh_sensitivity *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for sensitivities");
  const size_t n = (size_t)flesh_system_unknowns(system);
  const int multipliers = flesh_system_multiplier_count(system), internal = flesh_system_internal_count(system);
  self->n = (int)n;
  int status = flesh_stage_tangent_create(system, options, tolerance, &self->tangent);
  if (!status) self->state.x = calloc(10 * n + (size_t)multipliers + (size_t)internal + 1, sizeof *self->state.x);
  if (!status && !self->state.x) status = flesh_fail(FLESH_ERR_MEMORY, "no memory for sensitivities of %zu unknowns", n);
  if (status) {
    flesh_sensitivity_destroy(&self);
    return status;
  }
  self->state.v = self->state.x + n; /* 0 */
  self->x_lag = self->state.v + n;
  self->v_lag = self->x_lag + n;
  self->room = self->v_lag + n;
  self->state.multipliers = multipliers ? self->room + 6 * n : NULL;
  self->state.multiplier_count = multipliers;
  self->state.internal = internal ? self->room + 6 * n + multipliers : NULL;
  self->state.internal_count = internal;
  *sensitivity = self;
  return FLESH_OK;
}

void flesh_sensitivity_destroy(flesh_sensitivity **sensitivity)
{
  if (!sensitivity || !*sensitivity) return;
  flesh_stage_tangent_clear(&(*sensitivity)->tangent);
  free((*sensitivity)->state.x);
  free(*sensitivity);
  *sensitivity = NULL;
}

/* Copies the state, and refuses counts that are not the system's. */
static int take_state(flesh_sensitivity *self, const flesh_state *state)
{
  flesh_state *own = &self->state;
  const struct { const char *name; int given, count; const double *from; double *to; } parts[] = {
      {"multipliers", state->multiplier_count, own->multiplier_count, state->multipliers, own->multipliers},
      {"internal variables", state->internal_count, own->internal_count, state->internal, own->internal}};
  for (int k = 0; k < 2; k++) {
    if (parts[k].count && (!parts[k].from || parts[k].given != parts[k].count))
      return flesh_fail(FLESH_ERR_ARGUMENT, "the state has %d %s; the equilibrium needs the system's %d",
                        parts[k].from ? parts[k].given : 0, parts[k].name, parts[k].count);
    if (parts[k].count) memcpy(parts[k].to, parts[k].from, (size_t)parts[k].count * sizeof *parts[k].to);
  }
  own->t = state->t;
  memcpy(own->x, state->x, (size_t)self->n * sizeof *own->x);
  return FLESH_OK;
}

/* Refuses a state whose free forces are small neither relative to the largest effect's nor relative to round-off, which is
 * all that is left where nothing loads a body. */
static int check_balance(flesh_sensitivity *self)
{
  const flesh_stage_tangent *tangent = &self->tangent;
  flesh_equations *equations = &tangent->newton->equations;
  const uint8_t *is = equations->constrained.is;
  double *r = self->room, largest = 0;
  for (int e = 0; e < flesh_system_effect_count(tangent->system); e++) {
    const int status = flesh_system_effect_residual(tangent->system, e, &tangent->point, r);
    if (status) return status;
    largest = fmax(largest, flesh_norm(NULL, self->n, r));
  }
  int status = flesh_system_residual(tangent->system, &tangent->point, r);
  for (int d = 0; d < self->n; d++) r[d] = is[d] ? 0 : r[d];
  const double left = flesh_norm(NULL, self->n, r);
  if (status || left <= 1e-2 * largest) return status;
  memset(r, 0, (size_t)self->n * sizeof *r); /* the unknowns */
  if (flesh_equations_at_round_off(equations, r, left)) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT, "the state is no equilibrium: its free forces are %.3g N, those of the largest effect "
                                        "%.3g N", left, largest);
}

int flesh_sensitivity_set(flesh_sensitivity *self, const flesh_state *state, const flesh_lagged *lagged)
{
  FLESH_NEED({self, "sensitivity"}, {state, "state"}, {state ? state->x : NULL, "state->x"});
  const size_t bytes = (size_t)self->n * sizeof(double);
  self->is_set = 0;
  int status = take_state(self, state);
  if (status) return status;
  if (lagged) FLESH_NEED({lagged->x, "lagged->x"}); /* checks its x, once it is not NULL */
  memcpy(self->x_lag, lagged ? lagged->x : state->x, bytes);
  if (lagged && lagged->v) memcpy(self->v_lag, lagged->v, bytes);
  else memset(self->v_lag, 0, bytes);
  const flesh_stage stage = {.t = state->t, .load = 1, .prescribed_fraction = 1, .shift = {.x = 1}, .x0 = self->state.x,
                             .x_lag = self->x_lag, .v_lag = self->v_lag, .t_lag = lagged ? lagged->t : state->t,
                             .multipliers = self->state.multipliers, .internal = self->state.internal};
  memset(self->room, 0, bytes);
  flesh_problem *problem = self->tangent.problem;
  status = flesh_problem_set_stage(problem, &stage);
  if (!status) flesh_problem_start(problem, self->room);
  if (!status) status = flesh_stage_tangent_set(&self->tangent, &stage, self->room, lagged ? 0 : 1u << FLESH_LAGGED_X);
  if (!status) status = check_balance(self);
  self->is_set = !status;
  return status > 0 ? flesh_fail(FLESH_ERR_SOLVE, "the equilibrium at t = %g s has no residual", state->t) : status;
}

static int check_set(const flesh_sensitivity *self)
{
  if (self->is_set) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT, "the sensitivities have no equilibrium; flesh_sensitivity_set comes first");
}

int flesh_sensitivity_force(flesh_sensitivity *self, const flesh_parameter *parameter, double *force)
{
  FLESH_NEED({self, "sensitivity"}, {parameter, "parameter"}, {force, "force"});
  const int status = check_set(self);
  return status ? status : flesh_stage_tangent_force(&self->tangent, parameter, NULL, force, NULL);
}

/* Computes dx [n], the response of the free dofs to a change of the residual, and to a change `beside` of positions (NULL:
 * 0). */
static int respond(flesh_sensitivity *self, const double *force, const double *beside, double *dx)
{
  for (int d = 0; d < self->n; d++) self->room[d] = -force[d];
  return flesh_stage_tangent_solve(&self->tangent, 0, self->room, beside, dx);
}

int flesh_sensitivity_tangent(flesh_sensitivity *self, const flesh_parameter *parameter, double *dx)
{
  FLESH_NEED({self, "sensitivity"}, {parameter, "parameter"}, {dx, "dx"});
  const size_t n = (size_t)self->n;
  double *force = self->room, *moves = force + n, *const all[3] = {moves, force + 4 * n, force + 5 * n};
  int status = check_set(self);
  if (!status) status = flesh_stage_tangent_force(&self->tangent, parameter, NULL, force, all);
  if (!status) status = respond(self, force, moves, dx);
  for (int d = 0; d < self->n && !status; d++) dx[d] += moves[d]; /* 0 on free dofs */
  return status;
}

int flesh_sensitivity_respond(flesh_sensitivity *self, const double *force, double *dx)
{
  FLESH_NEED({self, "sensitivity"}, {force, "force"}, {dx, "dx"});
  const int status = check_set(self);
  return status ? status : respond(self, force, NULL, dx);
}

/* Computes the right-hand side g [n] of the adjoint: dQ/dx plus the contribution of the residual's weights; and `beside`,
 * minus the residual's weights, which acts on pressures as lambda does. */
static int gather(flesh_sensitivity *self, const flesh_quantity *quantity, double *g, double *beside)
{
  int status = FLESH_OK;
  for (int d = 0; d < self->n; d++) beside[d] = quantity->of_residual ? -quantity->of_residual[d] : 0;
  memset(g, 0, (size_t)self->n * sizeof *g);
  if (quantity->of_residual) {
    status = flesh_stage_tangent_stiffness_times(&self->tangent, 1, quantity->of_residual, g);
    if (!status && self->tangent.follows)
      flesh_couplings_add(&self->tangent.couplings, FLESH_LAGGED_X, 1, 1, quantity->of_residual, g);
  }
  for (int d = 0; d < self->n && quantity->by_x; d++) g[d] += quantity->by_x[d];
  return status;
}

int flesh_sensitivity_adjoint(flesh_sensitivity *self, const flesh_quantity *quantity, double *lambda)
{
  FLESH_NEED({self, "sensitivity"}, {quantity, "quantity"}, {lambda, "lambda"});
  int status = check_set(self);
  double *g = self->room, *beside = self->room + self->n;
  if (!status) status = gather(self, quantity, g, beside);
  return status ? status : flesh_stage_tangent_solve(&self->tangent, 1, g, beside, lambda);
}

int flesh_sensitivity_gradient(flesh_sensitivity *self, const flesh_quantity *quantity, int count,
                               const flesh_parameter *parameters, double *gradient)
{
  FLESH_NEED({self, "sensitivity"}, {quantity, "quantity"}, {parameters, "parameters"}, {gradient, "gradient"});
  if (count < 0) return flesh_fail(FLESH_ERR_ARGUMENT, "the number of parameters is %d; it must be at least 0", count);
  const size_t n = (size_t)self->n;
  double *force = self->room + n, *moves = force + n, *lambda = moves + n, *const all[3] = {moves, lambda + n, lambda + 2 * n};
  int status = flesh_sensitivity_adjoint(self, quantity, lambda);
  for (int k = 0; k < count && !status; k++) {
    status = flesh_stage_tangent_force(&self->tangent, &parameters[k], NULL, force, all);
    gradient[k] = 0;
    for (size_t d = 0; d < n && !status; d++) {
      gradient[k] -= lambda[d] * force[d] + self->tangent.pressed[d] * moves[d];
      if (quantity->by_x) gradient[k] += quantity->by_x[d] * moves[d];
      if (quantity->of_residual) gradient[k] += quantity->of_residual[d] * force[d];
    }
  }
  return status;
}
