/* pressure.c: a pressure on the deformed surface (a follower load), flat or curved: r_k is p times the exact integral
 * of the shape function N_k over the normals of the deformed area.
 *
 * That integral is dW/dx_k + sum of e_kab y_a x y_b, with the volume W between a point c and the surface and, if the
 * surface is open, a contribution of its rim (pressure_pairs.h). So a closed surface has the potential p W and exact
 * derivatives. The rim's contribution has no potential (Sewell 1967): it is expanded about the lagged state, without
 * the antisymmetric part of its derivative. The omitted part is of the size of an edge; statics repeat a solve until it
 * no longer changes.
 *
 * All sums run over pairs of nodes k < l: W is a third of the sum of G.(y_k x y_l), dW/dx_k half of that of y_l x G,
 * and the Jacobian's block is minus the skew matrix of G + h. */
#include <math.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/amplitude.h"
#include "effect/effect.h"
#include "effect/environment.h"
#include "effect/pressure_pairs.h"
#include "effect/private.h"
#include "effect/rank_share.h"
#include "element/body.h"
#include "math/mat3.h"
#include "mesh/mesh.h"

typedef struct pressure {
  flesh_pressure_pairs pairs;
  int is_open;     /* whether the surface has a rim, possibly on another rank */
  double pressure; /* Pa */
  double volume;   /* W at rest for a closed surface; 0 for an open one */
  const double *X; /* rest positions, borrowed */
  flesh_amplitude_copy amplitude;
} pressure;

static const flesh_cells *pressure_cells(const flesh_effect *effect)
{
  const pressure *self = effect->data;
  return &self->pairs.cells;
}

static double pressure_at(const pressure *self, const flesh_point *point)
{
  return point->load * self->pressure * flesh_amplitude_at(&self->amplitude, point->t);
}

/* Adds the nodes whose mean is c, those of the rim or of all pairs, and their number. */
static void add_nodes(const pressure *self, const double *x, double sums[4])
{
  const int count = self->is_open ? self->pairs.rim_count : 2 * self->pairs.cells.count;
  for (int k = 0; k < count; k++) {
    const double *at = x + 3 * (size_t)(self->is_open ? self->pairs.rim[k].k : self->pairs.cells.nodes[k]);
    for (int i = 0; i < 3; i++) sums[i] += at[i];
  }
  sums[3] += count;
}

static void mean(const double sums[4], double c[3])
{
  for (int i = 0; i < 3; i++) c[i] = sums[3] > 0 ? sums[i] / sums[3] : 0;
}

/* Computes c at the lagged state. */
static void middle(const pressure *self, const flesh_point *point, double c[3])
{
  const double *of_ranks = flesh_environment_of(point)->sums;
  double own[4] = {0};
  if (!of_ranks) add_nodes(self, point->lagged.x, own);
  mean(of_ranks ? of_ranks : own, c);
}

static inline void relative(const double *x, const double c[3], int node, double y[3])
{
  for (int i = 0; i < 3; i++) y[i] = x[3 * (size_t)node + i] - c[i];
}

/* The two nodes of a pair relative to c, and G. */
typedef struct at_pair {
  const int *node;
  double y[2][3], G[3];
} at_pair;

static inline void find_pair(const pressure *self, int k, const double *x, const double c[3], at_pair *p)
{
  double y[3], G[3] = {0};
  p->node = self->pairs.cells.nodes + 2 * (size_t)k;
  for (int a = 0; a < 2; a++) relative(x, c, p->node[a], p->y[a]);
  for (int w = self->pairs.first[k]; w < self->pairs.first[k + 1]; w++) {
    relative(x, c, self->pairs.wings[w].node, y);
    for (int i = 0; i < 3; i++) G[i] += self->pairs.wings[w].now * y[i];
  }
  for (int i = 0; i < 3; i++) p->G[i] = G[i];
}

/* Forces of a rim term per unit pressure: `lagged` is e y_a x y_b at its node k in the lagged state. `change` is the
 * symmetric part of the change by the displacements `move` from there: half of e (y_a x d_b - y_b x d_a) at k, of e y_b
 * x d_k at a and of -e y_a x d_k at b. */
typedef struct rim_force {
  int node[3];
  double move[3][3], lagged[3], change[3][3];
} rim_force;

