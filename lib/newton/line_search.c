/* line_search.c: Armijo's rule on the incremental potential, its replacement where round-off dominates, and lengthened
 * steps. */
#include "newton/line_search.h"

#include <math.h>

#include "effect/effect.h"
#include "newton/mechanisms.h"
#include "system/feasible_step.h"

/* After this many filtered steps in a row that were too short, a step is lengthened wherever the residual is. */
enum { MANY_SHORT = 16 };

/* Every MANY_STEPS steps, a solve with touching bodies is given up if these steps have lowered the potential by less than
 * least_gain times its total decrease. */
enum { MANY_STEPS = 100 };
static const double least_gain = 0.1;

/* One search: the direction, and the known values of the potential along it. */
typedef struct line {
  const double *u, *b, *p;
  double slope;               /* -b.p < 0 */
  double start, magnitude;    /* the potential at u and the sizes of its terms */
  double first;               /* the first try: the longest feasible step up to 1 */
  double round_off, measured; /* round-off of the potential: estimated, and measured (NaN: not yet) */
  double refused;             /* last refused length; INFINITY: none */
  double length, value;       /* length of the trial, and its potential */
  double made;                /* length for which the trial vector was made; NAN: none */
} line;

int flesh_search_makes_progress(flesh_search *self, const double *u)
{
  return self->gain > 0 && self->gain > 4 * flesh_equations_potential_round_off(self->equations, u);
}

typedef struct trial {
  double *at;
  const double *u, *p;
  double scale;
} trial;

static void step_part(void *data, int k, int begin, int end)
{
  (void)k;
  const trial *t = data;
  for (int d = begin; d < end; d++) t->at[d] = t->scale * t->p[d];
  for (int d = begin; d < end; d++) t->at[d] += t->u[d];
}

void flesh_step_to(const flesh_equations *equations, const double *u, double scale, const double *p, double *at)
{
  flesh_parallel_parts(equations->threads, equations->n, step_part, &(trial){at, u, p, scale});
}

static double dot(const flesh_search *self, const double *x, const double *y)
{
  return flesh_dot(self->equations->threads, self->equations->n, x, y);
}

/* A crease or an inverting tet is local. A body that is crumpled as a whole gets tangled less often by the filtered
 * Hessian's short steps. */
int flesh_is_local(const flesh_equations *equations, const double *r)
{
  double *squares = equations->scratch;
  for (int d = 0; d < equations->n; d++) squares[d] = r[d] * r[d];
  const double sum = flesh_dot(equations->threads, equations->n, r, r);
  return sum * sum < 0.01 * equations->evaluation.all * flesh_dot(equations->threads, equations->n, squares, squares);
}

/* Whether the eigenvalue filter needs the model ratio of steps. */
static int needs_model_ratio(const flesh_solver_options *options)
{
  return options->eigenvalue_filter == FLESH_FILTER_AUTO || options->eigenvalue_filter == FLESH_FILTER_TRUST_REGION ||
         options->eigenvalue_filter == FLESH_FILTER_TRUST_REGION_ALWAYS;
}

/* Computes p.H p with the unfiltered Hessian at u, by a difference of residuals; NaN where there is none. */
static double curvature(flesh_search *self, const double *u, const double *b, const double *p)
{
  const double epsilon = 1e-5;
  double *trial = self->equations->trial, *r = self->equations->work[0];
  for (int d = 0; d < self->equations->n; d++) trial[d] = u[d] + epsilon * p[d];
  if (flesh_equations_residual(self->equations, trial, r)) return NAN;
  return (dot(self, r, p) + dot(self, b, p)) / epsilon;
}

/* Longest first try: the feasible fraction of the direction, at most 1. */
static double longest_feasible(flesh_search *self, line *line)
{
  if (!flesh_system_limits_step(self->equations->system)) return 1;
  line->made = 1;
  flesh_step_to(self->equations, line->u, line->made, line->p, self->equations->trial);
  const double fraction = flesh_equations_max_feasible_step(self->equations, line->u, self->equations->trial);
  return fraction < 1 ? flesh_feasible_step_kept * fraction : 1;
}

