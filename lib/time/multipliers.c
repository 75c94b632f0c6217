/* multipliers.c: the augmented Lagrangian method (Hestenes 1969, Powell 1969; Nocedal & Wright 2006, section 17.3): a
 * solve with constant multipliers p and a penalty k for the gaps c of the constraints, then p <- p + k c, and so on.
 *
 * A solve leaves the fraction q/(q + k) of the error of the pressure, q being the stiffness of the body against it. In
 * statics q is that of its material, and the penalty is some hundred times as large. In motion the inertia of the
 * material between a tet and the surface adds to q, and the penalty is raised with that.
 *
 * The force of a multiplier acts at the point where the method balances forces; the constraint is on the end of the
 * step, x_1 = x_0 + u, where that is another point. Were it on the stage, the ends of the midpoint rule would oscillate
 * around the constraint with growing amplitude. As the stage moves by shift.x u, p changes by shift.x k c. */
#include "time/multipliers.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "effect/effect.h"
#include "system/inertia_modulus.h"
#include "system/ranks.h"
#include "system/system.h"

/* Most solves for multipliers, each of which should leave less than half of the gaps. */
enum { SOLVES = 60 };
/* Least penalty, over that of the reference ratio; in motion, over the stiffness by inertia. */
static const double least = FLESH_LEAST_PENALTY, raised = 30;

int flesh_multipliers_create(const flesh_system *system, flesh_nonlinear *nonlinear, const flesh_solver_options *options,
                             flesh_multipliers *self)
{
  *self = (flesh_multipliers){.system = system, .nonlinear = nonlinear, .team = flesh_system_team(system),
                              .tolerance = 1e-2 * options->newton_tolerance, .depth = options->newton_tolerance};
  self->count = flesh_system_multiplier_count(system);
  if (!self->count) return FLESH_OK;
  const size_t count = (size_t)self->count, n = (size_t)flesh_system_unknowns(system);
  self->n = (int)n;
  self->own = calloc(5 * count + 2 * n, sizeof *self->own);
  if (!self->own) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d multipliers", self->count);
  self->trial = self->own + count;
  self->lag = self->trial + count;
  self->gaps = self->lag + count;
  self->stiffness = self->gaps + count;
  self->x = self->stiffness + count;
  self->u = self->x + n;
  return FLESH_OK;
}

int flesh_multipliers_create_collective(flesh_multipliers *self)
{
  const flesh_system *system = self->system;
  if (!self->count) return FLESH_OK;
  const flesh_mesh *mesh = flesh_system_mesh(system);
  const flesh_point rest = flesh_point_at(0, flesh_mesh_positions(mesh), self->u, self->u);
  const int status = flesh_system_constraint_gaps(system, &rest, self->gaps, self->stiffness);
  if (status) return status;
  self->softest = INFINITY;
  for (int k = 0; k < self->count; k++)
    if (self->stiffness[k] > 0) self->softest = fmin(self->softest, self->stiffness[k]);
  self->softest = flesh_team_least(self->team, self->softest);
  self->inertia = flesh_system_inertia_modulus(system, self->x, self->u);
  return FLESH_OK;
}

void flesh_multipliers_clear(flesh_multipliers *self)
{
  free(self->own);
  *self = (flesh_multipliers){0};
}

int flesh_multipliers_view(const flesh_multipliers *self, const flesh_state *state, flesh_state *view)
{
  *view = *state;
  if (state->multipliers && state->multiplier_count != self->count)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the state has %d multipliers; the system has %d", state->multiplier_count,
                      self->count);
  if (!state->multipliers && self->count) {
    view->multipliers = self->own;
    view->multiplier_count = self->count;
  }
  return FLESH_OK;
}

int flesh_multipliers_gap(flesh_multipliers *self, const double *x, double *largest)
{
  const flesh_point point = flesh_point_at(0, x, x, x);
  const int status = flesh_system_constraint_gaps(self->system, &point, self->gaps, NULL);
  *largest = 0;
  for (int k = 0; k < self->count; k++) *largest = fmax(*largest, fabs(self->gaps[k]));
  flesh_team_largest(self->team, 1, largest);
  return status || *largest < INFINITY ? status : FLESH_NONFINITE;
}

