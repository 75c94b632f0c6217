/* tangent.c: linear systems with the exact derivative of the residual, for sensitivities: solved exactly, with one matrix
 * for many right-hand sides, where an iteration is content with approximations. */
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "linear/block_matrix.h"
#include "newton/newton.h"

/* Number of matrices that get new preconditioners after an old one has failed: contact then changes from step to step. */
enum { REFRESHES = 8 };

/* Residual of a factored solve, relative to the right-hand side, that counts as round-off: sensitivities need 1e-6. */
static const double rounding = 1e-8;

/* Factors K by KLU with pivots, which an indefinite K needs, unless that takes too long. */
static int factor_with_pivots(flesh_newton *self)
{
  flesh_tangent *tangent = &self->tangent;
  const flesh_equations *equations = &self->equations;
  if (equations->team && equations->team->ranks > 1)
    return flesh_fail(FLESH_ERR_SOLVE, "conjugate gradients cannot solve for the sensitivities, as the tangent is indefinite "
                                       "or too uneven; a single process can factor it");
  if (tangent->patterns != equations->patterns) flesh_direct_destroy(&tangent->pivots);
  int status = tangent->pivots ? FLESH_OK : flesh_direct_create(FLESH_LINEAR_KLU, equations->K, &tangent->pivots);
  tangent->patterns = equations->patterns;
  tangent->indefinite = !status && !self->direction.direct && flesh_direct_operations(tangent->pivots) > tangent->most;
  if (tangent->indefinite) return FLESH_OK;
  if (!status) status = flesh_direct_factor(tangent->pivots, equations->K);
  if (status > 0) return flesh_fail(FLESH_ERR_SOLVE, "the tangent is singular, so that there are no sensitivities: the state is "
                                                     "a bifurcation, or a part of the body moves freely");
  tangent->has_pivots = !status;
  return status;
}

int flesh_newton_factor_tangent(flesh_newton *self, const double *u)
{
  flesh_environment *environment = &self->equations.evaluation.environment;
  self->tangent.known = self->tangent.has_pivots = self->tangent.indefinite = 0;
  const int before = environment->tangents;
  environment->tangents = 1;
  int status = flesh_direction_assemble(&self->direction, u, FLESH_FILTER_NONE);
  environment->tangents = before;
  flesh_matrix_policy_assembled(&self->policy);
  const double *usual = self->direction.iterations_per_decade; /* 0 for a new preconditioner */
  const int anew = self->tangent.refreshes > 0;
  if (!status) status = anew ? flesh_matrix_policy_refresh(&self->policy) : flesh_matrix_policy_prepare(&self->policy);
  self->tangent.refreshes -= anew;
  self->tangent.kept = usual[0] + usual[1] > 0;
  flesh_matrix_policy_overwritten(&self->policy);
  if (status == FLESH_NOT_POSITIVE) status = factor_with_pivots(self);
  self->tangent.known = !status;
  return status;
}

/* The 2-norm of b - K p. Overwrites the equations' scratch. */
static double residual_of(flesh_newton *self, const double *b, const double *p)
{
  const flesh_equations *equations = &self->equations;
  double *r = equations->scratch;
  flesh_block_multiply_of_team(equations->team, equations->K, p, r);
  for (int d = 0; d < equations->n; d++) r[d] = b[d] - r[d];
  return flesh_norm(self->threads, equations->n, r);
}

/* Solves with iterative refinement, because KLU's pivots are those of an earlier matrix. Accepts a residual up to `most`,
 * which rounding leaves in stiff parts. */
