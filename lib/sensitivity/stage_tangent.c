/* stage_tangent.c: solves with the derivative of a stage's residual, and products with its parts. */
#include "sensitivity/stage_tangent.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/parallel_vector.h"
#include "effect/effect.h"
#include "effect/private.h"
#include "linear/block_matrix.h"
#include "math/differences.h"
#include "system/clearance.h"
#include "system/effect_view.h"
#include "system/one_effect.h"
#include "system/ranks.h"
#include "system/system.h"

/* Largest number of iterations for arguments that follow the solution, with the last KEPT directions, and of those for the
 * pressures of incompressible tets. */
enum { MOST_REPETITIONS = 400, KEPT = 10 };
#define ROUND_OFF 1e-6 /* largest round-off, relative to a right-hand side */
static const double loose = 1e-2; /* relative tolerance of a solve that another one follows */

int flesh_stage_tangent_create(const flesh_system *system, const flesh_solver_options *options, double tolerance,
                               flesh_stage_tangent *self)
{
  *self = (flesh_stage_tangent){.system = system, .n = flesh_system_unknowns(system), .tolerance = tolerance,
                                .multipliers = flesh_system_multiplier_count(system)};
  const size_t n = (size_t)self->n;
  if (flesh_system_team(system)) /* nodes of a colour are moved at once, and ranks have no colours in common */
    return flesh_fail(FLESH_ERR_ARGUMENT, "there are no sensitivities of a body shared out among ranks; use a single process");
  int status = flesh_problem_create(system, options, &self->problem);
  if (!status) status = flesh_couplings_create(system, &self->couplings);
  if (!status) status = flesh_prescribed_create(system, &self->others);
  if (status) return status;
  self->newton = &self->problem->newton;
  self->newton->equations.evaluation.environment.tangents = 1;
  self->x = flesh_calloc(11 * n + 1, sizeof *self->x);
  self->gaps = flesh_calloc(9 * (size_t)self->multipliers + 1, sizeof *self->gaps);
  if (!self->x || !self->gaps)
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the sensitivities of %d unknowns", self->n);
  self->v = self->x + n;
  self->a = self->v + n;
  self->room = self->a + n;
  self->end = self->room + 6 * n;
  self->pressed = self->end + n;
  return FLESH_OK;
}

void flesh_stage_tangent_clear(flesh_stage_tangent *self)
{
  flesh_problem_destroy(&self->problem);
  flesh_couplings_clear(&self->couplings);
  flesh_prescribed_clear(&self->others);
  flesh_free(self->products.values);
  flesh_free(self->x);
  flesh_free(self->gaps);
  flesh_free(self->directions);
  *self = (flesh_stage_tangent){0};
}

/* Adds the sentence of a status without one. */
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
  self->newton->policy.stage_continues = 1; /* allows a preconditioner to be used again */
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
  /* Shares the arrays, so that effects see that they are equal. */
  if (stage->frozen_at_solution) self->point.frozen = (flesh_frozen){self->x, self->v};
  self->held = stage->shift.x == 1 ? self->x : self->end;
  unsigned arguments = 1u << FLESH_LAGGED_X | 1u << FLESH_LAGGED_V;
  if (flesh_system_freezes(self->system)) {
    arguments |= 1u << FLESH_FROZEN_X | 1u << FLESH_OWN_V;
    if (self->point.frozen.v) arguments |= 1u << FLESH_FROZEN_V;
    if (stage->shift.v == 0) arguments |= 1u << FLESH_OWN_X; /* otherwise K contains the part of x */
  }
  return fail(self, flesh_couplings_find(&self->couplings, &self->point, arguments, equations->K), "residual");
}

/* Adds the products of the followed arguments with x to y. */
static void add_followed(const flesh_stage_tangent *self, int transposed, double scale, const double *x, double *y)
{
  const flesh_shift *shift = &self->stage.shift;
  for (int k = 0; k < FLESH_ARGUMENTS; k++)
    if (self->follows >> k & 1)
      flesh_couplings_add(&self->couplings, (flesh_argument)k, transposed,
                          scale * (flesh_argument_is_of_v((flesh_argument)k) ? shift->v : shift->x), x, y);
}

