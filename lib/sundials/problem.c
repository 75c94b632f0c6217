/* problem.c: evaluates the equations of a stage. */
#include "sundials/problem.h"

#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/large.h"
#include "sparse/block_matrix.h"

/* Mean positive diagonal entry of the rest stiffness: the scale of the constrained rows. */
static double typical_stiffness(flesh_problem *self)
{
  const double *X = flesh_mesh_positions(flesh_system_mesh(self->system));
  memset(self->v, 0, (size_t)self->n * sizeof *self->v);
  flesh_point point = {.t = 0, .load = 1, .x = X, .v = self->v, .a = self->v};
  double sum = 0;
  int count = 0;
  if (flesh_system_jacobian(self->system, &point, &(flesh_shift){.x = 1, .v = 1, .a = 1}, self->K)) return 1;
  for (int i = 0; i < self->K->rows; i++)
    for (int c = 0; c < 3; c++) {
      double d = self->K->values[9 * (size_t)self->K->row_start[i] + 4 * c];
      if (d > 0 && d < INFINITY) {
        sum += d;
        count++;
      }
    }
  return count ? sum / count : 1;
}

/* Inertia at rest, dof by dof; 0 where it has no value, so that nothing is rounded. */
static int find_inertia(flesh_problem *self)
{
  const double *X = flesh_mesh_positions(flesh_system_mesh(self->system));
  flesh_point point = {.t = 0, .load = 1, .x = X, .v = self->v, .a = self->v};
  self->inertia = malloc(((size_t)self->n + 1) * sizeof *self->inertia);
  if (!self->inertia) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d unknowns", self->n);
  const int failed = flesh_system_jacobian(self->system, &point, &(flesh_shift){.a = 1}, self->K) != FLESH_OK;
  for (int d = 0; d < self->n; d++)
    self->inertia[d] = failed ? 0 : (float)self->K->values[9 * (size_t)self->K->row_start[d / 3] + 4 * (size_t)(d % 3)];
  return FLESH_OK;
}

/* FLESH_ERR_ARGUMENT with the first option that makes no sense. */
static int check_options(const flesh_solver_options *o)
{
  const struct {
    const char *name;
    double value;
  } fractions[] = {{"newton_tolerance", o->newton_tolerance}, {"linear_tolerance", o->linear_tolerance}};
  for (int k = 0; k < 2; k++)
    if (!(fractions[k].value > 0 && fractions[k].value < 1))
      return flesh_fail(FLESH_ERR_ARGUMENT, "%s is %g; it must be > 0 and < 1", fractions[k].name,
                        fractions[k].value);
  const struct {
    const char *name;
    long long value, low, high;
  } integers[] = {{"max_newton", o->max_newton, 1, INT_MAX},
                  {"max_linear", o->max_linear, 1, INT_MAX},
                  {"max_halvings", o->max_halvings, 0, 30},
                  {"linear_solver", o->linear_solver, 0, FLESH_LINEAR_CHOLMOD},
                  {"preconditioner", o->preconditioner, 0, FLESH_PRECONDITIONER_NONE},
                  {"projection", o->projection, 0, FLESH_PROJECTION_NEVER},
                  {"globalization", o->globalization, 0, FLESH_GLOBALIZATION_KINSOL},
                  {"threads", o->threads, 0, FLESH_THREADS_MAX}};
  for (size_t k = 0; k < sizeof integers / sizeof integers[0]; k++)
    if (integers[k].value < integers[k].low || integers[k].value > integers[k].high)
      return flesh_fail(FLESH_ERR_ARGUMENT, "%s is %lld; it must be in %lld to %lld", integers[k].name,
                        integers[k].value, integers[k].low, integers[k].high);
  return FLESH_OK;
}

