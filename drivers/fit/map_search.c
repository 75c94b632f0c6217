/* map_search.c: searches the map and the keys with the least sum of squared residuals and penalty by the Gauss-Newton
 * method, with steps by conjugate gradients in a trust region (GSL; Steihaug 1983, Toint 1981), and the weight by
 * Morozov's discrepancy principle (1966): the smoothest map whose residuals match the deviations, reduced by what
 * fitting as many numbers as the measurements determine takes off (Hall & Titterington 1987). */
#include <gsl/gsl_blas.h>
#include <gsl/gsl_errno.h>
#include <gsl/gsl_multilarge_nlinear.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/error.h"
#include "fit/map.h"
#include "math/xorshift.h"

/* The equations of a step are solved until the residual is this share of the gradient. */
static const double step_tolerance = 1e-2;
/* The search ends if the sum of squares is within this share of its expectation, or if two weights have a smaller ratio
 * than close_weights. */
static const double enough = 0.02, close_weights = 1.1;
/* Factor from one weight to the next until the residuals are small enough; smallest weight, as a share of the first. */
static const double fall = 0.1, least_share = 1e-10;
/* Conjugate gradients that count the determined numbers end at this share of the squared residual. */
static const double trace_share = 1e-4;
enum { TRACE_ITERATIONS = 200 };

typedef struct searching {
  flesh_fit *fit;
  flesh_fit_found *found;
  double weight;
  flesh_fit_linear *linear;
  double *at, *p, *slopes, *linear_p; /* [parameters]: z of `linear`; p of the current evaluation; dq/dz and p at z of `linear` */
  double *u, *y;     /* [parameters], [count] */
  double largest;    /* largest residual so far */
  signed char held[FLESH_FIT_PARAMETERS]; /* keys that stay at a bound: -1 lower, 1 upper */
  int status;
} searching;

/* soft: a smooth function of z from 0 for small z to z for large z, and its slope. hard: its inverse. */
static double soft(double z, double *slope)
{
  *slope = 1 / (1 + exp(-z));
  return fmax(z, 0) + log1p(exp(-fabs(z)));
}
static double hard(double d) { return d + log(-expm1(-d)); }

/* Least distance from a bound at the start of a search, so that it can leave the bound: a share of the way between both
 * bounds, or a length in q. */
static const double least = 0.02;

/* Returns z for a search that does not know the bounds: z is q, or a smooth function takes it to q between the
 * bounds. */
static double z_of(const flesh_fit_parameter *parameter, double p)
{
  const double q = flesh_fit_q_of(parameter, p), low = flesh_fit_q_of(parameter, parameter->from),
               high = flesh_fit_q_of(parameter, parameter->to);
  if (isinf(low)) return isinf(high) ? q : -hard(fmax(high - q, least));
  if (isinf(high)) return hard(fmax(q - low, least));
  const double share = fmin(fmax((q - low) / (high - low), least), 1 - least);
  return (high - low) / 4 * log(share / (1 - share));
}

/* Returns the value for z, and dq/dz in *slope. */
static double p_at(const flesh_fit_parameter *parameter, double z, double *slope)
{
  const double low = flesh_fit_q_of(parameter, parameter->from), high = flesh_fit_q_of(parameter, parameter->to);
  double q = z;
  *slope = 1;
  if (isfinite(low) && isfinite(high)) {
    const double share = 1 / (1 + exp(-4 * z / (high - low)));
    *slope = 4 * share * (1 - share);
    q = low + (high - low) * share;
  } else if (isfinite(low)) q = low + soft(z, slope);
  else if (isfinite(high)) q = high - soft(-z, slope);
  return fmin(fmax(flesh_fit_p_of(parameter, q), parameter->from), parameter->to);
}

/* Returns 1 if p is near its upper bound, -1 if near the lower one, else 0. Near is within 0.01 in q, and within a hundredth
 * of the way between the bounds. */
static int side_of(const flesh_fit_parameter *parameter, double p)
{
  const double q = flesh_fit_q_of(parameter, p), low = flesh_fit_q_of(parameter, parameter->from),
               high = flesh_fit_q_of(parameter, parameter->to), near = 0.01 * fmin(high - low, 1);
  return high - q < near ? 1 : q - low < near ? -1 : 0;
}