/* Computes gaps [multipliers], the change of the constraints' gaps along p [n] from the positions `from` [n]: gaps are
 * cubic in x, so that differences of fourth order are exact. */
static int move_gaps(flesh_stage_tangent *self, const double *from, const double *p, double *gaps)
{
  double *x = self->room + 5 * (size_t)self->n, *now = self->gaps + 8 * (size_t)self->multipliers, largest = 0;
  for (int d = 0; d < self->n; d++) largest = fmax(largest, fabs(p[d]));
  const double step = largest > 0 ? 0.1 * self->couplings.length / largest : 1;
  flesh_point point = self->point;
  point.x = x;
  memset(gaps, 0, (size_t)self->multipliers * sizeof *gaps);
  for (int k = 0; k < FLESH_DIFFERENCES; k++) {
    for (int d = 0; d < self->n; d++) x[d] = from[d] + flesh_difference_at[k] * step * p[d];
    const int status = flesh_system_constraint_gaps(self->system, &point, now, NULL);
    if (status) return fail(self, status, "gap of a constraint");
    for (int e = 0; e < self->multipliers; e++) gaps[e] += flesh_difference_weight[k] / step * now[e];
  }
  return FLESH_OK;
}

/* Adds scale times the residual of effects with multipliers to y [n]. */
static int add_held(flesh_stage_tangent *self, const flesh_point *point, double scale, double *y)
{
  double *r = self->room + 5 * (size_t)self->n;
  for (int e = 0; e < flesh_system_effect_count(self->system); e++) {
    if (!flesh_system_effect(self->system, e)->operations->constraints) continue;
    const int status = flesh_system_effect_residual(self->system, e, point, r);
    if (status) return fail(self, status, "residual");
    for (int d = 0; d < self->n; d++) y[d] += scale * r[d];
  }
  return FLESH_OK;
}

/* Computes y, the force of pressures q at positions `at` [n]; the residual is linear in q. */
static int press(flesh_stage_tangent *self, const double *at, const double *q, double *y)
{
  double *sum = self->gaps + 8 * (size_t)self->multipliers, largest = 0, own = 1;
  for (int e = 0; e < self->multipliers; e++) {
    largest = fmax(largest, fabs(q[e]));
    own = fmax(own, self->point.multipliers ? fabs(self->point.multipliers[e]) : 0);
  }
  const double scale = largest > 0 ? own / largest : 1;
  flesh_point point = self->point;
  point.x = at;
  for (int e = 0; e < self->multipliers; e++)
    sum[e] = (self->point.multipliers ? self->point.multipliers[e] : 0) + scale * q[e];
  memset(y, 0, (size_t)self->n * sizeof *y);
  const int status = add_held(self, &point, -1 / scale, y);
  point.multipliers = sum;
  return status ? status : add_held(self, &point, 1 / scale, y);
}

/* The system of the pressures q alone, G_2 K^-1 G_1^T q = g, whose inverse is near the penalty in K. Its vectors
 * [multipliers] are gaps g, which the penalty k turns into pressures q = k g. */
typedef struct pressing {
  flesh_stage_tangent *self;
  const double *at, *held; /* [n] positions of G_1 and of G_2 */
  double tolerance, *load, *answer;                              /* room [n] */
  double *penalty, *q, *sum, *left, *first, *direction, *image, *bent; /* [multipliers] */
} pressing;

static double dot(const pressing *s, const double *a, const double *b)
{
  double sum = 0;
  for (int e = 0; e < s->self->multipliers; e++) sum += s->penalty[e] * a[e] * b[e];
  return sum;
}

/* Computes `image`, the gaps caused by the pressures of the gaps `direction`, and `answer`, the solution for them. */
static int apply(const pressing *s, const double *direction, double *image)
{
  for (int e = 0; e < s->self->multipliers; e++) s->q[e] = s->penalty[e] * direction[e];
  int status = press(s->self, s->at, s->q, s->load);
  if (!status) status = fail(s->self, flesh_newton_solve_tangent(s->self->newton, s->load, s->tolerance, s->answer), "solution");
  return status ? status : move_gaps(s->self, s->held, s->answer, image);
}