int flesh_problem_create(const flesh_system *system, const flesh_solver_options *options,
                         flesh_problem **problem)
{
  *problem = NULL;
  int status = check_options(options);
  if (status) return status;
  flesh_problem *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a solver");
  self->self = self;
  self->system = system;
  self->linear = flesh_linear_of(system);
  self->options = *options;
  self->n = flesh_system_unknowns(system);
  self->fixed = calloc((size_t)self->n + 1, 1);
  self->held = calloc((size_t)self->n + 1, sizeof *self->held);
  self->fixed_rows = calloc((size_t)self->n / 3 + 1, sizeof *self->fixed_rows);
  double **vectors[] = {&self->u_fixed, &self->x, &self->v, &self->a, &self->step, &self->gradient, &self->residual.u,
                       &self->residual.r, &self->potential.u, &self->reached.x, &self->u_matrix, &self->rest};
  enum { WORK = 4, VECTORS = sizeof vectors / sizeof vectors[0] };
  size_t apart;
  double *memory = self->work = flesh_large_vectors(VECTORS + WORK, (size_t)self->n, &apart);
  for (size_t k = 0; memory && k < VECTORS; k++) *vectors[k] = memory + (WORK + k) * apart;
  const int failed = !self->fixed || !self->held || !self->fixed_rows || !memory;
  status = failed ? flesh_fail(FLESH_ERR_MEMORY, "no memory for %d unknowns", self->n)
                      : flesh_system_matrix_create(system, &self->K);
  if (!status) status = flesh_threads_create(options->threads, &self->threads);
  if (!status) {
    if (options->linear_solver != FLESH_LINEAR_PCG)
      status = flesh_direct_create(options->linear_solver, self->K, &self->direct);
    else {
      status = self->linear->preconditioner_create(options->preconditioner, self->K,
                                                   flesh_mesh_positions(flesh_system_mesh(system)), self->threads,
                                                   &self->preconditioner);
      if (!status) status = self->linear->pcg_space_create(self->K, 1, self->threads, &self->pcg);
      if (!status) status = find_inertia(self);
    }
  }
  if (status) {
    flesh_problem_destroy(&self);
    return status;
  }
  self->fixed_scale = typical_stiffness(self);
  *problem = self;
  return FLESH_OK;
}

void flesh_problem_destroy(flesh_problem **problem)
{
  if (!problem || !*problem) return;
  flesh_problem *self = *problem;
  free(self->fixed);
  free(self->held);
  free(self->fixed_rows);
  free(self->inertia);
  free(self->work); /* and all other vectors with it */
  flesh_block_matrix_destroy(&self->K);
  self->linear->preconditioner_destroy(&self->preconditioner);
  self->linear->pcg_space_destroy(&self->pcg);
  flesh_direct_destroy(&self->direct);
  flesh_direct_destroy(&self->rescue);
  flesh_threads_destroy(&self->threads);
  flesh_scalar_view_clear(&self->view);
  free(self);
  *problem = NULL;
}

int flesh_problem_find_fixed(flesh_problem *self, double t)
{
  uint8_t *before = (uint8_t *)self->work;
  memcpy(before, self->fixed, (size_t)self->n);
  flesh_system_fixed(self->system, t, self->fixed);
  if (!memcmp(before, self->fixed, (size_t)self->n)) return 0;
  self->fixed_row_count = flesh_block_rows_to_fix(self->K, self->fixed, self->fixed_rows);
  self->held_count = 0;
  for (int d = 0; d < self->n; d++)
    if (self->fixed[d]) self->held[self->held_count++] = d;
  memset(self->u_fixed, 0, (size_t)self->n * sizeof *self->u_fixed);
  return 1;
}

/* The preconditioner of a stage that goes on from the one before serves as long as step and constraints are the same: a
 * body does not change much from step to step. So may the matrix of a calm one, as long as it foretells residuals. */
