/* obstacle_mesh.c: a surface of triangles as an obstacle.
 *
 * The barrier is summed over triangles, minus inner edges once for each of their triangles but the first, plus vertices
 * so that each counts once in total (Li et al. 2023, "Convergent Incremental Potential Contact", section 3): above a
 * flat face all but one term cancel. Every edge and vertex is assigned to one of its triangles, so one tree of boxes
 * finds all. */
#include "geometry/obstacle_mesh.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/sort.h"
#include "geometry/box_tree.h"
#include "math/area.h"
#include "math/mat3.h"
#include "math/nearest.h"

struct flesh_obstacle_tree {
  int nodes, triangles;
  double *positions;    /* [3*nodes] */
  int *corners;         /* [3*triangles], in the tree's order */
  double *edge_weight;  /* [3*triangles] of the edge from corner k to k+1; 0 if another triangle carries it */
  double *vertex_weight; /* [3*triangles] of the vertex at corner k, likewise */
  double *planes;        /* [4*triangles] unit normal n, then n.y for the points y of the plane */
  flesh_box_tree *tree;  /* only its boxes are kept; primitives are triangles in the order of `corners` */
};

static const double *corner_of(const flesh_obstacle_tree *self, int triangle, int k)
{
  return self->positions + 3 * (size_t)self->corners[3 * triangle + k % 3];
}

static int compare_places(const void *a, const void *b)
{
  const double *p = *(const double *const *)a, *q = *(const double *const *)b;
  for (int c = 0; c < 3; c++)
    if (p[c] != q[c]) return p[c] < q[c] ? -1 : 1;
  return 0;
}

/* Copies the positions without duplicates; place[i] is the new number of node i. */
static int copy_nodes(flesh_obstacle_tree *self, int nodes, const double *positions, int *place)
{
  const double **sorted = malloc(((size_t)nodes + 1) * sizeof *sorted);
  self->positions = malloc(3 * ((size_t)nodes + 1) * sizeof *self->positions);
  if (!sorted || !self->positions) {
    free(sorted);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for an obstacle of %d nodes", nodes);
  }
  for (int i = 0; i < nodes; i++) sorted[i] = positions + 3 * (size_t)i;
  qsort(sorted, (size_t)nodes, sizeof *sorted, compare_places);
  for (int i = 0; i < nodes; i++) {
    if (i == 0 || compare_places(&sorted[i - 1], &sorted[i]))
      memcpy(self->positions + 3 * (size_t)self->nodes++, sorted[i], 3 * sizeof(double));
    place[(sorted[i] - positions) / 3] = self->nodes - 1;
  }
  free(sorted);
  return FLESH_OK;
}

/* Whether a triangle has an area that exceeds rounding. */
static int has_area(const double *a, const double *b, const double *c)
{
  double e[3], f[3], n[3];
  for (int k = 0; k < 3; k++) e[k] = b[k] - a[k], f[k] = c[k] - a[k];
  flesh_vec3_cross(e, f, n);
  double longest = fmax(flesh_vec3_dot(e, e), flesh_vec3_dot(f, f));
  return flesh_vec3_dot(n, n) > 1e-24 * longest * longest;
}

static int copy_triangles(flesh_obstacle_tree *self, int nodes, int triangles, const int *given,
                          const int *place)
{
  self->corners = malloc(3 * ((size_t)triangles + 1) * sizeof *self->corners);
  if (!self->corners)
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for an obstacle of %d triangles", triangles);
  for (int t = 0; t < triangles; t++) {
    int *corner = self->corners + 3 * (size_t)self->triangles;
    for (int k = 0; k < 3; k++) {
      int node = given[3 * (size_t)t + k];
      if (node < 0 || node >= nodes)
        return flesh_fail(FLESH_ERR_ARGUMENT,
                          "triangle %d of the obstacle has node %d; its nodes are 0 to %d", t, node,
                          nodes - 1);
      corner[k] = place[node];
    }
    self->triangles += has_area(corner_of(self, self->triangles, 0),
                                corner_of(self, self->triangles, 1),
                                corner_of(self, self->triangles, 2));
  }
  return self->triangles ? FLESH_OK
                         : flesh_fail(FLESH_ERR_ARGUMENT, "the obstacle has no triangle with area");
}

