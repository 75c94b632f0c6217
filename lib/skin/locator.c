/* locator.c: a binary tree over the tets, split at the median of their centres along the longest side of the boxes;
 * searches visit the nearer child first and skip boxes farther away than the best tet so far. */
#include "skin/locator.h"

#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "math/mat3.h"
#include "mesh/shape.h"

enum { LEAF_TETS = 4 };

/* The children of node k are k+1 and `second`. A leaf has the tets order[first ... first+count-1]. */
typedef struct tree_node {
  double low[3], high[3];
  int second, first, count; /* count 0: not a leaf */
} tree_node;

struct flesh_locator {
  const double *x;
  const int *tets, *edges; /* edges: NULL if tets have four nodes */
  const uint8_t *curved;
  int *order;      /* [tets] */
  double *centres; /* [3*tets] */
  tree_node *nodes;
  int node_count;
  double tie; /* distances that differ by less count as equal, m */
};

static void widen(tree_node *node, const double p[3])
{
  for (int d = 0; d < 3; d++) {
    if (p[d] < node->low[d]) node->low[d] = p[d];
    if (p[d] > node->high[d]) node->high[d] = p[d];
  }
}

/* Extends a node's box by a curved tet, which lies in the hull of its corners and of the Bernstein points of its edges,
 * 2 x_ij - (x_i + x_j)/2. */
static void bound_edges(const flesh_locator *l, int t, tree_node *node)
{
  for (int k = 0; k < 6; k++) {
    const int *n = l->tets + 4 * (size_t)t, *corner = flesh_edge_corners[k];
    const double *p = l->x + 3 * (size_t)n[corner[0]], *q = l->x + 3 * (size_t)n[corner[1]];
    const double *m = l->x + 3 * (size_t)l->edges[6 * (size_t)t + k];
    double b[3];
    for (int d = 0; d < 3; d++) b[d] = 2 * m[d] - (p[d] + q[d]) / 2;
    widen(node, b);
  }
}

static void bound(const flesh_locator *l, int first, int count, tree_node *node)
{
  for (int d = 0; d < 3; d++) node->low[d] = INFINITY, node->high[d] = -INFINITY;
  for (int k = first; k < first + count; k++) {
    const int t = l->order[k];
    for (int i = 0; i < 4; i++) widen(node, l->x + 3 * (size_t)l->tets[4 * (size_t)t + i]);
    if (l->curved[t]) bound_edges(l, t, node);
  }
}

/* Moves the median of order[first ... first+count-1] along `axis` to its place, smaller ones before it (Hoare's
 * selection). */
static void select_median(flesh_locator *l, int first, int count, int axis)
{
  int low = first, high = first + count - 1, middle = first + count / 2;
  while (low < high) {
    double pivot = l->centres[3 * (size_t)l->order[(low + high) / 2] + axis];
    int i = low, j = high;
    while (i <= j) {
      while (l->centres[3 * (size_t)l->order[i] + axis] < pivot) i++;
      while (l->centres[3 * (size_t)l->order[j] + axis] > pivot) j--;
      if (i > j) break;
      int other = l->order[i];
      l->order[i++] = l->order[j];
      l->order[j--] = other;
    }
    if (middle <= j) high = j;
    else if (middle >= i) low = i;
    else break;
  }
}

/* Builds the subtree; its depth is log2 of the number of tets, as it is split in halves. */
static void grow(flesh_locator *l, int first, int count)
{
  tree_node *node = &l->nodes[l->node_count++];
  bound(l, first, count, node);
  node->first = first;
  node->count = count;
  if (count <= LEAF_TETS) return;
  int axis = 0;
  for (int d = 1; d < 3; d++)
    if (node->high[d] - node->low[d] > node->high[axis] - node->low[axis]) axis = d;
  select_median(l, first, count, axis);
  node->count = 0;
  grow(l, first, count / 2);
  node->second = l->node_count;
  grow(l, first + count / 2, count - count / 2);
}

