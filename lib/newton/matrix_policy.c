/* matrix_policy.c: cost and savings of older matrices and preconditioners. */
#include "newton/matrix_policy.h"

#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/team.h"
#include "newton/mechanisms.h"

/* Cost of a new preconditioner in iterations: it is made after that many excess iterations with an old one. */
enum { NEW_ONE = 6 };

static int uses(const flesh_matrix_policy *self, flesh_technique technique)
{
  return flesh_uses(self->equations->options, technique);
}

/* Drift of the stiff rows from which on the preconditioner is made anew. */
static const double MOST_DRIFT = 0.1;

/* Fraction of the target that solves aim at; ending lower gains nothing. */
static const double AIM = 0.5;
/* Largest fraction of the residual's norm that a good iteration leaves; if more is left, the residual has stopped falling. */
static const double FALLING = 0.3;
/* Largest factor by which a failed prediction raises the safety of later ones, and the fractions of safety factor and drift
 * that remain at the next stage. */
static const double MOST_RAISED = 8, STAYS = 0.95, DRIFT_STAYS = 0.97;

int flesh_matrix_policy_init(flesh_equations *equations, flesh_direction *direction, flesh_matrix_policy *self)
{
  *self = (flesh_matrix_policy){.equations = equations, .direction = direction};
  if (equations->options->linear_solver != FLESH_LINEAR_PCG) return FLESH_OK;
  self->inertia = flesh_malloc(((size_t)equations->n + 1) * sizeof *self->inertia);
  return self->inertia ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for %d unknowns", equations->n);
}

void flesh_matrix_policy_measure(flesh_matrix_policy *self)
{
  if (!self->inertia) return;
  flesh_equations *equations = self->equations;
  const flesh_block_matrix *K = equations->K;
  const double *X = flesh_mesh_positions(flesh_system_mesh(equations->system));
  const flesh_point point = flesh_point_at(0, X, equations->evaluation.zeros, equations->evaluation.zeros);
  const int failed =
      flesh_system_jacobian(equations->system, &point, &(flesh_shift){.a = 1}, equations->K) != FLESH_OK;
  for (int d = 0; d < equations->n; d++)
    self->inertia[d] = failed ? 0 : (float)K->values[9 * (size_t)K->row_start[d / 3] + 4 * (size_t)(d % 3)];
}

void flesh_matrix_policy_clear(flesh_matrix_policy *self)
{
  flesh_free(self->inertia);
  memset(self, 0, sizeof *self);
}

/* A stage that continues the one before keeps its preconditioner while step and constraints are the same, because a body
 * changes little from step to step. It may also keep the matrix of a slow motion, while that predicts residuals. */
void flesh_matrix_policy_begin_stage(flesh_matrix_policy *self, int constraints_changed, const flesh_solve_stats *last)
{
  const flesh_shift *now = &self->equations->stage.shift, *before = &self->prepared_for;
  self->previous_norm = self->smallest_norm = 0;
  if (now->x != before->x || now->v != before->v || now->a != before->a || now->a == 0) self->round_off = 0;
  const int was_hard = last->newton > 3 || last->projections > 0 || last->backtracks > 0;
  if (was_hard) self->age = -1;
  if (was_hard || !self->stage_continues) self->curvature = 0;
  if (constraints_changed || !self->stage_continues || now->x != before->x || now->v != before->v ||
      now->a != before->a) {
    self->direction->iterations_per_decade[0] = self->direction->iterations_per_decade[1] = 0;
    self->drift = 0;
    self->safety_factor = 1;
    self->age = -1;
  } else if (self->age >= 0) {
    self->age++;
  }
  /* The model may have become better since: trust it again, slowly. */
  self->safety_factor = fmax(1, STAYS * self->safety_factor);
  if (!self->kept) self->drift *= DRIFT_STAYS;
  self->stage_continues = 0;
}

void flesh_matrix_policy_end_stage(flesh_matrix_policy *self, const double *u)
{
  const double before = self->smallest_norm; /* 0: nothing was to be solved */
  const flesh_evaluation *evaluation = &self->equations->evaluation;
  const int measures = before > 0 && (self->kept ? self->age > 0 : self->age == 0);
  if (!measures || !flesh_evaluation_knows_residual(evaluation, u)) return;
  const double error = flesh_direction_model_error(self->direction, evaluation->residual.r);
  if (self->kept) self->drift = error / (before * self->age);
  else self->curvature = error / (before * before);
}

