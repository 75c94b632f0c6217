/* statistics.c: computes standard errors, intervals and correlations by the linearised model (Seber & Wild 2003, sections
 * 2.1 and 5.1), and says what the measurements do not determine. */
#include <gsl/gsl_cdf.h>
#include <gsl/gsl_multifit.h>
#include <math.h>

#include "base/error.h"
#include "fit/map.h"

typedef struct work {
  const flesh_fit *fit;
  const flesh_fit_found *found;
  flesh_fit_statistics *to;
  int n, null_count;
  int list[FLESH_FIT_PARAMETERS]; /* indices of the free parameters */
  gsl_matrix *J;                      /* by q, with rows over the deviations */
  gsl_multifit_linear_workspace *svd; /* of J with balanced columns */
  double *null; /* [null_count * n] relative changes of the parameters that leave the measured quantities unchanged */
  unsigned char loose[FLESH_FIT_PARAMETERS]; /* 1: the parameter is not determined */
} work;

static void decompose(work *w)
{
  for (int c = 0; c < w->n; c++)
    for (int i = 0; i < w->fit->count; i++)
      gsl_matrix_set(w->J, (size_t)i, (size_t)c, flesh_fit_by_q(w->fit, w->found->p, w->found->jacobian, i, w->list[c]));
  gsl_multifit_linear_bsvd(w->J, w->svd);
  w->null_count = w->n - (int)gsl_multifit_linear_rank(flesh_fit_least_share, w->svd);
}

/* Finds the changes of the parameters, as shares of them, that leave the measured quantities unchanged: rows with as
 * many zeros as elimination gives. */
static void reduce_null(work *w)
{
  const int n = w->n, rows = w->null_count;
  for (int r = 0; r < rows; r++)
    for (int c = 0; c < n; c++) {
      const int k = w->list[c];
      const double p = w->found->p[k];
      const double share = flesh_fit_slope(&w->fit->parameters[k], p) / (p != 0 ? p : 1);
      w->null[r * n + c] = gsl_matrix_get(w->svd->Q, (size_t)c, (size_t)(n - 1 - r)) * share / gsl_vector_get(w->svd->D, (size_t)c);
    }
  for (int r = 0; r < rows; r++) {
    double *row = w->null + r * n;
    int pivot = 0;
    for (int c = 1; c < n; c++)
      if (fabs(row[c]) > fabs(row[pivot])) pivot = c;
    const double largest = row[pivot];
    for (int c = 0; c < n && largest != 0; c++) row[c] /= largest;
    for (int other = 0; other < rows; other++) {
      const double factor = w->null[other * n + pivot];
      for (int c = 0; c < n && other != r; c++) w->null[other * n + c] -= factor * row[c];
    }
  }
  for (int r = 0; r < rows; r++)
    for (int c = 0; c < n; c++)
      if (fabs(w->null[r * n + c]) > flesh_fit_small_share) w->loose[c] = 1;
}

/* Computes covariances of q, then of the parameters. */
static void find_covariance(work *w)
{
  flesh_fit_statistics *to = w->to;
  const int n = w->n, all = to->count;
  const double scale = to->freedom > 0 ? to->scale : 1;
  for (int a = 0; a < n; a++)
    for (int b = 0; b < n; b++) {
      const int ka = w->list[a], kb = w->list[b];
      double sum = 0;
      if (w->loose[a] || w->loose[b]) continue;
      for (int s = 0; s < n - w->null_count; s++)
        sum += gsl_matrix_get(w->svd->Q, (size_t)a, (size_t)s) * gsl_matrix_get(w->svd->Q, (size_t)b, (size_t)s) /
               pow(gsl_vector_get(w->svd->S, (size_t)s), 2);
      sum *= scale * scale / gsl_vector_get(w->svd->D, (size_t)a) / gsl_vector_get(w->svd->D, (size_t)b);
      to->covariance[ka * all + kb] = sum * flesh_fit_slope(&w->fit->parameters[ka], w->found->p[ka]) *
                                      flesh_fit_slope(&w->fit->parameters[kb], w->found->p[kb]);
    }
}

