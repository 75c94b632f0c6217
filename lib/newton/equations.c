/* equations.c: evaluates the equations of a stage, and caches the last results. */
#include "newton/equations.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "linear/block_matrix.h"
#include "system/feasible_step.h"
#include "system/ranks.h"

enum { SCRATCH = 4, VECTORS = SCRATCH + 6 };

/* Mean positive diagonal entry of the rest stiffness, which scales the constrained rows. */
static double typical_stiffness(flesh_equations *self)
{
  flesh_evaluation *e = &self->evaluation;
  const double *X = flesh_mesh_positions(flesh_system_mesh(self->system));
  memset(e->v, 0, (size_t)self->n * sizeof *e->v);
  const flesh_point point = flesh_point_at(0, X, e->v, e->v);
  double sum[2] = {0}; /* sum of the entries, and their number */
  if (flesh_system_jacobian(self->system, &point, &(flesh_shift){.x = 1, .v = 1, .a = 1}, self->K)) return 1;
  for (int i = 0; i < self->K->rows; i++)
    for (int c = 0; c < 3; c++) {
      double d = self->K->values[9 * (size_t)self->K->row_start[i] + 4 * c];
      if (d > 0 && d < INFINITY) {
        sum[0] += d;
        sum[1]++;
      }
    }
  flesh_team_sum(self->team, 2, sum);
  return sum[1] > 0 ? sum[0] / sum[1] : 1;
}

int flesh_equations_init(const flesh_system *system, const flesh_solver_options *options, flesh_threads *threads,
                         flesh_solve_stats *stats, flesh_equations *self)
{
  flesh_constrained *constrained = &self->constrained;
  *self = (flesh_equations){.system = system, .options = options, .threads = threads, .stats = stats,
                            .team = flesh_system_team(system), .n = flesh_system_unknowns(system)};
  const size_t n = (size_t)self->n;
  size_t stride;
  constrained->is = flesh_calloc(n + 1, 1);
  constrained->dofs = flesh_calloc(n + 1, sizeof *constrained->dofs);
  constrained->rows = flesh_calloc(n / 3 + 1, sizeof *constrained->rows);
  self->scratch = flesh_huge_pages_vectors(VECTORS, n, &stride);
  double **vectors[] = {&constrained->u, &self->trial, &self->work[0], &self->work[1], &self->proposal,
                       &self->relative};
  for (size_t k = SCRATCH; self->scratch && k < VECTORS; k++) *vectors[k - SCRATCH] = self->scratch + k * stride;
  const int failed = !constrained->is || !constrained->dofs || !constrained->rows || !self->scratch;
  int status = failed ? flesh_fail(FLESH_ERR_MEMORY, "no memory for %d unknowns", self->n)
                      : flesh_system_matrix_create(system, &self->K);
  if (!status) status = flesh_evaluation_create(system, threads, &self->evaluation);
  if (!status) status = flesh_evaluation_keep_places(&self->evaluation);
  if (status) flesh_equations_clear(self);
  return status;
}

void flesh_equations_measure(flesh_equations *self) { self->constrained.stiffness = typical_stiffness(self); }

void flesh_equations_clear(flesh_equations *self)
{
  flesh_constrained *constrained = &self->constrained;
  flesh_free(constrained->is);
  flesh_free(constrained->dofs);
  flesh_free(constrained->rows);
  flesh_free(self->scratch); /* all other vectors are in the same allocation */
  flesh_evaluation_clear(&self->evaluation);
  flesh_block_matrix_destroy(&self->K);
  memset(self, 0, sizeof *self);
}

/* Lists the constrained rows and dofs. */
static void list_constrained(flesh_equations *self)
{
  flesh_constrained *constrained = &self->constrained;
  constrained->row_count = flesh_block_rows_to_fix(self->K, constrained->is, constrained->rows);
  constrained->count = 0;
  for (int d = 0; d < self->n; d++)
    if (constrained->is[d]) constrained->dofs[constrained->count++] = d;
  memset(constrained->u, 0, (size_t)self->n * sizeof *constrained->u);
}

int flesh_equations_find_constrained(flesh_equations *self, double t, const uint8_t *held)
{
  flesh_constrained *constrained = &self->constrained;
  uint8_t *before = (uint8_t *)self->scratch;
  memcpy(before, constrained->is, (size_t)self->n);
  flesh_system_fixed(self->system, t, constrained->is);
  for (int d = 0; d < self->n && held; d++) constrained->is[d] |= held[d];
  const int changed = memcmp(before, constrained->is, (size_t)self->n) != 0;
  if (changed) list_constrained(self);
  return changed;
}