void flesh_matrix_policy_assembled(flesh_matrix_policy *self) { self->kept = self->age = 0; }

void flesh_matrix_policy_overwritten(flesh_matrix_policy *self) { self->age = -1; }

/* Whether K of an earlier stage serves for a stage's first iteration: the residual that it does not predict meets the
 * target after one or two iterations. */
static int drifts_little(const flesh_matrix_policy *self, double norm)
{
  static const double unknown = 1e5; /* multiple of the target from which two iterations reach it if K drifts little */
  const double drift = self->drift * self->age, once = drift * norm, twice = self->safety_factor * drift * once;
  if (self->age < 1 || !(self->target > 0)) return 0;
  return drift > 0 ? fmin(4 * once, 5 * twice) <= self->target : norm < unknown * self->target;
}

/* Whether K, new in this stage, serves for two more iterations, the second of which removes what the first did not predict:
 * a residual and a few linear iterations cost less than another matrix. */
static int serves_twice(const flesh_matrix_policy *self, double norm)
{
  const double next = self->predicted_error;
  return self->age == 0 && 2 * self->safety_factor * next * next <= AIM * self->target * norm;
}

int flesh_matrix_policy_keep(flesh_matrix_policy *self, int usable, const double *r)
{
  const double before = self->smallest_norm, norm = flesh_equations_norm(self->equations, r);
  if (!usable || !(norm > 0)) return 0;
  if (!(before > 0)) {
    if (!uses(self, FLESH_TECHNIQUE_MATRICES_ACROSS_STEPS) || !drifts_little(self, norm)) return 0;
  } else if (!uses(self, FLESH_TECHNIQUE_KEPT_MATRICES)) {
    return 0;
  } else if (self->equations->evaluation.is_frozen) {
    /* The prediction mostly fails because the frozen state has moved, which another matrix would not predict either. */
    if (!(norm < 0.1 * before)) return 0;
    self->predicted_error = norm * norm / before;
  } else {
    if (!(norm < before)) return 0;
    const double error = flesh_direction_model_error(self->direction, r);
    if (self->age > 0) self->drift = error / (before * self->age);
    else if (self->kept) self->safety_factor *= fmin(fmax(error / self->predicted_error, 1), MOST_RAISED);
    else self->curvature = error / (before * before);
    /* The error of the prediction from the last iterate is |K'| step^2 / 2, or more if another step was taken. The next
     * step is shorter by norm / before, or by less if residuals get softer, and its error is |K'| step times its own
     * length. */
    self->predicted_error = 2 * self->safety_factor * error * norm / before;
    if (!(self->predicted_error <= AIM * self->target) && !serves_twice(self, norm)) return 0;
  }
  self->kept = 1;
  return 1;
}

typedef struct search {
  const flesh_matrix_policy *policy;
  _Atomic int found;
} search;

/* Round-off moves a row by a few units in the last place of its diagonal; inertia is a lower bound of the stiffness of the
 * softest displacements. If the diagonal is this many times the inertia, their stiffness changes by less than a hundredth
 * (or two where the mass is consistent, as it may be half of its diagonal). Steps take as many iterations up to 7e4, and
 * some hundredths more from 1e5 on, still in less time. */
static void seek_too_stiff(void *data, int k, int begin, int end)
{
  (void)k;
  static const double most = 4e5;
  search *s = data;
  const flesh_equations *equations = s->policy->equations;
  const flesh_block_matrix *K = equations->K;
  for (int d = begin; d < end && !atomic_load_explicit(&s->found, memory_order_relaxed); d++) {
    const double stiffness = K->values[9 * (size_t)K->row_start[d / 3] + 4 * (size_t)(d % 3)];
    if (!equations->constrained.is[d] && !(stiffness < most * equations->stage.shift.a * (double)s->policy->inertia[d]))
      atomic_store_explicit(&s->found, 1, memory_order_relaxed);
  }
}