static int solve_with_pivots(flesh_newton *self, const double *b, double tolerance, double most, double *p)
{
  const flesh_equations *equations = &self->equations;
  const int n = equations->n;
  double *r = equations->scratch, *correction = r + n, left = INFINITY;
  memset(p, 0, (size_t)n * sizeof *p);
  memcpy(r, b, (size_t)n * sizeof *r);
  for (int k = 0; k < 3 && !(left <= tolerance); k++) {
    const int status = flesh_direct_solve(self->tangent.pivots, r, correction);
    if (status) return status;
    for (int d = 0; d < n; d++) p[d] += correction[d];
    left = residual_of(self, b, p);
  }
  if (left <= most) return FLESH_OK;
  return flesh_fail(FLESH_ERR_SOLVE, "the tangent is too nearly singular for sensitivities: a residual of %.2g is left of a "
                                     "right-hand side of %.2g", left, flesh_norm(self->threads, n, b));
}

/* Vectors of MINRES: the last two or three of v, z and w, by their number. */
typedef struct minres {
  double *v[3], *z[2], *w[3], *image, *room;
} minres;

static int make_minres(size_t n, minres *m)
{
  m->room = flesh_calloc(9 * n + 1, sizeof *m->room);
  double *next = m->room, **const all[] = {&m->v[0], &m->v[1], &m->v[2], &m->z[0], &m->z[1], &m->w[0], &m->w[1], &m->w[2],
                                           &m->image};
  for (int k = 0; k < 9 && m->room; k++, next += n) *all[k] = next;
  return m->room ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for solves of %zu unknowns", n);
}

/* Computes z = P^-1 v with the preconditioner P, and gamma, the norm of v [n] by P^-1. */
static int precondition(flesh_newton *self, const double *v, double *z, double *gamma)
{
  const int n = self->equations.n;
  memcpy(z, v, (size_t)n * sizeof *z);
  const int status = flesh_direction_precondition(&self->direction, z);
  *gamma = sqrt(fmax(0, flesh_dot(self->threads, n, v, z)));
  return status || *gamma < INFINITY ? status : FLESH_NONFINITE;
}

/* Solves by minimal residuals (Paige & Saunders 1975; Elman, Silvester & Wathen 2014, algorithm 4.1): p += K^-1 r, until
 * the norm of the residual r [n] by the preconditioner has fallen by `reduction`, or `*left` iterations, counted down, are
 * used up. */
static int minimise(flesh_newton *self, const double *r, double reduction, minres *m, int *left, double *p)
{
  const flesh_equations *equations = &self->equations;
  const int n = equations->n;
  double before = 1, gamma, next = 0, c[2] = {1, 1}, s[2] = {0, 0};
  memset(m->room, 0, 9 * (size_t)n * sizeof *m->room);
  memcpy(m->v[0], r, (size_t)n * sizeof *r);
  int status = precondition(self, m->v[0], m->z[0], &gamma);
  double size = gamma;
  const double enough = reduction * gamma;
  for (int j = 0; !status && fabs(size) > enough && gamma > 0 && *left > 0; j++, --*left) {
    double *v = m->v[j % 3], *v_next = m->v[(j + 1) % 3], *v_before = m->v[(j + 2) % 3], *z = m->z[j % 2], *image = m->image,
           *w = m->w[j % 3], *w_before[2] = {m->w[(j + 1) % 3], m->w[(j + 2) % 3]}; /* the last but one, and the last */
    for (int d = 0; d < n; d++) z[d] /= gamma;
    flesh_block_multiply(equations->K, z, image);
    const double along = flesh_dot(self->threads, n, image, z);
    for (int d = 0; d < n; d++) v_next[d] = image[d] - along / gamma * v[d] - gamma / before * v_before[d];
    status = j % 16 || !flesh_newton_asked_to_stop(self) ? precondition(self, v_next, m->z[(j + 1) % 2], &next)
                                                         : self->iterations.stopped;
    const double diagonal = c[1] * along - c[0] * s[1] * gamma, length = hypot(diagonal, next),
                 beside[2] = {s[0] * gamma, s[1] * along + c[0] * c[1] * gamma};
    if (status || !(length > 0)) break;
    c[0] = c[1], s[0] = s[1], c[1] = diagonal / length, s[1] = next / length;
    for (int d = 0; d < n; d++) {
      w[d] = (z[d] - beside[0] * w_before[0][d] - beside[1] * w_before[1][d]) / length;
      p[d] += c[1] * size * w[d];
    }
    size *= -s[1];
    before = gamma, gamma = next;
  }
  return status;
}

