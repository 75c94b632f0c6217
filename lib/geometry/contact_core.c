/* contact_core.c: keeps the core of a spherical or capsule obstacle out of the body's faces. */
#include "geometry/contact_core.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "geometry/obstacle_bounds.h"
#include "geometry/obstacle_mesh.h"
#include "math/mat3.h"
#include "math/nearest.h"

/* A step ends when the distance is this fraction of the initial one. */
static const double nearest_fraction = 1e-2;
enum { ADVANCEMENTS = 200 };

static void sort_corners(int *corner)
{
  for (int i = 1; i < 3; i++)
    for (int j = i; j > 0 && corner[j] < corner[j - 1]; j--) {
      int swap = corner[j];
      corner[j] = corner[j - 1], corner[j - 1] = swap;
    }
}

/* Lists every node of the faces once. */
static int collect_nodes(int nodes, flesh_contact_core *core)
{
  char *seen = calloc((size_t)nodes + 1, 1);
  core->nodes = malloc(((size_t)nodes + 1) * sizeof *core->nodes);
  const int failed = !seen || !core->nodes;
  for (int k = 0; !failed && k < 3 * core->faces.count; k++) {
    const int node = core->faces.nodes[k];
    if (!seen[node]) core->nodes[core->node_count++] = node;
    seen[node] = 1;
  }
  free(seen);
  return failed ? flesh_fail(FLESH_ERR_MEMORY, "no memory for the contact of %d nodes", nodes) : FLESH_OK;
}

int flesh_contact_core_create(const flesh_mesh *mesh, const flesh_obstacle *obstacle, double weight,
                              double thickness, flesh_contact_core *core)
{
  *core = (flesh_contact_core){.thickness = thickness, .weight = weight};
  int points = flesh_obstacle_core(obstacle, &core->radius, NULL), faces;
  if (!points) return FLESH_OK;
  const int *surface = flesh_mesh_surface(mesh, &faces);
  int *nodes = malloc(3 * (size_t)faces * sizeof *nodes);
  core->centres = malloc(3 * (size_t)points * sizeof *core->centres);
  if (!nodes || !core->centres) {
    free(nodes);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the contact of %d faces", faces);
  }
  core->points = flesh_obstacle_core(obstacle, &core->radius, core->centres);
  memcpy(nodes, surface, 3 * (size_t)faces * sizeof *nodes);
  for (int t = 0; t < faces; t++) sort_corners(nodes + 3 * (size_t)t);
  core->faces = (flesh_cells){.count = faces, .nodes_per_cell = 3, .nodes = nodes};
  int status = collect_nodes(flesh_mesh_node_count(mesh), core);
  if (status) return status;
  return flesh_surface_weights(flesh_mesh_node_count(mesh), faces, nodes, &core->edge_weight,
                               &core->vertex_weight);
}

/* Copies face `face` of `whole` to index k with its nodes `from` in the new numbering, sorted to ascend. The weights of
 * its edges (each from its corner to the next) and vertices are permuted with them. */
static void place_face(const flesh_contact_core *whole, int face, const int from[3], flesh_contact_core *core, int k)
{
  int order[3] = {0, 1, 2};
  for (int i = 1; i < 3; i++)
    for (int j = i; j > 0 && from[order[j]] < from[order[j - 1]]; j--) {
      const int swap = order[j];
      order[j] = order[j - 1], order[j - 1] = swap;
    }
  for (int i = 0; i < 3; i++) {
    const int opposite = 3 - order[i] - order[(i + 1) % 3];
    ((int *)core->faces.nodes)[3 * (size_t)k + (size_t)i] = from[order[i]];
    core->vertex_weight[3 * (size_t)k + (size_t)i] = whole->vertex_weight[3 * (size_t)face + (size_t)order[i]];
    core->edge_weight[3 * (size_t)k + (size_t)i] = whole->edge_weight[3 * (size_t)face + (size_t)(opposite + 1) % 3];
  }
}

