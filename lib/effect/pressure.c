/* pressure.c: a pressure on the deformed surface (a follower load): -p times the area normal of each triangle, a third
 * to each node.
 *
 * With y = x - c, the volume W = sum of y_0.(y_1 x y_2)/6 between a point c and the surface has as its gradient just
 * these thirds, but for edges a -> b on the rim of an open surface, where (y_a x y_b)/6 at either end is lacking. So
 * r = p dW/dx, of which everything has exact derivatives and a surface without a rim nothing else, plus the rim's part.
 * That has no potential (Sewell 1967): it is expanded about the lagged state, without the antisymmetric part of its
 * derivative. What is left out is of the size of an edge; statics repeat a solve until it no longer changes. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/amplitude.h"
#include "effect/effect.h"
#include "effect/environment.h"
#include "effect/pressure_curved.h"
#include "effect/rank_share.h"
#include "math/mat3.h"
#include "mesh/mesh.h"

/* Of an edge the far nodes of the triangles that go along it from its lower to its higher node, and back; -1 on
 * the rim. */
typedef struct wings {
  int up, down;
} wings;

typedef struct pressure {
  int triangle_count;
  int *triangles;    /* [3*triangle_count] wound outwards */
  flesh_cells edges; /* the Jacobian's cells; one is there more than once where more than two triangles meet */
  wings *wings;      /* [edges.count] */
  int rim_count;
  int *rim;          /* [2*rim_count] edges as their triangles go round */
  double pressure;   /* Pa */
  double volume;     /* W at rest, where there is no rim */
  /* Of a rank's part of a closed surface, c, the same for all: thirds of area normals are the sum of what the ranks
   * have. */
  int has_centre;
  double centre[3];
  const double *X; /* of a part: rest positions, borrowed */
  flesh_amplitude_copy amplitude;
} pressure;

static const flesh_cells *pressure_cells(const flesh_effect *effect)
{
  const pressure *self = effect->data;
  return &self->edges;
}

static double pressure_at(const pressure *self, const flesh_point *point)
{
  return point->load * self->pressure * flesh_amplitude_at(&self->amplitude, point->t);
}

/* The mean of the rim's nodes, or of all. */
static void middle(const pressure *self, const double *x, double c[3])
{
  if (self->has_centre) {
    memcpy(c, self->centre, sizeof self->centre);
    return;
  }
  int count = self->rim_count ? 2 * self->rim_count : 3 * self->triangle_count;
  const int *nodes = self->rim_count ? self->rim : self->triangles;
  c[0] = c[1] = c[2] = 0;
  for (int k = 0; k < count; k++)
    for (int i = 0; i < 3; i++) c[i] += x[3 * nodes[k] + i] / count;
}

/* c at the lagged state: a part knows few of the rim's nodes, or none. */
static void lagged_middle(const pressure *self, const flesh_point *point, double c[3])
{
  if (!flesh_environment_of(point)->sums) middle(self, point->lagged.x, c);
  for (int i = 0; flesh_environment_of(point)->sums && i < 3; i++) c[i] = flesh_environment_of(point)->sums[i] / flesh_environment_of(point)->sums[3];
}

static inline void from(const double *x, const double c[3], int node, double y[3])
{
  for (int i = 0; i < 3; i++) y[i] = x[3 * node + i] - c[i];
}

/* Six times what an edge of the rim adds at its ends, for a unit pressure: y_0 x y_1 at the lagged state, and with the
 * moves d from there and the edge's middle m, m x d_1 and -m x d_0. */
typedef struct rim_force {
  const int *node;
  double lagged[3], change[2][3], move[2][3];
} rim_force;

