/* contact_closest.c: the points of two features of surfaces that are nearest to each other, and how they move. */
#include "geometry/contact_closest.h"

#include <math.h>
#include <string.h>

#include "math/mat3.h"

/* Squared sines below which edges are taken for parallel, and triangles for edges. */
static const double least_sine = 1e-20;

int flesh_contact_kind_nodes(flesh_contact_kind kind)
{
  return kind == FLESH_CONTACT_POINT_POINT ? 2 : kind == FLESH_CONTACT_POINT_EDGE ? 3 : 4;
}

static void subtract(const double *a, const double *b, double c[3])
{
  for (int k = 0; k < 3; k++) c[k] = a[k] - b[k];
}

double flesh_contact_nearest_of_edge(const double *p, const int nodes[2], const double *x, double weights[2])
{
  const int low = nodes[1] < nodes[0];
  const double *A = x + 3 * (size_t)nodes[low], *B = x + 3 * (size_t)nodes[!low];
  double e[3], d[3];
  subtract(B, A, e);
  subtract(p, A, d);
  const double along = flesh_vec3_dot(d, e), all = flesh_vec3_dot(e, e), t = along / all;
  int end = -1;
  if (!(along > 0) || !(t > 0)) end = 0; /* edges without length too */
  else if (!(t < 1)) end = 1;
  if (end == 1) subtract(p, B, d);
  for (int k = 0; k < 3 && end < 0; k++) d[k] -= t * e[k];
  weights[!low] = end < 0 ? t : end;
  weights[low] = end < 0 ? 1 - t : !end;
  return flesh_vec3_dot(d, d);
}

/* Whether the foot of the perpendicular from p is within the triangle: then its weights and distance squared. */
static int foot_within(const double *p, const int nodes[3], const double *x, double weights[3], double *squared)
{
  const double *X[3];
  double e[3], f[3], h[3], n[3], q[3];
  for (int k = 0; k < 3; k++) X[k] = x + 3 * (size_t)nodes[k];
  subtract(X[1], X[0], e);
  subtract(X[2], X[0], f);
  subtract(p, X[0], h);
  flesh_vec3_cross(e, f, n);
  const double area = flesh_vec3_dot(n, n), ee = flesh_vec3_dot(e, e), ff = flesh_vec3_dot(f, f);
  if (!(area > least_sine * ee * ff)) return 0;
  flesh_vec3_cross(h, f, q);
  weights[1] = flesh_vec3_dot(q, n) / area;
  flesh_vec3_cross(e, h, q);
  weights[2] = flesh_vec3_dot(q, n) / area;
  weights[0] = 1 - weights[1] - weights[2];
  const double height = flesh_vec3_dot(h, n);
  *squared = height / area * height;
  return weights[0] > 0 && weights[1] > 0 && weights[2] > 0;
}

double flesh_contact_nearest_of_triangle(const double *p, const int nodes[3], const double *x, double weights[3])
{
  double best = INFINITY, squared;
  if (foot_within(p, nodes, x, weights, &squared)) return squared;
  weights[0] = 1, weights[1] = weights[2] = 0;
  for (int k = 0; k < 3; k++) {
    const int next = (k + 1) % 3;
    double w[2];
    squared = flesh_contact_nearest_of_edge(p, (const int[]){nodes[k], nodes[next]}, x, w);
    if (squared >= best) continue; /* what is no number is taken */
    best = squared;
    weights[k] = w[0], weights[next] = w[1], weights[(k + 2) % 3] = 0;
  }
  return best;
}

/* The nearest points within both of two edges: their weights, where they are there. */
static int cross_within(const int nodes[4], const double *x, double *s, double *t)
{
  double u[3], v[3], r[3], q[3], z[3];
  subtract(x + 3 * (size_t)nodes[1], x + 3 * (size_t)nodes[0], u);
  subtract(x + 3 * (size_t)nodes[3], x + 3 * (size_t)nodes[2], v);
  subtract(x + 3 * (size_t)nodes[0], x + 3 * (size_t)nodes[2], r);
  flesh_vec3_cross(u, v, q);
  const double area = flesh_vec3_dot(q, q);
  if (!(area > least_sine * flesh_vec3_dot(u, u) * flesh_vec3_dot(v, v))) return 0;
  flesh_vec3_cross(v, r, z);
  *s = flesh_vec3_dot(z, q) / area;
  flesh_vec3_cross(u, r, z);
  *t = flesh_vec3_dot(z, q) / area;
  return *s > 0 && *s < 1 && *t > 0 && *t < 1;
}

