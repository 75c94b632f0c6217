/* stage_tangent.c: solves with the derivative of a stage's residual, and what a parameter changes in it. */
#include "sensitivity/stage_tangent.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/parallel_vector.h"
#include "effect/effect.h"
#include "linear/block_matrix.h"
#include "system/clearance.h"
#include "system/effect_view.h"
#include "system/one_effect.h"
#include "system/ranks.h"
#include "system/system.h"

/* Solves with what effects read of the solution itself are repeated, as the step's own were; and those for the pressures
 * of incompressible tets. */
enum { MOST_REPETITIONS = 400 };
#define ROUND_OFF 1e-6 /* of a right-hand side, at most */

int flesh_stage_tangent_create(const flesh_system *system, const flesh_solver_options *options, double tolerance,
                               flesh_stage_tangent *self)
{
  *self = (flesh_stage_tangent){.system = system, .n = flesh_system_unknowns(system), .tolerance = tolerance,
                                .multipliers = flesh_system_multiplier_count(system)};
  const size_t n = (size_t)self->n;
  if (flesh_system_team(system))
    return flesh_fail(FLESH_ERR_ARGUMENT, "there are no sensitivities of a body that ranks share out; a single process has them");
  int status = flesh_problem_create(system, options, &self->problem);
  if (!status) status = flesh_couplings_create(system, &self->couplings);
  if (status) return status;
  self->newton = &self->problem->newton;
  self->newton->equations.evaluation.environment.tangents = 1;
  self->x = flesh_calloc(9 * n + 1, sizeof *self->x);
  self->gaps = flesh_calloc(5 * (size_t)self->multipliers + 1, sizeof *self->gaps);
  if (!self->x || !self->gaps)
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the sensitivities of %d unknowns", self->n);
  self->v = self->x + n;
  self->a = self->v + n;
  self->room = self->a + n;
  return FLESH_OK;
}

void flesh_stage_tangent_clear(flesh_stage_tangent *self)
{
  flesh_problem_destroy(&self->problem);
  flesh_couplings_clear(&self->couplings);
  flesh_free(self->products.values);
  flesh_free(self->x);
  flesh_free(self->gaps);
  *self = (flesh_stage_tangent){0};
}

/* The sentence of a status without one. */
static int fail(const flesh_stage_tangent *self, int status, const char *what)
{
  return status <= 0 ? status : flesh_fail(FLESH_ERR_SOLVE, "at t = %g s the %s has no value", self->stage.t, what);
}

int flesh_stage_tangent_set(flesh_stage_tangent *self, const flesh_stage *stage, const double *u, unsigned follows)
{
  flesh_equations *equations = &self->newton->equations;
  const size_t bytes = (size_t)self->n * sizeof(double);
  self->stage = *stage;
  self->follows = follows;
  self->newton->policy.stage_continues = 1; /* a preconditioner may serve again */
  int status = flesh_problem_set_stage(self->problem, stage);
  if (status) return status;
  if (stage->frozen_at_solution) flesh_newton_freeze(self->newton, u);
  status = fail(self, flesh_newton_factor_tangent(self->newton, u), "tangent");
  if (status) return status;
  self->point = flesh_equations_point(equations, u);
  memcpy(self->x, self->point.x, bytes);
  memcpy(self->v, self->point.v, bytes);
  memcpy(self->a, self->point.a, bytes);
  self->point.x = self->x;
  self->point.v = self->v;
  self->point.a = self->a;
  unsigned readings = 1u << FLESH_LAGGED_X | 1u << FLESH_LAGGED_V;
  if (flesh_system_freezes(self->system)) readings |= 1u << FLESH_FROZEN_X;
  if (flesh_system_freezes(self->system) && self->point.frozen.v) readings |= 1u << FLESH_FROZEN_V;
  self->parts_freezing = flesh_system_freezes(self->system) && !(follows >> FLESH_FROZEN_X & 1);
  if (self->parts_freezing) readings |= 1u << FLESH_OWN_V;
  return fail(self, flesh_couplings_find(&self->couplings, &self->point, readings, equations->K), "residual");
}

