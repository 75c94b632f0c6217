/* map_statistics.c: finds how well the measurements determine a map and its keys, and what the penalty does, from the matrix
 * H in q at the end of the search: J^T J plus the second derivative of half the penalty. With C = H^-1, variances are
 * the diagonal of C, and resolutions that of C J^T J (Tarantola 2005, sections 3.4 and 7.3; Rodgers 2000, section 2.4).
 * Such a variance is a mean over maps that the penalty favours. Its effect on this map, the shift C g with the
 * penalty's derivative g, is therefore added as a square. For keys only a tenth of the penalty counts: it has rounded
 * the edges of this map, so its shift is smaller than at the true map. */
#include <gsl/gsl_blas.h>
#include <gsl/gsl_cdf.h>
#include <gsl/gsl_linalg.h>
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "cli/interrupt.h"
#include "fit/map.h"

/* MOST: largest number of parameters for which the matrices are made, 50 MB each, two of them. unknown: deviation of q
 * where neither measurements nor neighbours say anything. loose_share: a key is not determined if more than this share
 * of its variance comes from there. fixed: information that is given to a fixed parameter. belief_of_keys: share of the
 * penalty that counts for keys. */
enum { MOST = 2500 };
static const double unknown = 10, loose_share = 0.1, fixed = 1e20, belief_of_keys = 0.1;

typedef struct work {
  flesh_fit *fit;
  flesh_fit_found *found;
  flesh_fit_statistics *to;
  flesh_fit_linear *linear;
  gsl_matrix *J, *information, *C; /* [count][parameters]; J^T J; H^-1 */
  double *u, *y;                   /* [parameters], [count]; workspace */
  double *shift;                   /* [parameters] shift of q by the penalty */
} work;

/* Computes J by rows or by columns, whichever are fewer. */
static int find_jacobian(work *w)
{
  const int rows = w->fit->count, columns = w->fit->parameter_count, by_rows = rows < columns;
  double *one = by_rows ? w->y : w->u;
  int status = FLESH_OK;
  for (int k = 0; k < (by_rows ? rows : columns) && !status; k++) {
    for (int i = 0; i < (by_rows ? rows : columns); i++) one[i] = i == k;
    status = flesh_interrupt_check();
    if (status) break;
    if (by_rows) status = flesh_fit_linear_times_transposed(w->linear, one, gsl_matrix_ptr(w->J, (size_t)k, 0));
    else status = flesh_fit_linear_times(w->linear, one, w->y);
    for (int i = 0; i < rows && !by_rows; i++) gsl_matrix_set(w->J, (size_t)i, (size_t)k, w->y[i]);
  }
  return status;
}

/* Adds `belief` times the second derivative of half the penalty, which at an edge grows less than quadratically, to C;
 * sets u to the derivative of half the penalty. */
static void add_penalty(work *w, double belief)
{
  const flesh_fit_map *map = w->fit->map;
  const double whole = w->found->stages[w->found->chosen].weight;
  for (int k = 0; k < w->fit->parameter_count; k++) w->u[k] = 0;
  for (int k = 0; k < map->face_count; k++) {
    const size_t a = (size_t)map->faces[2 * k], b = (size_t)map->faces[2 * k + 1];
    double slope, weight = belief * whole * map->face_weights[k];
    const double residual = flesh_fit_map_residual(w->fit, k, w->found->p, &slope), bend = residual / map->edge;
    const double force = whole * map->face_weights[k] * residual * slope;
    if (map->penalty == FLESH_FIT_VARIATION) weight *= pow(1 + bend * bend / 2, -3);
    *gsl_matrix_ptr(w->C, a, a) += weight;
    *gsl_matrix_ptr(w->C, b, b) += weight;
    *gsl_matrix_ptr(w->C, a, b) -= weight;
    *gsl_matrix_ptr(w->C, b, a) -= weight;
    w->u[a] += force;
    w->u[b] -= force;
  }
  for (int k = 0; k < w->fit->parameter_count; k++)
    *gsl_matrix_ptr(w->C, (size_t)k, (size_t)k) +=
        k < w->fit->key_count && w->found->at_bound[k] ? fixed : 1 / (unknown * unknown);
}

/* Returns whether key k is determined; if not, adds a sentence, unless the sentence of an earlier key included it. */
static int is_determined(work *w, int k, unsigned char *said)
{
  const flesh_fit *fit = w->fit;
  const flesh_fit_map *map = fit->map;
  const char *names[FLESH_FIT_PARAMETERS + 1];
  char whole[160];
  double shares[FLESH_FIT_PARAMETERS + 1] = {0}, sum = 0, largest = 0;
  for (int i = 0; i < fit->parameter_count; i++) sum += pow(gsl_matrix_get(w->C, (size_t)i, (size_t)k) / unknown, 2);
  if (sum < loose_share * gsl_matrix_get(w->C, (size_t)k, (size_t)k)) return 1;
  for (int i = 0; i < fit->parameter_count; i++) {
    const flesh_fit_parameter *p = &fit->parameters[i];
    const int at = i < fit->key_count ? i : fit->key_count; /* the mean of the tets comes last */
    const double value = w->found->p[i] != 0 ? w->found->p[i] : 1;
    const double share = gsl_matrix_get(w->C, (size_t)i, (size_t)k) * flesh_fit_slope(p, value) / value;
    shares[at] += share / (i < fit->key_count ? 1 : map->count);
    names[at] = p->name;
  }
  snprintf(whole, sizeof whole, "%.100s of all tets", map->of.name);
  names[fit->key_count] = whole;
  for (int i = 0; i <= fit->key_count; i++) largest = fmax(largest, fabs(shares[i]));
  for (int i = 0; i <= fit->key_count; i++) shares[i] /= largest;
  if (!said[k]) flesh_fit_say_null(w->to, fit->key_count + 1, names, shares);
  for (int i = 0; i < fit->key_count; i++) said[i] |= fabs(shares[i]) > loose_share;
  return 0;
}