/* Solves with an indefinite K by minimal residuals, restarted with the remaining residual because the preconditioner is
 * rounded. */
static int solve_indefinite(flesh_newton *self, const double *b, double tolerance, double most, double *p)
{
  enum { TIMES = 4 }; /* multiple of conjugate gradients' iteration limit */
  static const double reduction = 1e-5;
  const size_t n = (size_t)self->equations.n;
  int left = TIMES * self->options.max_linear;
  minres m;
  int status = make_minres(n, &m);
  double *r = self->equations.scratch, size = flesh_norm(self->threads, (int)n, b), last = INFINITY;
  memset(p, 0, n * sizeof *p);
  memcpy(r, b, n * sizeof *r);
  while (!status && left > 0 && size > tolerance && size < last) {
    last = size;
    status = minimise(self, r, fmax(reduction, 0.1 * tolerance / size), &m, &left, p);
    size = residual_of(self, b, p);
  }
  self->stats.linear += TIMES * self->options.max_linear - left;
  flesh_free(m.room);
  if (status || size <= most) return status;
  return flesh_fail(FLESH_ERR_SOLVE, "the tangent is indefinite: its solves do not converge, and factoring it takes %.2g "
                                     "operations", flesh_direct_operations(self->tangent.pivots));
}

/* Number of iterations beyond which a kept preconditioner costs more than a new one. */
static int most_iterations(const flesh_newton *self, double tolerance)
{
  enum { NEW_ONE = 12 };
  const double *usual = self->direction.iterations_per_decade;
  const double expected = NEW_ONE + fmax(usual[0], usual[1]) * -log10(tolerance);
  return self->tangent.kept && expected < self->options.max_linear ? (int)expected : self->options.max_linear;
}

int flesh_newton_solve_tangent(flesh_newton *self, double *b, double tolerance, double *p)
{
  const flesh_equations *equations = &self->equations;
  const flesh_constrained *constrained = &equations->constrained;
  flesh_direction_kind kind;
  for (int k = 0; k < constrained->count; k++) b[constrained->dofs[k]] = 0;
  const double norm = flesh_norm(self->threads, equations->n, b);
  if (!(norm < INFINITY)) return FLESH_NONFINITE;
  if (norm == 0) {
    memset(p, 0, (size_t)equations->n * sizeof *p);
    return FLESH_OK;
  }
  flesh_direction_request request = {.tolerance = tolerance * norm, .max_iterations = most_iterations(self, tolerance),
                                     .stop = flesh_newton_asked_to_stop, .stop_data = self};
  int status = flesh_newton_asked_to_stop(self) ? self->iterations.stopped : FLESH_NOT_POSITIVE;
  if (status == FLESH_NOT_POSITIVE && !self->tangent.has_pivots && !self->tangent.indefinite)
    status = flesh_direction_solve(&self->direction, &request, b, p, &kind);
  if (status == FLESH_NOT_CONVERGED && self->tangent.kept && !(status = flesh_matrix_policy_refresh(&self->policy))) {
    self->tangent.kept = 0;
    self->tangent.refreshes = REFRESHES;
    request.max_iterations = self->options.max_linear;
    status = flesh_direction_solve(&self->direction, &request, b, p, &kind);
  }
  if (!status && self->direction.direct && !(residual_of(self, b, p) <= tolerance * norm)) status = FLESH_NOT_CONVERGED;
  if (status != FLESH_NOT_POSITIVE && status != FLESH_NOT_CONVERGED) return status;
  status = self->tangent.has_pivots || self->tangent.indefinite ? FLESH_OK : factor_with_pivots(self);
  if (status) return status;
  return (self->tangent.indefinite ? solve_indefinite : solve_with_pivots)(self, b, tolerance * norm,
                                                                           fmax(tolerance, rounding) * norm, p);
}
