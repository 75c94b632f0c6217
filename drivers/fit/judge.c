/* judge.c: computes standard errors, intervals and correlations by the linearised model (Seber & Wild 2003, sections
 * 2.1 and 5.1), and says what the measurements do not determine. */
#include <gsl/gsl_cdf.h>
#include <gsl/gsl_errno.h>
#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "fit/map.h"

/* Correlations above this are mentioned. */
static const double close_correlation = 0.98;
/* Limits above which residuals, in deviations, and the error of a parameter, as a share of it, are mentioned. */
static const double odd_scale = 1.5, large_share = 0.3;

typedef struct judging {
  const flesh_fit *fit;
  const flesh_fit_found *found;
  flesh_fit_statistics *to;
  int n, null_count;
  int list[FLESH_FIT_PARAMETERS]; /* indices of the free parameters */
  flesh_fit_svd svd;
  double *null; /* [null_count * n] relative changes of the parameters that leave the measured quantities unchanged */
  unsigned char loose[FLESH_FIT_PARAMETERS]; /* 1: the parameter is not determined */
} judging;

/* Decomposes the Jacobian by q; rows are divided by the deviations. */
static void decompose(judging *j)
{
  for (int c = 0; c < j->n; c++)
    for (int i = 0; i < j->fit->count; i++)
      gsl_matrix_set(j->svd.U, (size_t)i, (size_t)c, flesh_fit_by_q(j->fit, j->found->p, j->found->jacobian, i, j->list[c]));
  flesh_fit_svd_decompose(&j->svd);
  j->null_count = j->n - j->svd.rank;
}

/* Finds the changes of the parameters, as shares of them, that leave the measured quantities unchanged: rows with as
 * many zeros as elimination gives. */
static void reduce_null(judging *j)
{
  const int n = j->n, rows = j->null_count;
  for (int r = 0; r < rows; r++)
    for (int c = 0; c < n; c++) {
      const int k = j->list[c];
      const double norm = gsl_vector_get(j->svd.norms, (size_t)c), p = j->found->p[k];
      const double share = flesh_fit_slope(&j->fit->parameters[k], p) / (p != 0 ? p : 1);
      j->null[r * n + c] = gsl_matrix_get(j->svd.V, (size_t)c, (size_t)(n - 1 - r)) * share / (norm > 0 ? norm : 1);
    }
  for (int r = 0; r < rows; r++) {
    double *row = j->null + r * n;
    int pivot = 0;
    for (int c = 1; c < n; c++)
      if (fabs(row[c]) > fabs(row[pivot])) pivot = c;
    const double largest = row[pivot];
    for (int c = 0; c < n && largest != 0; c++) row[c] /= largest;
    for (int other = 0; other < rows; other++) {
      const double factor = j->null[other * n + pivot];
      for (int c = 0; c < n && other != r; c++) j->null[other * n + c] -= factor * row[c];
    }
  }
  for (int r = 0; r < rows; r++)
    for (int c = 0; c < n; c++)
      if (fabs(j->null[r * n + c]) > flesh_fit_small_share) j->loose[c] = 1;
}

/* Computes covariances of q, then of the parameters. */
static void find_covariance(judging *j)
{
  flesh_fit_statistics *to = j->to;
  const int n = j->n, all = to->count;
  const double scale = to->freedom > 0 ? to->scale : 1;
  for (int a = 0; a < n; a++)
    for (int b = 0; b < n; b++) {
      const int ka = j->list[a], kb = j->list[b];
      double sum = 0;
      if (j->loose[a] || j->loose[b]) continue;
      for (int s = 0; s < n - j->null_count; s++)
        sum += gsl_matrix_get(j->svd.V, (size_t)a, (size_t)s) * gsl_matrix_get(j->svd.V, (size_t)b, (size_t)s) /
               pow(gsl_vector_get(j->svd.S, (size_t)s), 2);
      sum *= scale * scale / gsl_vector_get(j->svd.norms, (size_t)a) / gsl_vector_get(j->svd.norms, (size_t)b);
      to->covariance[ka * all + kb] = sum * flesh_fit_slope(&j->fit->parameters[ka], j->found->p[ka]) *
                                      flesh_fit_slope(&j->fit->parameters[kb], j->found->p[kb]);
    }
}

static void find_correlation(flesh_fit_statistics *to)
{
  const int all = to->count;
  for (int a = 0; a < all; a++)
    for (int b = 0; b < all; b++)
      to->correlation[a * all + b] = a == b && !isnan(to->covariance[a * all + a])
                                         ? 1
                                         : to->covariance[a * all + b] /
                                               sqrt(to->covariance[a * all + a] * to->covariance[b * all + b]);
}

static void find_errors(const judging *j)
{
  flesh_fit_statistics *to = j->to;
  for (int k = 0; k < to->count; k++) {
    const flesh_fit_parameter *parameter = &j->fit->parameters[k];
    const double p = j->found->p[k], q = flesh_fit_q_of(parameter, p);
    flesh_fit_error *error = &to->errors[k];
    error->standard = sqrt(to->covariance[k * to->count + k]);
    const double half = to->quantile * error->standard / flesh_fit_slope(parameter, p);
    error->low = flesh_fit_p_of(parameter, q - half);
    error->high = flesh_fit_p_of(parameter, q + half);
  }
}