static double face_weight(const searching *s, int f) { return sqrt(s->weight * s->fit->map->face_weights[f]); }

/* Returns the value of parameter k for z, and dq/dz in *slope. */
static double value_at(const searching *s, int k, double z, double *slope)
{
  const flesh_fit_parameter *p = &s->fit->parameters[k];
  const int held = k < s->fit->key_count ? s->held[k] : 0;
  *slope = 0;
  return held ? held > 0 ? p->to : p->from : p_at(p, z, slope);
}

static void set_parameters(const searching *s, const double *z, double *p)
{
  double slope;
  for (int k = 0; k < s->fit->parameter_count; k++) p[k] = value_at(s, k, z[k], &slope);
}

static int find_residuals(const gsl_vector *z, void *data, gsl_vector *f)
{
  searching *s = data;
  double slope;
  if (s->status) return GSL_EFAILED;
  set_parameters(s, z->data, s->p);
  const int status = flesh_fit_evaluate(s->fit, s->p, s->y, NULL);
  if (status < 0) s->status = status;
  for (int i = 0; i < s->fit->count && !s->status; i++)
    gsl_vector_set(f, (size_t)i, status ? 10 * s->largest + 1 : flesh_fit_residual(s->fit, i, s->y));
  for (int k = 0; k < s->fit->map->face_count && !s->status; k++)
    gsl_vector_set(f, (size_t)(s->fit->count + k), face_weight(s, k) * flesh_fit_map_residual(s->fit, k, s->p, &slope));
  return s->status ? GSL_EFAILED : GSL_SUCCESS;
}

/* Linearises at z [parameters], unless that was done. */
static int linearise(searching *s, const double *z)
{
  const size_t bytes = (size_t)s->fit->parameter_count * sizeof *z;
  if (s->linear && !memcmp(s->at, z, bytes)) return FLESH_OK;
  flesh_fit_linear_destroy(&s->linear);
  memcpy(s->at, z, bytes);
  for (int k = 0; k < s->fit->parameter_count; k++) s->linear_p[k] = value_at(s, k, z[k], &s->slopes[k]);
  return flesh_fit_linear_create(s->fit, s->linear_p, &s->linear);
}

/* Adds the penalty's part of J u, or of J^T u; u and v refer to q. */
static void penalise(const searching *s, int transposed, const double *u, double *v)
{
  const flesh_fit_map *map = s->fit->map;
  for (int k = 0; k < map->face_count; k++) {
    const int *pair = map->faces + 2 * k;
    double slope;
    flesh_fit_map_residual(s->fit, k, s->linear_p, &slope);
    const double weight = slope * face_weight(s, k);
    if (transposed) v[pair[0]] += weight * u[k], v[pair[1]] -= weight * u[k];
    else v[k] = weight * (u[pair[0]] - u[pair[1]]);
  }
}

static int find_product(CBLAS_TRANSPOSE_t transposed, const gsl_vector *z, const gsl_vector *u, void *data, gsl_vector *v,
                        gsl_matrix *JTJ)
{
  searching *s = data;
  const int n = s->fit->parameter_count;
  (void)JTJ;
  if (!s->status) s->status = linearise(s, z->data);
  if (s->status) return GSL_EFAILED;
  if (transposed == CblasTrans) {
    s->status = flesh_fit_linear_times_transposed(s->linear, u->data, s->u);
    if (!s->status) penalise(s, 1, u->data + s->fit->count, s->u);
    for (int k = 0; k < n && !s->status; k++) gsl_vector_set(v, (size_t)k, s->slopes[k] * s->u[k]);
  } else {
    for (int k = 0; k < n; k++) s->u[k] = s->slopes[k] * gsl_vector_get(u, (size_t)k);
    s->status = flesh_fit_linear_times(s->linear, s->u, v->data);
    if (!s->status) penalise(s, 0, s->u, v->data + s->fit->count);
  }
  return s->status ? GSL_EFAILED : GSL_SUCCESS;
}