static void find_correlation(flesh_fit_statistics *to)
{
  const int all = to->count;
  const double *C = to->covariance;
  for (int a = 0; a < all; a++)
    for (int b = 0; b < all; b++)
      to->correlation[a * all + b] =
          a == b && !isnan(C[a * all + a]) ? 1 : C[a * all + b] / sqrt(C[a * all + a] * C[b * all + b]);
}

static void find_errors(const work *w)
{
  flesh_fit_statistics *to = w->to;
  for (int k = 0; k < to->count; k++) {
    const flesh_fit_parameter *parameter = &w->fit->parameters[k];
    const double p = w->found->p[k], q = flesh_fit_q_of(parameter, p);
    flesh_fit_error *error = &to->errors[k];
    error->standard = sqrt(to->covariance[k * to->count + k]);
    const double half = to->quantile * error->standard / flesh_fit_slope(parameter, p);
    error->low = flesh_fit_p_of(parameter, q - half);
    error->high = flesh_fit_p_of(parameter, q + half);
  }
}

/* Evaluates the linear model of a fit without a map. */
static void analyse_keys(work *w)
{
  flesh_fit_statistics *to = w->to;
  const char *names[FLESH_FIT_PARAMETERS];
  if (w->n) decompose(w);
  to->freedom = w->fit->count - (w->n - w->null_count);
  to->scale = to->freedom > 0 ? sqrt(to->squares / to->freedom) : NAN;
  to->quantile = to->freedom > 0 ? gsl_cdf_tdist_Pinv(0.975, to->freedom) : gsl_cdf_ugaussian_Pinv(0.975);
  reduce_null(w);
  find_covariance(w);
  for (int c = 0; c < w->n; c++) names[c] = w->fit->parameters[w->list[c]].name;
  for (int r = 0; r < w->null_count; r++) flesh_fit_say_null(to, w->n, names, w->null + r * w->n);
}

static int analyse(flesh_fit *fit, flesh_fit_found *found, work *w)
{
  flesh_fit_statistics *to = w->to;
  int status = FLESH_OK;
  to->squares = flesh_fit_squares(fit, 0, fit->count, found->values);
  for (int a = 0; a < to->count * to->count; a++) to->covariance[a] = NAN;
  if (fit->map) status = flesh_fit_map_statistics(fit, found, to);
  else analyse_keys(w);
  if (status) return status;
  find_correlation(to);
  find_errors(w);
  return FLESH_OK;
}

int flesh_fit_find_statistics(flesh_fit *fit, flesh_fit_found *found, flesh_fit_statistics *to)
{
  work w = {.fit = fit, .found = found, .to = to};
  const size_t all = (size_t)fit->key_count;
  flesh_arena *arena = &fit->arena;
  for (int k = 0; k < fit->key_count; k++)
    if (!found->at_bound[k]) w.list[w.n++] = k;
  const size_t n = (size_t)(w.n ? w.n : 1);
  *to = (flesh_fit_statistics){.count = fit->key_count, .errors = flesh_arena_take(arena, all * sizeof *to->errors),
                               .covariance = flesh_arena_take(arena, all * all * sizeof(double)),
                               .correlation = flesh_arena_take(arena, all * all * sizeof(double)), .sentences = json_array()};
  w.null = flesh_arena_take(arena, n * n * sizeof *w.null);
  w.J = gsl_matrix_alloc((size_t)fit->count, n);
  w.svd = gsl_multifit_linear_alloc((size_t)fit->count, n);
  const int lacks = !w.J || !w.svd || !to->errors || !to->covariance || !to->correlation || !to->sentences || !w.null;
  const int status = lacks ? flesh_fail(FLESH_ERR_MEMORY, "out of memory for the errors of a fit") : analyse(fit, found, &w);
  gsl_matrix_free(w.J);
  gsl_multifit_linear_free(w.svd);
  return status;
}