int flesh_equations_archive(flesh_equations *self, int matrix, flesh_archive *archive)
{
  flesh_evaluation *e = &self->evaluation;
  const size_t vector = (size_t)self->n * sizeof(double);
  int grown, status = flesh_proximity_archive(&e->proximity, self->K, &grown, archive);
  self->patterns += grown;
  flesh_archive_bytes(archive, self->constrained.is, (size_t)self->n);
  FLESH_ARCHIVE(archive, e->known_end.potential.known);
  if (e->known_end.potential.known) flesh_archive_bytes(archive, e->known_end.x, vector);
  FLESH_ARCHIVE(archive, e->known_end.potential.phi);
  FLESH_ARCHIVE(archive, e->known_end.potential.magnitude);
  if (matrix) flesh_archive_bytes(archive, self->K->values, 9 * (size_t)self->K->row_start[self->K->rows] * sizeof(double));
  flesh_clearance_archive(&e->clearance, archive);
  if (archive->mode == FLESH_ARCHIVE_LOAD && !archive->wrong) list_constrained(self);
  return status;
}

int flesh_equations_set_stage(flesh_equations *self, const flesh_stage *stage)
{
  flesh_evaluation *e = &self->evaluation;
  flesh_constrained *constrained = &self->constrained;
  self->stage = *stage;
  if (!stage->x_lag) self->stage.x_lag = stage->x0, self->stage.t_lag = stage->t;
  if (!stage->v_lag) self->stage.v_lag = stage->v0 ? stage->v0 : e->zeros;
  if (!stage->x_from) self->stage.x_from = self->stage.x_lag, self->stage.t_from = self->stage.t_lag;
  flesh_evaluation_forget(e);
  flesh_proximity_begin(&e->proximity);
  self->refused = self->fatal = e->is_frozen = 0;
  /* The multipliers or materials may have changed although x has not. */
  if (stage->multipliers || flesh_equations_is_softened(self)) e->known_end.potential.known = 0;
  double numbers[2] = {flesh_equations_find_constrained(self, stage->t, stage->held), 0};
  const int *dofs = constrained->dofs, count = constrained->count;
  for (int k = 0; k < count; k++) constrained->u[dofs[k]] = stage->x0[dofs[k]];
  flesh_system_prescribe(self->system, stage->t, constrained->u);
  for (int k = 0; k < count; k++) {
    double *u = &constrained->u[dofs[k]];
    *u = stage->prescribed_fraction * (*u - stage->x0[dofs[k]]) / stage->shift.x;
    numbers[1] = fmax(numbers[1], fabs(*u));
  }
  flesh_team_largest(self->team, 2, numbers); /* so that all ranks continue alike */
  constrained->displacement = numbers[1];
  flesh_clearance_begin(&e->clearance, stage->t, stage->x0, self->stage.t_lag, self->stage.x_lag, self->stage.x_from);
  return numbers[0] > 0;
}

void flesh_equations_start(const flesh_equations *self, double *u)
{
  flesh_copy(self->threads, self->n, self->constrained.u, u);
}

/* Sets y = base + shift u from begin to end; without a base, y = shift u. */
static void move(int begin, int end, const double *base, double shift, const double *u, double *y)
{
  if (base)
    for (int d = begin; d < end; d++) y[d] = base[d] + shift * u[d];
  else
    for (int d = begin; d < end; d++) y[d] = shift * u[d];
}

typedef struct displacement {
  const flesh_equations *equations;
  const double *u;
  double *x, *v, *a; /* v and a NULL: only positions */
} displacement;

enum { DOFS = 4096 }; /* dofs of a task */

static void move_part(void *data, int part)
{
  const displacement *to = data;
  const flesh_stage *s = &to->equations->stage;
  const int n = to->equations->n, begin = part * DOFS, end = begin + DOFS < n ? begin + DOFS : n;
  move(begin, end, s->x0, s->shift.x, to->u, to->x);
  if (!to->v) return;
  move(begin, end, s->v0, s->shift.v, to->u, to->v);
  move(begin, end, s->a0, s->shift.a, to->u, to->a);
}