/* Computes the sums of squares of the residuals and of the penalty. */
static void measure(const searching *s, const gsl_vector *f, flesh_fit_stage *stage)
{
  stage->squares = stage->penalty = 0;
  for (size_t i = 0; i < f->size; i++)
    *(i < (size_t)s->fit->count ? &stage->squares : &stage->penalty) += pow(gsl_vector_get(f, i), 2);
}

/* Holds the keys that have reached a bound and would go beyond it; returns whether there are any. */
static int hold(searching *s, const gsl_multilarge_nlinear_workspace *w)
{
  int some = 0;
  for (int k = 0; k < s->fit->key_count; k++) {
    const gsl_vector *z = gsl_multilarge_nlinear_position(w);
    double slope;
    const int side = side_of(&s->fit->parameters[k], value_at(s, k, gsl_vector_get(z, (size_t)k), &slope));
    if (s->held[k] || side * gsl_vector_get(w->g, (size_t)k) >= 0) continue;
    s->held[k] = (signed char)side;
    some = 1;
  }
  if (some) flesh_fit_linear_destroy(&s->linear);
  return some;
}

/* Iterates until a key is held, or until a step lowers the sum of squares by less than `tolerance` times its standard
 * deviation sqrt(2 count). With keys the limit is 5 times `tolerance`, by default the effect of a change by a fifth of
 * a standard error. */
static void iterate(searching *s, gsl_multilarge_nlinear_workspace *w, flesh_fit_stage *stage)
{
  const double small = s->fit->tolerance * (s->fit->key_count ? 5 : sqrt(2. * s->fit->count));
  while (!stage->converged && stage->iterations < s->fit->max_iterations && !s->status && !hold(s, w)) {
    const double before = stage->squares + stage->penalty;
    for (size_t i = 0; i < (size_t)s->fit->count; i++)
      s->largest = fmax(s->largest, fabs(gsl_vector_get(gsl_multilarge_nlinear_residual(w), i)));
    const int code = gsl_multilarge_nlinear_iterate(w);
    if (s->status) return;
    stage->iterations++;
    measure(s, gsl_multilarge_nlinear_residual(w), stage);
    stage->converged = code || before - stage->squares - stage->penalty <= small;
  }
}

/* Estimates how many numbers the measurements determine, by the share of random signs y that the linear model
 * reproduces: y^T J H^-1 J^T y (Hutchinson 1990) with H = J^T J + P^T P, which conjugate gradients sum up. */
static int count_determined(searching *s, const double *z, double *determined)
{
  const size_t n = (size_t)s->fit->parameter_count, faces = (size_t)s->fit->map->face_count;
  double *r = calloc(3 * n + faces, sizeof *r), *d = r + n, *h = d + n, *bend = h + n, rr = 0, first;
  uint32_t random = flesh_xorshift_first;
  int status = r ? linearise(s, z) : flesh_fail(FLESH_ERR_MEMORY, "out of memory for a map of %zu tets", n);
  for (int i = 0; i < s->fit->count; i++) s->y[i] = flesh_xorshift(&random) >> 31 ? 1 : -1;
  if (!status) status = flesh_fit_linear_times_transposed(s->linear, s->y, r);
  for (size_t k = 0; k < n && !status; k++) d[k] = r[k], rr += r[k] * r[k];
  first = rr;
  *determined = 0;
  for (int i = 0; i < TRACE_ITERATIONS && rr > trace_share * first && !status; i++) {
    double dh = 0, before = rr;
    status = flesh_fit_linear_times(s->linear, d, s->y);
    if (!status) status = flesh_fit_linear_times_transposed(s->linear, s->y, h);
    penalise(s, 0, d, bend);
    penalise(s, 1, bend, h);
    for (size_t k = 0; k < n; k++) dh += d[k] * h[k];
    if (status || !(dh > 0)) break;
    rr = 0;
    for (size_t k = 0; k < n; k++) r[k] -= before / dh * h[k], rr += r[k] * r[k];
    for (size_t k = 0; k < n; k++) d[k] = r[k] + rr / before * d[k];
    *determined += before * before / dh;
  }
  free(r);
  return status;
}