static void keep_what_serves(flesh_problem *self)
{
  const flesh_shift *now = &self->stage.shift, *before = &self->factored;
  const flesh_solve_stats *last = &self->stats;
  if (last->newton > 3 || last->projections > 0 || last->backtracks > 0) self->age = -1;
  if (flesh_problem_find_fixed(self, self->stage.t) || !self->goes_on || now->x != before->x || now->v != before->v ||
      now->a != before->a) {
    self->paces[0] = self->paces[1] = self->bend = self->drift = 0;
    self->softness = 1;
    self->age = -1;
  } else if (self->age >= 0) {
    self->age++;
  }
  /* What is calmer by now is to be found out. */
  self->softness = fmax(1, 0.95 * self->softness);
  if (!self->kept) self->drift *= 0.97;
  self->goes_on = 0;
}

int flesh_problem_set_stage(flesh_problem *self, const flesh_stage *stage)
{
  self->stage = *stage;
  if (!stage->x_lag) self->stage.x_lag = stage->x0, self->stage.t_lag = stage->t;
  if (!stage->v_lag) self->stage.v_lag = stage->v0 ? stage->v0 : self->rest;
  self->residual.known = self->potential.known = 0;
  self->previous_norm = self->smallest_norm = self->stride = 0;
  self->at_rounding = self->refused = self->stopped = self->follow = self->shortened = 0;
  self->creeping = self->cuts = self->pause = 0;
  self->next_pause = 1;
  if (self->stalled > 0) self->stalled = 0; /* what is too dear stays so */
  self->model_ratio = self->first_potential = NAN;
  keep_what_serves(self);
  const int *held = self->held, count = self->held_count;
  for (int k = 0; k < count; k++) self->u_fixed[held[k]] = stage->x0[held[k]];
  flesh_system_prescribe(self->system, stage->t, self->u_fixed);
  for (int k = 0; k < count; k++)
    self->u_fixed[held[k]] = stage->share * (self->u_fixed[held[k]] - stage->x0[held[k]]) / stage->shift.x;
  return FLESH_OK;
}

void flesh_problem_start(const flesh_problem *self, double *u)
{
  flesh_copy(self->threads, self->n, self->u_fixed, u);
}

flesh_solve_stats *flesh_problem_stats(flesh_problem *self) { return &self->stats; }

/* y = base + shift u from begin to end; without a base, 0. */
static void go(int begin, int end, const double *base, double shift, const double *u, double *y)
{
  if (base)
    for (int d = begin; d < end; d++) y[d] = base[d] + shift * u[d];
  else
    for (int d = begin; d < end; d++) y[d] = shift * u[d];
}

typedef struct departure {
  flesh_problem *problem;
  const double *u;
} departure;

enum { DOFS = 4096 }; /* of a task */

static void go_part(void *data, int part)
{
  const departure *from = data;
  flesh_problem *self = from->problem;
  const flesh_stage *s = &self->stage;
  const int begin = part * DOFS, end = begin + DOFS < self->n ? begin + DOFS : self->n;
  go(begin, end, s->x0, s->shift.x, from->u, self->x);
  go(begin, end, s->v0, s->shift.v, from->u, self->v);
  go(begin, end, s->a0, s->shift.a, from->u, self->a);
}

/* The point of u with the constrained dofs at their prescribed places whatever u says of them: the free rows then do
 * not depend on those of u, so that a matrix without their columns is the exact Jacobian from any start. */
static flesh_point point_at(flesh_problem *self, const double *u)
{
  const flesh_stage *s = &self->stage;
  flesh_threads_run(self->threads, (self->n + DOFS - 1) / DOFS, go_part, &(departure){self, u});
  for (int k = 0; k < self->held_count; k++) {
    const int d = self->held[k];
    const double held = self->u_fixed[d];
    self->x[d] = s->x0[d] + s->shift.x * held;
    self->v[d] = (s->v0 ? s->v0[d] : 0) + s->shift.v * held;
    self->a[d] = (s->a0 ? s->a0[d] : 0) + s->shift.a * held;
  }
  return (flesh_point){.t = s->t, .load = s->load, .x = self->x, .v = self->v, .a = self->a,
                       .x_lag = s->x_lag, .v_lag = s->v_lag, .t_lag = s->t_lag, .threads = self->threads,
                       .costs = self->costs};
}