/* Whether solves with K in single precision are as good as with K, on all ranks. */
static int may_be_rounded(const flesh_matrix_policy *self)
{
  search s = {.policy = self};
  flesh_parallel_parts(self->equations->threads, self->equations->n, seek_too_stiff, &s);
  return !flesh_team_any(self->equations->team, s.found);
}

int flesh_matrix_policy_refresh(flesh_matrix_policy *self)
{
  self->prepared_for = self->equations->stage.shift;
  const int single = uses(self, FLESH_TECHNIQUE_SINGLE_PRECISION) && self->inertia && may_be_rounded(self);
  return flesh_direction_factor(self->direction, single);
}

int flesh_matrix_policy_prepare(flesh_matrix_policy *self)
{
  const flesh_direction *direction = self->direction;
  const double *per_decade = direction->iterations_per_decade;
  if (direction->direct && self->kept) return FLESH_OK;
  if (!self->kept && !uses(self, FLESH_TECHNIQUE_KEPT_PRECONDITIONERS)) return flesh_matrix_policy_refresh(self);
  if (direction->preconditioner && direction->linear->preconditioner_drift(direction->preconditioner) > MOST_DRIFT)
    return flesh_matrix_policy_refresh(self);
  if (!self->kept && flesh_direction_stiffened(direction) >= NEW_ONE)
    return flesh_matrix_policy_refresh(self);
  if (direction->preconditioner && per_decade[0] + per_decade[1] > 0 && direction->excess_iterations < NEW_ONE)
    return FLESH_OK;
  return flesh_matrix_policy_refresh(self);
}

/* Linear tolerance with a kept matrix, relative to its predicted model error; a smaller tolerance gains nothing. */
static const double KEPT_DEPTH = 0.8;

/* Least tolerance of a stage's first solve, relative to the residual: single precision serves down to 1e-5. */
static const double DEEPEST_FIRST = 2e-5;

/* Returns the tolerance of a linear solve. If Newton's iteration converges fast, the tolerance follows it (Eisenstat &
 * Walker 1996, choice 2), so that the linear solve does not spoil the last step. It is at least half the target, because
 * less gains nothing, and exactly that near the target. Recovering from an increase of the residual does not count as
 * convergence. A stage's first solve is as exact as the new matrices of recent stages predicted, within single precision. */
double flesh_matrix_policy_tolerance(flesh_matrix_policy *self, double norm, double tolerance)
{
  const double before = self->smallest_norm, rate = norm / before, least = AIM * self->target;
  if (!(before > 0) || norm < before) self->smallest_norm = norm;
  if (self->target == 0) return tolerance;
  if (before > 0 && self->kept) return fmax(least, KEPT_DEPTH * self->predicted_error);
  if (!uses(self, FLESH_TECHNIQUE_FORCING_TERMS)) return fmax(least, tolerance);
  if (!(before > 0)) {
    const double unpredicted = self->curvature > 0 ? fmax(self->curvature * norm, DEEPEST_FIRST) * norm : tolerance;
    return fmax(least, fmin(tolerance, unpredicted));
  }
  const double expected = 0.9 * rate * rate * norm;
  return expected < 20 * least ? least : fmin(tolerance, expected);
}

/* Multiple of the last measured round-off (in motion, at this shift) above which a residual is not measured again. */
static const double AGAIN = 1e4;

/* Measuring round-off costs a residual, so it is done only where the norm is suspiciously small or has stopped falling:
 * compared with the one before or, while recovering from an increase, with the smallest. */
int flesh_matrix_policy_at_round_off(flesh_matrix_policy *self, double norm, const double *u)
{
  flesh_equations *equations = self->equations;
  const double before = self->previous_norm;
  self->previous_norm = norm;
  if (norm < FALLING * before && norm < FALLING * self->smallest_norm) return 0;
  if (norm < FALLING * before || before == 0) return flesh_equations_at_round_off(equations, u, norm);
  if (norm > AGAIN * self->round_off && self->round_off > 0) return 0;
  self->round_off = flesh_equations_residual_round_off(equations, u);
  return norm <= FLESH_ROUND_OFF_LEAVES * self->round_off;
}
