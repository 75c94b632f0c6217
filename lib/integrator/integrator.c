/* integrator.c: steps with their retries: in halves in time, in load increments in statics. */
#include "flesh/integrator.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "integrator/adaptive.h"
#include "integrator/method.h"
#include "integrator/nonlinear.h"

struct flesh_integrator {
  const flesh_system *system;
  flesh_method method;
  const flesh_method_row *row;
  flesh_solver_options options;
  flesh_nonlinear *nonlinear;
  int n;
  double *base;  /* [2*n] of the stage */
  double *start; /* [n] where a static solve with increments began */
  flesh_failure failure;
  flesh_adaptive *adaptive; /* of the adaptive methods */
  int calm;                 /* the motion has been found calm: IDA steps */
};

static int is_adaptive(flesh_method method)
{
  return method == FLESH_METHOD_ADAPTIVE || method == FLESH_METHOD_CALM_ADAPTIVE;
}

int flesh_integrator_create(const flesh_system *system, flesh_method method,
                            const flesh_solver_options *options, flesh_integrator **integrator)
{
  *integrator = NULL;
  const flesh_method_row *row = flesh_method_find(method);
  if (!row) return flesh_fail(FLESH_ERR_ARGUMENT, "there is no integration method %d", (int)method);
  flesh_integrator *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for an integrator");
  self->system = system;
  self->method = method;
  self->row = row;
  self->options = *options;
  self->n = flesh_system_unknowns(system);
  self->base = calloc((size_t)self->n * 2 + 1, sizeof *self->base);
  self->start = calloc((size_t)self->n + 1, sizeof *self->start);
  int status = self->base && self->start
                   ? flesh_nonlinear_create(system, options, &self->nonlinear)
                   : flesh_fail(FLESH_ERR_MEMORY, "no memory for %d unknowns", self->n);
  if (!status && is_adaptive(method)) status = flesh_adaptive_create(system, options, &self->adaptive);
  if (status) {
    flesh_integrator_destroy(&self);
    return status;
  }
  *integrator = self;
  return FLESH_OK;
}

void flesh_integrator_destroy(flesh_integrator **integrator)
{
  if (!integrator || !*integrator) return;
  flesh_nonlinear_destroy(&(*integrator)->nonlinear);
  flesh_adaptive_destroy(&(*integrator)->adaptive);
  free((*integrator)->base);
  free((*integrator)->start);
  free(*integrator);
  *integrator = NULL;
}

flesh_method flesh_integrator_method(const flesh_integrator *integrator)
{
  return integrator->method;
}

const flesh_failure *flesh_integrator_failure(const flesh_integrator *integrator)
{
  return &integrator->failure;
}

size_t flesh_integrator_memory(const flesh_integrator *integrator)
{
  return sizeof *integrator + 3 * (size_t)integrator->n * sizeof(double) +
         flesh_nonlinear_memory(integrator->nonlinear) +
         (integrator->adaptive ? flesh_adaptive_memory(integrator->adaptive) : 0);
}

int flesh_integrator_set_adaptive(flesh_integrator *integrator, const flesh_adaptive_options *options)
{
  integrator->calm = 0;
  return integrator->adaptive ? flesh_adaptive_set_options(integrator->adaptive, options) : FLESH_OK;
}

void flesh_integrator_set_stop(flesh_integrator *integrator, int (*stop)(void *data), void *data)
{
  if (integrator->adaptive) flesh_adaptive_set_stop(integrator->adaptive, stop, data);
}

const char *flesh_integrator_warning(const flesh_integrator *integrator)
{
  return integrator->adaptive ? flesh_adaptive_warning(integrator->adaptive) : NULL;
}

double flesh_integrator_energy_gain(const flesh_integrator *integrator)
{
  return integrator->adaptive ? flesh_adaptive_energy_gain(integrator->adaptive) : 0;
}

/* Everything that is known about a solve that failed. */
static void record_failure(flesh_integrator *self, const flesh_stage *stage, double h, int halvings,
                           int status, const flesh_solve_stats *stats)
{
  const flesh_mesh *mesh = flesh_system_mesh(self->system);
  const double *x = flesh_nonlinear_positions(self->nonlinear);
  flesh_failure *f = &self->failure;
  *f = (flesh_failure){.status = status, .t = stage->t, .h = h, .halvings = halvings,
                       .residual = stats->residual_last, .target = stats->residual_target};
  f->worst_J = flesh_mesh_jacobians(mesh, x, NULL, &f->worst_tet, NULL);
  const int *tet = flesh_mesh_tets(mesh) + 4 * (size_t)f->worst_tet;
  for (int c = 0; c < 3; c++)
    for (int a = 0; a < 4; a++) f->worst_position[c] += x[3 * tet[a] + c] / 4;
  f->worst_node = flesh_nonlinear_worst_node(self->nonlinear);
}