static void rim_at(const pressure *self, int k, const flesh_point *point, const double c[3], rim_force *f)
{
  double y[2][3], m[3], back[3];
  f->node = self->rim + 2 * (size_t)k;
  for (int a = 0; a < 2; a++) {
    from(point->lagged.x, c, f->node[a], y[a]);
    for (int i = 0; i < 3; i++) f->move[a][i] = point->x[3 * f->node[a] + i] - point->lagged.x[3 * f->node[a] + i];
  }
  for (int i = 0; i < 3; i++) m[i] = (y[0][i] + y[1][i]) / 2;
  flesh_vec3_cross(y[0], y[1], f->lagged);
  flesh_vec3_cross(m, f->move[1], f->change[0]);
  flesh_vec3_cross(m, f->move[0], back);
  for (int i = 0; i < 3; i++) f->change[1][i] = -back[i];
}

static int pressure_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const pressure *self = effect->data;
  double p = pressure_at(self, point) / 6, c[3], y[3][3], n[3];
  if (p == 0) return FLESH_OK;
  lagged_middle(self, point, c);
  for (int k = 0; k < self->triangle_count; k++) {
    const int *node = self->triangles + 3 * (size_t)k;
    for (int a = 0; a < 3; a++) from(point->x, c, node[a], y[a]);
    for (int a = 0; a < 3; a++) {
      flesh_vec3_cross(y[(a + 1) % 3], y[(a + 2) % 3], n);
      for (int i = 0; i < 3; i++) r[3 * node[a] + i] += p * n[i];
    }
  }
  for (int k = 0; k < self->rim_count; k++) {
    rim_force f;
    rim_at(self, k, point, c, &f);
    for (int a = 0; a < 2; a++)
      for (int i = 0; i < 3; i++) r[3 * f.node[a] + i] += p * (f.lagged[i] + f.change[a][i]);
  }
  return FLESH_OK;
}

/* Where a wing is; on the rim the edge's lagged middle stands for the one that is not there. */
static void wing_at(const pressure *self, int edge, int wing, const flesh_point *point, double y[3])
{
  const int *node = self->edges.nodes + 2 * (size_t)edge;
  for (int i = 0; i < 3; i++)
    y[i] = wing >= 0 ? point->x[3 * wing + i]
                     : (point->lagged.x[3 * node[0] + i] + point->lagged.x[3 * node[1] + i]) / 2;
}

/* Edge by edge, because an edge's block is the skew matrix of the small difference of two wings, d2W/dx_a dx_b =
 * -[x_up - x_down]/6; diagonal blocks there are none. With s that difference, [[0,B],[B^T,0]] has the eigenvalues +-|s|
 * and the absolute value diag(|s| (1 - s s^T/s.s)), half the sum with which is its positive part. */
static int pressure_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                             flesh_block_matrix *K, const int *slots)
{
  const pressure *self = effect->data;
  double p = shift->x * pressure_at(self, point) / 6;
  if (p == 0) return FLESH_OK;
  const double size = shift->filter == FLESH_FILTER_NONE ? 0 : shift->filter == FLESH_FILTER_CLAMP ? 0.5 : 1;
  for (int k = 0; k < self->edges.count; k++, slots += 3) {
    double y[2][3], s[3], length;
    wing_at(self, k, self->wings[k].up, point, y[0]);
    wing_at(self, k, self->wings[k].down, point, y[1]);
    for (int i = 0; i < 3; i++) s[i] = p * (y[1][i] - y[0][i]);
    length = sqrt(flesh_vec3_dot(s, s));
    if (size < 1) {
      double *B = K->values + 9 * (size_t)slots[1], part = 1 - size;
      B[1] -= part * s[2];
      B[2] += part * s[1];
      B[3] += part * s[2];
      B[5] -= part * s[0];
      B[6] -= part * s[1];
      B[7] += part * s[0];
    }
    for (int end = 0; size > 0 && length > 0 && end < 2; end++) {
      double *D = K->values + 9 * (size_t)slots[2 * end];
      for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) D[3 * i + j] += size * ((i == j) * length - s[i] * s[j] / length);
    }
  }
  return FLESH_OK;
}