/* Takes a step of `length` along `direction`: updates the remaining gaps, and the solution p. */
static void go(const pressing *s, double length, const double *direction, const double *image, double *p)
{
  for (int e = 0; e < s->self->multipliers; e++) s->sum[e] += length * direction[e], s->left[e] -= length * image[e];
  for (int d = 0; d < s->self->n; d++) p[d] -= length * s->answer[d];
}

/* Solves by Bi-CGSTAB (van der Vorst 1992), as G_1 and G_2 differ where a stage is within the step; starts from the gaps
 * `left`. */
static int solve_pressures(const pressing *s, double *p)
{
  const size_t bytes = (size_t)s->self->multipliers * sizeof(double);
  const double target = s->tolerance * s->tolerance * dot(s, s->left, s->left);
  double along = dot(s, s->left, s->left);
  memset(s->sum, 0, bytes);
  memcpy(s->first, s->left, bytes);
  memcpy(s->direction, s->left, bytes);
  for (int k = 0; k < MOST_REPETITIONS; k++) {
    if (dot(s, s->left, s->left) <= target) return FLESH_OK;
    int status = apply(s, s->direction, s->image);
    if (status) return status;
    const double length = along / dot(s, s->first, s->image);
    go(s, length, s->direction, s->image, p);
    if (dot(s, s->left, s->left) <= target) return FLESH_OK;
    status = apply(s, s->left, s->bent);
    if (status) return status;
    const double damping = dot(s, s->bent, s->left) / dot(s, s->bent, s->bent);
    go(s, damping, s->left, s->bent, p);
    const double before = along;
    along = dot(s, s->first, s->left);
    const double share = along / before * length / damping;
    for (int e = 0; e < s->self->multipliers; e++)
      s->direction[e] = s->left[e] + share * (s->direction[e] - damping * s->image[e]);
  }
  return flesh_fail(FLESH_ERR_SOLVE, "at t = %g s the pressures of incompressible tets have no sensitivities: their solves do "
                                     "not converge", s->self->stage.t);
}

/* Solves with K alone to a relative tolerance; sets b [n] to 0 on constrained dofs. With multipliers, finds p and the
 * pressures of flesh_stage_tangent_solve, and `pressed` [n], the pressures' force. */
static int solve_alone(flesh_stage_tangent *self, int transposed, double *b, const double *beside, double tolerance, double *p,
                       double *pressed)
{
  const size_t n = (size_t)self->n, count = (size_t)self->multipliers;
  const double *at = transposed ? self->held : self->x, *held = transposed ? self->x : self->held;
  double *gaps = self->gaps;
  const pressing s = {self, at, held, tolerance, self->room + 3 * n, self->room + 4 * n,
                      gaps, gaps + count, gaps + 2 * count, gaps + 3 * count, gaps + 4 * count, gaps + 5 * count,
                      gaps + 6 * count, gaps + 7 * count};
  int status = fail(self, flesh_newton_solve_tangent(self->newton, b, tolerance, p), "solution");
  if (status || !count) return status;
  status = fail(self, flesh_system_constraint_gaps(self->system, &self->point, s.left, s.penalty), "gap of a constraint");
  for (size_t e = 0; e < count; e++) s.penalty[e] *= self->point.penalty;
  for (size_t d = 0; d < n; d++) s.load[d] = p[d] + (beside ? beside[d] : 0);
  if (!status) status = move_gaps(self, held, s.load, s.left);
  if (!status) status = solve_pressures(&s, p);
  for (size_t e = 0; e < count; e++) s.q[e] = s.penalty[e] * s.sum[e];
  return status ? status : press(self, at, s.q, pressed);
}

/* Sets constrained dofs to 0, and returns the 2-norm. */
static double free_norm(const flesh_stage_tangent *self, double *y)
{
  const flesh_constrained *constrained = &self->newton->equations.constrained;
  for (int k = 0; k < constrained->count; k++) y[constrained->dofs[k]] = 0;
  return flesh_norm(NULL, self->n, y);
}