static void move_all(displacement to)
{
  const flesh_equations *self = to.equations;
  const flesh_constrained *constrained = &self->constrained;
  const flesh_stage *s = &self->stage;
  flesh_threads_run(self->threads, (self->n + DOFS - 1) / DOFS, move_part, &to);
  for (int k = 0; k < constrained->count; k++) {
    const int d = constrained->dofs[k];
    const double value = constrained->u[d];
    to.x[d] = s->x0[d] + s->shift.x * value;
    if (!to.v) continue;
    to.v[d] = (s->v0 ? s->v0[d] : 0) + s->shift.v * value;
    to.a[d] = (s->a0 ? s->a0[d] : 0) + s->shift.a * value;
  }
}

/* Largest displacement of a node at u from the start of the stage, m. */
static double displacement_to(const flesh_equations *self, const double *u)
{
  return fmax(flesh_clearance_moved(&self->evaluation.clearance, self->stage.shift.x, u),
              2 * fabs(self->stage.shift.x) * self->constrained.displacement);
}

/* Whether surfaces are far from each other at u; certain only if u has the constrained dofs at their places. */
static int is_far(flesh_equations *self, const double *u)
{
  flesh_clearance *clearance = &self->evaluation.clearance;
  int exact = 1, count = clearance->begins_far && clearance->u ? self->constrained.count : 0;
  for (int k = 0, d; k < count && exact; k++) d = self->constrained.dofs[k], exact = u[d] == self->constrained.u[d];
  return flesh_clearance_is_far(clearance, self->stage.x0, self->stage.shift.x, exact ? u : NULL);
}

flesh_point flesh_equations_point(flesh_equations *self, const double *u)
{
  flesh_evaluation *e = &self->evaluation;
  const flesh_stage *s = &self->stage;
  move_all((displacement){self, u, e->x, e->v, e->a});
  const int looks = e->clearance.free && e->clearance.least_left > 0;
  if (looks) {
    e->clearance.moved = displacement_to(self, u);
    e->clearance.moved_most = fmax(e->clearance.moved_most, e->clearance.moved);
    e->clearance.is_far = is_far(self, u);
  }
  e->at_stage = e->environment;
  e->at_stage.clearance = looks ? &e->clearance : NULL;
  if (self->far_away) e->at_stage.relative = flesh_equations_relative(self, u);
  flesh_point point = flesh_evaluation_point(e, s->t, e->x, e->v, e->a);
  point.environment = &e->at_stage;
  point.load = s->load;
  point.lagged = (flesh_lagged){s->t_lag, s->x_lag, s->v_lag};
  point.frozen = (flesh_frozen){s->x0, s->v0};
  if (e->is_frozen) point.frozen = (flesh_frozen){e->frozen, e->frozen + self->n};
  point.multipliers = s->multipliers;
  if (s->penalty > 0) point.penalty = s->penalty;
  point.internal = s->internal;
  return point;
}

int flesh_equations_freeze(flesh_equations *self, const double *u)
{
  flesh_evaluation *e = &self->evaluation;
  if (!e->frozen || !self->stage.frozen_at_solution) return 0;
  flesh_equations_point(self, u);
  flesh_copy(self->threads, self->n, e->x, e->frozen);
  flesh_copy(self->threads, self->n, e->v, e->frozen + self->n);
  e->is_frozen = 1;
  flesh_evaluation_forget(e);
  return 1;
}

int flesh_equations_is_clear(flesh_equations *self, const double *u)
{
  const flesh_evaluation *e = &self->evaluation;
  return !flesh_system_limits_step(self->system) || (e->clearance.free && e->clearance.least_left > 0 && is_far(self, u) &&
                                                     displacement_to(self, u) < e->clearance.least_left);
}

/* Whether no effect limits the straight step from the lagged state to x. */
static int is_free_to(const flesh_equations *self, const double *x)
{
  const flesh_stage *s = &self->stage;
  return flesh_system_max_feasible_step(self->system, &self->evaluation.proximity, s->internal, s->t_from, s->x_from, s->t,
                                        x) == 1;
}

int flesh_equations_is_feasible(flesh_equations *self, const double *u, double beyond)
{
  if (flesh_equations_is_clear(self, u)) return 1;
  move_all((displacement){.equations = self, .u = u, .x = self->scratch});
  for (int d = 0; beyond > 0 && d < self->n; d++) self->scratch[d] += beyond * (self->scratch[d] - self->stage.x_from[d]);
  return is_free_to(self, self->scratch);
}