int flesh_contact_core_restrict(const flesh_contact_core *whole, int count, const int *kept, const int *corners,
                                const flesh_mesh *mesh, flesh_contact_core *core)
{
  const size_t faces = (size_t)count, points = (size_t)whole->points;
  *core = (flesh_contact_core){.points = whole->points, .radius = whole->radius, .thickness = whole->thickness,
                               .weight = whole->weight};
  core->centres = malloc(3 * points * sizeof *core->centres);
  core->faces = (flesh_cells){.count = count, .nodes_per_cell = 3, .nodes = malloc(3 * faces * sizeof(int))};
  core->edge_weight = malloc(3 * faces * sizeof *core->edge_weight);
  core->vertex_weight = malloc(3 * faces * sizeof *core->vertex_weight);
  if (!core->centres || !core->faces.nodes || !core->edge_weight || !core->vertex_weight)
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the contact of %d faces", count);
  memcpy(core->centres, whole->centres, 3 * points * sizeof *core->centres);
  for (int k = 0; k < count; k++) place_face(whole, kept[k], corners + 3 * (size_t)k, core, k);
  return collect_nodes(flesh_mesh_node_count(mesh), core);
}

void flesh_contact_core_clear(flesh_contact_core *core)
{
  free(core->centres);
  free(core->nodes);
  flesh_cells_clear(&core->faces);
  free(core->edge_weight);
  free(core->vertex_weight);
  *core = (flesh_contact_core){0};
}

/* A ball's centre with a face, edge or node of the body: the foot of the centre on it and its weights. */
typedef struct pair {
  int count, corner[3]; /* corners of the face with a non-zero weight */
  double weights[3], direction[3], to_centre;
} pair;

/* Returns the pair of p with the first `count` of the given corners of a face whose corners are at X. */
static pair pair_of(const double *const X[3], int count, const int *corners, const double p[3])
{
  const double *const places[3] = {X[corners[0]], X[corners[1]], X[corners[2]]};
  double weights[3] = {1, 0, 0};
  pair found = {0};
  if (count == 3) flesh_nearest_on_triangle(places, p, weights);
  if (count == 2) flesh_nearest_on_segment(places[0], places[1], p, weights);
  memcpy(found.direction, p, sizeof found.direction);
  for (int k = 0; k < count; k++) {
    if (weights[k] == 0) continue;
    found.corner[found.count] = corners[k];
    found.weights[found.count++] = weights[k];
    for (int c = 0; c < 3; c++) found.direction[c] -= weights[k] * places[k][c];
  }
  found.to_centre = sqrt(flesh_vec3_dot(found.direction, found.direction));
  for (int c = 0; c < 3; c++) found.direction[c] /= found.to_centre;
  return found;
}

/* Whether the box around the three corners is at least `reach` away from p. */
static int is_far(const double *const X[3], const double p[3], double reach)
{
  for (int c = 0; c < 3; c++) {
    const double a = X[0][c] - p[c], b = X[1][c] - p[c], d = X[2][c] - p[c];
    if ((a >= reach && b >= reach && d >= reach) || (-a >= reach && -b >= reach && -d >= reach)) return 1;
  }
  return 0;
}

/* A face, its three edges and its three vertices: number of corners, then the corners. */
static const int parts[7][4] = {{3, 0, 1, 2}, {2, 0, 1, 2}, {2, 1, 2, 0}, {2, 2, 0, 1},
                                {1, 0, 1, 2}, {1, 1, 2, 0}, {1, 2, 0, 1}};

static double share_of(const flesh_contact_core *core, int face, int part)
{
  return part == 0 ? 1 : part < 4 ? core->edge_weight[3 * face + part - 1]
                                  : core->vertex_weight[3 * face + part - 4];
}

static void corners_of(const flesh_contact_core *core, int face, const double *x, const double *X[3])
{
  for (int k = 0; k < 3; k++) X[k] = x + 3 * (size_t)core->faces.nodes[3 * face + k];
}

/* Calls visit(data, pair, corner positions of its face, weight of the barrier, face) for every pair within the
 * thickness. Stops at and returns the first status that is not FLESH_OK. */