static void find_rim(const flesh_pressure_rim *t, const flesh_point *point, const double c[3], rim_force *f)
{
  double y[3][3], by[3];
  *f = (rim_force){.node = {t->k, t->a, t->b}};
  for (int n = 0; n < 3; n++) {
    relative(point->lagged.x, c, f->node[n], y[n]);
    relative(point->x, point->lagged.x + 3 * (size_t)f->node[n], f->node[n], f->move[n]);
  }
  flesh_vec3_cross(y[1], y[2], f->lagged);
  for (int i = 0; i < 3; i++) f->lagged[i] *= t->e;
  for (int n = 1; n < 3; n++) {
    const double half = n == 1 ? t->e / 2 : -t->e / 2;
    flesh_vec3_cross(y[3 - n], f->move[n], by);
    for (int i = 0; i < 3; i++) f->change[0][i] -= half * by[i];
    flesh_vec3_cross(y[3 - n], f->move[0], by);
    for (int i = 0; i < 3; i++) f->change[n][i] = half * by[i];
  }
}

/* Adds p times the forces to r, unless that is NULL; adds the potential per unit pressure, W plus the rim's
 * contribution, to sums[0], and the magnitudes of its terms to sums[1]. */
static void add_all(const pressure *self, const flesh_point *point, const double c[3], double p, double *r,
                    double sums[2])
{
  double f[2][3];
  for (int k = 0; k < self->pairs.cells.count; k++) {
    at_pair at;
    find_pair(self, k, point->x, c, &at);
    flesh_vec3_cross(at.y[1], at.G, f[0]);
    const double volume = flesh_vec3_dot(at.y[0], f[0]) / 3;
    sums[0] += volume;
    sums[1] += fabs(volume);
    if (!r) continue;
    flesh_vec3_cross(at.G, at.y[0], f[1]);
    for (int a = 0; a < 2; a++)
      for (int i = 0; i < 3; i++) r[3 * (size_t)at.node[a] + i] += p / 2 * f[a][i];
  }
  for (int k = 0; k < self->pairs.rim_count; k++) {
    rim_force rim;
    find_rim(&self->pairs.rim[k], point, c, &rim);
    const double first = flesh_vec3_dot(rim.lagged, rim.move[0]), second = flesh_vec3_dot(rim.change[0], rim.move[0]);
    sums[0] += first + second;
    sums[1] += fabs(first) + fabs(second);
    for (int i = 0; r && i < 3; i++) r[3 * (size_t)rim.node[0] + i] += p * rim.lagged[i];
    for (int d = 0; r && d < 9; d++) r[3 * (size_t)rim.node[d / 3] + d % 3] += p * rim.change[d / 3][d % 3];
  }
}

static int pressure_evaluate(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *r,
                             double *phi, double *magnitude)
{
  const pressure *self = effect->data;
  double p = pressure_at(self, point), c[3], sums[2] = {0};
  if (p == 0 || (!r && shift->x == 0)) return FLESH_OK;
  middle(self, point, c);
  add_all(self, point, c, p, r, sums);
  if (!phi || shift->x == 0) return FLESH_OK;
  *phi += p * (sums[0] - self->volume) / shift->x;
  *magnitude += fabs(p) * (sums[1] + fabs(self->volume)) / shift->x;
  return FLESH_OK;
}

static int pressure_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  return pressure_evaluate(effect, point, &(flesh_shift){0}, r, NULL, NULL);
}

static int pressure_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                              double *phi, double *magnitude)
{
  return pressure_evaluate(effect, point, shift, NULL, phi, magnitude);
}

/* Adds a block B = [s]x and its transpose for each pair, filtered. [[0,B],[B^T,0]] has the eigenvalues +-|s| and the
 * absolute value diag(|s| (1 - s s^T/s.s)); half the sum of both is its positive part. */
