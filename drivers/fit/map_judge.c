/* map_judge.c: finds how well the measurements determine a map and its keys, and what the penalty does, from the matrix
 * H in q at the end of the search: J^T J plus the second derivative of half the penalty. With C = H^-1, variances are
 * the diagonal of C, and resolutions that of C J^T J (Tarantola 2005, sections 3.4 and 7.3; Rodgers 2000, section 2.4).
 * Such a variance is a mean over maps that the penalty favours. Its effect on this map, the shift C g with the
 * penalty's derivative g, is therefore added as a square. For keys only a tenth of the penalty counts: it has rounded
 * the edges of this map, so its shift is smaller than at the true map. */
#include <gsl/gsl_blas.h>
#include <gsl/gsl_cdf.h>
#include <gsl/gsl_linalg.h>
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

typedef struct judging {
  flesh_fit *fit;
  flesh_fit_found *found;
  flesh_fit_statistics *to;
  flesh_fit_linear *linear;
  gsl_matrix *J, *information, *C; /* [count][parameters]; J^T J; H^-1 */
  double *u, *y;                   /* [parameters], [count]; workspace */
  double *shift;                   /* [parameters] shift of q by the penalty */
} judging;

/* Computes J by rows or by columns, whichever are fewer. */
static int find_jacobian(judging *j)
{
  const int rows = j->fit->count, columns = j->fit->parameter_count, by_rows = rows < columns;
  double *one = by_rows ? j->y : j->u;
  int status = FLESH_OK;
  for (int k = 0; k < (by_rows ? rows : columns) && !status; k++) {
    for (int i = 0; i < (by_rows ? rows : columns); i++) one[i] = i == k;
    status = flesh_interrupt_check();
    if (status) break;
    if (by_rows) status = flesh_fit_linear_times_transposed(j->linear, one, gsl_matrix_ptr(j->J, (size_t)k, 0));
    else status = flesh_fit_linear_times(j->linear, one, j->y);
    for (int i = 0; i < rows && !by_rows; i++) gsl_matrix_set(j->J, (size_t)i, (size_t)k, j->y[i]);
  }
  return status;
}

/* Adds `belief` times the second derivative of half the penalty, which at an edge grows less than quadratically. */
static void add_penalty(const judging *j, double belief, gsl_matrix *H)
{
  const flesh_fit_map *map = j->fit->map;
  for (int k = 0; k < map->face_count; k++) {
    const size_t a = (size_t)map->faces[2 * k], b = (size_t)map->faces[2 * k + 1];
    double slope, weight = belief * j->found->stages[j->found->chosen].weight * map->face_weights[k];
    const double bend = flesh_fit_map_bend(j->fit, k, j->found->p, &slope) / map->edge;
    if (map->penalty == FLESH_FIT_VARIATION) weight *= pow(1 + bend * bend / 2, -3);
    *gsl_matrix_ptr(H, a, a) += weight;
    *gsl_matrix_ptr(H, b, b) += weight;
    *gsl_matrix_ptr(H, a, b) -= weight;
    *gsl_matrix_ptr(H, b, a) -= weight;
  }
  for (int k = 0; k < j->fit->parameter_count; k++)
    *gsl_matrix_ptr(H, (size_t)k, (size_t)k) += k < j->fit->key_count && j->found->at_bound[k] ? fixed : 1 / (unknown * unknown);
}

/* Computes the shift: C times the derivative of half the penalty. */
static void find_shift(judging *j)
{
  const flesh_fit_map *map = j->fit->map;
  gsl_vector_view shift = gsl_vector_view_array(j->shift, j->C->size1), by = gsl_vector_view_array(j->u, j->C->size1);
  gsl_vector_set_zero(&by.vector);
  for (int k = 0; k < map->face_count; k++) {
    double slope, weight = j->found->stages[j->found->chosen].weight * map->face_weights[k];
    weight *= flesh_fit_map_bend(j->fit, k, j->found->p, &slope);
    j->u[map->faces[2 * k]] += weight * slope;
    j->u[map->faces[2 * k + 1]] -= weight * slope;
  }
  gsl_blas_dsymv(CblasLower, 1, j->C, &by.vector, 0, &shift.vector);
}

