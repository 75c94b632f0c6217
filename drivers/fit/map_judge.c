/* map_judge.c: what the measurements say of a map and what the penalty does, by the regularised Gauss-Newton matrix
 * H = J^T J + P^T P of the end, in q: deviations are the roots of the diagonal of H^-1, resolutions the diagonal of
 * H^-1 J^T J (Tarantola 2005, sections 3.4 and 7.3; Rodgers 2000, section 2.4). */
#include <gsl/gsl_errno.h>
#include <gsl/gsl_linalg.h>
#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "cli/interrupt.h"
#include "fit/map.h"

/* Tets whose matrix is made: 50 MB, twice. Of what nothing is known, neither by measurements nor by neighbours, q has this
 * deviation. */
enum { MOST = 2500 };
static const double unknown = 10;

static int no_memory(void) { return flesh_fail(FLESH_ERR_MEMORY, "out of memory for the deviations of a map"); }

/* J^T J [count][count]. */
static int find_information(flesh_fit *fit, flesh_fit_linear *linear, gsl_matrix *information)
{
  const int n = fit->parameter_count;
  double *u = calloc((size_t)n, sizeof *u), *y = malloc((size_t)fit->count * sizeof *y);
  int status = u && y ? FLESH_OK : no_memory();
  for (int k = 0; k < n && !status; k++) {
    if (flesh_interrupt_signal()) status = flesh_fail(FLESH_ERR_INTERRUPTED, "interrupted by %s", flesh_interrupt_name());
    for (int j = 0; j < n; j++) u[j] = j == k;
    if (!status) status = flesh_fit_linear_times(linear, u, y);
    if (!status) status = flesh_fit_linear_times_transposed(linear, y, gsl_matrix_ptr(information, (size_t)k, 0));
  }
  free(u);
  free(y);
  return status;
}

static void add_penalty(const flesh_fit *fit, const flesh_fit_map_found *found, gsl_matrix *H)
{
  const flesh_fit_map *map = fit->map;
  for (int k = 0; k < map->face_count; k++) {
    const size_t a = (size_t)map->faces[2 * k], b = (size_t)map->faces[2 * k + 1];
    double slope;
    flesh_fit_map_bend(map, flesh_fit_map_q(map, found->p[a]) - flesh_fit_map_q(map, found->p[b]), &slope);
    const double weight = found->stages[found->chosen].weight * map->face_weights[k] * slope * slope;
    *gsl_matrix_ptr(H, a, a) += weight;
    *gsl_matrix_ptr(H, b, b) += weight;
    *gsl_matrix_ptr(H, a, b) -= weight;
    *gsl_matrix_ptr(H, b, a) -= weight;
  }
  for (size_t k = 0; k < H->size1; k++) *gsl_matrix_ptr(H, k, k) += 1 / (unknown * unknown);
}

static int judge(flesh_fit *fit, flesh_fit_linear *linear, flesh_fit_map_found *found)
{
  const size_t n = (size_t)fit->parameter_count;
  gsl_matrix *information = gsl_matrix_alloc(n, n), *H = gsl_matrix_alloc(n, n);
  found->deviations = malloc(n * sizeof(double));
  found->resolutions = calloc(n, sizeof(double));
  const int room = information && H && found->deviations && found->resolutions;
  int status = room ? find_information(fit, linear, information) : no_memory();
  if (!status) {
    gsl_matrix_memcpy(H, information);
    add_penalty(fit, found, H);
    if (gsl_linalg_cholesky_decomp1(H) || gsl_linalg_cholesky_invert(H))
      status = flesh_fail(FLESH_ERR_SOLVE, "the matrix of a map's deviations is not positive");
  }
  found->determined = 0;
  for (size_t k = 0; k < n && !status; k++) {
    found->deviations[k] = sqrt(gsl_matrix_get(H, k, k));
    for (size_t j = 0; j < n; j++) found->resolutions[k] += gsl_matrix_get(H, k, j) * gsl_matrix_get(information, j, k);
    found->determined += found->resolutions[k];
  }
  gsl_matrix_free(information);
  gsl_matrix_free(H);
  return status;
}

int flesh_fit_map_judge(flesh_fit *fit, flesh_fit_map_found *found)
{
  flesh_fit_linear *linear = NULL;
  if (fit->parameter_count > MOST) return FLESH_OK;
  gsl_error_handler_t *handler = gsl_set_error_handler_off();
  int status = flesh_fit_linear_create(fit, found->p, &linear);
  if (!status) status = judge(fit, linear, found);
  flesh_fit_linear_destroy(&linear);
  gsl_set_error_handler(handler);
  return status;
}