/* Adds to y what the followed readings make of x. */
static void add_followed(const flesh_stage_tangent *self, int transposed, double scale, const double *x, double *y)
{
  const flesh_shift *shift = &self->stage.shift;
  for (int k = 0; k < FLESH_READINGS; k++)
    if (self->follows >> k & 1)
      flesh_couplings_add(&self->couplings, (flesh_reading)k, transposed,
                          scale * (k == FLESH_LAGGED_X || k == FLESH_FROZEN_X ? shift->x : shift->v), x, y);
}

/* How far the gaps of the constraints change along p [n], into gaps [multipliers]: cubic in x, so that differences of the
 * fourth order are exact. */
static int move_gaps(flesh_stage_tangent *self, const double *p, double *gaps)
{
  static const double at[] = {-2, -1, 1, 2}, weight[] = {1. / 12, -2. / 3, 2. / 3, -1. / 12};
  double *x = self->room + 5 * (size_t)self->n, *now = self->gaps + 3 * (size_t)self->multipliers, largest = 0;
  for (int d = 0; d < self->n; d++) largest = fmax(largest, fabs(p[d]));
  const double step = largest > 0 ? 0.1 * self->couplings.length / largest : 1;
  flesh_point point = self->point;
  point.x = x;
  memset(gaps, 0, (size_t)self->multipliers * sizeof *gaps);
  for (int k = 0; k < 4; k++) {
    for (int d = 0; d < self->n; d++) x[d] = self->x[d] + at[k] * step * p[d];
    const int status = flesh_system_constraint_gaps(self->system, &point, now, NULL);
    if (status) return fail(self, status, "gap of a constraint");
    for (int e = 0; e < self->multipliers; e++) gaps[e] += weight[k] / step * now[e];
  }
  return FLESH_OK;
}

/* y = the force of pressures q, in which the residual is linear. */
static int press(flesh_stage_tangent *self, const double *q, double *y)
{
  double *sum = self->gaps + 3 * (size_t)self->multipliers, *without = self->room + 5 * (size_t)self->n;
  double largest = 0, own = 1;
  for (int e = 0; e < self->multipliers; e++) {
    largest = fmax(largest, fabs(q[e]));
    own = fmax(own, self->point.multipliers ? fabs(self->point.multipliers[e]) : 0);
  }
  const double scale = largest > 0 ? own / largest : 1;
  flesh_point point = self->point;
  for (int e = 0; e < self->multipliers; e++)
    sum[e] = (self->point.multipliers ? self->point.multipliers[e] : 0) + scale * q[e];
  point.multipliers = sum;
  int status = flesh_system_residual(self->system, &self->point, without);
  if (!status) status = flesh_system_residual(self->system, &point, y);
  for (int d = 0; d < self->n; d++) y[d] = (y[d] - without[d]) / scale;
  return fail(self, status, "residual");
}

/* Solves with K alone to a relative tolerance; b [n] is overwritten. Where constraints have multipliers, their change q has
 * G p = 0 for the gaps, and K p + G^T q = b: conjugate gradients for q with G K^-1 G^T, whose inverse is near the penalty
 * that K has. */