int flesh_locator_create(const flesh_mesh *mesh, flesh_locator **locator)
{
  *locator = NULL;
  size_t tets = (size_t)flesh_mesh_tet_count(mesh);
  flesh_locator *l = calloc(1, sizeof *l);
  if (!l) return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a tree of tets");
  l->x = flesh_mesh_positions(mesh);
  l->tets = flesh_mesh_tets(mesh);
  l->edges = flesh_mesh_tet_edges(mesh);
  l->curved = flesh_mesh_tet_curved(mesh);
  l->order = malloc(tets * sizeof *l->order);
  l->centres = malloc(3 * tets * sizeof *l->centres);
  l->nodes = malloc(2 * tets * sizeof *l->nodes);
  if (!l->order || !l->centres || !l->nodes) {
    flesh_locator_destroy(&l);
    return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a tree of %zu tets", tets);
  }
  for (size_t t = 0; t < tets; t++) {
    const int *n = l->tets + 4 * t;
    l->order[t] = (int)t;
    for (size_t d = 0; d < 3; d++)
      l->centres[3 * t + d] = l->x[3 * (size_t)n[0] + d] + l->x[3 * (size_t)n[1] + d] +
                              l->x[3 * (size_t)n[2] + d] + l->x[3 * (size_t)n[3] + d];
  }
  grow(l, 0, (int)tets);
  double diagonal = 0;
  for (int d = 0; d < 3; d++) diagonal += pow(l->nodes[0].high[d] - l->nodes[0].low[d], 2);
  l->tie = 1e-12 * sqrt(diagonal);
  *locator = l;
  return FLESH_OK;
}

void flesh_locator_destroy(flesh_locator **locator)
{
  if (!locator || !*locator) return;
  free((*locator)->order);
  free((*locator)->centres);
  free((*locator)->nodes);
  free(*locator);
  *locator = NULL;
}

/* Computes the barycentric weights of the point in tet `t`. */
static void weigh(const flesh_locator *l, int t, const double point[3], double w[4])
{
  const int *n = l->tets + 4 * (size_t)t;
  const double *o = l->x + 3 * (size_t)n[0];
  double e[3][3], inverse[3][3], p[3];
  for (int i = 0; i < 3; i++)
    for (int d = 0; d < 3; d++) e[i][d] = l->x[3 * (size_t)n[i + 1] + d] - o[d];
  for (int i = 0; i < 3; i++) flesh_vec3_cross(e[(i + 1) % 3], e[(i + 2) % 3], inverse[i]);
  double volume = flesh_vec3_dot(e[0], inverse[0]);
  for (int d = 0; d < 3; d++) p[d] = point[d] - o[d];
  for (int i = 0; i < 3; i++) w[i + 1] = flesh_vec3_dot(p, inverse[i]) / volume;
  w[0] = 1 - w[1] - w[2] - w[3];
}

/* Squared distance of a point p from the segment and the triangle from the origin along a (and b): Ericson 2005,
 * Real-Time Collision Detection, 5.1. */
static double to_segment(const double p[3], const double a[3])
{
  double s = fmin(fmax(flesh_vec3_dot(p, a) / flesh_vec3_dot(a, a), 0), 1), sum = 0;
  for (int d = 0; d < 3; d++) sum += (p[d] - s * a[d]) * (p[d] - s * a[d]);
  return sum;
}

static double to_triangle(const double p[3], const double a[3], const double b[3])
{
  double normal[3], pb[3], ap[3];
  flesh_vec3_cross(a, b, normal);
  double area = flesh_vec3_dot(normal, normal);
  flesh_vec3_cross(p, b, pb);
  flesh_vec3_cross(a, p, ap);
  double s = flesh_vec3_dot(pb, normal) / area, t = flesh_vec3_dot(ap, normal) / area;
  if (s >= 0 && t >= 0 && s + t <= 1) {
    double height = flesh_vec3_dot(p, normal);
    return height * height / area;
  }
  double q[3], c[3];
  for (int d = 0; d < 3; d++) q[d] = p[d] - a[d], c[d] = b[d] - a[d];
  return fmin(to_segment(q, c), fmin(to_segment(p, a), to_segment(p, b)));
}

