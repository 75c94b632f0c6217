/* search.c: minimises the sum of squares by the Levenberg-Marquardt method (GSL's trust-region solver; More 1978,
 * Nielsen 1999). A parameter that would leave its bounds is put on the bound and stays there while the sum of squares
 * decreases beyond it. */
#include <gsl/gsl_blas.h>
#include <gsl/gsl_errno.h>
#include <gsl/gsl_multifit.h>
#include <gsl/gsl_multifit_nlinear.h>
#include <math.h>

#include "base/error.h"
#include "fit/map.h"

/* The search also ends if a further step would change q by less than this: for measurements without noise standard
 * errors are 0. */
static const double least_step = 1e-7;
/* A search that cannot improve because runs are too rough, as with impacts, counts as converged if it is within this
 * share of the standard errors. */
static const double rough = 0.1;
enum { RELEASES = 3 };

typedef struct searching {
  flesh_fit *fit;
  flesh_fit_found *found;
  int count, free_count; /* count: number of measured numbers */
  int list[FLESH_FIT_PARAMETERS]; /* indices of the free parameters */
  double q[FLESH_FIT_PARAMETERS]; /* within the bounds */
  int releases[FLESH_FIT_PARAMETERS];
  double *values; /* [count] workspace */
  double largest; /* largest residual at the last accepted parameters */
  int status;     /* error that ends the fit */
} searching;

/* Sets the parameters of a point of GSL, within their bounds. */
static void set_parameters(const searching *s, const gsl_vector *x, double *p)
{
  const flesh_fit_parameter *parameters = s->fit->parameters;
  for (int k = 0; k < s->fit->parameter_count; k++) p[k] = flesh_fit_value_at(&parameters[k], s->q[k]);
  for (int j = 0; j < s->free_count; j++)
    p[s->list[j]] = flesh_fit_value_at(&parameters[s->list[j]], gsl_vector_get(x, (size_t)j));
}

/* Computes residuals over their deviations. If a run fails, they are larger than at the last accepted parameters, so
 * that the step is reduced. */
static int find_residuals(const gsl_vector *x, void *data, gsl_vector *f)
{
  searching *s = data;
  double p[FLESH_FIT_PARAMETERS];
  if (s->status) return GSL_EFAILED;
  set_parameters(s, x, p);
  const int status = flesh_fit_evaluate(s->fit, p, s->values, NULL);
  if (status < 0) s->status = status;
  for (int i = 0; i < s->count && !s->status; i++)
    gsl_vector_set(f, (size_t)i, status ? 10 * s->largest + 1 : flesh_fit_residual(s->fit, i, s->values));
  return s->status ? GSL_EFAILED : GSL_SUCCESS;
}

/* Computes the Jacobian at parameters that GSL has accepted, which become those of the end. */
static int find_jacobian(const gsl_vector *x, void *data, gsl_matrix *J)
{
  searching *s = data;
  flesh_fit_found *found = s->found;
  if (s->status) return GSL_EFAILED;
  set_parameters(s, x, found->p);
  s->status = flesh_fit_evaluate_accepted(s->fit, found->p, found->values, found->jacobian);
  for (int i = 0; i < s->count && !s->status; i++)
    for (int j = 0; j < s->free_count; j++)
      gsl_matrix_set(J, (size_t)i, (size_t)j, flesh_fit_by_q(s->fit, found->p, found->jacobian, i, s->list[j]));
  return s->status ? GSL_EFAILED : GSL_SUCCESS;
}

/* Measures a Gauss-Newton step from here: its length in standard errors (an upper bound) and its largest change of q.
 * FLESH_ERR_MEMORY. */
static int measure_step(const gsl_matrix *J, const gsl_vector *f, double *errors, double *change)
{
  const size_t m = J->size1, n = J->size2;
  gsl_multifit_linear_workspace *w = gsl_multifit_linear_alloc(m, n);
  gsl_vector *step = gsl_vector_alloc(n);
  double inside = 0, all = 0;
  const int status = w && step ? FLESH_OK : flesh_no_memory();
  if (!status) {
    gsl_multifit_linear_bsvd(J, w);
    const size_t rank = gsl_multifit_linear_rank(flesh_fit_least_share, w);
    gsl_blas_dgemv(CblasTrans, 1, w->A, f, 0, w->xt); /* A is U of the decomposition, and Q is V */
    for (size_t j = 0; j < n; j++) {
      const double share = j < rank ? gsl_vector_get(w->xt, j) : 0;
      inside += share * share;
      gsl_vector_set(w->xt, j, j < rank ? share / gsl_vector_get(w->S, j) : 0);
    }
    gsl_blas_dgemv(CblasNoTrans, 1, w->Q, w->xt, 0, step);
    gsl_vector_div(step, w->D);
    gsl_blas_ddot(f, f, &all);
    *change = fmax(gsl_vector_max(step), -gsl_vector_min(step));
    *errors = m > n && all > inside ? sqrt(inside / ((all - inside) / (double)(m - n))) : INFINITY;
  }
  gsl_multifit_linear_free(w);
  gsl_vector_free(step);
  return status;
}

/* Returns half the derivative of the sum of squares by q_k at the last accepted parameters. */
static double gradient(const searching *s, int k)
{
  double sum = 0;
  for (int i = 0; i < s->count; i++)
    sum += flesh_fit_by_q(s->fit, s->found->p, s->found->jacobian, i, k) * flesh_fit_residual(s->fit, i, s->found->values);
  return sum;
}