static int solve(flesh_integrator *self, const flesh_stage *stage, double h, int halvings,
                 flesh_solve_stats *stats)
{
  int status = flesh_nonlinear_solve(self->nonlinear, stage, stats);
  if (status) record_failure(self, stage, h, halvings, status, stats);
  return status;
}

/* Steps from state->t to `end`, halving what fails: an explicit walk over the binary subdivision, so that depth is
 * bounded by max_halvings and work by its leaves. */
static int step_in_time(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  const double begin = state->t;
  unsigned long long place = 0; /* of the next piece, in units of h / 2^depth */
  int depth = 0;
  for (;;) {
    unsigned long long pieces = 1ULL << depth;
    double piece = h / (double)pieces;
    flesh_stage stage;
    self->row->stage(state, piece, self->n, self->base, &stage);
    stage.t = begin + h * ((double)(place + 1) / (double)pieces);
    int status = solve(self, &stage, piece, depth, stats);
    if (status < 0) return status;
    if (status) {
      stats->convergence_failures++;
      if (depth == self->options.max_halvings) return status;
      depth++;
      place *= 2;
      continue;
    }
    self->row->finish(&stage, flesh_nonlinear_unknowns(self->nonlinear), piece, self->n, state);
    stats->steps++;
    stats->order = 1;
    stats->h_last = piece;
    place++;
    while (depth > 0 && place % 2 == 0) depth--, place /= 2;
    if (depth == 0) return FLESH_OK;
  }
}

/* Equilibrium at t+h: the full load first, then in increments that shrink on failure and grow on success. */
static int solve_static(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  flesh_stage stage;
  self->row->stage(state, h, self->n, self->base, &stage);
  int status = solve(self, &stage, h, 0, stats);
  if (status == FLESH_OK) {
    self->row->finish(&stage, flesh_nonlinear_unknowns(self->nonlinear), h, self->n, state);
    return FLESH_OK;
  }
  /* The load is carried from its present share to the full one; what is prescribed moves along. */
  memcpy(self->start, state->x, (size_t)self->n * sizeof *self->start);
  double reached = 0, increment = 0.5;
  const double smallest = ldexp(1, -self->options.max_halvings), begin = state->t;
  while (status >= 0 && reached < 1) {
    double load = fmin(1, reached + increment);
    self->row->stage(state, h, self->n, self->base, &stage);
    stage.load = load;
    stage.share = (load - reached) / (1 - reached);
    status = solve(self, &stage, h, (int)lround(-log2(increment)), stats);
    if (status < 0) break;
    if (status) {
      increment /= 2;
      if (increment < smallest) break;
      continue;
    }
    self->row->finish(&stage, flesh_nonlinear_unknowns(self->nonlinear), h, self->n, state);
    reached = load;
    increment *= 2;
    state->t = reached < 1 ? begin : stage.t;
  }
  if (reached >= 1) return FLESH_OK;
  /* A part of the load is no equilibrium that was asked for. */
  memcpy(state->x, self->start, (size_t)self->n * sizeof *self->start);
  return status;
}

/* IDA's steps; before the motion is calm, backward Euler's where those are asked for. */
static int step_adaptively(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats,
                           int *euler)
{
  int status = FLESH_OK;
  if (self->method == FLESH_METHOD_ADAPTIVE) self->calm = 1;
  else if (!self->calm || !flesh_adaptive_returned(self->adaptive, state))
    status = flesh_adaptive_is_calm(self->adaptive, state, h, &self->calm, stats);
  *euler = !self->calm;
  if (status) return status;
  if (*euler) return step_in_time(self, state, h, stats);
  status = flesh_adaptive_step(self->adaptive, state, h, stats);
  if (status == FLESH_ERR_INTEGRATOR) self->failure = *flesh_adaptive_failure(self->adaptive);
  return status;
}

int flesh_integrator_step(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  flesh_solve_stats ignored = {0};
  if (!stats) stats = &ignored;
  if (!(h >= 0) || (h == 0 && self->method != FLESH_METHOD_STATIC))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the step is %g s; it must be positive", h);
  int status, euler = 1;
  if (is_adaptive(self->method)) status = step_adaptively(self, state, h, stats, &euler);
  else if (self->method == FLESH_METHOD_STATIC) status = solve_static(self, state, h, stats);
  else status = step_in_time(self, state, h, stats);
  if (status > 0 && !euler) return status;
  if (status <= 0) return status;
  const flesh_failure *f = &self->failure;
  return flesh_fail(f->status == FLESH_NONFINITE ? FLESH_ERR_NONFINITE : FLESH_ERR_SOLVE,
                    "at t = %.9g s with h = %.3g s: %s; residual %.3g N, wanted %.3g N; smallest J = %.3g in "
                    "tet %d at (%.4g, %.4g, %.4g)",
                    f->t, f->h, flesh_status_text(f->status), f->residual, f->target, f->worst_J,
                    f->worst_tet, f->worst_position[0], f->worst_position[1], f->worst_position[2]);
}