/* Lengthens the accepted step as long as that lowers the potential further, but not beyond the refused length `too_long`
 * (INFINITY: none). */
static void lengthen(flesh_search *self, line *line, double too_long)
{
  const int bounded = too_long < INFINITY;
  for (int tries = 0; tries < 20; tries++) {
    /* Go to the minimum of the parabola through the known values. The first try goes at least to twice the length, because
     * a potential that curves less than the matrix says (x^4) keeps falling. */
    const double length = line->length;
    double curvature_estimate = (line->value - line->start) / (length * length) - line->slope / length, further, ignored;
    double longer = curvature_estimate > 0 ? fmin(-line->slope / (2 * curvature_estimate), 4 * length) : 4 * length;
    if (tries == 0 && !bounded) longer = fmax(longer, 2 * length);
    if (longer >= too_long) longer = sqrt(length * too_long);
    if (longer < 1.4 * length) return;
    flesh_step_to(self->equations, line->u, longer, line->p, self->equations->trial);
    if (flesh_equations_max_feasible_step(self->equations, line->u, self->equations->trial) < 1 ||
        flesh_equations_potential(self->equations, self->equations->trial, &further, &ignored) || !(further < line->value)) {
      too_long = longer;
    } else {
      line->value = further;
      line->length = longer;
    }
  }
}

typedef enum verdict { REFUSED, ACCEPTED, AGAIN } verdict;

/* Judges whether the trial's value is low enough. AGAIN: the potential's round-off turned out larger, and the search starts
 * anew with it. */
static verdict judge(flesh_search *self, line *line)
{
  const double slope = line->length * line->slope, rise = line->value - line->start;
  if (line->value <= line->start + flesh_armijo * line->length * line->slope) return ACCEPTED;
  /* If round-off dominates the expected decrease, the slope at the end shows what the values cannot (the approximate Wolfe
   * condition of Hager & Zhang 2005). Below their last digit the values show nothing. */
  const double unseen =
      -slope < 1e-16 * line->magnitude ? fmax(line->round_off, 1e-8 * line->magnitude) : line->round_off;
  if (flesh_uses(self->equations->options, FLESH_TECHNIQUE_APPROXIMATE_WOLFE) && -slope <= line->round_off &&
      line->value <= line->start + unseen &&
      !flesh_equations_residual(self->equations, self->equations->trial, self->equations->work[0]) &&
      dot(self, self->equations->work[0], line->p) <= -(1 - 2 * flesh_armijo) * line->slope)
    return ACCEPTED;
  /* If little decrease is expected, a rise may be round-off. The sizes of the terms understate it where parts of a term
   * cancel (I_C - 3 near rest, or a load attached far from the origin): the round-off is measured once. */
  if (!(rise > line->round_off && -slope < 1e-8 * line->magnitude)) return REFUSED;
  if (isnan(line->measured)) line->measured = 4 * flesh_equations_potential_round_off(self->equations, line->u);
  if (!(rise <= line->measured)) return REFUSED;
  line->round_off = line->measured;
  line->length = line->first;
  return AGAIN;
}

/* Watches for a solve with touching bodies that makes no progress. Only for steps in time, which can be shortened. */
static void watch_progress(flesh_search *self, double value)
{
  const flesh_equations *equations = self->equations;
  const int touches = equations->evaluation.proximity.near && equations->stage.shift.a != 0;
  if (!touches || ++self->steps % MANY_STEPS) return;
  self->stalls = self->steps > MANY_STEPS &&
                 self->asked_potential - value < least_gain * (self->first_potential - value);
  self->asked_potential = value;
}