static int solve_alone(flesh_stage_tangent *self, double *b, double tolerance, double *p)
{
  const int count = self->multipliers;
  const size_t n = (size_t)self->n;
  double *gaps = self->gaps, *stiffness = gaps + count, *q = gaps + 2 * count, *moved = gaps + 4 * count;
  double *load = self->room + 3 * n, *answer = self->room + 4 * n, first = 0, last = 0;
  int status = fail(self, flesh_newton_solve_tangent(self->newton, b, tolerance, p), "solution");
  if (status || !count) return status;
  status = fail(self, flesh_system_constraint_gaps(self->system, &self->point, gaps, stiffness), "gap of a constraint");
  if (!status) status = move_gaps(self, p, gaps);
  memset(q, 0, (size_t)count * sizeof *q);
  for (int k = 0; k < MOST_REPETITIONS && !status; k++) {
    double now = 0, curvature = 0;
    for (int e = 0; e < count; e++) now += self->point.penalty * stiffness[e] * gaps[e] * gaps[e];
    if (k == 0) first = now;
    if (now <= tolerance * tolerance * first) return FLESH_OK;
    for (int e = 0; e < count; e++)
      q[e] = self->point.penalty * stiffness[e] * gaps[e] + (k ? now / last * q[e] : 0);
    last = now;
    status = press(self, q, load);
    if (!status) status = fail(self, flesh_newton_solve_tangent(self->newton, load, tolerance, answer), "solution");
    if (!status) status = move_gaps(self, answer, moved);
    if (status) return status;
    for (int e = 0; e < count; e++) curvature += q[e] * moved[e];
    for (int e = 0; e < count; e++) gaps[e] -= now / curvature * moved[e];
    for (int d = 0; d < self->n; d++) p[d] -= now / curvature * answer[d];
  }
  return status ? status
                : flesh_fail(FLESH_ERR_SOLVE, "at t = %g s the pressures of incompressible tets have no sensitivities: their "
                                              "solves do not converge", self->stage.t);
}

/* left = b - (K + D) p on the free dofs, D being the derivative by what is followed. Returns its 2-norm. */
static double find_left(flesh_stage_tangent *self, int transposed, const double *b, const double *p, double *left)
{
  const flesh_equations *equations = &self->newton->equations;
  flesh_block_multiply(equations->K, p, left);
  for (int d = 0; d < self->n; d++) left[d] = b[d] - left[d];
  add_followed(self, transposed, -1, p, left);
  for (int k = 0; k < equations->constrained.count; k++) left[equations->constrained.dofs[k]] = 0;
  return flesh_norm(NULL, self->n, left);
}

/* Whether the solution itself is read. */
static int reads_solution(const flesh_stage_tangent *self)
{
  int reads = 0;
  for (int k = 0; k < FLESH_READINGS; k++)
    reads |= (self->follows >> k & 1) && flesh_couplings_any(&self->couplings, (flesh_reading)k);
  return reads;
}

int flesh_stage_tangent_solve(flesh_stage_tangent *self, int transposed, const double *b, double *p)
{
  double *left = self->room, *correction = self->room + self->n, lasts[3] = {INFINITY, INFINITY, INFINITY};
  const int reads = reads_solution(self);
  if (reads && self->multipliers)
    return flesh_fail(FLESH_ERR_ARGUMENT, "there are no sensitivities of incompressible tets (poisson 0.5) under loads that "
                                          "follow the shape; take poisson: 0.4999");
  memcpy(left, b, (size_t)self->n * sizeof *left);
  int status = solve_alone(self, left, self->tolerance, p);
  if (status || !reads) return status;
  const double norm = flesh_norm(NULL, self->n, left); /* of the free dofs by now */
  for (int k = 0; k < MOST_REPETITIONS; k++) {
    const double size = find_left(self, transposed, b, p, left);
    /* Round-off of K p may be more than the tolerance, as where materials are nearly incompressible. */
    if (size <= self->tolerance * norm || (size <= ROUND_OFF * norm && size > 0.9 * lasts[k % 3])) return FLESH_OK;
    lasts[k % 3] = size;
    status = solve_alone(self, left, fmin(self->tolerance * norm / size, 0.1), correction);
    for (int d = 0; d < self->n && !status; d++) p[d] += correction[d];
    if (status) return status;
  }
  return flesh_fail(FLESH_ERR_SOLVE, "at t = %g s the sensitivities of loads that follow the shape do not converge",
                    self->stage.t);
}

