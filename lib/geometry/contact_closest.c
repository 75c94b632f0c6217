/* contact_closest.c: nearest points of two features of surfaces, and how they move. */
#include "geometry/contact_closest.h"

#include <math.h>
#include <string.h>

#include "math/mat3.h"

/* Squared sine of the angle below which edges count as parallel and triangles as edges. */
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
  if (!(along > 0) || !(t > 0)) end = 0; /* also for an edge without length */
  else if (!(t < 1)) end = 1;
  if (end == 1) subtract(p, B, d);
  for (int k = 0; k < 3 && end < 0; k++) d[k] -= t * e[k];
  weights[!low] = end < 0 ? t : end;
  weights[low] = end < 0 ? 1 - t : !end;
  return flesh_vec3_dot(d, d);
}

/* Finds the foot of the perpendicular from p in the triangle's plane: its weights and the squared distance. Returns 0
 * if the triangle has no area. */
static int find_foot(const double *p, const int nodes[3], const double *x, double weights[3], double *squared)
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
  return 1;
}

/* Returns the part of a triangle that bears its point nearest to p, decided by signs: edge k, 3 + corner k, or -1 if
 * rounding makes the signs inconsistent. `foot` has the weights of the foot in the plane, `on` those of the nearest
 * points on the edges. */
static int bearing_part(const double foot[3], const double (*on)[2])
{
  for (int k = 0; k < 3; k++)
    if (foot[(k + 2) % 3] <= 0 && on[k][0] > 0 && on[k][1] > 0) return k;
  for (int k = 0; k < 3; k++)
    if (on[k][0] == 1 && on[(k + 2) % 3][1] == 1) return 3 + k;
  return -1;
}

/* Compares signs rather than distances: near an edge, distances to the plane and to the edge differ only by the square
 * of the distance between the two feet, which rounding hides. */
double flesh_contact_nearest_of_triangle(const double *p, const int nodes[3], const double *x, double weights[3])
{
  double squared[4], on[3][2];
  const int flat = find_foot(p, nodes, x, weights, &squared[3]);
  if (flat && weights[0] > 0 && weights[1] > 0 && weights[2] > 0) return squared[3];
  for (int k = 0; k < 3; k++)
    squared[k] = flesh_contact_nearest_of_edge(p, (const int[]){nodes[k], nodes[(k + 1) % 3]}, x, on[k]);
  int part = flat ? bearing_part(weights, (const double(*)[2])on) : -1;
  for (int k = 0, best = 0; part < 0 && k < 3; k++) {
    if (squared[k] < squared[best] || isnan(squared[k])) best = k;
    if (k == 2) part = best;
  }
  const int edge = part % 3;
  weights[edge] = on[edge][0], weights[(edge + 1) % 3] = on[edge][1], weights[(edge + 2) % 3] = 0;
  return squared[edge];
}

/* Finds the nearest points of two edges if they are interior to both: s and t are their weights. Returns whether they
 * are. */
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

/* Finds the signed weights of two edges' nodes at their nearest points. */
static void shares_of_edges(const int nodes[4], const double *x, double share[4])
{
  double s, t, best = INFINITY;
  if (cross_within(nodes, x, &s, &t)) {
    share[0] = 1 - s, share[1] = s, share[2] = t - 1, share[3] = -t;
    return;
  }
  share[0] = 1, share[1] = 0, share[2] = -1, share[3] = 0;
  for (int a = 0; a < 4; a++) { /* an end of one edge and the other edge */
    const int *other = nodes + (a < 2 ? 2 : 0), sign = a < 2 ? 1 : -1;
    double w[2];
    const double squared = flesh_contact_nearest_of_edge(x + 3 * (size_t)nodes[a], other, x, w);
    if (squared >= best) continue; /* a NaN is accepted */
    best = squared;
    memset(share, 0, 4 * sizeof *share);
    share[a] = sign;
    share[other - nodes] = -sign * w[0], share[other - nodes + 1] = -sign * w[1];
  }
}

/* Finds the foot of the perpendicular from p on the edge's line. Returns 0 if the edge has no length. */
static int foot_on_line(const double *p, const int nodes[2], const double *x, double weights[2])
{
  double e[3], d[3];
  subtract(x + 3 * (size_t)nodes[1], x + 3 * (size_t)nodes[0], e);
  subtract(p, x + 3 * (size_t)nodes[0], d);
  const double all = flesh_vec3_dot(e, e);
  weights[1] = flesh_vec3_dot(d, e) / all;
  weights[0] = 1 - weights[1];
  return all > 0;
}

/* Finds the shares of all nodes, and which of them bear the nearest points. */
static void find_shares(flesh_contact_kind kind, int within, const int *nodes, const double *x, double share[4],
                        int bears[4])
{
  const double *p = x + 3 * (size_t)nodes[0];
  double w[3] = {1, 0, 0}, squared;
  int all = 0;
  if (kind == FLESH_CONTACT_EDGE_EDGE) {
    shares_of_edges(nodes, x, share);
  } else {
    if (kind == FLESH_CONTACT_POINT_EDGE) {
      all = within && foot_on_line(p, nodes + 1, x, w);
      if (!all) flesh_contact_nearest_of_edge(p, nodes + 1, x, w);
    }
    if (kind == FLESH_CONTACT_POINT_TRIANGLE) {
      all = within && find_foot(p, nodes + 1, x, w, &squared);
      if (!all) flesh_contact_nearest_of_triangle(p, nodes + 1, x, w);
    }
    share[0] = 1;
    for (int k = 0; k < 3; k++) share[k + 1] = -w[k];
  }
  for (int k = 0; k < flesh_contact_kind_nodes(kind); k++) bears[k] = all || share[k] != 0;
}

/* Computes the tangents from `turn` and orthonormalises them, transforming `turn` accordingly. */
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

/* Computes normal and distance from D. With four bearing nodes the normal is the cross product of the tangents, which
 * is more accurate. */
static void find_normal(const double (*places)[3], flesh_contact_closest *c)
{
  double D[3] = {0, 0, 0};
  for (int n = 1; n < c->count; n++) /* shares sum to 0, so positions relative to the first node will do */
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

void flesh_contact_find_closest(flesh_contact_kind kind, int within, const int *nodes, const double *x,
                                flesh_contact_closest *closest)
{
  double share[4], places[4][3];
  int bears[4];
  const int second = kind == FLESH_CONTACT_EDGE_EDGE ? 2 : 1; /* index of the second feature's first node */
  const int all = flesh_contact_kind_nodes(kind);
  *closest = (flesh_contact_closest){0};
  flesh_contact_closest *c = closest;
  find_shares(kind, within, nodes, x, share, bears);
  for (int a = 0; a < all; a++)
    if (bears[a]) {
      c->corner[c->count] = a;
      c->share[c->count] = share[a];
      subtract(x + 3 * (size_t)nodes[a], x + 3 * (size_t)nodes[c->corner[0]], places[c->count]);
      c->count++;
    }
  /* Each tangent leads from the first bearing node of a feature to another one of that feature. */
  for (int a = 1, first = 0, i = 0; a < c->count; a++) {
    if ((c->corner[a] < second) != (c->corner[first] < second)) {
      first = a;
      continue;
    }
    const double towards = c->corner[a] < second ? 1 : -1;
    c->turn[i][first] = -towards;
    c->turn[i++][a] = towards;
  }
  c->dimension = c->count - 2;
  find_tangents((const double(*)[3])places, c);
  find_normal((const double(*)[3])places, c);
}
