/* bernstein.c: the Jacobian of a ten-node tet in Bernstein form, and its minimum by subdivision. */
#include "mesh/bernstein.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "mesh/edges.h"

/* Exponents of the coefficients; the first four are those of the corners. */
static const unsigned char exponent[FLESH_CUBIC][4] = {
    {3, 0, 0, 0}, {0, 3, 0, 0}, {0, 0, 3, 0}, {0, 0, 0, 3}, {2, 1, 0, 0}, {1, 2, 0, 0}, {0, 2, 1, 0},
    {0, 1, 2, 0}, {2, 0, 1, 0}, {1, 0, 2, 0}, {2, 0, 0, 1}, {1, 0, 0, 2}, {0, 2, 0, 1}, {0, 1, 0, 2},
    {0, 0, 2, 1}, {0, 0, 1, 2}, {0, 1, 1, 1}, {1, 0, 1, 1}, {1, 1, 0, 1}, {1, 1, 1, 0}};

/* place[i][j][k]: index of the coefficient of the monomial L_i L_j L_k. */
static const unsigned char place[4][4][4] = {
    {{0, 4, 8, 10}, {4, 5, 19, 18}, {8, 19, 9, 17}, {10, 18, 17, 11}},
    {{4, 5, 19, 18}, {5, 1, 6, 12}, {19, 6, 7, 16}, {18, 12, 16, 13}},
    {{8, 19, 9, 17}, {19, 6, 7, 16}, {9, 7, 2, 14}, {17, 16, 14, 15}},
    {{10, 18, 17, 11}, {18, 12, 16, 13}, {17, 16, 14, 15}, {11, 13, 15, 3}}};

/* Computes the derivatives of x along the edges 01, 02, 03, which are linear, at the four corners. x = sum b_ij B_ij
 * with b_ii = x_i and b_ij = 2 x_ij - (x_i + x_j)/2, so that d/dxi_i at corner k is 2 (b_ik - b_0k). */
static void edge_derivatives(const double *x, const int corners[4], const int edge_nodes[6], double e[3][4][3])
{
  double b[4][4][3];
  for (int i = 0; i < 4; i++)
    for (int k = 0; k < 4; k++) {
      const double *p = x + 3 * (size_t)corners[i], *q = x + 3 * (size_t)corners[k];
      const double *m = i == k ? p : x + 3 * (size_t)edge_nodes[flesh_edge_between[i][k]];
      for (int d = 0; d < 3; d++) b[i][k][d] = i == k ? p[d] : 2 * m[d] - (p[d] + q[d]) / 2;
    }
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 4; k++)
      for (int d = 0; d < 3; d++) e[i][k][d] = 2 * (b[i + 1][k][d] - b[0][k][d]);
}

__attribute__((noinline)) void flesh_tet10_jacobian(const double *x, const int corners[4],
                                                    const int edge_nodes[6], double c[FLESH_CUBIC])
{
  double e[3][4][3];
  edge_derivatives(x, corners, edge_nodes, e);
  memset(c, 0, FLESH_CUBIC * sizeof *c);
  for (int l = 0; l < 4; l++)
    for (int m = 0; m < 4; m++) {
      const double *p = e[1][l], *q = e[2][m];
      const double n[3] = {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]};
      for (int k = 0; k < 4; k++)
        c[place[k][l][m]] += e[0][k][0] * n[0] + e[0][k][1] * n[1] + e[0][k][2] * n[2];
    }
  /* A coefficient is the mean over the arrangements of its exponents, of which there are 3, or 6. */
  for (int a = 4; a < 16; a++) c[a] /= 3;
  for (int a = 16; a < FLESH_CUBIC; a++) c[a] /= 6;
}

double flesh_cubic_integral(const double c[FLESH_CUBIC])
{
  double sum = 0;
  for (int a = 0; a < FLESH_CUBIC; a++) sum += c[a];
  return sum / (6 * FLESH_CUBIC); /* the reference tet has the volume 1/6 */
}

void flesh_cubic_weights(const double L[4], double weights[FLESH_CUBIC])
{
  for (int a = 0; a < FLESH_CUBIC; a++) {
    double power = a < 4 ? 1 : a < 16 ? 3 : 6;
    for (int i = 0; i < 4; i++)
      for (int k = 0; k < exponent[a][i]; k++) power *= L[i];
    weights[a] = power;
  }
}

double flesh_cubic_sum(const double c[FLESH_CUBIC], const double weights[FLESH_CUBIC])
{
  double sum = 0;
  for (int a = 0; a < FLESH_CUBIC; a++) sum += c[a] * weights[a];
  return sum;
}