int flesh_problem_reaches(flesh_problem *self, const double *u)
{
  const flesh_stage *s = &self->stage;
  if (!flesh_system_bars(self->system)) return 1;
  point_at(self, u);
  return flesh_system_way(self->system, s->t_lag, s->x_lag, s->t, self->x) == 1;
}

int flesh_problem_clear(flesh_problem *self, double *u)
{
  const flesh_stage *s = &self->stage;
  if (flesh_problem_reaches(self, u)) return FLESH_OK;
  flesh_system_clear(self->system, s->t_lag, s->x_lag, s->t, self->x);
  for (int d = 0; d < self->n; d++)
    if (!self->fixed[d]) u[d] = (self->x[d] - s->x0[d]) / s->shift.x;
  return flesh_problem_reaches(self, u) ? FLESH_OK : FLESH_UNDEFINED;
}

double flesh_problem_way(flesh_problem *self, const double *from, const double *to)
{
  if (!flesh_system_bars(self->system)) return 1;
  point_at(self, from);
  memcpy(self->work, self->x, (size_t)self->n * sizeof *self->x);
  point_at(self, to);
  return flesh_system_way(self->system, self->stage.t, self->work, self->stage.t, self->x);
}

static int same(const flesh_problem *self, const double *u, const double *other)
{
  return flesh_same(self->threads, self->n, u, other);
}

/* Constraint rows of the residual just evaluated at u, which is then known. */
static int finish_residual(flesh_problem *self, const double *u)
{
  for (int k = 0; k < self->held_count; k++) {
    const int d = self->held[k];
    self->residual.r[d] = self->fixed_scale * (u[d] - self->u_fixed[d]);
  }
  if (!(flesh_norm(self->threads, self->n, self->residual.r) < INFINITY)) return FLESH_NONFINITE;
  flesh_copy(self->threads, self->n, u, self->residual.u);
  self->residual.known = 1;
  return FLESH_OK;
}

/* The same of the potential, but for where it is. */
static void finish_potential(flesh_problem *self, const double *u)
{
  double springs = 0; /* whose gradient the constrained rows are */
  for (int k = 0; k < self->held_count; k++) {
    const double off = u[self->held[k]] - self->u_fixed[self->held[k]];
    springs += off * off;
  }
  self->potential.value += self->fixed_scale / 2 * springs;
  self->potential.magnitude += self->fixed_scale / 2 * springs;
  self->potential.known = 1;
}

static void keep_place(flesh_problem *self, const double *u)
{
  flesh_copy(self->threads, self->n, u, self->potential.u);
  self->potential.with_residual = 0;
}

int flesh_problem_residual(flesh_problem *self, const double *u, double *r)
{
  if (!self->residual.known || !same(self, u, self->residual.u)) {
    flesh_point point = point_at(self, u);
    if (self->potential.known && self->potential.with_residual) keep_place(self, self->residual.u);
    self->residual.known = 0;
    self->stats.residuals++;
    /* The guard sees to the way from iterate to iterate; without it there is only the whole. */
    if (self->options.globalization != FLESH_GLOBALIZATION_ENERGY && !flesh_problem_reaches(self, u))
      return self->refused = FLESH_UNDEFINED;
    int status = flesh_system_residual(self->system, &point, self->residual.r);
    if (!status) status = finish_residual(self, u);
    if (status) return self->refused = status;
  }
  if (r != self->residual.r) flesh_copy(self->threads, self->n, self->residual.r, r);
  return FLESH_OK;
}

static int knows_potential(const flesh_problem *self, const double *u)
{
  return self->potential.known && same(self, u, self->potential.with_residual ? self->residual.u : self->potential.u);
}

