/* pressure_curved.c: a pressure on the curved faces of ten-node tets: r_k = p times the integral of N_k over the normals
 * of the deformed area, exactly.
 *
 * With y = x - c, the volume between a point c and the surface is W = sum of t_abc det(y_a, y_b, y_c), and that
 * integral is dW/dx_k + sum of e_kab y_a x y_b, of which the second is a third of that of N_k y x dy along the rim,
 * where there is one. As on flat triangles (pressure.c), what the rim adds is expanded about the lagged state without
 * the antisymmetric part of its derivative.
 *
 * All goes pair by pair of nodes k < l: with G = sum of t_klc y_c and h = sum of (e_klb - e_lkb)/2 y_b at the lagged
 * state, W is a third of the sum of G.(y_k x y_l), dW/dx_k half of that of y_l x G, and the Jacobian's block is minus
 * the skew matrix of G + h. */
#include "effect/pressure_curved.h"

#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "effect/amplitude.h"
#include "effect/effect.h"
#include "effect/environment.h"
#include "effect/face_shares.h"
#include "math/mat3.h"
#include "mesh/mesh.h"

/* What of a sum of terms that are of the size of 1 is rounding. */
static const double rounding = 1e-12;

typedef flesh_curved_wing wing;
typedef flesh_curved_rim rim_term;
typedef flesh_curved_pressure pressure;

static const flesh_cells *pressure_cells(const flesh_effect *effect)
{
  const pressure *self = effect->data;
  return &self->pairs;
}

static double pressure_at(const pressure *self, const flesh_point *point)
{
  return point->load * self->pressure * flesh_amplitude_at(&self->amplitude, point->t);
}

/* c at the lagged state, which a part of the body does not know by itself. */
static void middle(const pressure *self, const flesh_point *point, double c[3])
{
  const double *x = point->lagged.x;
  for (int i = 0; i < 3; i++) c[i] = flesh_environment_of(point)->sums ? flesh_environment_of(point)->sums[i] / flesh_environment_of(point)->sums[3] : 0;
  for (int k = 0; k < self->node_count && !flesh_environment_of(point)->sums; k++)
    for (int i = 0; i < 3; i++) c[i] += x[3 * (size_t)self->nodes[k] + i] / self->node_count;
}

/* The two nodes of a pair at y, G there and h at the lagged state. */
typedef struct at_pair {
  const int *node;
  double y[2][3], G[3], h[3];
} at_pair;

static void find_pair(const pressure *self, int k, const double *x, const double *x_lag, const double c[3], at_pair *p)
{
  p->node = self->pairs.nodes + 2 * (size_t)k;
  for (int i = 0; i < 3; i++) {
    p->G[i] = p->h[i] = 0;
    for (int a = 0; a < 2; a++) p->y[a][i] = x[3 * (size_t)p->node[a] + i] - c[i];
    for (int w = self->first[k]; w < self->first[k + 1]; w++) {
      const wing *wing = &self->wings[w];
      p->G[i] += wing->now * (x[3 * (size_t)wing->node + i] - c[i]);
      p->h[i] += wing->lagged * (x_lag[3 * (size_t)wing->node + i] - c[i]);
    }
  }
}

static void move_of(const flesh_point *point, int node, double d[3])
{
  for (int i = 0; i < 3; i++) d[i] = point->x[3 * (size_t)node + i] - point->lagged.x[3 * (size_t)node + i];
}

/* e y_a x y_b at the lagged state. */
static void rim_at(const rim_term *t, const double *x_lag, const double c[3], double f[3])
{
  double y[2][3];
  for (int i = 0; i < 3; i++) {
    y[0][i] = x_lag[3 * (size_t)t->a + i] - c[i];
    y[1][i] = x_lag[3 * (size_t)t->b + i] - c[i];
  }
  flesh_vec3_cross(y[0], y[1], f);
  for (int i = 0; i < 3; i++) f[i] *= t->e;
}