/* Builds the tree of boxes and puts the triangles into its order. */
static int grow_tree(flesh_obstacle_tree *self)
{
  int *given = self->corners;
  int status = flesh_box_tree_create(self->triangles, 3, given, NULL, self->positions, &self->tree);
  if (status) return status;
  self->corners = malloc(3 * (size_t)self->triangles * sizeof *self->corners);
  for (int t = 0; t < self->triangles && self->corners; t++)
    memcpy(self->corners + 3 * (size_t)t, given + 3 * (size_t)self->tree->order[t], 3 * sizeof *given);
  free(given);
  flesh_box_tree_keep_boxes(self->tree);
  return self->corners ? FLESH_OK
                       : flesh_fail(FLESH_ERR_MEMORY, "no memory for an obstacle of %d triangles", self->triangles);
}

static int make_planes(flesh_obstacle_tree *self)
{
  self->planes = malloc(4 * (size_t)self->triangles * sizeof *self->planes);
  if (!self->planes) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d triangles", self->triangles);
  for (int t = 0; t < self->triangles; t++) {
    const double *X = corner_of(self, t, 0), *Y = corner_of(self, t, 1), *Z = corner_of(self, t, 2);
    double *n = self->planes + 4 * (size_t)t;
    flesh_area_vector(X, Y, Z, n);
    const double length = sqrt(flesh_vec3_dot(n, n));
    for (int c = 0; c < 3; c++) n[c] /= length;
    n[3] = flesh_vec3_dot(n, X);
  }
  return FLESH_OK;
}

typedef struct side {
  int low, high, place; /* nodes, ascending; 3*triangle + corner */
} side;

int flesh_surface_weights(int nodes, int triangles, const int *corners, double **edge_weight,
                          double **vertex_weight)
{
  const int sides = 3 * triangles;
  side *sorted = malloc((size_t)sides * sizeof *sorted);
  double *of_node = calloc((size_t)nodes + 1, sizeof *of_node);
  *edge_weight = calloc((size_t)sides, sizeof **edge_weight);
  *vertex_weight = calloc((size_t)sides, sizeof **vertex_weight);
  int failed = !sorted || !of_node || !*edge_weight || !*vertex_weight;
  for (int k = 0; k < sides && !failed; k++) {
    int a = corners[k], b = corners[k % 3 == 2 ? k - 2 : k + 1];
    sorted[k] = (side){a < b ? a : b, a < b ? b : a, k};
    of_node[a] -= 1;
  }
  if (!failed) qsort(sorted, (size_t)sides, sizeof *sorted, flesh_compare_three_ints);
  for (int k = 0, next; k < sides && !failed; k = next) {
    for (next = k + 1; next < sides && sorted[next].low == sorted[k].low &&
                       sorted[next].high == sorted[k].high;)
      next++;
    const int again = next - k - 1; /* triangles of the edge beyond the first */
    (*edge_weight)[sorted[k].place] = -again;
    of_node[sorted[k].low] += again;
    of_node[sorted[k].high] += again;
  }
  for (int k = 0; k < sides && !failed; k++) {
    (*vertex_weight)[k] = 1 + of_node[corners[k]];
    of_node[corners[k]] = -1; /* further corners at this vertex get weight 0 */
  }
  free(sorted);
  free(of_node);
  return failed ? flesh_fail(FLESH_ERR_MEMORY, "no memory for a surface of %d triangles", triangles)
                : FLESH_OK;
}

int flesh_obstacle_tree_create(int nodes, const double *positions, int triangles,
                               const int *triangle_nodes, flesh_obstacle_tree **tree)
{
  *tree = NULL;
  if (nodes < 3 || triangles < 1)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the obstacle has %d triangles on %d nodes; it needs one at least",
                      triangles, nodes);
  for (int d = 0; d < 3 * nodes; d++)
    if (!(fabs(positions[d]) < INFINITY))
      return flesh_fail(FLESH_ERR_ARGUMENT, "node %d of the obstacle is not finite", d / 3);
  flesh_obstacle_tree *self = calloc(1, sizeof *self);
  int *place = malloc((size_t)nodes * sizeof *place);
  int status = self && place
                   ? FLESH_OK
                   : flesh_fail(FLESH_ERR_MEMORY, "no memory for an obstacle of %d nodes", nodes);
  if (!status) status = copy_nodes(self, nodes, positions, place);
  if (!status) status = copy_triangles(self, nodes, triangles, triangle_nodes, place);
  if (!status) status = grow_tree(self);
  if (!status) status = make_planes(self);
  if (!status)
    status = flesh_surface_weights(self->nodes, self->triangles, self->corners, &self->edge_weight,
                                   &self->vertex_weight);
  free(place);
  if (status) flesh_obstacle_tree_destroy(&self);
  *tree = self;
  return status;
}

