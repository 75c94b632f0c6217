/* contact_set.c: the barrier between surfaces: energy, residual and Hessians of its pairs, computed in parts by
 * threads. */
#include "geometry/contact_set.h"

#include <limits.h>
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "geometry/contact_parts.h"

int flesh_contact_set_create(const flesh_contact_surface *surface, const double *X, const flesh_contact_law *law,
                             flesh_contact_set *set)
{
  *set = (flesh_contact_set){.surface = surface, .law = *law, .own = INT_MAX, .distance = INFINITY};
  set->edge_squared = flesh_malloc(((size_t)surface->edge_count + 1) * sizeof *set->edge_squared);
  if (!set->edge_squared)
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the contact of %d edges", surface->edge_count);
  for (int e = 0; e < surface->edge_count; e++) {
    const double *A = X + 3 * (size_t)surface->edges[2 * e], *B = X + 3 * (size_t)surface->edges[2 * e + 1];
    set->edge_squared[e] = 0;
    for (int c = 0; c < 3; c++) set->edge_squared[e] += (B[c] - A[c]) * (B[c] - A[c]);
  }
  return FLESH_OK;
}

void flesh_contact_set_clear(flesh_contact_set *set)
{
  flesh_free(set->pairs);
  flesh_free(set->closest);
  flesh_free(set->edge_squared);
  flesh_free(set->values);
  flesh_free(set->gradients);
  flesh_free(set->scratch);
  *set = (flesh_contact_set){0};
}

typedef struct job {
  const flesh_contact_set *set;
  const double *x;
  double scale, *hessians;
  flesh_eigenvalue_filter filter;
  int parts, gradients, undefined[FLESH_CONTACT_PARTS];
} job;

static job job_of(const flesh_contact_set *set, const double *x)
{
  return (job){.set = set, .x = x, .parts = flesh_contact_parts(set->count, 32)};
}

static void gradients_of_part(void *data, int task)
{
  job *j = data;
  const flesh_contact_set *set = j->set;
  const int end = flesh_contact_part(set->count, j->parts, task + 1);
  for (int k = flesh_contact_part(set->count, j->parts, task); k < end; k++)
    if (flesh_contact_pair_gradient(set->pairs + k, set->closest + k, j->x, set->values + k,
                                    j->gradients ? set->gradients + 12 * (size_t)k : NULL))
      j->undefined[task] = 1;
}

int flesh_contact_set_evaluate(flesh_contact_set *set, const double *x, flesh_threads *threads, double *energy,
                               double *size, double *r)
{
  job j = job_of(set, x);
  j.gradients = r != NULL;
  flesh_threads_run(threads, j.parts, gradients_of_part, &j);
  for (int p = 0; p < j.parts; p++)
    if (j.undefined[p]) return FLESH_UNDEFINED;
  for (int k = 0; k < set->count; k++) {
    const flesh_contact_pair *pair = set->pairs + k;
    const double *g = set->gradients + 12 * (size_t)k;
    if (!flesh_contact_set_owns(set, pair)) continue;
    if (energy) *energy += set->values[k];
    if (size) *size += fabs(set->values[k]);
    for (int a = 0, nodes = flesh_contact_kind_nodes(pair->kind); r && a < nodes; a++)
      for (int c = 0; c < 3; c++) r[3 * (size_t)pair->nodes[a] + c] += g[3 * a + c];
  }
  return FLESH_OK;
}

static void hessians_of_part(void *data, int task)
{
  const job *j = data;
  const flesh_contact_set *set = j->set;
  const int end = flesh_contact_part(set->count, j->parts, task + 1);
  for (int k = flesh_contact_part(set->count, j->parts, task); k < end; k++) {
    double *H = j->hessians + 144 * (size_t)k;
    if (!flesh_contact_set_owns(set, set->pairs + k)) continue;
    flesh_contact_pair_hessian(set->pairs + k, set->closest + k, j->x, j->filter, H);
    for (int e = 0; e < 144; e++) H[e] *= j->scale;
  }
}

void flesh_contact_set_hessians(const flesh_contact_set *set, const double *x, double scale,
                                flesh_eigenvalue_filter filter, flesh_threads *threads, double *hessians)
{
  job j = job_of(set, x);
  j.scale = scale;
  j.filter = filter;
  j.hessians = hessians;
  flesh_threads_run(threads, j.parts, hessians_of_part, &j);
}