/* Returns the distance of the point from tet `t`: 0 if no weight is negative. */
static double distance_to(const flesh_locator *l, int t, const double point[3], const double w[4])
{
  static const int faces[4][3] = {{1, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}};
  const int *n = l->tets + 4 * (size_t)t;
  double least = INFINITY;
  int outside = 0;
  for (int k = 0; k < 4; k++) {
    if (w[k] >= 0) continue; /* the nearest face is one that the point lies beyond */
    const double *o = l->x + 3 * (size_t)n[faces[k][0]], *p = l->x + 3 * (size_t)n[faces[k][1]];
    const double *q = l->x + 3 * (size_t)n[faces[k][2]];
    double r[3], a[3], b[3];
    for (int d = 0; d < 3; d++) r[d] = point[d] - o[d], a[d] = p[d] - o[d], b[d] = q[d] - o[d];
    least = fmin(least, to_triangle(r, a, b));
    outside = 1;
  }
  return outside ? sqrt(least) : 0;
}

static void place_nodes(const flesh_locator *l, int t, double x[10][3])
{
  for (int a = 0; a < 10; a++) {
    const int n = a < 4 ? l->tets[4 * (size_t)t + a] : l->edges[6 * (size_t)t + a - 4];
    for (int d = 0; d < 3; d++) x[a][d] = l->x[3 * (size_t)n + d];
  }
}

/* Computes the image of L and the derivative of the map, at L with its negative coordinates cut off, along the
 * directions from corner 0 to the corners 1 to 3. */
static void image(const double x[10][3], const double L[4], double y[3], double J[9])
{
  double N[10], cut[4], sum = 0;
  flesh_tet10_weights(L, N);
  for (int d = 0; d < 3; d++) {
    y[d] = 0;
    for (int a = 0; a < 10; a++) y[d] += N[a] * x[a][d];
  }
  for (int i = 0; i < 4; i++) sum += cut[i] = fmax(L[i], 0);
  for (int i = 0; i < 4; i++) cut[i] /= sum;
  for (int c = 0; c < 3; c++) {
    double D[4] = {-1, 0, 0, 0};
    D[c + 1] = 1;
    flesh_tet10_shape_along(cut, D, N);
    for (int d = 0; d < 3; d++) {
      J[3 * d + c] = 0;
      for (int a = 0; a < 10; a++) J[3 * d + c] += N[a] * x[a][d];
    }
  }
}

/* Finds the coordinates in a curved tet by Newton's method from those of the straight tet in w, with steps of at most
 * half the tet; returns whether it converged. */
static int weigh_curved(const double x[10][3], const double point[3], double size, double w[4])
{
  for (int i = 0; i < 50; i++) {
    double y[3], J[9], inverse[9], r[3], step[3], largest = 0, off = 0;
    image(x, w, y, J);
    for (int d = 0; d < 3; d++) r[d] = point[d] - y[d], off = fmax(off, fabs(r[d]));
    if (off <= 1e-14 * size) return 1;
    if (!flesh_mat3_inverse(J, inverse)) return 0;
    flesh_mat3_times(inverse, r, step);
    for (int d = 0; d < 3; d++) largest = fmax(largest, fabs(step[d]));
    if (!isfinite(largest)) return 0;
    if (largest <= 1e-15 && off <= 1e-12 * size) return 1;
    double scale = largest > 0.5 && i ? 0.5 / largest : 1;
    for (int d = 0; d < 3; d++) w[d + 1] += scale * step[d];
    w[0] = 1 - w[1] - w[2] - w[3];
  }
  double y[3], J[9], off = 0;
  image(x, w, y, J);
  for (int d = 0; d < 3; d++) off = fmax(off, fabs(point[d] - y[d]));
  return off <= 1e-11 * size;
}

/* Returns the least distance from the image of w with its negative coordinates cut off, and from the four flat
 * triangles of each face beyond which the point lies. */