int flesh_problem_potential(flesh_problem *self, const double *u, double *phi, double *magnitude)
{
  if (!knows_potential(self, u)) {
    flesh_point point = point_at(self, u);
    self->potential.known = 0;
    self->stats.potentials++;
    flesh_placed *placed = &self->potential.placed;
    *placed = self->reached.there;
    if (self->stage.shift.x != 1 || !same(self, self->x, self->reached.x)) placed->known = 0;
    int status = flesh_system_potential_placed(self->system, &point, &self->stage.shift, placed, &self->potential.value,
                                               &self->potential.magnitude);
    if (status) return status;
    finish_potential(self, u);
    keep_place(self, u);
  }
  *phi = self->potential.value;
  *magnitude = self->potential.magnitude;
  return FLESH_OK;
}

int flesh_problem_evaluate(flesh_problem *self, const double *u, double *phi, double *magnitude)
{
  if (!knows_potential(self, u) && !(self->residual.known && same(self, u, self->residual.u))) {
    flesh_point point = point_at(self, u);
    self->residual.known = self->potential.known = 0;
    self->stats.residuals++;
    self->stats.potentials++;
    int status = flesh_system_evaluate_placed(self->system, &point, &self->stage.shift, &self->potential.placed,
                                              self->residual.r, &self->potential.value, &self->potential.magnitude);
    if (status) return status;
    finish_potential(self, u);
    /* One without a finite norm is refused when it is asked for. */
    self->potential.with_residual = finish_residual(self, u) == FLESH_OK;
    if (!self->potential.with_residual) keep_place(self, u);
  }
  return flesh_problem_potential(self, u, phi, magnitude);
}

/* How far the residual is from what K foretold at the last linear solve. */
static double departure_of(const flesh_problem *self, const double *residual)
{
  return self->pcg ? self->linear->pcg_departure(self->pcg, residual) : flesh_norm(self->threads, self->n, residual);
}

/* How far K of an earlier stage was off by the end of this one, at u. */
static void learn_drift(flesh_problem *self, const double *u)
{
  const double before = self->smallest_norm; /* 0: nothing was to be solved */
  if (self->kept && self->age > 0 && before > 0 && self->residual.known && same(self, u, self->residual.u))
    self->drift = departure_of(self, self->residual.r) / (before * self->age);
}

void flesh_problem_reach(flesh_problem *self, const double *u)
{
  learn_drift(self, u);
  self->reached.there.known = 0;
  if (self->stage.shift.x != 1 || !knows_potential(self, u)) return; /* else no step ends where the stage does */
  point_at(self, u);
  flesh_copy(self->threads, self->n, self->x, self->reached.x);
  self->reached.there = self->potential.placed;
}

/* The rule of Chen et al. 2024, "Trust-Region Eigenvalue Filtering", who trust the model to a hundredth. It saves a
 * tenth of the iterations in dynamics. In statics it saves none, and trusted to a fifth, which takes a third off a
 * shear, it tangles what is stretched. */
static int filter_of(const flesh_problem *self)
{
  flesh_filtering filtering = self->options.filtering;
  if (filtering == FLESH_FILTERING_AUTO)
    filtering = self->stage.shift.a != 0 ? FLESH_FILTERING_TRUST_REGION : FLESH_FILTERING_ABSOLUTE;
  if (filtering == FLESH_FILTERING_TRUST_REGION)
    return fabs(self->model_ratio - 1) < 0.01 ? FLESH_PROJECTED_CLAMP : FLESH_PROJECTED_ABSOLUTE;
  return filtering == FLESH_FILTERING_CLAMP ? FLESH_PROJECTED_CLAMP : FLESH_PROJECTED_ABSOLUTE;
}

void flesh_problem_fix_matrix(flesh_problem *self)
{
  flesh_block_fix_rows(self->K, self->fixed, self->fixed_scale, self->fixed_row_count, self->fixed_rows);
}

