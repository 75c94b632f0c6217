/* guard.c: scales Newton steps so that the incremental potential falls, watches how well the quadratic model
 * foretold it, and has few nodes that stay behind solved for alone. */
#include <math.h>
#include <string.h>

#include "effect/effect.h"
#include "sundials/problem.h"

/* Sufficient decrease of Armijo; Nocedal & Wright 2006, section 3.1. */
static const double decrease = 1e-4;

/* So many filtered steps in a row fall short before one is lengthened wherever the residual is. */
enum { CREEPING = 16 };

typedef struct trial {
  double *at;
  const double *u, *p;
  double scale;
} trial;

static void try_part(void *data, int k, int begin, int end)
{
  (void)k;
  const trial *t = data;
  for (int d = begin; d < end; d++) t->at[d] = t->scale * t->p[d];
  for (int d = begin; d < end; d++) t->at[d] += t->u[d];
}

/* The trial u + scale p, rounded as KINSOL rounds it once p is scaled (no fused product and sum): what is known of the
 * one that is accepted then holds for KINSOL's next iterate. */
static void try_scale(flesh_problem *self, const double *u, double scale, const double *p)
{
  flesh_parts_run(self->threads, self->n, try_part, &(trial){self->step, u, p, scale});
}

/* p.H p with the unfiltered Hessian at u, by a difference of residuals; NaN where there is none. */
static double curvature(flesh_problem *self, const double *u, const double *r, const double *p)
{
  const double epsilon = 1e-5;
  for (int d = 0; d < self->n; d++) self->step[d] = u[d] + epsilon * p[d];
  if (flesh_problem_residual(self, self->step, self->work)) return NAN;
  return (flesh_dot(self->threads, self->n, self->work, p) - flesh_dot(self->threads, self->n, r, p)) / epsilon;
}

/* Actual over foretold decrease of the accepted filtered step p, whose slope is given; NaN where it is not needed. */
static double model_ratio(flesh_problem *self, const double *u, const double *r, const double *p,
                          double slope, double actual)
{
  const flesh_filtering filtering = self->options.filtering;
  if ((filtering != FLESH_FILTERING_AUTO && filtering != FLESH_FILTERING_TRUST_REGION) || !self->projected) return NAN;
  return actual / -(slope + curvature(self, u, r, p) / 2);
}

/* Lengthens a step that has been accepted as long as that lowers the potential `value` further. The scale `too_long`
 * has been refused; INFINITY: none. */
static void lengthen(flesh_problem *self, const double *u, const double *p, double start, double slope,
                     double too_long, double *scale, double *value)
{
  for (int tries = 0; tries < 20; tries++) {
    /* The minimum of the parabola through what is known; the first try goes as far as 2 at least, because a
     * potential that bends less than the matrix says (x^4) goes on falling beyond it. */
    double bend = (*value - start) / (*scale * *scale) - slope / *scale, further, ignored;
    double longer = bend > 0 ? fmin(-slope / (2 * bend), 4 * *scale) : 4 * *scale;
    if (tries == 0 && too_long == INFINITY) longer = fmax(longer, 2 * *scale);
    if (longer >= too_long) longer = sqrt(*scale * too_long);
    if (longer < 1.4 * *scale) return;
    try_scale(self, u, longer, p);
    if (flesh_problem_way(self, u, self->step) < 1 ||
        flesh_problem_potential(self, self->step, &further, &ignored) || !(further < *value)) {
      too_long = longer;
    } else {
      *value = further;
      *scale = longer;
    }
  }
}

/* Whether few nodes carry the residual: its participation ratio, 1 when all carry the same. A crease or a tet that
 * turns inside out; a body that is crumpled as a whole is tangled less often by the projected Hessian's short steps. */
static int is_local(int n, const double *r)
{
  double second = 0, fourth = 0;
  for (int d = 0; d < n; d++) {
    double square = r[d] * r[d];
    second += square;
    fourth += square * square;
  }
  return second * second < 0.01 * n * fourth;
}

/* Whether the next step should follow negative curvature: after a projected step that fell short, until one that
 * followed had to be cut to almost nothing. */
static int choose_follow(const flesh_problem *self, int fell_short, double scale)
{
  if (self->options.projection != FLESH_PROJECTION_DEMAND) return 0;
  if (self->projected) return fell_short;
  return self->follow && !(self->beyond && scale < 0.02);
}

/* Of the step p, what bars ways lets pass; 1: all. */
static double longest_scale(flesh_problem *self, const double *u, const double *p)
{
  if (!flesh_system_bars(self->system)) return 1;
  try_scale(self, u, 1, p);
  const double way = flesh_problem_way(self, u, self->step);
  return way < 1 ? flesh_way_kept * way : 1;
}