void flesh_equations_take_free(const flesh_equations *self, const double *x, double *u)
{
  for (int d = 0; d < self->n; d++)
    if (!self->constrained.is[d]) u[d] = (x[d] - self->stage.x0[d]) / self->stage.shift.x;
}

void flesh_equations_keep_gaps(flesh_equations *self, double *u)
{
  const flesh_stage *s = &self->stage;
  double *x = self->scratch;
  if (flesh_equations_is_clear(self, u)) return;
  move_all((displacement){.equations = self, .u = u, .x = x});
  if (flesh_system_keep_gaps(self->system, &self->evaluation.proximity, s->internal, s->x_from, x))
    flesh_equations_take_free(self, x, u);
}

double flesh_equations_max_feasible_step(flesh_equations *self, const double *from, const double *to)
{
  flesh_evaluation *e = &self->evaluation;
  if (e->clearance.stays_far && e->clearance.moved_most < e->clearance.least_left && flesh_equations_is_clear(self, to))
    return 1;
  double *x_from = self->scratch, *x_to = x_from + self->n;
  move_all((displacement){.equations = self, .u = from, .x = x_from});
  move_all((displacement){.equations = self, .u = to, .x = x_to});
  return flesh_system_max_feasible_step(self->system, &e->proximity, self->stage.internal, self->stage.t, x_from,
                                        self->stage.t, x_to);
}

/* Replaces the constrained rows of the residual just evaluated at u, which is then known. */
static int finish_residual(flesh_equations *self, const double *u)
{
  flesh_evaluation *e = &self->evaluation;
  flesh_constrained *constrained = &self->constrained;
  for (int k = 0; k < constrained->count; k++) {
    const int d = constrained->dofs[k];
    e->residual.reactions[k] = e->residual.r[d];
    e->residual.r[d] = constrained->stiffness * (u[d] - constrained->u[d]);
  }
  if (!(flesh_norm(self->threads, self->n, e->residual.r) < INFINITY)) return FLESH_NONFINITE;
  flesh_evaluation_take_residual(e, u);
  return FLESH_OK;
}

/* Adds the energy of the constraints' springs to the potential, which is then known; the caller records its u. */
static void finish_potential(flesh_equations *self, const double *u)
{
  flesh_evaluation *e = &self->evaluation;
  double springs = 0; /* energy whose gradient is the constrained rows */
  for (int k = 0; k < self->constrained.count; k++) {
    const double off = u[self->constrained.dofs[k]] - self->constrained.u[self->constrained.dofs[k]];
    springs += self->constrained.dofs[k] < e->own ? off * off : 0;
  }
  flesh_team_sum(self->team, 1, &springs);
  e->potential.value += self->constrained.stiffness / 2 * springs;
  e->potential.magnitude += self->constrained.stiffness / 2 * springs;
  e->potential.known = 1;
}

int flesh_equations_residual(flesh_equations *self, const double *u, double *r)
{
  flesh_evaluation *e = &self->evaluation;
  if (!flesh_evaluation_knows_residual(e, u)) {
    flesh_point point = flesh_equations_point(self, u);
    flesh_evaluation_drop_residual(e);
    self->stats->residuals++;
    if (!flesh_equations_are_guarded(self) && !flesh_equations_is_clear(self, u) && !is_free_to(self, e->x))
      return self->refused = FLESH_UNDEFINED;
    int status = flesh_equations_keep_fatal(self, flesh_system_residual(self->system, &point, e->residual.r));
    if (!status) status = finish_residual(self, u);
    if (status) return self->refused = status;
  }
  if (r != e->residual.r) flesh_copy(self->threads, self->n, e->residual.r, r);
  return FLESH_OK;
}

int flesh_equations_potential(flesh_equations *self, const double *u, double *phi, double *magnitude)
{
  flesh_evaluation *e = &self->evaluation;
  if (!flesh_evaluation_knows_potential(e, u)) {
    flesh_point point = flesh_equations_point(self, u);
    e->potential.known = 0;
    self->stats->potentials++;
    flesh_position_potential *by_position = &e->potential.by_position;
    *by_position = e->known_end.potential;
    if (self->stage.shift.x != 1 || !flesh_evaluation_is_at_known_end(e)) by_position->known = 0;
    int status = flesh_system_potential_by_position(self->system, &point, &self->stage.shift, by_position,
                                                    &e->potential.value, &e->potential.magnitude);
    if (status) return flesh_equations_keep_fatal(self, status);
    finish_potential(self, u);
    flesh_evaluation_take_potential(e, u);
  }
  *phi = e->potential.value;
  *magnitude = e->potential.magnitude;
  return FLESH_OK;
}