/* A part of the tet: both cubics on it. */
typedef struct piece {
  double c[FLESH_CUBIC], C[FLESH_CUBIC];
} piece;

/* Bounds the minimum of c/C on a piece; the lower bound is -infinity if coefficients of C are not positive. */
static flesh_least bounds(const piece *p)
{
  flesh_least b = {INFINITY, INFINITY};
  int bounded = 1;
  for (int a = 0; a < FLESH_CUBIC; a++) {
    if (!(p->C[a] > 0)) bounded = 0;
    double ratio = p->c[a] / p->C[a];
    if (a < 4) b.high = fmin(b.high, ratio);
    b.low = fmin(b.low, ratio);
  }
  if (!bounded) b.low = -INFINITY;
  return b;
}

static int place_of(const int a[4])
{
  int corner[3], found = 0;
  for (int i = 0; i < 4; i++)
    for (int k = 0; k < a[i]; k++) corner[found++] = i;
  return place[corner[0]][corner[1]][corner[2]];
}

/* Splits a cubic at the middle of the edge between corners i and j, by de Casteljau's scheme along every row of
 * coefficients in that direction. `near` keeps corner i, `far` corner j. */
static void halve(const double c[FLESH_CUBIC], int i, int j, double near[FLESH_CUBIC], double far[FLESH_CUBIC])
{
  for (int first = 0; first < FLESH_CUBIC; first++) {
    if (exponent[first][j]) continue;
    int n = exponent[first][i], row[4], a[4];
    double value[4];
    for (int d = 0; d < 4; d++) a[d] = exponent[first][d];
    for (int k = 0; k <= n; k++, a[i]--, a[j]++) {
      row[k] = place_of(a);
      value[k] = c[row[k]];
    }
    for (int k = 0; k <= n; k++) {
      near[row[k]] = value[0];
      far[row[n - k]] = value[n - k];
      for (int m = 0; m < n - k; m++) value[m] = (value[m] + value[m + 1]) / 2;
    }
  }
}

/* Returns the edge along which the coefficients of the cubics change most. */
static int steepest_edge(const piece *p)
{
  double most = -1, c_size = 0, C_size = 0;
  int edge = 0;
  for (int a = 0; a < FLESH_CUBIC; a++) c_size = fmax(c_size, fabs(p->c[a])), C_size = fmax(C_size, fabs(p->C[a]));
  for (int k = 0; k < 6; k++) {
    const int i = flesh_edge_corners[k][0], j = flesh_edge_corners[k][1];
    for (int l = 0; l < 4; l++)
      for (int m = l; m < 4; m++) {
        const int a = place[i][l][m], b = place[j][l][m];
        double step = fabs(p->c[a] - p->c[b]) / c_size + fabs(p->C[a] - p->C[b]) / C_size;
        if (step > most) most = step, edge = k;
      }
  }
  return edge;
}

flesh_least flesh_cubic_least(const double c[FLESH_CUBIC], const double C[FLESH_CUBIC], double tolerance)
{
  enum { DEPTH = 40 }; /* pieces on the stack: one for each cut on the way to the current piece */
  piece stack[DEPTH + 2];
  flesh_least least = {INFINITY, INFINITY};
  double size = 0, sum = 0;
  for (int a = 0; a < FLESH_CUBIC; a++) {
    sum += c[a];
    stack[0].c[a] = c[a], stack[0].C[a] = C[a];
    if (C[a] > 0) size = fmax(size, fabs(c[a] / C[a]));
  }
  if (!isfinite(sum) || !isfinite(size)) return (flesh_least){NAN, NAN};
  for (int count = 1, cuts = 0; count;) {
    const piece *p = &stack[count - 1];
    flesh_least b = bounds(p);
    least.high = fmin(least.high, b.high);
    const double gap = least.high - b.low;
    const int known = b.low > 0 || least.high <= 0 || gap <= 1e-13 * size;
    if ((known && gap <= tolerance * size) || cuts == FLESH_SUBDIVISIONS || count == DEPTH) {
      least.low = fmin(least.low, b.low);
      count--;
      continue;
    }
    const int *ends = flesh_edge_corners[steepest_edge(p)];
    const piece cut = *p;
    halve(cut.c, ends[0], ends[1], stack[count - 1].c, stack[count].c);
    halve(cut.C, ends[0], ends[1], stack[count - 1].C, stack[count].C);
    /* Takes the half with the lower bound first, as it may settle the other half. */
    if (bounds(&stack[count - 1]).low < bounds(&stack[count]).low) {
      const piece kept = stack[count];
      stack[count] = stack[count - 1], stack[count - 1] = kept;
    }
    count++, cuts++;
  }
  return least;
}