int flesh_problem_assemble(flesh_problem *self, const double *u, int project)
{
  flesh_point point = point_at(self, u);
  flesh_shift shift = self->stage.shift;
  shift.project = project ? filter_of(self) : FLESH_PROJECTED_NOT;
  self->stats.assemblies++;
  self->stats.projections += project;
  self->solved = 0;
  int status = flesh_system_jacobian(self->system, &point, &shift, self->K);
  if (status) return status;
  flesh_problem_fix_matrix(self);
  if (u != self->u_matrix) flesh_copy(self->threads, self->n, u, self->u_matrix);
  self->kept = self->age = 0;
  self->projected = project;
  self->filtered = shift.project;
  self->zeroed = 0;
  return FLESH_OK;
}

/* Whether K of an earlier stage serves for a stage's first iteration: where what it will not foretell ends at the
 * target by one iteration, or by two. */
static int drifts_little(const flesh_problem *self, double norm)
{
  static const double unknown = 1e5; /* so many targets are reached by two if it drifts little */
  const double drift = self->drift * self->age, once = drift * norm, twice = self->softness * drift * once;
  if (self->age < 1 || !(self->target > 0)) return 0;
  return drift > 0 ? fmin(4 * once, 5 * twice) <= self->target : norm < unknown * self->target;
}

/* Whether K, new in this stage, serves for two more iterations, of which the first ends where it does not foretell: a
 * residual and a few linear iterations cost less than another matrix. */
static int serves_twice(const flesh_problem *self, double norm)
{
  const double next = self->next_departure;
  return self->age == 0 && 2 * self->softness * next * next <= 0.5 * self->target * norm;
}

int flesh_problem_keep_matrix(flesh_problem *self, const double *u, const double *residual)
{
  const double before = self->smallest_norm, norm = flesh_norm(self->threads, self->n, residual);
  if (self->projected || self->beyond || !(norm > 0)) return 0;
  if (!(before > 0)) {
    if (!drifts_little(self, norm)) return 0;
  } else {
    if (!(norm < before)) return 0;
    const double off = departure_of(self, residual);
    if (self->age > 0) self->drift = off / (before * self->age);
    else if (self->kept) self->softness *= fmin(fmax(off / self->next_departure, 1), 8);
    else self->bend = off / (before * before);
    /* What was not foretold from the last iterate on is |K'| step^2 / 2, or more where the step taken was another one;
     * the step from here, shorter by norm / before, or less as residuals get softer, meets |K'| step with its own
     * length. */
    self->next_departure = 2 * self->softness * off * norm / before;
    if (!(self->next_departure <= 0.5 * self->target) && !serves_twice(self, norm)) return 0;
  }
  flesh_copy(self->threads, self->n, u, self->u_matrix);
  self->zeroed = 0;
  self->kept = 1;
  return 1;
}

typedef struct search {
  const flesh_problem *problem;
  _Atomic int found;
} search;

/* Rounding moves a row by few units in the last place of its diagonal, and inertia is what the softest displacements
 * have at least. Where the one is this many times the other, their stiffness changes by less than a hundredth (or
 * two where the mass is consistent, as that may be half of its diagonal). Steps take as many iterations up to 7e4,
 * and some hundredths more from 1e5 on, in less time all the same. */
static void seek_too_stiff(void *data, int k, int begin, int end)
{
  (void)k;
  static const double most = 4e5;
  search *s = data;
  const flesh_problem *self = s->problem;
  for (int d = begin; d < end && !atomic_load_explicit(&s->found, memory_order_relaxed); d++) {
    const double stiffness = self->K->values[9 * (size_t)self->K->row_start[d / 3] + 4 * (size_t)(d % 3)];
    if (!self->fixed[d] && !(stiffness < most * self->stage.shift.a * (double)self->inertia[d]))
      atomic_store_explicit(&s->found, 1, memory_order_relaxed);
  }
}

/* Whether K rounded to single precision is as good as K. */
static int may_be_rounded(const flesh_problem *self)
{
  search s = {.problem = self};
  flesh_parts_run(self->threads, self->n, seek_too_stiff, &s);
  return !s.found;
}