int flesh_equations_evaluate(flesh_equations *self, const double *u, double *phi, double *magnitude)
{
  flesh_evaluation *e = &self->evaluation;
  if (!flesh_evaluation_knows_potential(e, u) && !flesh_evaluation_knows_residual(e, u)) {
    flesh_point point = flesh_equations_point(self, u);
    flesh_evaluation_forget(e);
    self->stats->residuals++;
    self->stats->potentials++;
    flesh_position_potential *by_position = &e->potential.by_position;
    int status = flesh_system_evaluate_by_position(self->system, &point, &self->stage.shift, by_position,
                                              e->residual.r, &e->potential.value, &e->potential.magnitude);
    if (status) return flesh_equations_keep_fatal(self, status);
    finish_potential(self, u);
    /* A residual without a finite norm is refused when it is asked for. */
    e->potential.with_residual = finish_residual(self, u) == FLESH_OK;
    if (!e->potential.with_residual) flesh_evaluation_take_potential(e, u);
  }
  return flesh_equations_potential(self, u, phi, magnitude);
}

void flesh_equations_save_end(flesh_equations *self, const double *u)
{
  flesh_evaluation *e = &self->evaluation;
  e->known_end.potential.known = 0;
  if (self->stage.shift.x != 1 || flesh_equations_is_softened(self) || self->far_away || !flesh_evaluation_knows_potential(e, u))
    return; /* this end of the stage is no end of a step, or x is rounded there */
  flesh_equations_point(self, u);
  flesh_copy(self->threads, self->n, e->x, e->known_end.x);
  e->known_end.potential = e->potential.by_position;
  e->known_end.potential.far = e->at_stage.clearance && e->clearance.is_far;
}

void flesh_equations_constrain_matrix(flesh_equations *self)
{
  flesh_constrained *constrained = &self->constrained;
  flesh_block_fix_rows(self->K, constrained->is, constrained->stiffness, constrained->row_count,
                       constrained->rows);
}

int flesh_equations_assemble(flesh_equations *self, const double *u, flesh_eigenvalue_filter filter)
{
  flesh_constrained *constrained = &self->constrained;
  flesh_point point = flesh_equations_point(self, u);
  flesh_shift shift = self->stage.shift;
  shift.filter = filter;
  self->stats->assemblies++;
  self->stats->projections += filter != FLESH_FILTER_NONE;
  int grown, status = flesh_proximity_cover(&self->evaluation.proximity, &point, self->K, &grown);
  if (grown) {
    self->patterns++;
    constrained->row_count = flesh_block_rows_to_fix(self->K, constrained->is, constrained->rows);
  }
  flesh_proximity_predict(&self->evaluation.proximity, &point);
  if (!status) status = flesh_system_jacobian(self->system, &point, &shift, self->K);
  if (!status) flesh_equations_constrain_matrix(self);
  return flesh_equations_keep_fatal(self, status);
}

int flesh_equations_assemble_mass(flesh_equations *self, double t, const double *x, const double *v)
{
  flesh_evaluation *e = &self->evaluation;
  const size_t bytes = (size_t)self->n * sizeof *x;
  if (x != e->x) memcpy(e->x, x, bytes);
  if (v != e->v) memcpy(e->v, v, bytes);
  flesh_evaluation_forget(e);
  self->stats->assemblies++;
  const flesh_point point = flesh_evaluation_point(e, t, e->x, e->v, e->a);
  return flesh_system_jacobian(self->system, &point, &(flesh_shift){.a = 1}, self->K);
}

int flesh_equations_load_norm(flesh_equations *self, const double *u, double *norm)
{
  flesh_point point = flesh_equations_point(self, u);
  double *r = self->scratch;
  int status = flesh_system_load(self->system, &point, r);
  if (status) return status;
  for (int k = 0; k < self->constrained.count; k++) r[self->constrained.dofs[k]] = 0;
  *norm = flesh_equations_norm(self, r);
  return *norm < INFINITY ? FLESH_OK : FLESH_NONFINITE;
}