static double distance_to_curved(const double x[10][3], const double point[3], const double w[4])
{
  static const int faces[4][3] = {{1, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}};
  double cut[4], N[10], sum = 0, least = 0;
  if (fmin(fmin(w[0], w[1]), fmin(w[2], w[3])) >= 0) return 0;
  for (int i = 0; i < 4; i++) sum += cut[i] = fmax(w[i], 0);
  for (int i = 0; i < 4; i++) cut[i] /= sum;
  flesh_tet10_shape(cut, N);
  for (int d = 0; d < 3; d++) {
    double off = point[d];
    for (int a = 0; a < 10; a++) off -= N[a] * x[a][d];
    least += off * off;
  }
  for (int k = 0; k < 4; k++) {
    if (w[k] >= 0) continue;
    const int a = faces[k][0], b = faces[k][1], c = faces[k][2], p = 4 + flesh_edge_between[a][b],
              q = 4 + flesh_edge_between[b][c], r = 4 + flesh_edge_between[c][a];
    const int parts[4][3] = {{a, p, r}, {p, b, q}, {r, q, c}, {p, q, r}};
    for (int t = 0; t < 4; t++) {
      double o[3], u[3], v[3];
      for (int d = 0; d < 3; d++) {
        o[d] = point[d] - x[parts[t][0]][d];
        u[d] = x[parts[t][1]][d] - x[parts[t][0]][d], v[d] = x[parts[t][2]][d] - x[parts[t][0]][d];
      }
      least = fmin(least, to_triangle(o, u, v));
    }
  }
  return sqrt(least);
}

/* Finds the place of a point in a curved tet; returns 0 if the tet's map, continued outside, does not reach the
 * point. */
static int place_in_curved(const flesh_locator *l, int t, const double point[3], flesh_place *place)
{
  double x[10][3], size = 0;
  place_nodes(l, t, x);
  for (int a = 0; a < 10; a++)
    for (int d = 0; d < 3; d++) size = fmax(size, fmax(fabs(x[a][d]), fabs(point[d])));
  if (!weigh_curved(x, point, size, place->weights)) return 0;
  place->distance = distance_to_curved(x, point, place->weights);
  return 1;
}

static double least_weight(const double w[4])
{
  return fmin(fmin(w[0], w[1]), fmin(w[2], w[3]));
}

/* Replaces *best by tet `t` if that is better. */
static void consider(const flesh_locator *l, int t, const double point[3], flesh_place *best)
{
  flesh_place found = {.tet = t};
  weigh(l, t, point, found.weights);
  if (!l->curved[t]) found.distance = distance_to(l, t, point, found.weights);
  else if (!place_in_curved(l, t, point, &found)) return;
  if (found.distance > best->distance + l->tie) return;
  int better = found.distance < best->distance - l->tie || best->tet < 0;
  if (!better) {
    double mine = least_weight(found.weights), other = least_weight(best->weights);
    better = mine > other || (mine == other && t < best->tet);
    /* Equal tets keep the least of their distances for later comparisons. */
    if (better) found.distance = fmin(found.distance, best->distance);
    else best->distance = fmin(found.distance, best->distance);
  }
  if (better) *best = found;
}

/* Returns the distance of the point from the node's box. */
static double box_distance(const tree_node *node, const double point[3])
{
  double sum = 0;
  for (int d = 0; d < 3; d++) {
    double out = fmax(fmax(node->low[d] - point[d], point[d] - node->high[d]), 0);
    sum += out * out;
  }
  return sqrt(sum);
}

void flesh_locator_find(const flesh_locator *l, const double point[3], int hint,
                        flesh_place *place)
{
  struct {
    int node;
    double distance;
  } stack[64]; /* 32 levels hold any number of tets, as the tree is split in halves */
  int top = 0;
  *place = (flesh_place){.tet = -1, .distance = INFINITY};
  if (hint >= 0) consider(l, hint, point, place);
  stack[top].node = 0;
  stack[top++].distance = box_distance(&l->nodes[0], point);
  while (top) {
    top--;
    const tree_node *node = &l->nodes[stack[top].node];
    if (stack[top].distance > place->distance + l->tie) continue;
    if (node->count) {
      for (int k = 0; k < node->count; k++)
        if (l->order[node->first + k] != hint) consider(l, l->order[node->first + k], point, place);
      continue;
    }
    int child[2] = {(int)(node - l->nodes) + 1, node->second};
    double d[2] = {box_distance(&l->nodes[child[0]], point),
                   box_distance(&l->nodes[child[1]], point)};
    int near = d[1] < d[0];
    for (int k = 0; k < 2; k++) { /* the nearer child is on top */
      int c = k ? near : !near;
      stack[top].node = child[c];
      stack[top++].distance = d[c];
    }
  }
}