/* Computes left = b - (K + D) p on the free dofs, less the force of pressures, D being the derivative by the followed
 * arguments; b NULL: 0. Returns its 2-norm. */
static double find_left(flesh_stage_tangent *self, int transposed, const double *b, const double *p, const double *pressed,
                        double *left)
{
  flesh_block_multiply(self->newton->equations.K, p, left);
  for (int d = 0; d < self->n; d++) left[d] = (b ? b[d] : 0) - left[d] - pressed[d];
  add_followed(self, transposed, -1, p, left);
  return free_norm(self, left);
}

/* Whether effects read the solution itself. */
static int reads_solution(const flesh_stage_tangent *self)
{
  int reads = 0;
  for (int k = 0; k < FLESH_ARGUMENTS; k++)
    reads |= (self->follows >> k & 1) && flesh_couplings_any(&self->couplings, (flesh_argument)k);
  return reads;
}

/* Makes room for KEPT directions, [3*n] each: the direction d, its change of the residual, -(K + D) d less the force of its
 * pressures, and that force. FLESH_ERR_MEMORY. */
static int make_directions(flesh_stage_tangent *self)
{
  if (!self->directions) self->directions = flesh_calloc(3 * KEPT * (size_t)self->n, sizeof *self->directions);
  return self->directions ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for directions of %d unknowns", self->n);
}

static double *direction_of(const flesh_stage_tangent *self, int k)
{
  return self->directions + 3 * (size_t)self->n * (size_t)(k % KEPT);
}

/* Makes the change of direction k orthogonal to those of earlier directions, with length 1. *along: product of that change
 * with the residual `left`. Returns 0 if nothing changes. */
static int orthonormalise(const flesh_stage_tangent *self, int k, const double *left, double *along)
{
  const int n = self->n;
  double *direction = direction_of(self, k);
  for (int before = k < KEPT ? 0 : k - KEPT + 1; before < k; before++) {
    const double *other = direction_of(self, before), share = flesh_dot(NULL, n, other + n, direction + n);
    for (int d = 0; d < 3 * n; d++) direction[d] -= share * other[d];
  }
  const double size = flesh_norm(NULL, n, direction + n);
  for (int d = 0; d < 3 * n && size > 0; d++) direction[d] /= size;
  *along = flesh_dot(NULL, n, left, direction + n);
  return size > 0;
}

/* Solves by generalised conjugate residuals (Eisenstat, Elman & Schultz 1983, SIAM J. Numer. Anal. 20), with solves with K
 * alone, from p with its residual in room [n], of 2-norm `size`. Merely repeating solves with K alone would diverge where
 * loads swing the shape ever wider. */
static int follow(flesh_stage_tangent *self, int transposed, const double *b, double norm, double size, double *p)
{
  double *left = self->room, lasts[3] = {INFINITY, INFINITY, INFINITY}, along;
  int status = make_directions(self), exact = 1;
  for (int k = 0; k < MOST_REPETITIONS && !status; k++) {
    if (!exact && (exact = size <= self->tolerance * norm || k % KEPT == 0))
      size = find_left(self, transposed, b, p, self->pressed, left);
    /* The round-off of K p may exceed the tolerance, as where materials are nearly incompressible. */
    if (size <= self->tolerance * norm || (size <= ROUND_OFF * norm && size > 0.9 * lasts[k % 3])) return FLESH_OK;
    lasts[k % 3] = size;
    double *direction = direction_of(self, k), *change = direction + self->n, *pressed = change + self->n;
    const double enough = self->multipliers ? fmin(self->tolerance * norm / size, 0.1) : loose; /* all gaps stay closed */
    status = solve_alone(self, transposed, left, NULL, enough, direction, pressed);
    if (status) return status;
    find_left(self, transposed, NULL, direction, pressed, change);
    if (!orthonormalise(self, k, left, &along)) break;
    for (int d = 0; d < self->n; d++) {
      p[d] -= along * direction[d];
      left[d] -= along * change[d];
      self->pressed[d] -= along * pressed[d];
    }
    size = flesh_norm(NULL, self->n, left);
    exact = 0;
  }
  return status ? status : flesh_fail(FLESH_ERR_SOLVE, "at t = %g s the sensitivities of loads that follow the shape do not "
                                                       "converge", self->stage.t);
}