/* Computes C and the shift: C times the derivative of half the penalty. */
static int invert(work *w, double belief)
{
  gsl_vector_view shift = gsl_vector_view_array(w->shift, w->C->size1), by = gsl_vector_view_array(w->u, w->C->size1);
  gsl_matrix_memcpy(w->C, w->information);
  add_penalty(w, belief);
  if (gsl_linalg_cholesky_decomp1(w->C) || gsl_linalg_cholesky_invert(w->C))
    return flesh_fail(FLESH_ERR_SOLVE, "the matrix of a map's deviations is not positive");
  gsl_blas_dsymv(CblasLower, 1, w->C, &by.vector, 0, &shift.vector);
  return FLESH_OK;
}

static int find_covariance(work *w)
{
  const flesh_fit *fit = w->fit;
  const int n = fit->key_count;
  unsigned char said[FLESH_FIT_PARAMETERS] = {0}, known[FLESH_FIT_PARAMETERS];
  for (int k = 0; k < n; k++) known[k] = !w->found->at_bound[k] && is_determined(w, k, said);
  const int status = n ? invert(w, belief_of_keys) : FLESH_OK;
  if (status) return status;
  for (int a = 0; a < n; a++)
    for (int b = 0; b < n; b++)
      if (known[a] && known[b])
        w->to->covariance[a * n + b] = (gsl_matrix_get(w->C, (size_t)a, (size_t)b) + w->shift[a] * w->shift[b]) *
                                       flesh_fit_slope(&fit->parameters[a], w->found->p[a]) *
                                       flesh_fit_slope(&fit->parameters[b], w->found->p[b]);
  return FLESH_OK;
}

static int analyse(work *w)
{
  const size_t n = (size_t)w->fit->parameter_count, keys = (size_t)w->fit->key_count;
  flesh_fit_found *found = w->found;
  int status = find_jacobian(w);
  if (status) return status;
  gsl_blas_dgemm(CblasTrans, CblasNoTrans, 1, w->J, w->J, 0, w->information);
  status = invert(w, 1);
  if (status) return status;
  found->determined = 0;
  for (size_t k = keys; k < n; k++) {
    gsl_vector_view row = gsl_matrix_row(w->C, k), column = gsl_matrix_column(w->information, k);
    found->deviations[k - keys] = hypot(sqrt(gsl_matrix_get(w->C, k, k)), w->shift[k]);
    gsl_blas_ddot(&row.vector, &column.vector, &found->resolutions[k - keys]);
    found->determined += found->resolutions[k - keys];
    w->u[k - keys] = found->deviations[k - keys];
  }
  found->largest = gsl_stats_max(w->u, 1, n - keys);
  found->median = gsl_stats_select(w->u, 1, n - keys, (n - keys) / 2);
  return find_covariance(w);
}

int flesh_fit_map_statistics(flesh_fit *fit, flesh_fit_found *found, flesh_fit_statistics *to)
{
  const size_t n = (size_t)fit->parameter_count, m = (size_t)fit->count;
  work w = {.fit = fit, .found = found, .to = to};
  to->freedom = (int)lround(fmax(fit->count - found->stages[found->chosen].determined, 1));
  to->scale = sqrt(to->squares / to->freedom);
  to->quantile = gsl_cdf_ugaussian_Pinv(0.975);
  if (n > MOST) return FLESH_OK;
  w.J = gsl_matrix_alloc(m, n);
  w.information = gsl_matrix_alloc(n, n);
  w.C = gsl_matrix_alloc(n, n);
  w.u = malloc((2 * n + m) * sizeof *w.u);
  found->deviations = flesh_arena_take(&fit->arena, n * sizeof(double));
  found->resolutions = flesh_arena_take(&fit->arena, n * sizeof(double));
  const int room = w.J && w.information && w.C && w.u && found->deviations && found->resolutions;
  int status = room ? flesh_fit_linear_create(fit, found->p, &w.linear)
                    : flesh_fail(FLESH_ERR_MEMORY, "out of memory for the deviations of a map");
  if (!status) {
    w.y = w.u + n, w.shift = w.y + m;
    status = analyse(&w);
  }
  flesh_fit_linear_destroy(&w.linear);
  gsl_matrix_free(w.J);
  gsl_matrix_free(w.information);
  gsl_matrix_free(w.C);
  free(w.u);
  return status;
}