static int pressure_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                             flesh_block_matrix *K, const int *slots)
{
  const pressure *self = effect->data;
  double p = shift->x * pressure_at(self, point), c[3];
  if (p == 0) return FLESH_OK;
  const double size = shift->filter == FLESH_FILTER_NONE ? 0 : shift->filter == FLESH_FILTER_CLAMP ? 0.5 : 1;
  middle(self, point, c);
  for (int k = 0; k < self->pairs.cells.count; k++, slots += 3) {
    at_pair at;
    double s[3], y[3];
    find_pair(self, k, point->x, c, &at);
    for (int i = 0; i < 3; i++) s[i] = -p * at.G[i];
    for (int w = self->pairs.first[k]; w < self->pairs.first[k + 1]; w++) {
      const flesh_pressure_wing *wing = &self->pairs.wings[w];
      relative(point->lagged.x, c, wing->node, y);
      for (int i = 0; i < 3; i++) s[i] -= p * wing->lagged * y[i];
    }
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

/* Computes the change of a pair's forces per unit pressure if c moves by dc. */
static void move_pair(const pressure *self, int k, const at_pair *at, const double dc[3], double f[2][3])
{
  double sum = 0, change[3], by[3];
  for (int w = self->pairs.first[k]; w < self->pairs.first[k + 1]; w++) sum += self->pairs.wings[w].now;
  for (int a = 0; a < 2; a++) {
    for (int i = 0; i < 3; i++) change[i] = at->G[i] - sum * at->y[1 - a][i];
    flesh_vec3_cross(change, dc, by);
    for (int i = 0; i < 3; i++) f[a][i] = a ? -by[i] : by[i];
  }
}

/* Computes the change of a rim term's forces per unit pressure if its lagged nodes and c move. */
static void move_rim(const flesh_pressure_rim *t, const flesh_point *point, const double c[3], const double moves[12],
                     double f[3][3])
{
  double y[3][3], dy[3][3], by[4][3];
  rim_force rim;
  find_rim(t, point, c, &rim);
  for (int n = 0; n < 3; n++) {
    relative(point->lagged.x, c, rim.node[n], y[n]);
    for (int i = 0; i < 3; i++) dy[n][i] = moves[3 * n + i] - moves[9 + i];
  }
  flesh_vec3_cross(dy[1], y[2], by[0]);
  flesh_vec3_cross(y[1], dy[2], by[1]);
  for (int i = 0; i < 3; i++) f[0][i] = t->e * (by[0][i] + by[1][i]);
  for (int n = 1; n < 3; n++) {
    const double half = n == 1 ? t->e / 2 : -t->e / 2;
    flesh_vec3_cross(dy[3 - n], rim.move[n], by[0]);
    flesh_vec3_cross(moves + 3 * n, y[3 - n], by[1]);
    flesh_vec3_cross(dy[3 - n], rim.move[0], by[2]);
    flesh_vec3_cross(moves, y[3 - n], by[3]);
    for (int i = 0; i < 3; i++) f[0][i] -= half * (by[0][i] + by[1][i]), f[n][i] = half * (by[2][i] + by[3][i]);
  }
}

/* A product with the derivative by the lagged nodes and by c; the member c holds the displacement of c or, transposed,
 * the sum for it. */
typedef struct by_lagged {
  int transposed;
  const double *w;
  double *y, c[3];
} by_lagged;

/* Adds the derivative D of the degree of freedom `row` by `column`, of the lagged state or of c. */
static inline void add_entry(by_lagged *s, double D, size_t row, size_t column, int of_c)
{
  if (s->transposed) *(of_c ? s->c + column : s->y + column) += D * s->w[row];
  else s->y[row] += D * (of_c ? s->c : s->w)[column];
}

static inline size_t dof_of(const int *node, int d) { return 3 * (size_t)node[d / 3] + (size_t)(d % 3); }

static void pressure_multiply(const flesh_effect *effect, const flesh_point *point, flesh_argument argument, int transposed,
                              double scale, const double *w, double *y)
{
  const pressure *self = effect->data;
  const double p = scale * pressure_at(self, point);
  double c[3], sums[4] = {0}, f[3][3];
  by_lagged s = {transposed, w, y, {0}};
  if (argument != FLESH_LAGGED_X || !self->is_open || p == 0) return;
  middle(self, point, c);
  add_nodes(self, w, sums);
  if (!transposed) mean(sums, s.c);
  for (int k = 0; k < self->pairs.cells.count; k++) {
    at_pair at;
    find_pair(self, k, point->x, c, &at);
    for (size_t i = 0; i < 3; i++) {
      move_pair(self, k, &at, (const double[3]){i == 0, i == 1, i == 2}, f);
      for (int d = 0; d < 6; d++) add_entry(&s, p / 2 * f[d / 3][d % 3], dof_of(at.node, d), i, 1);
    }
  }
  for (int k = 0; k < self->pairs.rim_count; k++) {
    const flesh_pressure_rim *t = &self->pairs.rim[k];
    const int node[3] = {t->k, t->a, t->b};
    for (int j = 0; j < 12; j++) {
      double moves[12] = {0};
      moves[j] = 1;
      move_rim(t, point, c, moves, f);
      for (int d = 0; d < 9; d++)
        add_entry(&s, p * f[d / 3][d % 3], dof_of(node, d), j < 9 ? dof_of(node, j) : (size_t)(j - 9), j >= 9);
    }
  }
  for (int k = 0; k < self->pairs.rim_count && transposed; k++)
    for (int i = 0; i < 3; i++) y[3 * (size_t)self->pairs.rim[k].k + (size_t)i] += s.c[i] / sums[3];
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
  return sizeof *self + flesh_pressure_pairs_memory(&self->pairs) + flesh_amplitude_memory(&self->amplitude);
}

static void pressure_destroy(void *data)
{
  pressure *self = data;
  if (!self) return;
  flesh_pressure_pairs_clear(&self->pairs);
  flesh_amplitude_clear(&self->amplitude);
  flesh_free(self);
}

/* Creates the data, with `whole` and `part` as for flesh_pressure_pairs_create. Destroy *result also after an error. */
static int create(const flesh_mesh *mesh, int count, const int *triangles, double value, const pressure *whole,
                  const flesh_rank_part *part, pressure **result)
{
  pressure *self = *result = flesh_calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a pressure");
  self->pressure = value;
  self->X = flesh_mesh_positions(mesh);
  return flesh_pressure_pairs_create(mesh, count, triangles, whole ? &whole->pairs : NULL, part, &self->pairs);
}

static int pressure_restrict(const flesh_effect *whole, const flesh_rank_part *part, const flesh_body *body,
                             flesh_effect **restricted)
{
  const pressure *from = whole->data;
  int found, *kept, *local;
  pressure *self;
  int status = flesh_rank_share_faces(part, from->pairs.triangle_count, from->pairs.triangles, &found, &kept, &local);
  if (status) return status;
  status = create(body->mesh, found, local, from->pressure, from, part, &self);
  if (!status) status = flesh_amplitude_copy_of(&from->amplitude, &self->amplitude);
  flesh_free(kept);
  flesh_free(local);
  return flesh_effect_create_after(status, whole->operations, body->mesh, self, restricted);
}

static void pressure_sum(const flesh_effect *effect, const flesh_point *point, double *sums)
{
  add_nodes(effect->data, point->lagged.x, sums);
}

/* Provides the size of the rim and, for a closed surface, its middle. */
static void pressure_count(const flesh_effect *effect, flesh_rank_numbers *numbers)
{
  const pressure *self = effect->data;
  add_nodes(self, self->X, numbers->sums);
  numbers->largest[0] = self->pairs.rim_count;
}

static void pressure_take(flesh_effect *effect, const flesh_rank_numbers *numbers);

#define OPERATIONS(READS, ...)                                                                                         \
  {                                                                                                                    \
      .name = "pressure",                                                                                              \
      .role = FLESH_ROLE_LOAD,                                                                                         \
      .cells = pressure_cells,                                                                                         \
      .residual = pressure_residual,                                                                                   \
      .jacobian = pressure_jacobian,                                                                                   \
      .potential = pressure_potential,                                                                                 \
      .destroy = pressure_destroy,                                                                                     \
      .time = &(const flesh_effect_time){.next_event = pressure_next_event},                                           \
      .figures = &(const flesh_effect_figures){.memory = pressure_memory},                                             \
      .library = &(const flesh_effect_private){                                                                        \
          .evaluate = pressure_evaluate,                                                                               \
          .partials = &(const flesh_effect_partials){.multiply = pressure_multiply, .reads = READS},                   \
          .ranks = &(const flesh_effect_ranks){.restrict_to_part = pressure_restrict, .sum_count = 4,                  \
                                               .sum = pressure_sum, .count = pressure_count, .take = pressure_take}},  \
      __VA_ARGS__                                                                                                      \
  }
/* A surface with a rim has no energy. */
static const flesh_effect_operations closed_operations = OPERATIONS(0, .energy = pressure_energy),
                                     open_operations = OPERATIONS(1u << FLESH_LAGGED_X, .traits = FLESH_IS_FOLLOWER_LOAD);
#undef OPERATIONS

static void pressure_take(flesh_effect *effect, const flesh_rank_numbers *numbers)
{
  pressure *self = effect->data;
  const flesh_point rest = flesh_point_at(0, self->X, NULL, NULL);
  double c[3], sums[2] = {0};
  mean(numbers->sums, c);
  self->is_open = numbers->largest[0] > 0;
  if (!self->is_open) add_all(self, &rest, c, 0, NULL, sums);
  self->volume = sums[0];
  effect->operations = self->is_open ? &open_operations : &closed_operations;
}

int flesh_effect_pressure(const flesh_body *body, int count, const int *triangles, double value,
                          const flesh_amplitude *amplitude, flesh_effect **effect)
{
  FLESH_NEED_BODY({body, "body"}, {triangles, "triangles"});
  if (!(fabs(value) < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "pressure is %g Pa; it must be finite", value);
  if (count < 1 && !body->mesh->split)
    return flesh_fail(FLESH_ERR_ARGUMENT, "a pressure acts on nothing; it must be given at least one triangle");
  pressure *self;
  int status = create(body->mesh, count, triangles, value, NULL, NULL, &self);
  if (!status) status = flesh_amplitude_take(amplitude, &self->amplitude);
  if (status) {
    pressure_destroy(self);
    return status;
  }
  status = flesh_effect_create(&closed_operations, body->mesh, self, effect);
  if (status) return status;
  flesh_rank_numbers numbers = {0};
  pressure_count(*effect, &numbers);
  pressure_take(*effect, &numbers);
  return FLESH_OK;
}