/* Searches with one weight from p [parameters], which becomes the end. */
static int search_with(searching *s, double *p, flesh_fit_stage *stage)
{
  const flesh_fit *fit = s->fit;
  const size_t n = (size_t)fit->parameter_count, m = (size_t)(fit->count + fit->map->face_count);
  gsl_multilarge_nlinear_parameters options = gsl_multilarge_nlinear_default_parameters();
  options.trs = gsl_multilarge_nlinear_trs_cgst;
  options.scale = gsl_multilarge_nlinear_scale_levenberg;
  options.solver = gsl_multilarge_nlinear_solver_none;
  options.tol = step_tolerance;
  gsl_multilarge_nlinear_workspace *w = gsl_multilarge_nlinear_alloc(gsl_multilarge_nlinear_trust, &options, m, n);
  gsl_vector *z = gsl_vector_alloc(n);
  gsl_multilarge_nlinear_fdf fdf = {.f = find_residuals, .df = find_product, .n = m, .p = n, .params = s};
  if (!w || !z) s->status = flesh_fail(FLESH_ERR_MEMORY, "out of memory for a map of %zu tets", n);
  for (size_t k = 0; k < n && !s->status; k++) gsl_vector_set(z, k, z_of(&fit->parameters[k], p[k]));
  s->weight = stage->weight;
  memset(s->held, 0, sizeof s->held);
  while (!s->status && !stage->converged && stage->iterations < s->fit->max_iterations) {
    if (gsl_multilarge_nlinear_init(z, &fdf, w) != GSL_SUCCESS || s->status) break;
    measure(s, gsl_multilarge_nlinear_residual(w), stage);
    iterate(s, w, stage);
    gsl_vector_memcpy(z, gsl_multilarge_nlinear_position(w));
    set_parameters(s, z->data, p);
  }
  if (!s->status) s->status = count_determined(s, z->data, &stage->determined);
  if (w) gsl_multilarge_nlinear_free(w);
  if (z) gsl_vector_free(z);
  return s->status;
}

/* Finds a first weight at which the map is nearly uniform: the sum of squares of what a uniform change of 1 does to the
 * measured numbers, over the penalty of a change of 1 across every face. */
static int first_weight(searching *s, double *weight)
{
  const int n = s->fit->parameter_count;
  double sum = 0, faces = 0;
  for (int k = 0; k < n; k++) s->u[k] = z_of(&s->fit->parameters[k], s->found->p[k]);
  int status = linearise(s, s->u);
  for (int k = 0; k < n; k++) s->u[k] = k >= s->fit->key_count;
  if (!status) status = flesh_fit_linear_times(s->linear, s->u, s->y);
  for (int i = 0; i < s->fit->count && !status; i++) sum += s->y[i] * s->y[i];
  for (int k = 0; k < s->fit->map->face_count; k++) faces += s->fit->map->face_weights[k];
  *weight = sum > 0 && faces > 0 ? sum / faces : 1;
  return status;
}

/* Returns the logarithm of the mean squared residual, in deviations, over its expectation: 0 if they agree. */
static double excess(const searching *s, const flesh_fit_stage *stage)
{
  return log(stage->squares / fmax(s->fit->count - stage->determined, 1));
}

static void print_progress(const searching *s, const flesh_fit_stage *stage)
{
  if (s->fit->options.quiet) return;
  printf("weight %.3g: residuals %.4g times the deviations, %d iterations\n", stage->weight, exp(excess(s, stage) / 2),
         stage->iterations);
  fflush(stdout);
}

/* Makes a stage with this weight, or reads it if it was made before. */
static int make_stage(searching *s, double weight, double *p)
{
  flesh_fit_found *found = s->found;
  flesh_fit_stage *stage = &found->stages[found->stage_count];
  const double began = flesh_wall_seconds();
  *stage = (flesh_fit_stage){.weight = weight};
  int there, status = flesh_fit_stage_read(s->fit, found->stage_count + 1, stage, p, &there);
  if (!status && !there) {
    status = search_with(s, p, stage);
    if (!status) status = flesh_fit_stage_write(s->fit, found->stage_count + 1, began, stage, p);
  }
  if (!status) print_progress(s, stage), found->stage_count++;
  return status;
}

