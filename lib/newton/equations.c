/* equations.c: evaluates the equations of a stage, and keeps what was evaluated last. */
#include "newton/equations.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "linear/block_matrix.h"
#include "system/feasible_step.h"
#include "system/ranks.h"

/* Mean positive diagonal entry of the rest stiffness: the scale of the constrained rows. */
static double typical_stiffness(flesh_equations *self)
{
  const double *X = flesh_mesh_positions(flesh_system_mesh(self->system));
  memset(self->v, 0, (size_t)self->n * sizeof *self->v);
  const flesh_point point = flesh_point_at(0, X, self->v, self->v);
  double sum[2] = {0}; /* and how many there are */
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

int flesh_equations_init(const flesh_system *system, flesh_threads *threads, flesh_solve_stats *stats, int check_reach,
                         flesh_equations *self)
{
  *self = (flesh_equations){.system = system, .threads = threads, .stats = stats, .check_reach = check_reach,
                            .team = flesh_system_team(system)};
  self->n = flesh_system_unknowns(system);
  self->constrained = flesh_calloc((size_t)self->n + 1, 1);
  self->constrained_dofs = flesh_calloc((size_t)self->n + 1, sizeof *self->constrained_dofs);
  self->constrained_rows = flesh_calloc((size_t)self->n / 3 + 1, sizeof *self->constrained_rows);
  double **vectors[] = {&self->u_constrained, &self->x, &self->v, &self->a, &self->residual.u, &self->residual.r,
                        &self->residual.reactions, &self->potential.u, &self->reached.x, &self->zeros};
  enum { SCRATCH = 4, VECTORS = sizeof vectors / sizeof vectors[0] };
  size_t apart;
  double *memory = self->scratch = flesh_huge_pages_vectors(VECTORS + SCRATCH, (size_t)self->n, &apart);
  for (size_t k = 0; memory && k < VECTORS; k++) *vectors[k] = memory + (SCRATCH + k) * apart;
  const int freezes = flesh_system_freezes(system);
  if (freezes) self->frozen = flesh_malloc((2 * (size_t)self->n + 1) * sizeof *self->frozen);
  const int failed = !self->constrained || !self->constrained_dofs || !self->constrained_rows || !memory ||
                     (freezes && !self->frozen);
  int status = failed ? flesh_fail(FLESH_ERR_MEMORY, "no memory for %d unknowns", self->n)
                      : flesh_system_matrix_create(system, &self->K);
  if (!status) status = flesh_evaluation_create(system, threads, &self->evaluation);
  self->evaluation.environment.proximity = &self->proximity;
  if (!status) status = flesh_clearance_create(system, threads, &self->clearance);
  if (!status) status = flesh_proximity_create(system, threads, &self->proximity);
  status = flesh_team_agree(self->team, status);
  if (!status) self->constraint_stiffness = typical_stiffness(self);
  else flesh_equations_clear(self);
  return status;
}

void flesh_equations_clear(flesh_equations *self)
{
  flesh_free(self->constrained);
  flesh_free(self->constrained_dofs);
  flesh_free(self->constrained_rows);
  flesh_free(self->frozen);
  flesh_free(self->scratch); /* and all other vectors with it */
  flesh_evaluation_clear(&self->evaluation);
  flesh_clearance_clear(&self->clearance);
  flesh_proximity_clear(&self->proximity);
  flesh_block_matrix_destroy(&self->K);
  memset(self, 0, sizeof *self);
}

size_t flesh_equations_memory(const flesh_equations *self)
{
  return (size_t)self->n * ((self->frozen ? 16 : 14) * sizeof(double) + sizeof(int) + 1) +
         flesh_evaluation_memory(&self->evaluation) + flesh_clearance_memory(&self->clearance) + flesh_proximity_memory(&self->proximity) +
         (size_t)self->n / 3 * sizeof(int) +
         (size_t)self->K->row_start[self->K->rows] * 9 * sizeof(double);
}

/* What follows from which dofs are constrained. */
static void list_constrained(flesh_equations *self)
{
  self->constrained_row_count = flesh_block_rows_to_fix(self->K, self->constrained, self->constrained_rows);
  self->constrained_count = 0;
  for (int d = 0; d < self->n; d++)
    if (self->constrained[d]) self->constrained_dofs[self->constrained_count++] = d;
  memset(self->u_constrained, 0, (size_t)self->n * sizeof *self->u_constrained);
}

int flesh_equations_find_constrained(flesh_equations *self, double t, const uint8_t *held)
{
  uint8_t *before = (uint8_t *)self->scratch;
  memcpy(before, self->constrained, (size_t)self->n);
  flesh_system_fixed(self->system, t, self->constrained);
  for (int d = 0; d < self->n && held; d++) self->constrained[d] |= held[d];
  double changed = memcmp(before, self->constrained, (size_t)self->n) != 0;
  if (changed > 0) list_constrained(self);
  flesh_team_largest(self->team, 1, &changed); /* all ranks go on alike */
  return changed > 0;
}

int flesh_equations_archive(flesh_equations *self, int matrix, flesh_archive *archive)
{
  const size_t vector = (size_t)self->n * sizeof(double);
  int grown, status = flesh_proximity_archive(&self->proximity, self->K, &grown, archive);
  self->patterns += grown;
  flesh_archive_bytes(archive, self->constrained, (size_t)self->n);
  flesh_archive_bytes(archive, self->reached.x, vector);
  FLESH_ARCHIVE(archive, self->reached.there.known);
  FLESH_ARCHIVE(archive, self->reached.there.phi);
  FLESH_ARCHIVE(archive, self->reached.there.magnitude);
  if (matrix) flesh_archive_bytes(archive, self->K->values, 9 * (size_t)self->K->row_start[self->K->rows] * sizeof(double));
  flesh_clearance_archive(&self->clearance, archive);
  if (archive->mode == FLESH_ARCHIVE_LOAD && !archive->wrong) list_constrained(self);
  return status;
}

int flesh_equations_set_stage(flesh_equations *self, const flesh_stage *stage)
{
  self->stage = *stage;
  if (!stage->x_lag) self->stage.x_lag = stage->x0, self->stage.t_lag = stage->t;
  if (!stage->v_lag) self->stage.v_lag = stage->v0 ? stage->v0 : self->zeros;
  if (!stage->x_from) self->stage.x_from = self->stage.x_lag, self->stage.t_from = self->stage.t_lag;
  self->residual.known = self->potential.known = self->refused = self->is_frozen = 0;
  /* They may have changed where x has not. */
  if (stage->multipliers || stage->softened) self->reached.there.known = 0;
  const int changed = flesh_equations_find_constrained(self, stage->t, stage->held);
  const int *dofs = self->constrained_dofs, count = self->constrained_count;
  for (int k = 0; k < count; k++) self->u_constrained[dofs[k]] = stage->x0[dofs[k]];
  flesh_system_prescribe(self->system, stage->t, self->u_constrained);
  self->constrained_displacement = 0;
  for (int k = 0; k < count; k++) {
    double *u = &self->u_constrained[dofs[k]];
    *u = stage->prescribed_fraction * (*u - stage->x0[dofs[k]]) / stage->shift.x;
    self->constrained_displacement = fmax(self->constrained_displacement, fabs(*u));
  }
  if (self->clearance.free) flesh_team_largest(self->team, 1, &self->constrained_displacement);
  flesh_clearance_begin(&self->clearance, stage->t, stage->x0, self->stage.t_lag, self->stage.x_lag);
  return changed;
}

void flesh_equations_start(const flesh_equations *self, double *u)
{
  flesh_copy(self->threads, self->n, self->u_constrained, u);
}

/* y = base + shift u from begin to end; without a base, 0. */
static void move(int begin, int end, const double *base, double shift, const double *u, double *y)
{
  if (base)
    for (int d = begin; d < end; d++) y[d] = base[d] + shift * u[d];
  else
    for (int d = begin; d < end; d++) y[d] = shift * u[d];
}

typedef struct displacement {
  flesh_equations *equations;
  const double *u;
} displacement;

enum { DOFS = 4096 }; /* of a task */

static void move_part(void *data, int part)
{
  const displacement *from = data;
  flesh_equations *self = from->equations;
  const flesh_stage *s = &self->stage;
  const int begin = part * DOFS, end = begin + DOFS < self->n ? begin + DOFS : self->n;
  move(begin, end, s->x0, s->shift.x, from->u, self->x);
  move(begin, end, s->v0, s->shift.v, from->u, self->v);
  move(begin, end, s->a0, s->shift.a, from->u, self->a);
}

/* How far a node at u is from where the stage begins, at most, m. */
static double displacement_to(const flesh_equations *self, const double *u)
{
  return fmax(flesh_clearance_moved(&self->clearance, self->stage.shift.x, u),
              2 * fabs(self->stage.shift.x) * self->constrained_displacement);
}

flesh_point flesh_equations_point_at(const flesh_equations *self, double t, const double *x, const double *v,
                                     const double *a)
{
  flesh_point point = flesh_point_at(t, x, v, a);
  point.threads = self->threads;
  point.environment = &self->evaluation.environment;
  return point;
}

flesh_point flesh_equations_point(flesh_equations *self, const double *u)
{
  const flesh_stage *s = &self->stage;
  flesh_threads_run(self->threads, (self->n + DOFS - 1) / DOFS, move_part, &(displacement){self, u});
  for (int k = 0; k < self->constrained_count; k++) {
    const int d = self->constrained_dofs[k];
    const double value = self->u_constrained[d];
    self->x[d] = s->x0[d] + s->shift.x * value;
    self->v[d] = (s->v0 ? s->v0[d] : 0) + s->shift.v * value;
    self->a[d] = (s->a0 ? s->a0[d] : 0) + s->shift.a * value;
  }
  const int looks = self->clearance.free && self->clearance.least_left > 0;
  if (looks) {
    self->clearance.moved = displacement_to(self, u);
    self->clearance.moved_most = fmax(self->clearance.moved_most, self->clearance.moved);
  }
  self->at_stage = self->evaluation.environment;
  self->at_stage.clearance = looks ? &self->clearance : NULL;
  self->at_stage.softened = s->softened;
  flesh_point point = flesh_equations_point_at(self, s->t, self->x, self->v, self->a);
  point.environment = &self->at_stage;
  point.load = s->load;
  point.lagged = (flesh_lagged){s->t_lag, s->x_lag, s->v_lag};
  point.frozen = (flesh_frozen){s->x0, s->v0};
  if (self->is_frozen) point.frozen = (flesh_frozen){self->frozen, self->frozen + self->n};
  point.multipliers = s->multipliers;
  if (s->penalty > 0) point.penalty = s->penalty;
  point.internal = s->internal;
  return point;
}

int flesh_equations_freeze(flesh_equations *self, const double *u)
{
  if (!self->frozen || !self->stage.frozen_at_solution) return 0;
  flesh_equations_point(self, u);
  flesh_copy(self->threads, self->n, self->x, self->frozen);
  flesh_copy(self->threads, self->n, self->v, self->frozen + self->n);
  self->is_frozen = 1;
  self->residual.known = self->potential.known = 0;
  return 1;
}

int flesh_equations_is_clear(const flesh_equations *self, const double *u)
{
  if (!flesh_system_limits_step(self->system)) return 1;
  if (self->proximity.near) return 0; /* nodes are always near some others */
  return self->clearance.free && self->clearance.least_left > 0 && displacement_to(self, u) < self->clearance.least_left;
}

int flesh_equations_can_reach(flesh_equations *self, const double *u)
{
  const flesh_stage *s = &self->stage;
  if (flesh_equations_is_clear(self, u)) return 1;
  flesh_equations_point(self, u);
  return flesh_system_max_feasible_step(self->system, &self->proximity, s->internal, s->t_from, s->x_from, s->t, self->x) ==
         1;
}

/* The free dofs of u become those of x. */
static void take_free(const flesh_equations *self, const double *x, double *u)
{
  for (int d = 0; d < self->n; d++)
    if (!self->constrained[d]) u[d] = (x[d] - self->stage.x0[d]) / self->stage.shift.x;
}

int flesh_equations_push_out(flesh_equations *self, double *u)
{
  const flesh_stage *s = &self->stage;
  if (flesh_equations_can_reach(self, u)) return FLESH_OK;
  flesh_system_push_out(self->system, s->t_from, s->x_from, s->t, self->x);
  take_free(self, self->x, u);
  if (flesh_equations_can_reach(self, u)) return FLESH_OK;
  /* Nothing is pushed out of other bodies: it stays where it was. */
  if (self->proximity.near) take_free(self, s->x_from, u);
  return self->proximity.near && flesh_equations_can_reach(self, u) ? FLESH_OK : FLESH_UNDEFINED;
}

double flesh_equations_max_feasible_step(flesh_equations *self, const double *from, const double *to)
{
  if (self->clearance.moved_most < self->clearance.least_left && flesh_equations_is_clear(self, to)) return 1;
  flesh_equations_point(self, from);
  memcpy(self->scratch, self->x, (size_t)self->n * sizeof *self->x);
  flesh_equations_point(self, to);
  return flesh_system_max_feasible_step(self->system, &self->proximity, self->stage.internal, self->stage.t, self->scratch,
                                        self->stage.t, self->x);
}

static int same(const flesh_equations *self, const double *u, const double *other)
{
  return flesh_same(self->threads, self->n, u, other);
}

/* Constraint rows of the residual just evaluated at u, which is then known. */
static int finish_residual(flesh_equations *self, const double *u)
{
  for (int k = 0; k < self->constrained_count; k++) {
    const int d = self->constrained_dofs[k];
    self->residual.reactions[k] = self->residual.r[d];
    self->residual.r[d] = self->constraint_stiffness * (u[d] - self->u_constrained[d]);
  }
  if (!(flesh_norm(self->threads, self->n, self->residual.r) < INFINITY)) return FLESH_NONFINITE;
  flesh_copy(self->threads, self->n, u, self->residual.u);
  self->residual.known = 1;
  return FLESH_OK;
}

/* The same of the potential, but for where it is. */
static void finish_potential(flesh_equations *self, const double *u)
{
  const int own = 3 * flesh_team_own(self->team, self->n / 3);
  double springs = 0; /* whose gradient the constrained rows are */
  for (int k = 0; k < self->constrained_count; k++) {
    const double off = u[self->constrained_dofs[k]] - self->u_constrained[self->constrained_dofs[k]];
    springs += self->constrained_dofs[k] < own ? off * off : 0;
  }
  flesh_team_sum(self->team, 1, &springs);
  self->potential.value += self->constraint_stiffness / 2 * springs;
  self->potential.magnitude += self->constraint_stiffness / 2 * springs;
  self->potential.known = 1;
}

static void keep_place(flesh_equations *self, const double *u)
{
  flesh_copy(self->threads, self->n, u, self->potential.u);
  self->potential.with_residual = 0;
}

int flesh_equations_knows_residual(const flesh_equations *self, const double *u)
{
  return self->residual.known && same(self, u, self->residual.u);
}

int flesh_equations_residual(flesh_equations *self, const double *u, double *r)
{
  if (!flesh_equations_knows_residual(self, u)) {
    flesh_point point = flesh_equations_point(self, u);
    if (self->potential.known && self->potential.with_residual) keep_place(self, self->residual.u);
    self->residual.known = 0;
    self->stats->residuals++;
    if (self->check_reach && !flesh_equations_can_reach(self, u)) return self->refused = FLESH_UNDEFINED;
    int status = flesh_system_residual(self->system, &point, self->residual.r);
    if (!status) status = finish_residual(self, u);
    if (status) return self->refused = status;
  }
  if (r != self->residual.r) flesh_copy(self->threads, self->n, self->residual.r, r);
  return FLESH_OK;
}

static int knows_potential(const flesh_equations *self, const double *u)
{
  return self->potential.known && same(self, u, self->potential.with_residual ? self->residual.u : self->potential.u);
}

int flesh_equations_potential(flesh_equations *self, const double *u, double *phi, double *magnitude)
{
  if (!knows_potential(self, u)) {
    flesh_point point = flesh_equations_point(self, u);
    self->potential.known = 0;
    self->stats->potentials++;
    flesh_position_potential *by_position = &self->potential.by_position;
    *by_position = self->reached.there;
    if (self->stage.shift.x != 1 || !same(self, self->x, self->reached.x)) by_position->known = 0;
    int status = flesh_system_potential_by_position(self->system, &point, &self->stage.shift, by_position,
                                                    &self->potential.value, &self->potential.magnitude);
    if (status) return status;
    finish_potential(self, u);
    keep_place(self, u);
  }
  *phi = self->potential.value;
  *magnitude = self->potential.magnitude;
  return FLESH_OK;
}

int flesh_equations_evaluate(flesh_equations *self, const double *u, double *phi, double *magnitude)
{
  if (!knows_potential(self, u) && !flesh_equations_knows_residual(self, u)) {
    flesh_point point = flesh_equations_point(self, u);
    self->residual.known = self->potential.known = 0;
    self->stats->residuals++;
    self->stats->potentials++;
    flesh_position_potential *by_position = &self->potential.by_position;
    int status = flesh_system_evaluate_by_position(self->system, &point, &self->stage.shift, by_position,
                                              self->residual.r, &self->potential.value, &self->potential.magnitude);
    if (status) return status;
    finish_potential(self, u);
    /* One without a finite norm is refused when it is asked for. */
    self->potential.with_residual = finish_residual(self, u) == FLESH_OK;
    if (!self->potential.with_residual) keep_place(self, u);
  }
  return flesh_equations_potential(self, u, phi, magnitude);
}

void flesh_equations_reach(flesh_equations *self, const double *u)
{
  self->reached.there.known = 0;
  if (self->stage.shift.x != 1 || self->stage.softened || !knows_potential(self, u))
    return; /* no step ends where the stage does */
  flesh_equations_point(self, u);
  flesh_copy(self->threads, self->n, self->x, self->reached.x);
  self->reached.there = self->potential.by_position;
}

void flesh_equations_constrain_matrix(flesh_equations *self)
{
  flesh_block_fix_rows(self->K, self->constrained, self->constraint_stiffness, self->constrained_row_count,
                       self->constrained_rows);
}

int flesh_equations_assemble(flesh_equations *self, const double *u, flesh_eigenvalue_filter filter)
{
  flesh_point point = flesh_equations_point(self, u);
  flesh_shift shift = self->stage.shift;
  shift.filter = filter;
  self->stats->assemblies++;
  self->stats->projections += filter != FLESH_FILTER_NONE;
  int grown, status = flesh_proximity_cover(&self->proximity, &point, self->K, &grown);
  if (grown) {
    self->patterns++;
    self->constrained_row_count = flesh_block_rows_to_fix(self->K, self->constrained, self->constrained_rows);
  }
  flesh_proximity_predict(&self->proximity, &point);
  if (!status) status = flesh_system_jacobian(self->system, &point, &shift, self->K);
  if (!status) flesh_equations_constrain_matrix(self);
  return status;
}

int flesh_equations_assemble_mass(flesh_equations *self, double t, const double *x, const double *v)
{
  const size_t bytes = (size_t)self->n * sizeof *x;
  if (x != self->x) memcpy(self->x, x, bytes);
  if (v != self->v) memcpy(self->v, v, bytes);
  self->residual.known = self->potential.known = 0;
  self->stats->assemblies++;
  const flesh_point point = flesh_equations_point_at(self, t, self->x, self->v, self->a);
  return flesh_system_jacobian(self->system, &point, &(flesh_shift){.a = 1}, self->K);
}

int flesh_equations_load_norm(flesh_equations *self, const double *u, double *norm)
{
  flesh_point point = flesh_equations_point(self, u);
  double *r = self->scratch;
  int status = flesh_system_load(self->system, &point, r);
  if (status) return status;
  for (int k = 0; k < self->constrained_count; k++) r[self->constrained_dofs[k]] = 0;
  *norm = flesh_norm(self->threads, self->n, r);
  return *norm < INFINITY ? FLESH_OK : FLESH_NONFINITE;
}