int flesh_stage_tangent_solve(flesh_stage_tangent *self, int transposed, const double *b, const double *beside, double *p)
{
  const size_t bytes = (size_t)self->n * sizeof *p;
  double *right = self->room;
  memset(self->pressed, 0, bytes);
  memset(p, 0, bytes);
  memcpy(right, b, bytes);
  if (!reads_solution(self)) return solve_alone(self, transposed, right, beside, self->tolerance, p, self->pressed);
  const double norm = free_norm(self, right);
  if (!self->multipliers || !beside) return follow(self, transposed, b, norm, norm, p);
  const int status = solve_alone(self, transposed, right, beside, self->tolerance, p, self->pressed);
  return status ? status : follow(self, transposed, b, norm, find_left(self, transposed, b, p, self->pressed, right), p);
}

/* Whether a product with the Jacobian needs the effect's matrix. Not if the effect depends on positions alone and these
 * stay, is linear, or freezes, as its matrix is then that of x and v together. */
static int takes_matrix(const flesh_stage_tangent *self, int e, const flesh_shift *shift)
{
  const flesh_effect *effect = flesh_system_effect(self->system, e);
  if (!effect->operations->jacobian || flesh_effect_has_trait(effect, FLESH_FREEZES)) return 0;
  if (effect->operations->role == FLESH_ROLE_INERTIA || flesh_couplings_leave(&self->couplings, e)) return 0;
  if (flesh_effect_private_of(effect)->linear_in_v) return 0;
  return shift->x != 0 || !flesh_effect_has_trait(effect, FLESH_DEPENDS_ON_POSITION_ONLY);
}

/* Makes a zero matrix of K's pattern. */
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

/* Computes y = (x dr/dx + v dr/dv + a dr/da) w, or the transposed product. */
static int product(flesh_stage_tangent *self, int transposed, flesh_shift shift, const double *w, double *y)
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
  flesh_point point = self->point;
  double *force = self->room + 5 * (size_t)self->n;
  point.v = point.a = w;
  for (int e = 0; e < self->system->entry_count && !status; e++) {
    const flesh_effect *effect = flesh_system_effect(self->system, e);
    const int inertia = effect->operations->role == FLESH_ROLE_INERTIA;
    const double scale = inertia ? shift.a : flesh_effect_private_of(effect)->linear_in_v ? shift.v : 0;
    if (scale == 0 || flesh_couplings_leave(&self->couplings, e)) continue;
    status = flesh_system_effect_residual(self->system, e, &point, force);
    for (int d = 0; d < self->n; d++) y[d] += scale * force[d];
  }
  if (shift.x != 0) flesh_couplings_add(&self->couplings, FLESH_OWN_X, transposed, shift.x, w, y);
  if (shift.v != 0) flesh_couplings_add(&self->couplings, FLESH_OWN_V, transposed, shift.v, w, y);
  return fail(self, status, "residual");
}

int flesh_stage_tangent_mass_times(flesh_stage_tangent *self, const double *w, double *y)
{
  return product(self, 0, (flesh_shift){.a = 1}, w, y);
}

int flesh_stage_tangent_damping_times(flesh_stage_tangent *self, int transposed, const double *w, double *y)
{
  return product(self, transposed, (flesh_shift){.v = 1}, w, y);
}

int flesh_stage_tangent_stiffness_times(flesh_stage_tangent *self, int transposed, const double *w, double *y)
{
  return product(self, transposed, (flesh_shift){.x = 1}, w, y);
}

int flesh_stage_tangent_read(flesh_stage_tangent *self, const double *w, double *by_x, double *by_v)
{
  int status = flesh_stage_tangent_stiffness_times(self, 1, w, by_x);
  if (!status) status = flesh_stage_tangent_damping_times(self, 1, w, by_v);
  for (int k = 0; k < FLESH_OWN_V && !status; k++)
    flesh_couplings_add(&self->couplings, (flesh_argument)k, 1, 1, w, flesh_argument_is_of_v((flesh_argument)k) ? by_v : by_x);
  return status;
}