static int for_pairs(const flesh_contact_core *core, const flesh_frame *frame, const double *x,
                     int (*visit)(void *data, const pair *found, const double *const X[3],
                                  double share, int face),
                     void *data)
{
  const double *X[3];
  int status = FLESH_OK;
  flesh_bounds bounds = {0};
  if (core->points) bounds = flesh_bounds_of(core->node_count, core->nodes, x);
  for (int point = 0; point < core->points; point++) {
    double p[3];
    flesh_frame_leave(frame, core->centres + 3 * point, p);
    if (flesh_bounds_are_far(&bounds, p, core->radius + core->thickness)) continue;
    for (int f = 0; f < core->faces.count; f++) {
      corners_of(core, f, x, X);
      if (is_far(X, p, core->radius + core->thickness)) continue;
      for (int part = 0; part < 7 && !status; part++) {
        double share = core->weight * share_of(core, f, part);
        if (share == 0) continue;
        const pair found = pair_of(X, parts[part][0], parts[part] + 1, p);
        if (found.to_centre - core->radius < core->thickness)
          status = visit(data, &found, X, share, f);
      }
      if (status) return status;
    }
  }
  return FLESH_OK;
}

/* Outputs of flesh_contact_core_add. */
typedef struct sums {
  const flesh_contact_core *core;
  double *energy, *r;
} sums;

static int add_force(void *data, const pair *found, const double *const X[3], double share,
                     int face)
{
  const sums *s = data;
  const double w = s->core->thickness, d = found->to_centre - s->core->radius;
  const int *nodes = s->core->faces.nodes + 3 * face;
  double value, first, second;
  (void)X;
  if (!(d > 0)) return FLESH_UNDEFINED;
  flesh_barrier_law(d / w, &value, &first, &second);
  if (s->energy) *s->energy += share * w * value;
  for (int a = 0; s->r && a < found->count; a++)
    for (int c = 0; c < 3; c++)
      s->r[3 * nodes[found->corner[a]] + c] -=
          share * first * found->weights[a] * found->direction[c];
  return FLESH_OK;
}

int flesh_contact_core_add(const flesh_contact_core *core, const flesh_frame *frame,
                           const double *x, double *energy, double *r)
{
  sums s = {core, energy, r};
  return for_pairs(core, frame, x, add_force, &s);
}

/* Arguments of flesh_contact_core_jacobian. */
typedef struct matrix {
  const flesh_contact_core *core;
  double scale;
  int filter;
  flesh_block_matrix *K;
  const int *slots; /* [6 * faces] */
} matrix;

/* Adds the second derivative of a pair's barrier times `share`. With e from the foot to the centre, tangents T_i from
 * the first corner to the others, and r_ia = (dw_a/ds_i) e - w_a T_i, the second derivative of |e|^2/2 is w_a w_b I -
 * r_ia (T.T)^-1_ij r_jb. With a filter, the negative semi-definite parts are left out. */
static int add_second(void *data, const pair *found, const double *const X[3], double share,
                      int face)
{
  static const int slot_of[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
  const matrix *m = data;
  const int *slots = m->slots + 6 * (size_t)face;
  const double radius = m->core->radius, w = m->core->thickness;
  double value, first, second, T[2][3], G[3] = {1, 0, 1}, rows[2][3][3];
  const int dimension = found->count - 1;
  const double *n = found->direction, rho = found->to_centre;
  if (!(rho > radius)) return FLESH_OK;
  flesh_barrier_law((rho - radius) / w, &value, &first, &second);
  for (int i = 0; i < dimension; i++)
    for (int c = 0; c < 3; c++) T[i][c] = X[found->corner[i + 1]][c] - X[found->corner[0]][c];
  if (dimension > 0) G[0] = flesh_vec3_dot(T[0], T[0]);
  if (dimension > 1) G[1] = flesh_vec3_dot(T[0], T[1]), G[2] = flesh_vec3_dot(T[1], T[1]);
  const double determinant = G[0] * G[2] - G[1] * G[1];
  const double inverse[2][2] = {{G[2] / determinant, -G[1] / determinant},
                                {-G[1] / determinant, G[0] / determinant}};
  for (int i = 0; i < dimension; i++)
    for (int a = 0; a < found->count; a++)
      for (int c = 0; c < 3; c++)
        rows[i][a][c] = ((a == i + 1) - (a == 0)) * rho * n[c] - found->weights[a] * T[i][c];
  const int push = !m->filter || share > 0, bend = !m->filter || share < 0;
  for (int a = 0; a < found->count; a++)
    for (int b = 0; b < found->count; b++) {
      const int row = found->corner[a], column = found->corner[b];
      if (row > column) continue; /* only the upper triangle: nodes of a face ascend */
      double *block = m->K->values + 9 * (size_t)slots[slot_of[row][column]];
      const double ww = found->weights[a] * found->weights[b];
      for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
          double sum = 0, turned = 0;
          for (int k = 0; k < dimension; k++)
            for (int l = 0; l < dimension; l++)
              turned += rows[k][a][i] * inverse[k][l] * rows[l][b][j];
          if (push) sum += second / w * ww * n[i] * n[j] - first / rho * turned;
          if (bend) sum += first / rho * ww * ((i == j) - n[i] * n[j]);
          block[3 * i + j] += m->scale * share * sum;
        }
    }
  return FLESH_OK;
}