/* Whether a product with the Jacobian takes the effect's matrix: not of positions alone where these stay, nor of M a, which
 * is linear; and what freezes is told apart by differences. */
static int takes_matrix(const flesh_stage_tangent *self, int e, const flesh_shift *shift)
{
  const flesh_effect *effect = flesh_system_effect(self->system, e);
  if (!effect->operations->jacobian || (self->parts_freezing && flesh_effect_has_trait(effect, FLESH_FREEZES))) return 0;
  if (effect->operations->role == FLESH_ROLE_INERTIA) return 0;
  return shift->x != 0 || !flesh_effect_has_trait(effect, FLESH_DEPENDS_ON_POSITION_ONLY);
}

/* Room for a matrix of K's pattern, with zeros. */
static int clear_products(flesh_stage_tangent *self)
{
  const flesh_block_matrix *K = self->newton->equations.K;
  const size_t numbers = 9 * (size_t)K->row_start[K->rows];
  if (numbers > self->product_room) {
    flesh_free(self->products.values);
    self->products.values = flesh_calloc(numbers, sizeof(double));
    self->product_room = self->products.values ? numbers : 0;
    if (!self->products.values) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a matrix of %zu numbers", numbers);
  }
  double *values = self->products.values;
  self->products = *K;
  self->products.values = values;
  memset(values, 0, numbers * sizeof *values);
  return FLESH_OK;
}

/* y = (x dr/dx + v dr/dv + a dr/da) w. */
static int product(flesh_stage_tangent *self, flesh_shift shift, const double *w, double *y)
{
  flesh_block_matrix *K = &self->products;
  flesh_effect_view view = flesh_effect_view_of(self->system, &self->point);
  int status = FLESH_OK, count = 0;
  for (int e = 0; e < self->system->entry_count && !status; e++) {
    const flesh_system_entry *entry = &self->system->entries[e];
    if (!takes_matrix(self, e, &shift) || flesh_clearance_holds(view.environment.clearance, e)) continue;
    if (count++ == 0) status = clear_products(self);
    if (!status)
      status = entry->effect->operations->jacobian(entry->effect, flesh_effect_view_turn(&view, e), &shift, K,
                                                   K->layout ? K->layout->slots[e] : entry->slots);
  }
  if (status) return fail(self, status, "tangent");
  if (count) flesh_block_multiply(K, w, y);
  else memset(y, 0, (size_t)self->n * sizeof *y);
  if (shift.a == 0) return FLESH_OK;
  flesh_point point = self->point;
  double *force = self->room + 5 * (size_t)self->n;
  point.a = w;
  status = flesh_system_roles_residual(self->system, FLESH_ROLE_BIT(FLESH_ROLE_INERTIA), &point, force);
  for (int d = 0; d < self->n; d++) y[d] += shift.a * force[d];
  return fail(self, status, "residual");
}

int flesh_stage_tangent_mass_times(flesh_stage_tangent *self, const double *w, double *y)
{
  return product(self, (flesh_shift){.a = 1}, w, y);
}

/* y = dr/dv w, or transposed. */
static int damp(flesh_stage_tangent *self, int transposed, const double *w, double *y)
{
  const int status = product(self, (flesh_shift){.v = 1}, w, y);
  if (!status && self->parts_freezing) flesh_couplings_add(&self->couplings, FLESH_OWN_V, transposed, 1, w, y);
  return status;
}

int flesh_stage_tangent_damping_times(flesh_stage_tangent *self, const double *w, double *y) { return damp(self, 1, w, y); }

int flesh_stage_tangent_damping_times_on(flesh_stage_tangent *self, const double *w, double *y) { return damp(self, 0, w, y); }

int flesh_stage_tangent_stiffness_times(flesh_stage_tangent *self, const double *w, double *y)
{
  return product(self, (flesh_shift){.x = 1}, w, y);
}