int flesh_problem_factor(flesh_problem *self)
{
  self->single = self->pcg && may_be_rounded(self);
  self->paces[0] = self->paces[1] = self->lost = 0;
  self->factored = self->stage.shift;
  return self->direct ? flesh_direct_factor(self->direct, self->K)
                      : self->linear->preconditioner_setup(self->preconditioner, self->K, self->fixed);
}

int flesh_problem_load_norm(flesh_problem *self, const double *u, double *norm)
{
  flesh_point point = point_at(self, u);
  double *r = self->work;
  int status = flesh_system_load(self->system, &point, r);
  if (status) return status;
  for (int k = 0; k < self->held_count; k++) r[self->held[k]] = 0;
  *norm = flesh_norm(self->threads, self->n, r);
  return *norm < INFINITY ? FLESH_OK : FLESH_NONFINITE;
}

/* Moves the point of u by rounding: x by the last digit of the largest, as differences of places are what counts, and
 * rates by those of the terms they are sums of, which may be far larger than the sums. */
static void disturb(flesh_problem *self, const double *u, uint32_t *random)
{
  const flesh_stage *stage = &self->stage;
  const double largest = flesh_largest(self->threads, self->n, self->x);
  for (int d = 0; d < self->n; d++) {
    /* xorshift (Marsaglia 2003): any fixed sequence of signs and sizes will do */
    *random ^= *random << 13;
    *random ^= *random >> 17;
    *random ^= *random << 5;
    const double relative = DBL_EPSILON * (*random * 0x1p-31 - 1);
    self->x[d] += relative * largest;
    self->v[d] += relative * (fabs(stage->v0 ? stage->v0[d] : 0) + fabs(stage->shift.v * u[d]));
    self->a[d] += relative * (fabs(stage->a0 ? stage->a0[d] : 0) + fabs(stage->shift.a * u[d]));
  }
}

double flesh_problem_rounding(flesh_problem *self, const double *u)
{
  double *exact = self->work, *moved = self->work + self->n;
  uint32_t random = 2463534242u;
  if (flesh_problem_residual(self, u, exact)) return 0;
  flesh_point point = point_at(self, u);
  disturb(self, u, &random);
  self->stats.residuals++;
  if (flesh_system_residual(self->system, &point, moved)) return 0;
  for (int d = 0; d < self->n; d++) moved[d] = self->fixed[d] ? 0 : moved[d] - exact[d];
  return flesh_norm(self->threads, self->n, moved);
}

double flesh_problem_potential_rounding(flesh_problem *self, const double *u)
{
  enum { SAMPLES = 4 }; /* one may come out small by chance */
  double least = INFINITY, most = -INFINITY, value, magnitude;
  uint32_t random = 2463534242u;
  for (int sample = 0; sample < SAMPLES; sample++) {
    flesh_point point = point_at(self, u);
    disturb(self, u, &random);
    self->stats.potentials++;
    if (flesh_system_potential(self->system, &point, &self->stage.shift, &value, &magnitude)) continue;
    least = fmin(least, value);
    most = fmax(most, value);
  }
  return fmax(most - least, 0);
}

size_t flesh_problem_memory(const flesh_problem *self)
{
  size_t bytes = sizeof *self + (size_t)self->n * (16 * sizeof(double) + sizeof(int) + 1) +
                 (size_t)self->n / 3 * sizeof(int);
  bytes += (size_t)self->K->row_start[self->K->rows] * 9 * sizeof(double);
  if (self->preconditioner) bytes += self->linear->preconditioner_memory(self->preconditioner);
  if (self->pcg) bytes += self->linear->pcg_space_memory(self->pcg);
  if (self->direct) bytes += flesh_direct_memory(self->direct);
  if (self->rescue) bytes += flesh_direct_memory(self->rescue);
  return bytes;
}