/* Takes over the accepted step. Returns whether the set of free parameters has changed, because some have met a
 * bound. */
static int accept(searching *s, const gsl_vector *x)
{
  const flesh_fit *fit = s->fit;
  flesh_fit_found *found = s->found;
  int met = 0;
  s->largest = 0;
  for (int i = 0; i < s->count; i++) s->largest = fmax(s->largest, fabs(flesh_fit_residual(fit, i, found->values)));
  for (int j = 0; j < s->free_count; j++) {
    const int k = s->list[j];
    const double wanted = gsl_vector_get(x, (size_t)j);
    s->q[k] = flesh_fit_clamp(&fit->parameters[k], wanted);
    if (wanted == s->q[k]) continue;
    met = 1;
    const int side = wanted > s->q[k] ? 1 : -1;
    if (side * gradient(s, k) < 0) found->at_bound[k] = (signed char)side;
  }
  return met;
}

static void print_progress(const searching *s)
{
  if (s->fit->options.quiet) return;
  printf("iteration %d: sum of squares %.6g", s->found->iterations,
         flesh_fit_squares(s->fit, 0, s->count, s->found->values));
  for (int k = 0; k < s->fit->parameter_count && k < 6; k++) printf(", %s %.6g", s->fit->parameters[k].name, s->found->p[k]);
  printf("%s\n", s->fit->parameter_count > 6 ? ", ..." : "");
  fflush(stdout);
}

/* Iterates with the free parameters until the search ends or one meets a bound; returns whether one has. */
static int iterate(searching *s, gsl_multifit_nlinear_workspace *w)
{
  flesh_fit_found *found = s->found;
  for (;;) {
    double errors = INFINITY, change = INFINITY;
    const int met = accept(s, gsl_multifit_nlinear_position(w));
    print_progress(s);
    if (met) return 1;
    s->status = measure_step(gsl_multifit_nlinear_jac(w), gsl_multifit_nlinear_residual(w), &errors, &change);
    found->converged = errors <= s->fit->tolerance || change <= least_step;
    if (s->status || found->converged) return 0;
    if (found->iterations == s->fit->max_iterations) {
      snprintf(found->words, sizeof found->words, "the search has not ended after %d iterations (max_iterations)",
               found->iterations);
      return 0;
    }
    const int code = gsl_multifit_nlinear_iterate(w);
    found->iterations++;
    if (s->status) return 0;
    if (!code) continue;
    found->converged = errors <= rough;
    if (isinf(errors))
      snprintf(found->words, sizeof found->words, "no step lowers the sum of squares further, which is not 0 although there are "
                                                  "as many parameters as measured numbers: perhaps no parameters give them");
    else
      snprintf(found->words, sizeof found->words, "no step lowers the sum of squares further, although one of %.2g standard "
                                                  "errors should: the runs cannot distinguish parameters so close to each "
                                                  "other", errors);
    return 0;
  }
}

/* Frees the parameters at bounds that would return from them; returns whether there are any. */
static int release(searching *s)
{
  int released = 0;
  for (int k = 0; k < s->fit->parameter_count; k++) {
    if (!s->found->at_bound[k] || s->found->at_bound[k] * gradient(s, k) <= 0 || s->releases[k] == RELEASES) continue;
    s->found->at_bound[k] = 0;
    s->releases[k]++;
    released = 1;
  }
  return released;
}

/* Runs one search with the free parameters; returns whether one has met a bound. */
static int search_free(searching *s)
{
  gsl_multifit_nlinear_parameters options = gsl_multifit_nlinear_default_parameters();
  options.solver = gsl_multifit_nlinear_solver_svd;
  const size_t n = (size_t)s->free_count, m = (size_t)s->count;
  gsl_multifit_nlinear_workspace *w = gsl_multifit_nlinear_alloc(gsl_multifit_nlinear_trust, &options, m, n);
  gsl_vector *x = gsl_vector_alloc(n);
  gsl_multifit_nlinear_fdf fdf = {.f = find_residuals, .df = find_jacobian, .n = m, .p = n, .params = s};
  int met = 0;
  for (size_t j = 0; j < n && x; j++) gsl_vector_set(x, j, s->q[s->list[j]]);
  if (!w || !x) s->status = flesh_fail(FLESH_ERR_MEMORY, "out of memory for a fit");
  else if (gsl_multifit_nlinear_init(x, &fdf, w) == GSL_SUCCESS && !s->status) met = iterate(s, w);
  if (w) gsl_multifit_nlinear_free(w);
  if (x) gsl_vector_free(x);
  return met;
}

int flesh_fit_search(flesh_fit *fit, flesh_fit_found *found)
{
  if (fit->map) return flesh_fit_map_search(fit, found);
  searching s = {.fit = fit, .found = found, .count = fit->count,
                 .values = flesh_arena_take(&fit->arena, (size_t)fit->count * sizeof(double))};
  s.status = s.values ? flesh_fit_found_open(fit, found) : flesh_fail(FLESH_ERR_MEMORY, "out of memory for a fit");
  for (int k = 0; k < fit->parameter_count; k++) s.q[k] = flesh_fit_q_of(&fit->parameters[k], fit->parameters[k].start);
  for (int more = 1; more && !s.status;) {
    s.free_count = 0;
    for (int k = 0; k < fit->parameter_count; k++)
      if (!found->at_bound[k]) s.list[s.free_count++] = k;
    found->converged = !s.free_count;
    more = s.free_count && search_free(&s);
    if (!s.status && !more && found->converged) more = release(&s);
  }
  return s.status;
}