void flesh_obstacle_tree_destroy(flesh_obstacle_tree **tree)
{
  if (!tree || !*tree) return;
  free((*tree)->positions);
  free((*tree)->corners);
  free((*tree)->edge_weight);
  free((*tree)->vertex_weight);
  free((*tree)->planes);
  flesh_box_tree_destroy(&(*tree)->tree);
  free(*tree);
  *tree = NULL;
}

void flesh_obstacle_tree_surface(const flesh_obstacle_tree *self, int *nodes,
                                 const double **positions, int *triangles, const int **corners)
{
  *nodes = self->nodes;
  *positions = self->positions;
  *triangles = self->triangles;
  *corners = self->corners;
}

static int is_far(const flesh_box_branch *bounds, const double y[3], double w)
{
  double square = 0;
  for (int c = 0; c < 3; c++) {
    double d = flesh_max(flesh_max(bounds->low[c] - y[c], y[c] - bounds->high[c]), 0);
    square += d * d;
  }
  return square >= w * w;
}

double flesh_obstacle_tree_clearance(const flesh_obstacle_tree *self, const double low[3], const double high[3], double reach)
{
  int stack[FLESH_BOX_TREE_DEPTH], height = 0;
  double most = reach * reach, least = INFINITY;
  for (stack[height++] = 0; height > 0 && least > 0;) {
    const flesh_box_branch *b = &self->tree->branches[stack[--height]];
    double square = 0;
    for (int c = 0; c < 3; c++) {
      const double d = flesh_max(b->low[c] - high[c], low[c] - b->high[c]);
      square += d > 0 ? d * d : 0 * d;
    }
    if (isnan(square)) return NAN;
    if (square > most) continue;
    if (!b->children) {
      least = most = square;
      continue;
    }
    stack[height++] = b->children + 1;
    stack[height++] = b->children;
  }
  return sqrt(least);
}

/* Whether the triangle's plane is at least w away from y. */
static int plane_is_far(const flesh_obstacle_tree *self, int t, const double y[3], double w)
{
  const double *n = self->planes + 4 * (size_t)t;
  return fabs(flesh_vec3_dot(n, y) - n[3]) >= w;
}

/* Adds the barrier of the feature that bears the foot with these weights of the corners: a triangle, edge or vertex by
 * the number of non-zero weights. */
static void add_at(const double *const X[3], int corners, const double *weights, const double y[3],
                   double w, double share, flesh_barrier *barrier)
{
  flesh_barrier_core near = {.flat = -1};
  double length = 0;
  int touched[3] = {0};
  for (int k = 0; k < corners; k++)
    if (weights[k] != 0) touched[++near.flat] = k;
  for (int c = 0; c < 3; c++) {
    near.direction[c] = y[c];
    for (int k = 0; k < corners; k++) near.direction[c] -= weights[k] * X[k][c];
    if (near.flat == 1) near.axis[c] = X[touched[1]][c] - X[touched[0]][c];
    length += near.axis[c] * near.axis[c];
  }
  for (int c = 0; c < 3 && near.flat == 1; c++) near.axis[c] /= sqrt(length);
  near.distance = sqrt(flesh_vec3_dot(near.direction, near.direction));
  for (int c = 0; c < 3; c++) near.direction[c] /= near.distance;
  flesh_barrier_add(barrier, w, share, &near);
}

static void add_triangle(const flesh_obstacle_tree *self, int t, const double y[3], double w,
                         flesh_barrier *barrier)
{
  if (plane_is_far(self, t, y, w)) return;
  const double *const X[3] = {corner_of(self, t, 0), corner_of(self, t, 1), corner_of(self, t, 2)};
  double weights[3];
  if (!(flesh_nearest_on_triangle(X, y, weights) < w * w)) return;
  add_at(X, 3, weights, y, w, 1, barrier);
  for (int k = 0; k < 3; k++) {
    const double *const ends[3] = {X[k], X[(k + 1) % 3], NULL};
    double edge = self->edge_weight[3 * t + k], vertex = self->vertex_weight[3 * t + k];
    if (edge != 0 && flesh_nearest_on_segment(ends[0], ends[1], y, weights) < w * w)
      add_at(ends, 2, weights, y, w, edge, barrier);
    if (vertex != 0) add_at(ends, 1, (const double[]){1}, y, w, vertex, barrier);
  }
}