/* Returns whether key k is determined; if not, adds a sentence, unless the sentence of an earlier key included it. */
static int is_determined(judging *j, int k, unsigned char *said)
{
  const flesh_fit *fit = j->fit;
  const flesh_fit_map *map = fit->map;
  const char *names[FLESH_FIT_PARAMETERS + 1];
  char whole[160];
  double shares[FLESH_FIT_PARAMETERS + 1] = {0}, sum = 0, largest = 0;
  for (int i = 0; i < fit->parameter_count; i++) sum += pow(gsl_matrix_get(j->C, (size_t)i, (size_t)k) / unknown, 2);
  if (sum < loose_share * gsl_matrix_get(j->C, (size_t)k, (size_t)k)) return 1;
  for (int i = 0; i < fit->parameter_count; i++) {
    const flesh_fit_parameter *p = &fit->parameters[i];
    const int at = i < fit->key_count ? i : fit->key_count; /* the mean of the tets comes last */
    const double value = j->found->p[i] != 0 ? j->found->p[i] : 1;
    const double share = gsl_matrix_get(j->C, (size_t)i, (size_t)k) * flesh_fit_slope(p, value) / value;
    shares[at] += share / (i < fit->key_count ? 1 : map->count);
    names[at] = p->name;
  }
  snprintf(whole, sizeof whole, "%.100s of all tets", map->of.name);
  names[fit->key_count] = whole;
  for (int i = 0; i <= fit->key_count; i++) largest = fmax(largest, fabs(shares[i]));
  for (int i = 0; i <= fit->key_count; i++) shares[i] /= largest;
  if (!said[k]) flesh_fit_tell_null(j->to, fit->key_count + 1, names, shares);
  for (int i = 0; i < fit->key_count; i++) said[i] |= fabs(shares[i]) > loose_share;
  return 0;
}

/* Computes C and the shift. */
static int invert(judging *j, double belief)
{
  gsl_matrix_memcpy(j->C, j->information);
  add_penalty(j, belief, j->C);
  if (gsl_linalg_cholesky_decomp1(j->C) || gsl_linalg_cholesky_invert(j->C))
    return flesh_fail(FLESH_ERR_SOLVE, "the matrix of a map's deviations is not positive");
  find_shift(j);
  return FLESH_OK;
}

static int take_covariance(judging *j)
{
  const flesh_fit *fit = j->fit;
  const int n = fit->key_count;
  unsigned char said[FLESH_FIT_PARAMETERS] = {0}, known[FLESH_FIT_PARAMETERS];
  for (int k = 0; k < n; k++) known[k] = !j->found->at_bound[k] && is_determined(j, k, said);
  const int status = n ? invert(j, belief_of_keys) : FLESH_OK;
  if (status) return status;
  for (int a = 0; a < n; a++)
    for (int b = 0; b < n; b++)
      if (known[a] && known[b])
        j->to->covariance[a * n + b] = (gsl_matrix_get(j->C, (size_t)a, (size_t)b) + j->shift[a] * j->shift[b]) *
                                       flesh_fit_slope(&fit->parameters[a], j->found->p[a]) *
                                       flesh_fit_slope(&fit->parameters[b], j->found->p[b]);
  return FLESH_OK;
}

static int judge(judging *j)
{
  const size_t n = (size_t)j->fit->parameter_count, keys = (size_t)j->fit->key_count;
  flesh_fit_found *found = j->found;
  int status = find_jacobian(j);
  if (status) return status;
  gsl_blas_dgemm(CblasTrans, CblasNoTrans, 1, j->J, j->J, 0, j->information);
  status = invert(j, 1);
  if (status) return status;
  found->determined = 0;
  for (size_t k = keys; k < n; k++) {
    gsl_vector_view row = gsl_matrix_row(j->C, k), column = gsl_matrix_column(j->information, k);
    found->deviations[k - keys] = hypot(sqrt(gsl_matrix_get(j->C, k, k)), j->shift[k]);
    gsl_blas_ddot(&row.vector, &column.vector, &found->resolutions[k - keys]);
    found->determined += found->resolutions[k - keys];
  }
  return take_covariance(j);
}

int flesh_fit_map_judge(flesh_fit *fit, flesh_fit_found *found, flesh_fit_statistics *to)
{
  const size_t n = (size_t)fit->parameter_count, m = (size_t)fit->count;
  judging j = {.fit = fit, .found = found, .to = to};
  to->freedom = (int)lround(fmax(fit->count - found->stages[found->chosen].determined, 1));
  to->scale = sqrt(to->squares / to->freedom);
  to->quantile = gsl_cdf_ugaussian_Pinv(0.975);
  if (n > MOST) return FLESH_OK;
  j.J = gsl_matrix_alloc(m, n);
  j.information = gsl_matrix_alloc(n, n);
  j.C = gsl_matrix_alloc(n, n);
  j.u = malloc((2 * n + m) * sizeof *j.u);
  found->deviations = flesh_arena_take(&fit->arena, n * sizeof(double));
  found->resolutions = flesh_arena_take(&fit->arena, n * sizeof(double));
  const int room = j.J && j.information && j.C && j.u && found->deviations && found->resolutions;
  int status = room ? flesh_fit_linear_create(fit, found->p, &j.linear)
                    : flesh_fail(FLESH_ERR_MEMORY, "out of memory for the deviations of a map");
  if (!status) {
    j.y = j.u + n, j.shift = j.y + m;
    status = judge(&j);
  }
  flesh_fit_linear_destroy(&j.linear);
  gsl_matrix_free(j.J);
  gsl_matrix_free(j.information);
  gsl_matrix_free(j.C);
  free(j.u);
  return status;
}