/* Adds to the accepted step p, which led to the potential `value`, what lowers that further at the few nodes that carry
 * the residual there, if few do. Whether it has. */
static int add_patch(flesh_problem *self, const double *u, double *p, double value)
{
  double *residual = self->residual.r, *longer = self->work + self->n, lower, ignored;
  try_scale(self, u, 1, p);
  if (flesh_problem_residual(self, self->step, residual) || !is_local(self->n, residual)) return 0;
  if (self->patch(self, self->step, residual, longer)) return 0;
  for (int d = 0; d < self->n; d++) longer[d] += p[d];
  try_scale(self, u, 1, longer);
  if (flesh_problem_way(self, u, self->step) < 1) return 0;
  if (flesh_problem_evaluate(self, self->step, &lower, &ignored) || !(lower < value)) return 0;
  memcpy(p, longer, (size_t)self->n * sizeof *p);
  return 1;
}

int flesh_guard_step(flesh_problem *self, const double *u, const double *r, double *p)
{
  double slope = flesh_dot(self->threads, self->n, r, p), start, magnitude;
  if (!(slope < 0)) return FLESH_NOT_POSITIVE;
  int status = flesh_problem_potential(self, u, &start, &magnitude);
  if (status) return status;
  double rounding = 1e-13 * magnitude, measured = NAN, refused = INFINITY;
  if (isnan(self->first_potential)) self->first_potential = start;
  const double full = longest_scale(self, u, p);
  for (double scale = full; scale > 1e-14;) {
    double value, ignored;
    try_scale(self, u, scale, p);
    /* A first try is mostly taken: the residual, which KINSOL wants next, comes with it. */
    status = scale == full && !self->shortened ? flesh_problem_evaluate(self, self->step, &value, &ignored)
                                               : flesh_problem_potential(self, self->step, &value, &ignored);
    if (status < 0) return status;
    if (!status) {
      int accepted = value <= start + decrease * scale * slope;
      /* Where the expected decrease drowns in rounding, the slope at the end tells what the values
       * cannot (the approximate Wolfe condition of Hager & Zhang 2005). Below their last digit they tell nothing. */
      const double unseen = -scale * slope < 1e-16 * magnitude ? fmax(rounding, 1e-8 * magnitude) : rounding;
      if (!accepted && -scale * slope <= rounding && value <= start + unseen &&
          !flesh_problem_residual(self, self->step, self->work))
        accepted = flesh_dot(self->threads, self->n, self->work, p) <= -(1 - 2 * decrease) * slope;
      /* Where little is expected a rise may be rounding, which the terms' sizes understate where they cancel within
       * (I_C - 3 near rest, or what hangs on a place far from the origin). Then once more. */
      const double rise = value - start;
      if (!accepted && rise > rounding && -scale * slope < 1e-8 * magnitude) {
        if (isnan(measured)) measured = 4 * flesh_problem_potential_rounding(self, u);
        if (rise <= measured) {
          rounding = measured;
          scale = full;
          continue;
        }
      }
      if (accepted) {
        /* By the quadratic model, at its minimum. */
        double foretold = -scale * slope / 2;
        const int too_short = self->options.follow_curvature && foretold > 10 * rounding &&
                              start - value > 1.2 * foretold;
        const int fell_short = too_short && is_local(self->n, r);
        self->creeping = too_short && self->projected && scale == full ? self->creeping + 1 : 0;
        if (fell_short || self->creeping > CREEPING) lengthen(self, u, p, start, slope, INFINITY, &scale, &value);
        else if (too_short && scale < full) lengthen(self, u, p, start, slope, refused, &scale, &value);
        self->follow = choose_follow(self, fell_short, scale);
        self->shortened = scale < full;
        for (int d = 0; d < self->n && scale != 1; d++) p[d] *= scale;
        self->stats.potential_rises += value > self->first_potential + 1e-12 * magnitude;
        self->model_ratio = model_ratio(self, u, r, p, scale * slope, start - value);
        const int went_astray = scale != full || self->projected || self->beyond ||
                                (foretold > 10 * rounding && fabs(start - value - foretold) > 0.25 * foretold);
        const int patched = self->patch && went_astray && add_patch(self, u, p, value);
        self->cut = patched || scale > full ? 1 : scale / full;
        return FLESH_OK;
      }
    }
    self->stats.backtracks++;
    refused = scale;
    /* The minimum of the parabola through what is known, kept within a tenth and a half. */
    double parabola = status ? 0.5 : -slope * scale / (2 * (value - start - scale * slope));
    scale *= fmin(fmax(parabola, 0.1), 0.5);
  }
  return FLESH_NOT_CONVERGED;
}
