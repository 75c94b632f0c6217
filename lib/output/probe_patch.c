/* probe_patch.c: weights that smooth strain, stress and energy at a point, from the ten-node tets around it.
 *
 * A quadratic polynomial is fitted to the values at the quadrature points of a patch of tets, by least squares
 * (Zienkiewicz & Zhu 1992; here with weights w_s that fall with the distance). Its value at the point is a sum over the
 * samples: with polynomials q_j that are orthonormal in the weights, sample s counts w_s sum_j q_j(point) q_j(s). */
#include "output/probe_patch.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "mesh/mesh.h"
#include "mesh/tet10.h"
#include "output/tet_shape.h"

enum { MONOMIALS = 10 };

/* Monomials of which less than this share is left beside those before them are left out: the samples do not tell them. */
static const double least_share = 0.02;
/* Weights are a sample's volume times exp(-decay r^2), at r times the largest coordinate of all from the point. */
static const double decay = 2;

typedef struct samples {
  int count;
  double *y;      /* [3*count] places relative to the point, over the largest coordinate */
  double *weight; /* [count] */
  double *q;      /* [MONOMIALS*count] the orthonormal polynomials */
} samples;

static int is_beside(const flesh_body *body, int tet, int other)
{
  const int *tets = flesh_mesh_tets(body->mesh), *own = tets + 4 * (size_t)tet, *its = tets + 4 * (size_t)other;
  int shared = 0;
  for (int k = 0; k < 16; k++) shared |= own[k / 4] == its[k % 4];
  return shared && flesh_mesh_is_quadratic(body->mesh, other) &&
         (!body->tet_material || body->tet_material[tet] == body->tet_material[other]);
}

/* Places the samples at the quadrature points of the tets, and weighs them. */
static void place_samples(const samples *s, const flesh_tet_stress *stress, const int *tets, const double X[3])
{
  const flesh_mesh *mesh = stress->body->mesh;
  double *rest = mesh->positions, far = 0, weights[10];
  int nodes[10];
  flesh_strain_point points[FLESH_TET10_POINTS];
  for (int k = 0; k < s->count; k++) {
    const int tet = tets[k / FLESH_TET10_POINTS], q = k % FLESH_TET10_POINTS;
    double *y = s->y + 3 * (size_t)k;
    if (!q) flesh_tet_stress_points(stress, &(flesh_state){.x = rest}, tet, points);
    const int size = flesh_tet_weights(mesh, tet, points[q].L, nodes, weights);
    for (int d = 0; d < 3; d++) {
      y[d] = -X[d];
      for (int a = 0; a < size; a++) y[d] += weights[a] * rest[3 * (size_t)nodes[a] + (size_t)d];
      far = fmax(far, fabs(y[d]));
    }
    s->weight[k] = points[q].volume;
  }
  for (int k = 0; k < s->count; k++) {
    double *y = s->y + 3 * (size_t)k;
    for (int d = 0; d < 3; d++) y[d] /= far;
    s->weight[k] *= exp(-decay * (y[0] * y[0] + y[1] * y[1] + y[2] * y[2]));
  }
}

static double product(const samples *s, const double *p, const double *q)
{
  double sum = 0;
  for (int k = 0; k < s->count; k++) sum += s->weight[k] * p[k] * q[k];
  return sum;
}

/* Finds the weights of the samples, by Gram & Schmidt on the monomials, each twice. */
static void weigh_samples(const samples *s, double *weights)
{
  static const signed char factors[MONOMIALS][2] = {{3, 3}, {0, 3}, {1, 3}, {2, 3}, {0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}};
  double at_point[MONOMIALS];
  int count = 0;
  for (int m = 0; m < MONOMIALS; m++) {
    double *q = s->q + (size_t)count * (size_t)s->count;
    for (int k = 0; k < s->count; k++) {
      const double y[4] = {s->y[3 * k], s->y[3 * k + 1], s->y[3 * k + 2], 1};
      q[k] = y[factors[m][0]] * y[factors[m][1]];
    }
    const double size = product(s, q, q);
    at_point[count] = m == 0;
    for (int j = 0; j < 2 * count; j++) {
      const double *other = s->q + (size_t)(j % count) * (size_t)s->count, share = product(s, q, other);
      for (int k = 0; k < s->count; k++) q[k] -= share * other[k];
      at_point[count] -= share * at_point[j % count];
    }
    const double left = product(s, q, q);
    if (!(left > least_share * least_share * size)) continue;
    for (int k = 0; k < s->count; k++) q[k] /= sqrt(left);
    at_point[count] /= sqrt(left);
    for (int k = 0; k < s->count; k++) weights[k] += s->weight[k] * at_point[count] * q[k];
    count++;
  }
}

int flesh_patch_find(const flesh_tet_stress *stress, int tet, const double X[3], int *count, int **tets, double **weights)
{
  const int all = flesh_mesh_tet_count(stress->body->mesh);
  *count = 0;
  for (int e = 0; e < all; e++) *count += is_beside(stress->body, tet, e);
  const size_t size = FLESH_TET10_POINTS * (size_t)*count;
  double *work = malloc((4 + MONOMIALS) * size * sizeof *work);
  *tets = malloc((size_t)*count * sizeof **tets);
  *weights = calloc(size, sizeof **weights);
  const int failed = !work || !*tets || !*weights;
  for (int e = 0, k = 0; e < all && !failed; e++)
    if (is_beside(stress->body, tet, e)) (*tets)[k++] = e;
  if (!failed) {
    samples s = {(int)size, work, work + 3 * size, work + 4 * size};
    place_samples(&s, stress, *tets, X);
    weigh_samples(&s, *weights);
  }
  free(work);
  return failed ? flesh_fail(FLESH_ERR_MEMORY, "no memory for the %d tets around a probe", *count) : FLESH_OK;
}