/* The signed weights of two edges' nodes at their nearest points. */
static void shares_of_edges(const int nodes[4], const double *x, double share[4])
{
  double s, t, best = INFINITY;
  if (cross_within(nodes, x, &s, &t)) {
    share[0] = 1 - s, share[1] = s, share[2] = t - 1, share[3] = -t;
    return;
  }
  share[0] = 1, share[1] = 0, share[2] = -1, share[3] = 0;
  for (int a = 0; a < 4; a++) { /* one's end and the other */
    const int *other = nodes + (a < 2 ? 2 : 0), sign = a < 2 ? 1 : -1;
    double w[2];
    const double squared = flesh_contact_nearest_of_edge(x + 3 * (size_t)nodes[a], other, x, w);
    if (squared >= best) continue; /* what is no number is taken */
    best = squared;
    memset(share, 0, 4 * sizeof *share);
    share[a] = sign;
    share[other - nodes] = -sign * w[0], share[other - nodes + 1] = -sign * w[1];
  }
}

/* What of the nodes is borne by: their shares. */
static void shares_of(flesh_contact_kind kind, const int *nodes, const double *x, double share[4])
{
  const double *p = x + 3 * (size_t)nodes[0];
  double w[3] = {1, 0, 0};
  if (kind == FLESH_CONTACT_EDGE_EDGE) {
    shares_of_edges(nodes, x, share);
    return;
  }
  if (kind == FLESH_CONTACT_POINT_EDGE) flesh_contact_nearest_of_edge(p, nodes + 1, x, w);
  if (kind == FLESH_CONTACT_POINT_TRIANGLE) flesh_contact_nearest_of_triangle(p, nodes + 1, x, w);
  share[0] = 1;
  for (int k = 0; k < 3; k++) share[k + 1] = -w[k];
}

/* Orthonormal tangents of those that the places' changes `turn` make. */
static void find_tangents(const double (*places)[3], flesh_contact_closest *c)
{
  for (int i = 0; i < c->dimension; i++) {
    double *t = c->tangent[i], *a = c->turn[i];
    for (int k = 0; k < 3; k++) {
      t[k] = 0;
      for (int n = 0; n < c->count; n++) t[k] += a[n] * places[n][k];
    }
    if (i == 1) {
      const double along = flesh_vec3_dot(t, c->tangent[0]);
      for (int k = 0; k < 3; k++) t[k] -= along * c->tangent[0][k];
      for (int n = 0; n < c->count; n++) a[n] -= along * c->turn[0][n];
    }
    const double length = 1 / sqrt(flesh_vec3_dot(t, t));
    for (int k = 0; k < 3; k++) t[k] *= length;
    for (int n = 0; n < c->count; n++) a[n] *= length;
  }
}

/* D itself, and where four nodes bear it the direction at right angles to both tangents, which is known better. */
static void find_normal(const double (*places)[3], flesh_contact_closest *c)
{
  double D[3] = {0, 0, 0};
  for (int n = 1; n < c->count; n++) /* shares sum to 0: places are relative to the first */
    for (int k = 0; k < 3; k++) D[k] += c->share[n] * places[n][k];
  if (c->count == 4) {
    flesh_vec3_cross(c->tangent[0], c->tangent[1], c->normal);
    const double height = flesh_vec3_dot(D, c->normal);
    for (int k = 0; k < 3; k++) c->normal[k] *= height < 0 ? -1 : 1;
    c->distance = fabs(height);
    return;
  }
  if (c->count == 3) {
    const double along = flesh_vec3_dot(D, c->tangent[0]);
    for (int k = 0; k < 3; k++) D[k] -= along * c->tangent[0][k];
  }
  c->distance = sqrt(flesh_vec3_dot(D, D));
  for (int k = 0; k < 3; k++) c->normal[k] = c->distance > 0 ? D[k] / c->distance : 0;
}

void flesh_contact_find_closest(flesh_contact_kind kind, const int *nodes, const double *x,
                                flesh_contact_closest *closest)
{
  double share[4], places[4][3];
  const int all = flesh_contact_kind_nodes(kind);
  *closest = (flesh_contact_closest){0};
  flesh_contact_closest *c = closest;
  shares_of(kind, nodes, x, share);
  for (int a = 0; a < all; a++)
    if (share[a] != 0) {
      c->corner[c->count] = a;
      c->share[c->count] = share[a];
      subtract(x + 3 * (size_t)nodes[a], x + 3 * (size_t)nodes[c->corner[0]], places[c->count]);
      c->count++;
    }
  /* Those after the first of the same feature, less that, move along it. */
  for (int a = 1, first = 0, i = 0; a < c->count; a++) {
    if ((c->share[a] > 0) != (c->share[first] > 0)) {
      first = a;
      continue;
    }
    const double towards = c->share[a] > 0 ? 1 : -1;
    c->turn[i][first] = -towards;
    c->turn[i++][a] = towards;
  }
  c->dimension = c->count - 2;
  find_tangents((const double(*)[3])places, c);
  find_normal((const double(*)[3])places, c);
}