/* Returns a weight between one with too large residuals and one with too small ones, by linear interpolation of
 * logarithms, away from both ends. */
static double between(const searching *s, const flesh_fit_stage *large, const flesh_fit_stage *small)
{
  const double a = excess(s, large), b = excess(s, small), share = fmin(fmax(a / (a - b), 0.1), 0.9);
  return exp(log(large->weight) + share * (log(small->weight) - log(large->weight)));
}

/* Lowers the weight until the residuals are as small as the deviations, then searches the weight at which they match;
 * always starts from the smoother map, so that no roughness remains. */
static int search_weight(searching *s, double first)
{
  flesh_fit_found *found = s->found;
  const size_t bytes = (size_t)s->fit->parameter_count * sizeof *found->p;
  /* of the last two stages */
  double *smooth = flesh_arena_take(&s->fit->arena, 2 * bytes), *smoothest = smooth + s->fit->parameter_count, weight = first;
  int status = smooth ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "out of memory for a map"), large = -1, small = -1;
  if (!status) memcpy(smooth, found->p, bytes);
  while (!status && found->stage_count < FLESH_FIT_STAGES) {
    memcpy(found->p, smooth, bytes);
    status = make_stage(s, weight, found->p);
    if (status) break;
    const int now = found->chosen = found->stage_count - 1;
    const double far = excess(s, &found->stages[now]);
    if (small < 0 && now >= 2 && far > 0 && far > excess(s, &found->stages[now - 2]) - log(1 + enough)) {
      found->chosen = now - 2; /* the rougher maps fit no better */
      memcpy(found->p, smoothest, bytes);
      break;
    }
    memcpy(smoothest, smooth, bytes);
    if (far > 0) large = now, memcpy(smooth, found->p, bytes);
    else small = now;
    if (fabs(far) <= log(1 + enough) || large < 0) break; /* large < 0: the nearly uniform map is already within the deviations */
    if (small < 0 ? weight < least_share * first : found->stages[large].weight < close_weights * found->stages[small].weight)
      break;
    weight = small < 0 ? weight * fall : between(s, &found->stages[large], &found->stages[small]);
  }
  return status;
}

int flesh_fit_map_search(flesh_fit *fit, flesh_fit_found *found)
{
  const size_t n = (size_t)fit->parameter_count;
  double *room = flesh_arena_take(&fit->arena, (5 * n + (size_t)fit->count) * sizeof *room), weight = fit->map->weight;
  searching s = {.fit = fit, .found = found};
  s.status = room ? flesh_fit_found_open(fit, found) : flesh_fail(FLESH_ERR_MEMORY, "out of memory for a map");
  if (room) s.at = room, s.p = s.at + n, s.slopes = s.p + n, s.linear_p = s.slopes + n, s.u = s.linear_p + n, s.y = s.u + n;
  if (!s.status && isnan(weight)) {
    s.status = first_weight(&s, &weight);
    if (!s.status) s.status = search_weight(&s, weight);
  } else if (!s.status) s.status = make_stage(&s, weight, found->p);
  if (!s.status) s.status = flesh_fit_evaluate_accepted(fit, found->p, found->values, NULL);
  for (int k = 0; k < fit->parameter_count && !s.status; k++) {
    const flesh_fit_parameter *p = &fit->parameters[k];
    const int on = (found->p[k] >= p->to) - (found->p[k] <= p->from);
    found->at_bound[k] = (signed char)(k < fit->key_count ? on : side_of(p, found->p[k]));
  }
  for (int k = 0; k < found->stage_count; k++) found->iterations += found->stages[k].iterations;
  found->converged = !s.status && found->stages[found->chosen].converged;
  if (!s.status && !found->converged)
    snprintf(found->words, sizeof found->words, "the search has not ended after %d iterations (max_iterations)",
             fit->max_iterations);
  flesh_fit_linear_destroy(&s.linear);
  return s.status;
}