void flesh_obstacle_tree_barrier(const flesh_obstacle_tree *self, const double y[3], double w,
                                 flesh_barrier *barrier)
{
  int stack[FLESH_BOX_TREE_DEPTH], height = 0;
  for (stack[height++] = 0; height > 0;) {
    const flesh_box_branch *b = &self->tree->branches[stack[--height]];
    if (is_far(b, y, w)) continue;
    if (!b->children) {
      for (int t = b->begin; t < b->end; t++) add_triangle(self, t, y, w, barrier);
      continue;
    }
    stack[height++] = b->children + 1;
    stack[height++] = b->children;
  }
}

/* Whether the first `fraction` of the step meets the box. `inverse` has the reciprocals of the step's components. */
static int meets(const flesh_box_branch *bounds, const double y0[3], const double inverse[3], double fraction)
{
  double enter = 0, leave = fraction;
  for (int c = 0; c < 3; c++) {
    if (fabs(inverse[c]) == INFINITY) { /* the component is 0 or nearly so */
      if (y0[c] < bounds->low[c] || y0[c] > bounds->high[c]) return 0;
      continue;
    }
    double near = (bounds->low[c] - y0[c]) * inverse[c], far = (bounds->high[c] - y0[c]) * inverse[c];
    if ((near < far ? near : far) > enter) enter = near < far ? near : far;
    if ((near < far ? far : near) < leave) leave = near < far ? far : near;
  }
  /* The tolerance keeps rounding from letting a step slip past a flat box. */
  return enter <= leave + 1e-12 * (1 + fabs(enter));
}

/* Returns the fraction of the step e at which it meets the triangle, enlarged against rounding, else 1 (Moller &
 * Trumbore 1997). */
static double fraction_to_triangle(const double *const X[3], const double y0[3], const double e[3])
{
  double u[3], v[3], d[3], p[3], q[3];
  const double slack = 1e-10;
  for (int c = 0; c < 3; c++)
    u[c] = X[1][c] - X[0][c], v[c] = X[2][c] - X[0][c], d[c] = y0[c] - X[0][c];
  flesh_vec3_cross(e, v, p);
  double determinant = flesh_vec3_dot(u, p);
  if (determinant == 0) return 1;
  flesh_vec3_cross(d, u, q);
  double a = flesh_vec3_dot(d, p) / determinant, b = flesh_vec3_dot(e, q) / determinant;
  double s = flesh_vec3_dot(v, q) / determinant;
  int through = a >= -slack && b >= -slack && a + b <= 1 + slack && s >= 0 && s <= 1;
  return through ? s : 1;
}

double flesh_obstacle_tree_max_feasible_step(const flesh_obstacle_tree *self, const double y0[3], const double y1[3])
{
  double fraction = 1, e[3] = {y1[0] - y0[0], y1[1] - y0[1], y1[2] - y0[2]};
  const double inverse[3] = {1 / e[0], 1 / e[1], 1 / e[2]};
  int stack[FLESH_BOX_TREE_DEPTH], height = 0;
  if (e[0] == 0 && e[1] == 0 && e[2] == 0) return 1;
  for (stack[height++] = 0; height > 0;) {
    const flesh_box_branch *b = &self->tree->branches[stack[--height]];
    if (!meets(b, y0, inverse, fraction)) continue;
    for (int t = b->begin; t < b->end && !b->children; t++) {
      const double *const X[3] = {corner_of(self, t, 0), corner_of(self, t, 1), corner_of(self, t, 2)};
      fraction = fmin(fraction, fraction_to_triangle(X, y0, e));
    }
    if (!b->children) continue;
    stack[height++] = b->children + 1;
    stack[height++] = b->children;
  }
  return fraction;
}

size_t flesh_obstacle_tree_memory(const flesh_obstacle_tree *self)
{
  return sizeof *self + 3 * (size_t)self->nodes * sizeof *self->positions +
         3 * (size_t)self->triangles * (sizeof *self->corners + sizeof *self->edge_weight + sizeof *self->vertex_weight) +
         4 * (size_t)self->triangles * sizeof *self->planes + flesh_box_tree_memory(self->tree);
}
