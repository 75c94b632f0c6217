/* contact_pair.c: the barrier between two features of surfaces, its derivatives, and the eigenvalues of its Hessian. */
#include "geometry/contact_pair.h"

#include <math.h>
#include <string.h>

#include "flesh/status.h"
#include "geometry/barrier.h"
#include "math/eig_small.h"
#include "math/mat3.h"

double flesh_contact_parallel(double first_squared, double second_squared)
{
  return 1e-3 * first_squared * second_squared;
}

/* Orthonormal basis of the vectors of 2, 3 or 4 numbers that sum to 0: its first 1, 2 or 3 rows (Helmert). */
#define SQRT2  1.4142135623730951
#define SQRT6  2.4494897427831781
#define SQRT12 3.4641016151377544
static const double helmert[3][4] = {{1 / SQRT2, -1 / SQRT2, 0, 0},
                                     {1 / SQRT6, 1 / SQRT6, -2 / SQRT6, 0},
                                     {1 / SQRT12, 1 / SQRT12, 1 / SQRT12, -3 / SQRT12}};

/* Returns the filtered eigenvalue: negative ones become 0 or positive. */
static double filtered(double eigenvalue, flesh_eigenvalue_filter filter)
{
  if (eigenvalue >= 0 || filter == FLESH_FILTER_NONE) return eigenvalue;
  return filter == FLESH_FILTER_ABSOLUTE ? -eigenvalue : 0;
}

static void filter_matrix(int n, flesh_eigenvalue_filter filter, double *A)
{
  double w[9], Q[81];
  if (filter == FLESH_FILTER_NONE) return;
  flesh_eigh_small(n, A, w, Q);
  for (int k = 0; k < n; k++) w[k] = filtered(w[k], filter);
  for (int i = 0; i < n; i++)
    for (int j = 0; j <= i; j++) {
      double sum = 0;
      for (int k = 0; k < n; k++) sum += w[k] * Q[n * i + k] * Q[n * j + k];
      A[n * i + j] = A[n * j + i] = sum;
    }
}

/* The mollifier of two edges: its value, its first and second derivatives by y = |u x v|^2, and the gradient of y by
 * the edge vectors u and v. */
typedef struct mollifier {
  double value, first, second, u[3], v[3], by_u[3], by_v[3];
} mollifier;

static int find_mollifier(const flesh_contact_pair *pair, const double *x, mollifier *m)
{
  double q[3];
  const int *n = pair->nodes;
  if (pair->kind != FLESH_CONTACT_EDGE_EDGE || !(pair->parallel > 0)) return 0;
  for (int c = 0; c < 3; c++) {
    m->u[c] = x[3 * (size_t)n[1] + c] - x[3 * (size_t)n[0] + c];
    m->v[c] = x[3 * (size_t)n[3] + c] - x[3 * (size_t)n[2] + c];
  }
  flesh_vec3_cross(m->u, m->v, q);
  const double y = flesh_vec3_dot(q, q) / pair->parallel;
  if (!(y < 1)) return 0;
  flesh_vec3_cross(m->v, q, m->by_u);
  flesh_vec3_cross(q, m->u, m->by_v);
  for (int c = 0; c < 3; c++) m->by_u[c] *= 2, m->by_v[c] *= 2;
  m->value = y * (2 - y);
  m->first = 2 * (1 - y) / pair->parallel;
  m->second = -2 / (pair->parallel * pair->parallel);
  return 1;
}

/* Computes the gradient of y by the four nodes' positions. */
static void mollifier_gradient(const mollifier *m, double g[12])
{
  for (int c = 0; c < 3; c++) {
    g[c] = -m->by_u[c], g[3 + c] = m->by_u[c];
    g[6 + c] = -m->by_v[c], g[9 + c] = m->by_v[c];
  }
}

int flesh_contact_pair_gradient(const flesh_contact_pair *pair, const flesh_contact_closest *at, const double *x, double *value,
                                double *gradient)
{
  mollifier m;
  double law, first, second, turn[12];
  *value = 0;
  if (gradient) memset(gradient, 0, 12 * sizeof *gradient);
  if (!(at->distance > 0)) return FLESH_UNDEFINED;
  if (at->distance >= pair->thickness) return FLESH_OK;
  flesh_barrier_law(at->distance / pair->thickness, &law, &first, &second);
  const int mollified = find_mollifier(pair, x, &m);
  *value = pair->weight * pair->thickness * law;
  for (int a = 0; gradient && a < at->count; a++)
    for (int c = 0; c < 3; c++)
      gradient[3 * at->corner[a] + c] = pair->weight * first * at->share[a] * at->normal[c] * (mollified ? m.value : 1);
  if (!mollified) return FLESH_OK;
  mollifier_gradient(&m, turn);
  for (int k = 0; gradient && k < 12; k++) gradient[k] += *value * m.first * turn[k];
  *value *= m.value;
  return FLESH_OK;
}