/* Finds the largest gap where the solve has led. */
static int find_gaps(flesh_multipliers *self, const flesh_stage *stage, const flesh_stage_end *end, const double *u,
                     double *largest)
{
  for (int d = 0; d < self->n && !end; d++) self->x[d] = stage->x0[d] + stage->shift.x * u[d];
  if (end) end->find(end->data, u, self->x);
  return flesh_multipliers_gap(self, self->x, largest);
}

/* Sets the multipliers to the state's pressures minus the part that the penalty carries if the stage's gaps stay the
 * same. */
static void begin(flesh_multipliers *self, const flesh_state *state, double penalty)
{
  const size_t bytes = (size_t)self->count * sizeof *self->trial;
  memcpy(self->trial, state->multipliers, bytes);
  for (int k = 0; self->goes_on && k < self->count; k++) self->trial[k] -= penalty * self->stiffness[k] * self->lag[k];
}

int flesh_multipliers_solve(flesh_multipliers *self, flesh_stage *stage, const flesh_state *state,
                            const flesh_stage_end *end, const double *const *guesses, int extensions,
                            flesh_solve_stats *stats)
{
  flesh_nonlinear *nonlinear = self->nonlinear;
  if (!self->count) return flesh_nonlinear_solve(nonlinear, stage, guesses, extensions, stats);
  const double *next[] = {self->u, NULL}, *u = nonlinear->u;
  const double by_inertia = self->inertia * stage->shift.a / stage->shift.x;
  const double tolerance = self->allowed > 0 ? self->allowed : self->tolerance;
  double largest = 0, deeper = 1;
  int status = FLESH_NOT_CONVERGED, settled = 0;
  stage->multipliers = self->trial;
  stage->penalty = fmax(least, raised * by_inertia / self->softest);
  begin(self, state, stage->penalty);
  for (int k = 0; k < SOLVES && !settled; k++) {
    const int before = stats->newton;
    status = flesh_nonlinear_solve(nonlinear, stage, k ? next : guesses, extensions, stats);
    nonlinear->newton->goal.target = status ? 0 : deeper * stats->residual_target;
    const double gap_before = largest;
    if (!status) status = find_gaps(self, stage, end, u, &largest);
    if (status) break;
    const int idle = k && stats->newton == before, stays = k && largest > gap_before / 2; /* gaps at round-off */
    settled = largest <= fmax(tolerance, idle ? self->depth : stays ? self->tolerance : 0);
    if (settled) break;
    deeper = idle ? 0.1 : 1; /* the residual that may be left exceeds what the correction changes */
    const double change = stage->shift.x * stage->penalty;
    for (int e = 0; e < self->count; e++) self->trial[e] += change * self->stiffness[e] * self->gaps[e];
    memcpy(self->u, u, (size_t)self->n * sizeof *u);
    stats->multiplier_updates++;
    nonlinear->newton->policy.stage_continues = 1;
  }
  nonlinear->newton->goal.target = 0;
  self->left = status || settled ? 0 : largest;
  return status || settled ? status : FLESH_NOT_CONVERGED;
}

int flesh_multipliers_accept(flesh_multipliers *self, const flesh_stage *stage, flesh_state *state)
{
  const size_t bytes = (size_t)self->count * sizeof *self->trial;
  int status = FLESH_OK;
  if (!self->count) return FLESH_OK;
  memset(self->lag, 0, bytes);
  if (stage->shift.x != 1) {
    const flesh_point point = flesh_nonlinear_point(self->nonlinear);
    status = flesh_system_constraint_gaps(self->system, &point, self->lag, NULL);
  }
  for (int k = 0; k < self->count; k++)
    state->multipliers[k] = self->trial[k] + stage->penalty * self->stiffness[k] * self->lag[k];
  self->goes_on = 1;
  return status;
}

void flesh_multipliers_forget(flesh_multipliers *self) { self->goes_on = 0; }

void flesh_multipliers_archive(flesh_multipliers *self, flesh_archive *archive)
{
  double *of_tets[] = {self->own, self->lag};
  if (!self->count) return;
  for (size_t k = 0; k < sizeof of_tets / sizeof of_tets[0]; k++)
    flesh_archive_tets(archive, of_tets[k], (size_t)self->count);
  FLESH_ARCHIVE(archive, self->left);
  FLESH_ARCHIVE(archive, self->goes_on);
}