/* W between c and the surface at x; adds the size of its terms to *size. */
static double volume_of(const pressure *self, const double *x, const double c[3], double *size)
{
  double volume = 0, y[3][3], n[3];
  for (int k = 0; k < self->triangle_count; k++) {
    for (int a = 0; a < 3; a++) from(x, c, self->triangles[3 * (size_t)k + a], y[a]);
    flesh_vec3_cross(y[1], y[2], n);
    double term = flesh_vec3_dot(y[0], n) / 6;
    volume += term;
    *size += fabs(term);
  }
  return volume;
}

/* Of a rank's part of a surface without a rim; with one there is neither c nor W. */
static void set_centre(pressure *self, int is_closed, const double centre[3])
{
  double size = 0;
  self->has_centre = is_closed;
  memcpy(self->centre, centre, sizeof self->centre);
  self->volume = is_closed ? volume_of(self, self->X, centre, &size) : 0;
}

static int pressure_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                              double *phi, double *magnitude)
{
  const pressure *self = effect->data;
  double p = pressure_at(self, point), c[3], size = 0;
  if (shift->x == 0 || p == 0) return FLESH_OK;
  lagged_middle(self, point, c);
  double value = volume_of(self, point->x, c, &size) - self->volume;
  for (int k = 0; k < self->rim_count; k++) {
    rim_force f;
    rim_at(self, k, point, c, &f);
    double first = flesh_vec3_dot(f.lagged, f.move[0]), second = flesh_vec3_dot(f.lagged, f.move[1]),
           both = flesh_vec3_dot(f.change[0], f.move[0]);
    value += (first + second + both) / 6;
    size += (fabs(first) + fabs(second) + fabs(both)) / 6;
  }
  *phi += p * value / shift->x;
  *magnitude += fabs(p) * (size + fabs(self->volume)) / shift->x;
  return FLESH_OK;
}

static int pressure_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  double magnitude = 0;
  *energy = 0;
  return pressure_potential(effect, point, &(flesh_shift){.x = 1}, energy, &magnitude);
}

static double pressure_next_event(const flesh_effect *effect, double t)
{
  const pressure *self = effect->data;
  return flesh_amplitude_next_event(&self->amplitude, t);
}

static size_t pressure_memory(const flesh_effect *effect)
{
  const pressure *self = effect->data;
  /* Rooms are made for every side of a triangle. */
  return sizeof *self + (size_t)self->triangle_count * 3 * (5 * sizeof(int) + sizeof *self->wings) +
         (size_t)self->amplitude.curve.count * sizeof *self->amplitude.curve.keyframes;
}

static void pressure_destroy(void *data)
{
  pressure *self = data;
  if (!self) return;
  flesh_cells_clear(&self->edges);
  free(self->wings);
  free(self->triangles);
  free(self->rim);
  flesh_amplitude_clear(&self->amplitude);
  free(self);
}

/* A side of a triangle. */
typedef struct side {
  int low, high, upwards, wing;
} side;

static int compare_sides(const void *a, const void *b)
{
  const side *p = a, *q = b;
  int low = (p->low > q->low) - (p->low < q->low), high = (p->high > q->high) - (p->high < q->high);
  return low ? low : high ? high : q->upwards - p->upwards;
}