void flesh_contact_core_jacobian(const flesh_contact_core *core, const flesh_frame *frame,
                                 const double *x, double scale, int filter, flesh_block_matrix *K,
                                 const int *slots)
{
  matrix m = {core, scale, filter, K, slots};
  for_pairs(core, frame, x, add_second, &m);
}

/* Advances by steps that are safe for any motion: the distance divided by the largest approach of any corner (additive
 * advancement; Li et al. 2021, "Codimensional Incremental Potential Contact", section 5). */
static double feasible_fraction(const double *const X0[3], const double *const X1[3], const double p0[3],
                          const double p1[3], double radius)
{
  static const int whole[3] = {0, 1, 2};
  double approach = 0, s = 0;
  for (int k = 0; k < 3; k++) {
    double square = 0;
    for (int c = 0; c < 3; c++) {
      double move = X1[k][c] - X0[k][c] - (p1[c] - p0[c]);
      square += move * move;
    }
    approach = flesh_max(square, approach);
  }
  approach = sqrt(approach);
  if (approach == 0 || is_far(X0, p0, radius + approach)) return 1;
  double least = 0;
  for (int step = 0; step < ADVANCEMENTS; step++) {
    double places[3][3], p[3];
    const double *X[3] = {places[0], places[1], places[2]};
    for (int c = 0; c < 3; c++) {
      p[c] = p0[c] + s * (p1[c] - p0[c]);
      for (int k = 0; k < 3; k++) places[k][c] = X0[k][c] + s * (X1[k][c] - X0[k][c]);
    }
    double d = pair_of(X, 3, whole, p).to_centre - radius;
    if (step == 0) least = nearest_fraction * d;
    if (!(d > least)) return s;
    s += (d - least / 2) / approach;
    if (s >= 1) return 1;
  }
  return s;
}

/* Returns the largest displacement of a node of the faces. */
static double largest_move(const flesh_contact_core *core, const double *x0, const double *x1)
{
  double largest = 0;
  for (int k = 0; k < core->node_count; k++) {
    const size_t i = 3 * (size_t)core->nodes[k];
    const double move[3] = {x1[i] - x0[i], x1[i + 1] - x0[i + 1], x1[i + 2] - x0[i + 2]};
    largest = flesh_max(flesh_vec3_dot(move, move), largest);
  }
  return sqrt(largest);
}

double flesh_contact_core_max_feasible_step(const flesh_contact_core *core, const flesh_frame *from,
                              const double *x0, const flesh_frame *to, const double *x1)
{
  const double move = core->points ? largest_move(core, x0, x1) : 0;
  double fraction = 1;
  const double *X0[3], *X1[3];
  flesh_bounds bounds = {0};
  if (core->points) bounds = flesh_bounds_of(core->node_count, core->nodes, x0);
  for (int point = 0; point < core->points; point++) {
    double p0[3], p1[3];
    flesh_frame_leave(from, core->centres + 3 * point, p0);
    flesh_frame_leave(to, core->centres + 3 * point, p1);
    const double e[3] = {p1[0] - p0[0], p1[1] - p0[1], p1[2] - p0[2]};
    const double reach = core->radius + move + sqrt(flesh_vec3_dot(e, e));
    if (flesh_bounds_are_far(&bounds, p0, reach)) continue;
    for (int f = 0; f < core->faces.count; f++) {
      corners_of(core, f, x0, X0);
      if (is_far(X0, p0, reach)) continue;
      corners_of(core, f, x1, X1);
      fraction = fmin(fraction, feasible_fraction(X0, X1, p0, p1, core->radius));
    }
  }
  return fraction;
}