/* Scales p to the accepted length, or a longer one, and compares the result with the quadratic model. */
static void accept(flesh_search *self, line *line, flesh_step *step)
{
  const flesh_solver_options *options = self->equations->options;
  const int filtered = step->kind == FLESH_DIRECTION_FILTERED, n = self->equations->n;
  /* The decrease that the quadratic model predicts at its minimum. */
  const double predicted = -line->length * line->slope / 2;
  const int significant = predicted > 10 * line->round_off;
  const int too_short = significant && line->start - line->value > flesh_short_gain * predicted;
  const int locally = too_short && flesh_is_local(self->equations, line->b);
  self->short_filtered = too_short && filtered && line->length == line->first ? self->short_filtered + 1 : 0;
  if (!flesh_uses(options, FLESH_TECHNIQUE_LONGER_STEPS)) self->short_filtered = 0;
  else if (locally || self->short_filtered > MANY_SHORT) lengthen(self, line, INFINITY);
  else if (too_short && line->length < line->first) lengthen(self, line, line->refused);
  const double length = line->length, actual = line->start - line->value;
  self->shortened = length < line->first;
  self->gain = actual > 10 * line->round_off ? actual : 0;
  for (int d = 0; d < n && length != 1; d++) step->p[d] *= length;
  watch_progress(self, line->value);
  self->equations->stats->potential_rises += line->value > self->first_potential + 1e-12 * line->magnitude;
  *step = (flesh_step){
      .u = step->u, .b = step->b, .p = step->p, .kind = step->kind, .start = line->start, .value = line->value,
      .length = length, .cut = length > line->first ? 1 : length / line->first, .predicted = predicted, .actual = actual,
      .model_ratio = NAN, .too_short_locally = locally,
      .unpredicted = length != line->first || step->kind != FLESH_DIRECTION_NEWTON ||
                     (significant && fabs(actual - predicted) > 0.25 * predicted)};
  if (filtered && needs_model_ratio(options))
    step->model_ratio = actual / -(length * line->slope + curvature(self, step->u, step->b, step->p) / 2);
}

int flesh_search_run(flesh_search *self, flesh_step *step)
{
  flesh_equations *equations = self->equations;
  double *trial = equations->trial;
  line line = {.u = step->u, .b = step->b, .p = step->p, .slope = -dot(self, step->b, step->p), .measured = NAN,
               .refused = INFINITY, .made = NAN};
  self->gain = 0;
  if (!(line.slope < 0)) return FLESH_NOT_POSITIVE;
  int status = flesh_equations_potential(equations, step->u, &line.start, &line.magnitude);
  if (status) return status;
  line.round_off = 1e-13 * line.magnitude;
  if (isnan(self->first_potential)) self->first_potential = line.start;
  line.length = line.first = longest_feasible(self, &line);
  while (line.length > 1e-14) {
    double ignored;
    if (line.length != line.made) flesh_step_to(equations, step->u, line.length, step->p, trial);
    line.made = line.length;
    /* A first try is mostly accepted: evaluate the residual with it, which KINSOL asks for next. */
    status = line.length == line.first && !self->shortened
                 ? flesh_equations_evaluate(equations, trial, &line.value, &ignored)
                 : flesh_equations_potential(equations, trial, &line.value, &ignored);
    if (status < 0) return status;
    const verdict verdict = status ? REFUSED : judge(self, &line);
    if (verdict == AGAIN) continue;
    if (verdict == ACCEPTED) {
      accept(self, &line, step);
      return FLESH_OK;
    }
    self->equations->stats->backtracks++;
    line.refused = line.length;
    /* Go to the minimum of the parabola through the known values, kept between a tenth and a half of the length. */
    const double parabola = status ? 0.5 : -line.slope * line.length /
                                               (2 * (line.value - line.start - line.length * line.slope));
    line.length *= fmin(fmax(parabola, 0.1), 0.5);
  }
  return FLESH_NOT_CONVERGED;
}