double flesh_contact_pair_force(const flesh_contact_pair *pair, const double *x, flesh_contact_closest *closest)
{
  mollifier m;
  double law, first, second;
  flesh_contact_find_closest(pair->kind, pair->within, pair->nodes, x, closest);
  if (!(closest->distance > 0) || closest->distance >= pair->thickness) return 0;
  flesh_barrier_law(closest->distance / pair->thickness, &law, &first, &second);
  return -pair->weight * first * (find_mollifier(pair, x, &m) ? m.value : 1);
}

/* Computes the barrier's derivatives used in the Hessian: those at the present gap or, with an expected gap, the secant
 * to it and the force there. */
static void find_derivatives(const flesh_contact_closest *at, const flesh_contact_pair *pair, double *first,
                             double *second)
{
  const double s = at->distance / pair->thickness;
  double law, tangent;
  if (!(pair->expected > 0)) {
    flesh_barrier_law(s, &law, first, second);
    return;
  }
  *second = flesh_barrier_secant(s, pair->expected);
  *first = 0;
  if (pair->expected < 1) flesh_barrier_law(pair->expected, &law, first, &tangent);
}

/* Computes the barrier's Hessian in the basis named in contact_pair.h, M [q*q] with q = 2*dimension + 1, and its
 * eigenvalue for c m. */
static void small_hessian(const flesh_contact_closest *at, const flesh_contact_pair *pair, double *M, double *across)
{
  const double thickness = pair->thickness, weight = pair->weight;
  double first, second, norm = 0, own[3], turned[2][3];
  const int rows = at->count - 1, q = rows + at->dimension;
  find_derivatives(at, pair, &first, &second);
  for (int a = 0; a < at->count; a++) norm += at->share[a] * at->share[a];
  for (int i = 0; i < rows; i++) {
    own[i] = turned[0][i] = turned[1][i] = 0;
    for (int a = 0; a < at->count; a++) {
      own[i] += helmert[i][a] * at->share[a];
      for (int k = 0; k < at->dimension; k++) turned[k][i] += helmert[i][a] * at->turn[k][a];
    }
  }
  memset(M, 0, (size_t)(q * q) * sizeof *M);
  for (int i = 0; i < rows; i++) {
    for (int j = 0; j < rows; j++) {
      double sum = second / thickness * own[i] * own[j];
      for (int k = 0; k < at->dimension; k++) sum -= first * at->distance * turned[k][i] * turned[k][j];
      M[q * i + j] = weight * sum;
    }
    for (int k = 0; k < at->dimension; k++)
      M[q * i + rows + k] = M[q * (rows + k) + i] = -weight * first * sqrt(norm) * turned[k][i];
  }
  *across = weight * first / at->distance * norm;
}

/* Computes the directions m orthogonal to the normal and the tangents. Returns their number. */
static int directions_across(const flesh_contact_closest *at, double m[2][3])
{
  if (at->dimension == 2) return 0;
  if (at->dimension == 1) {
    flesh_vec3_cross(at->normal, at->tangent[0], m[0]);
    return 1;
  }
  flesh_vec3_perpendicular(at->normal, m[0]);
  flesh_vec3_cross(at->normal, m[0], m[1]);
  return 2;
}

/* The distinct blocks of the Hessian: `along` for moves along the normal, v between moves along and across it, T for
 * moves across it; c are the nodes' weights in moves across it. */
typedef struct small_blocks {
  double along[4][4], v[4][3], T[9], c[4];
} small_blocks;

/* Computes the blocks from M [q*q], whose node rows are in the Helmert basis. */
static small_blocks blocks_of(const flesh_contact_closest *at, const double *M, double across)
{
  small_blocks s = {.T = {0}};
  double m[2][3], norm = 0;
  const int rows = at->count - 1, q = rows + at->dimension;
  for (int a = 0; a < at->count; a++) norm += at->share[a] * at->share[a];
  for (int a = 0; a < at->count; a++) {
    s.c[a] = at->share[a] / sqrt(norm);
    for (int i = 0; i < rows; i++) {
      for (int j = 0; j < rows; j++)
        for (int b = a; b < at->count; b++) s.along[a][b] += helmert[i][a] * M[q * i + j] * helmert[j][b];
      for (int k = 0; k < at->dimension; k++)
        for (int d = 0; d < 3; d++) s.v[a][d] += helmert[i][a] * M[q * i + rows + k] * at->tangent[k][d];
    }
  }
  for (int k = 0; k < at->dimension; k++)
    for (int l = 0; l < at->dimension; l++)
      for (int e = 0; e < 9; e++) s.T[e] += M[q * (rows + k) + rows + l] * at->tangent[k][e / 3] * at->tangent[l][e % 3];
  for (int k = directions_across(at, m); k-- > 0;)
    for (int e = 0; e < 9; e++) s.T[e] += across * m[k][e / 3] * m[k][e % 3];
  return s;
}