/* Pairs the sides that go along an edge with those that come back; what is left is the rim. */
static int find_edges(pressure *self)
{
  int count = 3 * self->triangle_count, *nodes = malloc(((size_t)count * 2 + 1) * sizeof *nodes);
  side *sides = malloc(((size_t)count + 1) * sizeof *sides);
  self->edges = (flesh_cells){.count = 0, .nodes_per_cell = 2, .nodes = nodes};
  self->wings = malloc(((size_t)count + 1) * sizeof *self->wings);
  self->rim = malloc(((size_t)count * 2 + 1) * sizeof *self->rim);
  if (!sides || !nodes || !self->wings || !self->rim) {
    free(sides);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the edges of %d triangles", self->triangle_count);
  }
  for (int k = 0; k < count; k++) {
    const int *triangle = self->triangles + k - k % 3;
    int a = triangle[k % 3], b = triangle[(k + 1) % 3];
    sides[k] = (side){a < b ? a : b, a < b ? b : a, a < b, triangle[(k + 2) % 3]};
  }
  qsort(sides, (size_t)count, sizeof *sides, compare_sides);
  for (int k = 0, end; k < count; k = end) {
    int up = k, down = k;
    const int low = sides[k].low, high = sides[k].high;
    for (end = k; end < count && sides[end].low == low && sides[end].high == high; end++) down += sides[end].upwards;
    const int ups = down;
    for (; up < ups || down < end; up++, down++) {
      int e = self->edges.count++, has_up = up < ups, has_down = down < end;
      nodes[2 * e] = low;
      nodes[2 * e + 1] = high;
      self->wings[e] = (wings){has_up ? sides[up].wing : -1, has_down ? sides[down].wing : -1};
      if (has_up && has_down) continue;
      self->rim[2 * self->rim_count] = has_up ? low : high;
      self->rim[2 * self->rim_count++ + 1] = has_up ? high : low;
    }
  }
  free(sides);
  return FLESH_OK;
}

static int take_triangles(pressure *self, const flesh_mesh *mesh, int count, const int *triangles)
{
  int total = flesh_mesh_node_count(mesh);
  self->triangle_count = count;
  self->triangles = malloc(((size_t)count * 3 + 1) * sizeof *self->triangles);
  if (!self->triangles) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d triangles", count);
  for (int k = 0; k < 3 * count; k++) {
    int next = triangles[k % 3 == 2 ? k - 2 : k + 1];
    if (triangles[k] < 0 || triangles[k] >= total)
      return flesh_fail(FLESH_ERR_ARGUMENT, "triangle %d has node %d; the mesh has the nodes 0 to %d", k / 3,
                        triangles[k], total - 1);
    if (triangles[k] == next)
      return flesh_fail(FLESH_ERR_ARGUMENT, "triangle %d has node %d twice", k / 3, next);
    self->triangles[k] = triangles[k];
  }
  return FLESH_OK;
}

/* The sum of the rim's nodes at the lagged state, and their number. */
static void pressure_sum(const flesh_effect *effect, const flesh_point *point, double *sums)
{
  const pressure *self = effect->data;
  for (int k = 0; k < 2 * self->rim_count; k++)
    for (int i = 0; i < 3; i++) sums[i] += point->lagged.x[3 * (size_t)self->rim[k] + (size_t)i];
  sums[3] = 2 * self->rim_count;
}

/* The triangles of the rank's tets; whether the whole's have a rim, and c, are settled once all ranks have theirs. */
static int pressure_restrict(const flesh_effect *whole, const flesh_rank_part *part, const flesh_body *body,
                             flesh_effect **restricted)
{
  const pressure *from = whole->data;
  int *kept = NULL, *local = NULL, found = 0;
  pressure *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a pressure");
  self->pressure = from->pressure;
  self->X = flesh_mesh_positions(body->mesh);
  int status = flesh_amplitude_copy_of(&from->amplitude, &self->amplitude);
  if (!status) {
    status = flesh_rank_share_faces(part, from->triangle_count, from->triangles, &found, &kept, &local);
    if (!status) status = take_triangles(self, body->mesh, found, local);
    if (!status) status = find_edges(self);
    /* An edge between two ranks is no rim: each has one of the wings, and the edge's middle in place of the other, which
     * is the same on both, so that the sum has the difference of the wings. */
    if (!status) status = flesh_rank_share_edges(part, from->rim_count, from->rim, &self->rim_count, self->rim);
    flesh_free(kept);
    flesh_free(local);
  }
  if (status) {
    pressure_destroy(self);
    return status;
  }
  set_centre(self, from->rim_count == 0, from->centre);
  return flesh_effect_create(whole->operations, body->mesh, self, restricted);
}