static int pressure_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const pressure *self = effect->data;
  double p = pressure_at(self, point), c[3], f[3];
  if (p == 0) return FLESH_OK;
  middle(self, point, c);
  for (int k = 0; k < self->pairs.count; k++) {
    at_pair at;
    find_pair(self, k, point->x, point->lagged.x, c, &at);
    for (int a = 0; a < 2; a++) {
      const double sign = a ? -1 : 1;
      double d[3];
      flesh_vec3_cross(at.y[1 - a], at.G, f);
      for (int i = 0; i < 3; i++) r[3 * (size_t)at.node[a] + i] += sign * p / 2 * f[i];
      move_of(point, at.node[1 - a], d);
      flesh_vec3_cross(at.h, d, f);
      for (int i = 0; i < 3; i++) r[3 * (size_t)at.node[a] + i] -= sign * p * f[i];
    }
  }
  for (int k = 0; k < self->rim_count; k++) {
    rim_at(&self->rim[k], point->lagged.x, c, f);
    for (int i = 0; i < 3; i++) r[3 * (size_t)self->rim[k].k + i] += p * f[i];
  }
  return FLESH_OK;
}

/* As for edges of flat triangles: [[0,B],[B^T,0]] with the skew matrix B of s has the eigenvalues +-|s| and the absolute
 * value diag(|s| (1 - s s^T/s.s)), half the sum with which is its positive part. */