static void barrier_hessian(const flesh_contact_closest *at, const flesh_contact_pair *pair,
                            flesh_eigenvalue_filter filter, double *hessian)
{
  double M[25], across;
  const double *n = at->normal;
  small_hessian(at, pair, M, &across);
  filter_matrix(at->count - 1 + at->dimension, filter, M);
  const small_blocks s = blocks_of(at, M, filtered(across, filter));
  for (int a = 0; a < at->count; a++)
    for (int b = a; b < at->count; b++)
      for (int c = 0; c < 3; c++)
        for (int d = 0; d < 3; d++) {
          const int i = 3 * at->corner[a] + c, j = 3 * at->corner[b] + d;
          hessian[12 * i + j] = hessian[12 * j + i] = n[c] * (s.along[a][b] * n[d] + s.c[b] * s.v[a][d]) +
                                                      s.c[a] * (s.v[b][c] * n[d] + s.c[b] * s.T[3 * c + d]);
        }
}

/* Adds `scale` times the Hessian of y by the four nodes' positions. */
static void add_turning(const mollifier *m, double scale, double *hessian)
{
  const double *u = m->u, *v = m->v, uu = flesh_vec3_dot(u, u), vv = flesh_vec3_dot(v, v), uv = flesh_vec3_dot(u, v);
  for (int c = 0; c < 3; c++)
    for (int d = 0; d < 3; d++) {
      const double one = c == d;
      const double own[2] = {2 * (vv * one - v[c] * v[d]), 2 * (uu * one - u[c] * u[d])};
      const double both = 2 * (2 * u[c] * v[d] - v[c] * u[d] - uv * one);
      for (int a = 0; a < 4; a++)
        for (int b = 0; b < 4; b++) {
          const int sign = (a % 2 == b % 2) ? 1 : -1, i = 3 * a + c, j = 3 * b + d;
          if (a / 2 == b / 2) hessian[12 * i + j] += scale * sign * own[a / 2];
          else if (a < b) {
            hessian[12 * i + j] += scale * sign * both;
            hessian[12 * j + i] += scale * sign * both;
          }
        }
    }
}

/* Filters the eigenvalues of a whole Hessian, in the basis of moves of four nodes that sum to 0. */
static void filter_whole(flesh_eigenvalue_filter filter, double *hessian)
{
  double M[81];
  if (filter == FLESH_FILTER_NONE) return;
  for (int i = 0; i < 9; i++)
    for (int j = 0; j < 9; j++) {
      double sum = 0;
      for (int a = 0; a < 4; a++)
        for (int b = 0; b < 4; b++)
          sum += helmert[i / 3][a] * hessian[12 * (3 * a + i % 3) + 3 * b + j % 3] * helmert[j / 3][b];
      M[9 * i + j] = sum;
    }
  filter_matrix(9, filter, M);
  for (int k = 0; k < 12; k++)
    for (int l = 0; l < 12; l++) {
      double sum = 0;
      for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
          sum += helmert[i][k / 3] * M[9 * (3 * i + k % 3) + 3 * j + l % 3] * helmert[j][l / 3];
      hessian[12 * k + l] = sum;
    }
}

int flesh_contact_pair_hessian(const flesh_contact_pair *pair, const flesh_contact_closest *at, const double *x,
                               flesh_eigenvalue_filter filter, double *hessian)
{
  mollifier m;
  double law, first, second, g[12] = {0}, turn[12];
  memset(hessian, 0, 144 * sizeof *hessian);
  if (!(at->distance > 0)) return FLESH_UNDEFINED;
  if (at->distance >= pair->thickness) return FLESH_OK;
  const int mollified = find_mollifier(pair, x, &m);
  barrier_hessian(at, pair, mollified ? FLESH_FILTER_NONE : filter, hessian);
  if (!mollified) return FLESH_OK;
  flesh_barrier_law(at->distance / pair->thickness, &law, &first, &second);
  for (int a = 0; a < at->count; a++)
    for (int c = 0; c < 3; c++) g[3 * at->corner[a] + c] = pair->weight * first * at->share[a] * at->normal[c];
  const double value = pair->weight * pair->thickness * law;
  mollifier_gradient(&m, turn);
  for (int i = 0; i < 12; i++)
    for (int j = 0; j < 12; j++)
      hessian[12 * i + j] = m.value * hessian[12 * i + j] + m.first * (turn[i] * g[j] + g[i] * turn[j]) +
                            value * m.second * turn[i] * turn[j];
  add_turning(&m, value * m.first, hessian);
  filter_whole(filter, hessian);
  return FLESH_OK;
}