static void tell_parameters(judging *j)
{
  const flesh_fit_statistics *to = j->to;
  for (int k = 0; k < to->count; k++) {
    const char *name = j->fit->parameters[k].name;
    const double share = to->errors[k].standard / fabs(j->found->p[k]);
    if (j->found->at_bound[k])
      flesh_fit_say(j->to, "%s stays at its %s bound: it has no error, and the errors of the others assume that it stays there.",
                    name, j->found->at_bound[k] > 0 ? "upper" : "lower");
    else if (share > large_share)
      flesh_fit_say(j->to, "%s is hardly determined: its standard error is %.3g %% of it.", name, 100 * share);
    for (int b = 0; b < k; b++) {
      const double correlation = to->correlation[k * to->count + b];
      if (fabs(correlation) > close_correlation)
        flesh_fit_say(j->to, "%s and %s are hardly told apart: their errors have a correlation of %.4f.",
                      j->fit->parameters[b].name, name, correlation);
    }
  }
}

static void tell_residuals(judging *j)
{
  const flesh_fit_statistics *to = j->to;
  if (to->freedom <= 0)
    flesh_fit_say(j->to, "There are no more measured numbers than parameters: the errors rest on the stated deviations.");
  else if (to->scale > odd_scale || to->scale < 1 / odd_scale)
    flesh_fit_say(j->to, "The residuals are %.3g times the stated deviations, which the errors allow for: %s.", to->scale,
                  to->scale > 1 ? "the deviations are too small, the scene leaves something out, or another "
                                  "start finds better parameters"
                                : "the deviations are too large");
}

/* Evaluates the linear model of a fit without a map. */
static void judge_keys(judging *j)
{
  flesh_fit_statistics *to = j->to;
  const char *names[FLESH_FIT_PARAMETERS];
  if (j->n) decompose(j);
  to->freedom = j->fit->count - (j->n - j->null_count);
  to->scale = to->freedom > 0 ? sqrt(to->squares / to->freedom) : NAN;
  to->quantile = to->freedom > 0 ? gsl_cdf_tdist_Pinv(0.975, to->freedom) : gsl_cdf_ugaussian_Pinv(0.975);
  reduce_null(j);
  find_covariance(j);
  for (int c = 0; c < j->n; c++) names[c] = j->fit->parameters[j->list[c]].name;
  for (int r = 0; r < j->null_count; r++) flesh_fit_tell_null(to, j->n, names, j->null + r * j->n);
}

static int judge(flesh_fit *fit, flesh_fit_found *found, judging *j)
{
  flesh_fit_statistics *to = j->to;
  int status = FLESH_OK;
  to->squares = flesh_fit_squares(fit, 0, fit->count, found->values);
  for (int a = 0; a < to->count * to->count; a++) to->covariance[a] = NAN;
  if (fit->map) status = flesh_fit_map_judge(fit, found, to);
  else judge_keys(j);
  if (status) return status;
  find_correlation(to);
  find_errors(j);
  tell_parameters(j);
  if (!to->sentence_count && to->count && !(to->scale > odd_scale)) /* else the search may have missed the best parameters */
    flesh_fit_say(to, "%s determined.", to->count == 1 ? "The parameter is" : "All parameters are");
  if (fit->map) return flesh_fit_map_tell(fit, found, to);
  tell_residuals(j);
  return FLESH_OK;
}

int flesh_fit_judge(flesh_fit *fit, flesh_fit_found *found, flesh_fit_statistics *to)
{
  judging j = {.fit = fit, .found = found, .to = to};
  const size_t all = (size_t)fit->key_count;
  for (int k = 0; k < fit->key_count; k++)
    if (!found->at_bound[k]) j.list[j.n++] = k;
  const size_t n = (size_t)(j.n ? j.n : 1);
  flesh_arena *arena = &fit->arena;
  *to = (flesh_fit_statistics){.count = fit->key_count, .errors = flesh_arena_take(arena, all * sizeof *to->errors),
                               .covariance = flesh_arena_take(arena, all * all * sizeof(double)),
                               .correlation = flesh_arena_take(arena, all * all * sizeof(double)),
                               .sentences = flesh_arena_take(arena, FLESH_FIT_PARAMETERS * sizeof *to->sentences)};
  gsl_error_handler_t *handler = gsl_set_error_handler_off();
  j.null = calloc(n * n, sizeof *j.null);
  const int lacks = flesh_fit_svd_open(fit->count, (int)n, &j.svd) || !to->errors || !to->covariance || !to->correlation ||
                    !to->sentences || !j.null;
  const int status = lacks ? flesh_fail(FLESH_ERR_MEMORY, "out of memory for the errors of a fit") : judge(fit, found, &j);
  flesh_fit_svd_close(&j.svd);
  free(j.null);
  gsl_set_error_handler(handler);
  return status;
}