static int pressure_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                             flesh_block_matrix *K, const int *slots)
{
  const pressure *self = effect->data;
  double p = shift->x * pressure_at(self, point), c[3];
  if (p == 0) return FLESH_OK;
  const double size = shift->filter == FLESH_FILTER_NONE ? 0 : shift->filter == FLESH_FILTER_CLAMP ? 0.5 : 1;
  middle(self, point, c);
  for (int k = 0; k < self->pairs.count; k++, slots += 3) {
    at_pair at;
    double s[3];
    find_pair(self, k, point->x, point->lagged.x, c, &at);
    for (int i = 0; i < 3; i++) s[i] = -p * (at.G[i] + at.h[i]);
    const double length = sqrt(flesh_vec3_dot(s, s));
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

/* W and what the rim adds to the potential of a unit pressure; the size of their terms is added to *size. */
static double potential_of(const pressure *self, const flesh_point *point, double *size)
{
  double c[3], f[3], value = 0;
  middle(self, point, c);
  for (int k = 0; k < self->pairs.count; k++) {
    at_pair at;
    double d[2][3];
    find_pair(self, k, point->x, point->lagged.x, c, &at);
    flesh_vec3_cross(at.y[0], at.y[1], f);
    for (int a = 0; a < 2; a++) move_of(point, at.node[a], d[a]);
    const double volume = flesh_vec3_dot(at.G, f) / 3;
    flesh_vec3_cross(at.h, d[1], f);
    const double rim = -flesh_vec3_dot(d[0], f);
    value += volume + rim;
    *size += fabs(volume) + fabs(rim);
  }
  for (int k = 0; k < self->rim_count; k++) {
    double d[3];
    rim_at(&self->rim[k], point->lagged.x, c, f);
    move_of(point, self->rim[k].k, d);
    value += flesh_vec3_dot(f, d);
    *size += fabs(flesh_vec3_dot(f, d));
  }
  return value;
}

static int pressure_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                              double *phi, double *magnitude)
{
  const pressure *self = effect->data;
  double p = pressure_at(self, point), size = 0;
  if (shift->x == 0 || p == 0) return FLESH_OK;
  *phi += p * (potential_of(self, point, &size) - self->volume) / shift->x;
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
  return sizeof *self + (size_t)self->pairs.count * 3 * sizeof(int) + (size_t)self->wing_count * sizeof *self->wings +
         (size_t)self->rim_count * sizeof *self->rim + (size_t)self->node_count * sizeof(int) +
         (size_t)self->ties.count * 3 * sizeof(int) +
         (size_t)self->amplitude.curve.count * sizeof *self->amplitude.curve.keyframes;
}

void flesh_curved_pressure_destroy(void *data)
{
  pressure *self = data;
  if (!self) return;
  flesh_cells_clear(&self->pairs);
  flesh_cells_clear(&self->ties);
  free(self->first);
  free(self->wings);
  free(self->rim);
  free(self->nodes);
  flesh_amplitude_clear(&self->amplitude);
  free(self);
}

static const flesh_effect_operations closed_operations = {
    .name = "pressure",
    .role = FLESH_ROLE_LOAD,
    .cells = pressure_cells,
    .residual = pressure_residual,
    .jacobian = pressure_jacobian,
    .potential = pressure_potential,
    .energy = pressure_energy,
    .destroy = flesh_curved_pressure_destroy,
    .time = &(const flesh_effect_time){.next_event = pressure_next_event},
    .figures = &(const flesh_effect_figures){.memory = pressure_memory},
    .ranks = &flesh_curved_pressure_ranks,
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
    .destroy = flesh_curved_pressure_destroy,
    .time = &(const flesh_effect_time){.next_event = pressure_next_event},
    .figures = &(const flesh_effect_figures){.memory = pressure_memory},
    .ranks = &flesh_curved_pressure_ranks,
};

static int by_pair(const void *a, const void *b)
{
  const wing *p = a, *q = b;
  for (int i = 0; i < 2; i++)
    if (p->pair[i] != q->pair[i]) return p->pair[i] < q->pair[i] ? -1 : 1;
  return (p->node > q->node) - (p->node < q->node);
}

static int by_end(const void *a, const void *b)
{
  const rim_term *p = a, *q = b;
  if (p->k != q->k) return p->k < q->k ? -1 : 1;
  if (p->a != q->a) return p->a < q->a ? -1 : 1;
  return (p->b > q->b) - (p->b < q->b);
}

/* A part of G_kl (lagged 0) or h_kl: both change their sign with the order of k and l. */
static void add_wing(pressure *self, int k, int l, int node, double weight, int lagged)
{
  const double signed_weight = k < l ? weight : -weight;
  self->wings[self->wing_count++] = (wing){{k < l ? k : l, k < l ? l : k},
                                           node,
                                           lagged ? 0 : signed_weight,
                                           lagged ? signed_weight : 0};
}

/* Adds up terms of the same nodes and drops those that come to nothing. */
static void merge_rim(pressure *self)
{
  int kept = 0;
  qsort(self->rim, (size_t)self->rim_count, sizeof *self->rim, by_end);
  for (int i = 0, end; i < self->rim_count; i = end) {
    rim_term sum = self->rim[i];
    for (end = i + 1; end < self->rim_count && !by_end(&self->rim[end], &sum); end++) sum.e += self->rim[end].e;
    if (fabs(sum.e) > rounding) self->rim[kept++] = sum;
  }
  self->rim_count = kept;
}

static void merge_wings(pressure *self)
{
  int kept = 0;
  qsort(self->wings, (size_t)self->wing_count, sizeof *self->wings, by_pair);
  for (int i = 0, end; i < self->wing_count; i = end) {
    wing sum = self->wings[i];
    for (end = i + 1; end < self->wing_count && !by_pair(&self->wings[end], &sum); end++) {
      sum.now += self->wings[end].now;
      sum.lagged += self->wings[end].lagged;
    }
    if (fabs(sum.now) + fabs(sum.lagged) > rounding) self->wings[kept++] = sum;
  }
  self->wing_count = kept;
}

static void take_rim(pressure *self, int count, const flesh_face_quarter *quarters,
                     const double rim[FLESH_FACE_KINDS][6][FLESH_FACE_PAIRS])
{
  for (int q = 0; q < count; q++)
    for (int k = 0; k < 6; k++)
      for (int p = 0; p < FLESH_FACE_PAIRS; p++) {
        const int *node = quarters[q].node, a = node[flesh_face_pair[p][0]], b = node[flesh_face_pair[p][1]];
        const double e = rim[quarters[q].quarter][k][p];
        if (fabs(e) > rounding)
          self->rim[self->rim_count++] = (rim_term){node[k], a < b ? a : b, a < b ? b : a, a < b ? e : -e};
      }
  merge_rim(self);
}

static void take_wings(pressure *self, int count, const flesh_face_quarter *quarters,
                       const double volume[FLESH_FACE_KINDS][FLESH_FACE_TRIPLES])
{
  for (int q = 0; q < count; q++)
    for (int t = 0; t < FLESH_FACE_TRIPLES; t++) {
      const signed char *at = flesh_face_triple[t];
      const int a = quarters[q].node[at[0]], b = quarters[q].node[at[1]], c = quarters[q].node[at[2]];
      const double w = volume[quarters[q].quarter][t];
      if (fabs(w) <= rounding) continue;
      add_wing(self, a, b, c, w, 0);
      add_wing(self, b, c, a, w, 0);
      add_wing(self, c, a, b, w, 0);
    }
  for (int i = 0; i < self->rim_count; i++) {
    const rim_term *t = &self->rim[i];
    if (t->k != t->a) add_wing(self, t->k, t->a, t->b, t->e / 2, 1);
    if (t->k != t->b) add_wing(self, t->k, t->b, t->a, -t->e / 2, 1);
  }
  merge_wings(self);
}

/* The pairs, and the nodes whose mean is c: of the rim, or of all. */
static int take_pairs(pressure *self)
{
  int *nodes = malloc(((size_t)self->wing_count * 2 + 1) * sizeof *nodes), count = 0;
  self->pairs = (flesh_cells){.nodes_per_cell = 2, .nodes = nodes};
  self->first = malloc(((size_t)self->wing_count + 1) * sizeof *self->first);
  self->nodes = malloc(((size_t)self->wing_count * 2 + (size_t)self->rim_count + 1) * sizeof *self->nodes);
  if (!nodes || !self->first || !self->nodes)
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the pairs of %d nodes", self->wing_count);
  for (int w = 0; w < self->wing_count; w++) {
    const int *pair = self->wings[w].pair;
    if (count && nodes[2 * count - 2] == pair[0] && nodes[2 * count - 1] == pair[1]) continue;
    self->first[count++] = w;
    nodes[2 * count - 2] = pair[0], nodes[2 * count - 1] = pair[1];
  }
  self->first[count] = self->wing_count;
  self->pairs.count = count;
  for (int i = 0; i < self->rim_count; i++) self->nodes[self->node_count++] = self->rim[i].k;
  for (int i = 0; i < 2 * count && !self->rim_count; i++) self->nodes[self->node_count++] = nodes[i];
  return FLESH_OK;
}

/* What one rank computes, and needs all nodes of. */
static int take_ties(pressure *self)
{
  const int count = self->wing_count + self->rim_count;
  int *nodes = malloc((3 * (size_t)count + 1) * sizeof *nodes), *at = nodes;
  if (!nodes) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the pairs of %d nodes", self->wing_count);
  for (const wing *w = self->wings; w < self->wings + self->wing_count; w++, at += 3)
    at[0] = w->pair[0], at[1] = w->pair[1], at[2] = w->node;
  for (const rim_term *t = self->rim; t < self->rim + self->rim_count; t++, at += 3)
    at[0] = t->k, at[1] = t->a, at[2] = t->b;
  self->ties = (flesh_cells){.count = count, .nodes_per_cell = 3, .nodes = nodes};
  return FLESH_OK;
}

static int take_faces(pressure *self, const flesh_mesh *mesh, int count, const int *triangles)
{
  double volume[FLESH_FACE_KINDS][FLESH_FACE_TRIPLES], rim[FLESH_FACE_KINDS][6][FLESH_FACE_PAIRS];
  flesh_face_quarter *quarters = malloc((size_t)count * sizeof *quarters);
  const size_t rims = (size_t)count * 6 * FLESH_FACE_PAIRS;
  self->rim = malloc(rims * sizeof *self->rim);
  int status = quarters && self->rim ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for %d triangles", count);
  if (!status) status = flesh_face_quarters(mesh, count, triangles, quarters);
  if (!status) {
    for (int q = 0; q < FLESH_FACE_KINDS; q++) flesh_face_forms(q, volume[q], rim[q]);
    take_rim(self, count, quarters, (const double(*)[6][FLESH_FACE_PAIRS])rim);
    const size_t most = (size_t)count * 3 * FLESH_FACE_TRIPLES + 2 * (size_t)self->rim_count;
    self->wings = malloc((most + 1) * sizeof *self->wings);
    if (!self->wings) status = flesh_fail(FLESH_ERR_MEMORY, "no memory for %d triangles", count);
  }
  if (!status) take_wings(self, count, quarters, (const double(*)[FLESH_FACE_TRIPLES])volume);
  free(quarters);
  if (!status) status = take_pairs(self);
  return status ? status : take_ties(self);
}

int flesh_pressure_curved(const flesh_body *body, int count, const int *triangles, double value,
                          const flesh_amplitude *amplitude, flesh_effect **effect)
{
  if (body->mesh->split)
    return flesh_fail(FLESH_ERR_ARGUMENT, "on the faces of ten-node tets it needs the whole body, of which each rank has a "
                                          "part alone, as the mesh is split; leave it out, or give a mesh that is not "
                                          "split");
  pressure *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a pressure");
  self->pressure = value;
  int status = take_faces(self, body->mesh, count, triangles);
  if (!status) status = flesh_amplitude_take(amplitude, &self->amplitude);
  if (status) {
    flesh_curved_pressure_destroy(self);
    return status;
  }
  if (self->rim_count) return flesh_effect_create(&open_operations, body->mesh, self, effect);
  const double *X = flesh_mesh_positions(body->mesh);
  const flesh_point rest = flesh_point_at(0, X, NULL, NULL);
  double size = 0;
  self->volume = potential_of(self, &rest, &size);
  return flesh_effect_create(&closed_operations, body->mesh, self, effect);
}