/* The rest positions of the triangles' corners, their number; whether some have a rim. */
static void pressure_count(const flesh_effect *restricted, flesh_rank_numbers *numbers)
{
  const pressure *self = restricted->data;
  for (int k = 0; k < 3 * self->triangle_count; k++)
    for (int i = 0; i < 3; i++) numbers->sums[i] += self->X[3 * (size_t)self->triangles[k] + (size_t)i];
  numbers->sums[3] = 3 * self->triangle_count;
  numbers->largest[0] = self->rim_count;
}

static void pressure_take(flesh_effect *restricted, const flesh_rank_numbers *numbers);

static const flesh_effect_operations closed_operations = {
    .name = "pressure",
    .role = FLESH_ROLE_LOAD,
    .cells = pressure_cells,
    .residual = pressure_residual,
    .jacobian = pressure_jacobian,
    .potential = pressure_potential,
    .energy = pressure_energy,
    .destroy = pressure_destroy,
    .time = &(const flesh_effect_time){.next_event = pressure_next_event},
    .figures = &(const flesh_effect_figures){.memory = pressure_memory},
    .ranks = &(const flesh_effect_ranks){.restrict_to_part = pressure_restrict, .count = pressure_count,
                                         .take = pressure_take},
};

/* A surface with a rim has no energy. */
static const flesh_effect_operations open_operations = {
    .name = "pressure",
    .role = FLESH_ROLE_LOAD,
    .traits = FLESH_IS_FOLLOWER_LOAD,
    .cells = pressure_cells,
    .residual = pressure_residual,
    .jacobian = pressure_jacobian,
    .potential = pressure_potential,
    .destroy = pressure_destroy,
    .time = &(const flesh_effect_time){.next_event = pressure_next_event},
    .figures = &(const flesh_effect_figures){.memory = pressure_memory},
    .ranks = &(const flesh_effect_ranks){.restrict_to_part = pressure_restrict, .sum_count = 4, .sum = pressure_sum,
                                         .count = pressure_count, .take = pressure_take},
};

static void pressure_take(flesh_effect *restricted, const flesh_rank_numbers *numbers)
{
  const double *sums = numbers->sums, middle[3] = {sums[0] / sums[3], sums[1] / sums[3], sums[2] / sums[3]};
  const int is_open = numbers->largest[0] > 0;
  set_centre(restricted->data, !is_open, middle);
  restricted->operations = is_open ? &open_operations : &closed_operations;
}

int flesh_effect_pressure(const flesh_body *body, int count, const int *triangles, double value,
                          const flesh_amplitude *amplitude, flesh_effect **effect)
{
  FLESH_NEED({effect, "effect"});
  *effect = NULL;
  FLESH_NEED({body, "body"}, {triangles, "triangles"});
  if (!(fabs(value) < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "pressure is %g Pa; it must be finite", value);
  if (count < 1 && !body->mesh->split)
    return flesh_fail(FLESH_ERR_ARGUMENT, "a pressure needs a triangle that it acts on");
  if (flesh_mesh_order(body->mesh) == 2)
    return flesh_pressure_curved(body, count, triangles, value, amplitude, effect);
  pressure *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a pressure");
  self->pressure = value;
  int status = take_triangles(self, body->mesh, count, triangles);
  if (!status) status = find_edges(self);
  if (!status) status = flesh_amplitude_take(amplitude, &self->amplitude);
  if (status) {
    pressure_destroy(self);
    return status;
  }
  if (self->rim_count) return flesh_effect_create(&open_operations, body->mesh, self, effect);
  double c[3], size = 0;
  middle(self, flesh_mesh_positions(body->mesh), c);
  memcpy(self->centre, c, sizeof c);
  self->volume = volume_of(self, flesh_mesh_positions(body->mesh), c, &size);
  return flesh_effect_create(&closed_operations, body->mesh, self, effect);
}
