/* joint_spring.c: a spring between two points carried by groups of nodes: V = k/2 (|d| - L)^2, d = p_1 - p_2.
 *
 * With the weights c_a of carried_point.h, negative for the second group, d = sum of c_a x_a and sum of c_a = 0. The
 * force on node a is -c_a k (|d| - L) n, n = d/|d|. The forces sum to 0, and so does their torque, d x n. The Hessian
 * is c_a c_b H with H = k n n^T + k (1 - L/|d|)(I - n n^T). Its double eigenvalue across the spring, k (1 - L/|d|), is
 * negative if the spring is shorter than L. As c c^T is positive semi-definite, filtering H filters the whole
 * Hessian. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/carried_point.h"
#include "effect/effect.h"
#include "effect/rank_share.h"
#include "element/body.h"
#include "flesh/effects.h"
#include "flesh/ranks.h"
#include "math/mat3.h"

/* Least length, over L, in the curvature across the spring, which thus stays finite when the points meet. */
static const double nearest = 1e-8;

typedef struct joint_spring {
  int count;       /* number of nodes of both groups, without duplicates */
  int *nodes;      /* [count] ascending */
  double *weights; /* [count] c_a */
  double stiffness, length;
  flesh_cells cells; /* one cell of all nodes */
  flesh_carried_groups groups; /* set for a spring of length 0 whose points coincide; empty on a rank's part */
} joint_spring;

static size_t joint_spring_memory(const flesh_effect *effect)
{
  const joint_spring *self = effect->data;
  return sizeof *self + (size_t)self->count * (sizeof *self->nodes + sizeof *self->weights) +
         flesh_carried_groups_memory(&self->groups);
}

static void joint_spring_destroy(void *data)
{
  joint_spring *self = data;
  if (!self) return;
  flesh_free(self->nodes);
  flesh_free(self->weights);
  flesh_free(self->groups.nodes);
  flesh_free(self);
}

static const flesh_cells *joint_spring_cells(const flesh_effect *effect)
{
  const joint_spring *self = effect->data;
  return &self->cells;
}

/* Computes the direction n of d (0 if d is 0) and the sum *size of the magnitudes of its terms. Returns the length of
 * d, which is summed relative to the first node to limit rounding. */
static double measure(const joint_spring *self, const double *x, double n[3], double *size)
{
  const double *origin = x + 3 * (size_t)self->nodes[0];
  double d[3] = {0};
  *size = 0;
  for (int a = 1; a < self->count; a++) {
    const double *p = x + 3 * (size_t)self->nodes[a];
    for (int c = 0; c < 3; c++) {
      const double term = self->weights[a] * (p[c] - origin[c]);
      d[c] += term;
      *size += fabs(term);
    }
  }
  const double length = sqrt(flesh_vec3_dot(d, d));
  for (int c = 0; c < 3; c++) n[c] = length > 0 ? d[c] / length : 0;
  return length;
}

static int joint_spring_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const joint_spring *self = effect->data;
  double n[3], size;
  const double tension = self->stiffness * (measure(self, point->x, n, &size) - self->length);
  for (int a = 0; a < self->count; a++)
    for (int c = 0; c < 3; c++) r[3 * (size_t)self->nodes[a] + (size_t)c] += self->weights[a] * tension * n[c];
  return FLESH_OK;
}

/* Computes `factor` times the filtered 3 x 3 matrix H. */
static void hessian(const joint_spring *self, const double *x, flesh_eigenvalue_filter filter, double factor,
                    double H[9])
{
  double n[3], size;
  const double distance = measure(self, x, n, &size), L = self->length;
  double across = L > 0 ? 1 - L / fmax(distance, nearest * L) : 1;
  if (across < 0 && filter != FLESH_FILTER_NONE) across = filter == FLESH_FILTER_ABSOLUTE ? -across : 0;
  for (int k = 0; k < 9; k++)
    H[k] = factor * self->stiffness * ((k % 4 ? 0 : across) + (1 - across) * n[k / 3] * n[k % 3]);
}

static int joint_spring_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                                 flesh_block_matrix *K, const int *slots)
{
  const joint_spring *self = effect->data;
  double H[9];
  if (shift->x == 0) return FLESH_OK;
  hessian(self, point->x, shift->filter, shift->x, H);
  for (int a = 0; a < self->count; a++)
    for (int b = a; b < self->count; b++, slots++)
      for (int k = 0; k < 9; k++)
        K->values[9 * (size_t)*slots + (size_t)k] += self->weights[a] * self->weights[b] * H[k];
  return FLESH_OK;
}

static int joint_spring_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  const joint_spring *self = effect->data;
  double n[3], size;
  const double longer = measure(self, point->x, n, &size) - self->length;
  *energy = self->stiffness / 2 * longer * longer;
  return FLESH_OK;
}

static int joint_spring_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                                  double *phi, double *magnitude)
{
  const joint_spring *self = effect->data;
  double n[3], size;
  if (shift->x == 0) return FLESH_OK;
  const double longer = measure(self, point->x, n, &size) - self->length;
  const double energy = self->stiffness / 2 * longer * longer;
  *phi += energy / shift->x;
  /* Rounding of the terms changes |d| - L in proportion to their magnitudes. */
  *magnitude += (energy + self->stiffness * fabs(longer) * (size + self->length)) / shift->x;
  return FLESH_OK;
}

/* Sorts the nodes, and merges duplicates by summing their weights. */
static void sum_up(joint_spring *self)
{
  int kept = 0;
  for (int k = 0; k < self->count; k++) {
    const int node = self->nodes[k];
    const double weight = self->weights[k];
    int at = kept;
    while (at > 0 && self->nodes[at - 1] >= node) at--;
    if (at < kept && self->nodes[at] == node) {
      self->weights[at] += weight;
      continue;
    }
    for (int j = kept++; j > at; j--) self->nodes[j] = self->nodes[j - 1], self->weights[j] = self->weights[j - 1];
    self->nodes[at] = node;
    self->weights[at] = weight;
  }
  self->count = kept;
}

static int joint_spring_restrict(const flesh_effect *whole, const flesh_rank_part *part, const flesh_body *body,
                                 flesh_effect **restricted)
{
  const joint_spring *from = whole->data;
  const int here = flesh_rank_share_node(part, from->nodes[0]) >= 0;
  const size_t count = here ? (size_t)from->count : 0;
  joint_spring *self = flesh_calloc(1, sizeof *self);
  if (self) {
    *self = (joint_spring){.count = (int)count, .stiffness = here ? from->stiffness : 0, .length = from->length};
    self->nodes = flesh_calloc(count + 1, sizeof *self->nodes); /* node 0 without a weight if the spring belongs to
                                                                 * another rank */
    self->weights = flesh_calloc(count + 1, sizeof *self->weights);
  }
  if (!self || !self->nodes || !self->weights) {
    joint_spring_destroy(self);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for a spring of %d nodes", from->count);
  }
  for (size_t k = 0; k < count; k++) {
    self->nodes[k] = flesh_rank_part_find(part, from->nodes[k]);
    self->weights[k] = from->weights[k];
  }
  sum_up(self);
  self->cells = (flesh_cells){.count = here, .nodes_per_cell = here ? self->count : 1, .nodes = self->nodes};
  return flesh_effect_create(whole->operations, body->mesh, self, restricted);
}

static const flesh_cells *cells_of_ranks(const flesh_effect *whole, int *everywhere)
{
  (void)everywhere;
  return joint_spring_cells(whole);
}

static int count_bonds(const flesh_effect *effect)
{
  return ((const joint_spring *)effect->data)->groups.nodes != NULL;
}

static void get_bond(const flesh_effect *effect, int k, flesh_bond *bond)
{
  (void)k;
  flesh_carried_groups_bond(&((const joint_spring *)effect->data)->groups, bond);
}

static const flesh_effect_operations joint_spring_operations = {
    .name = "joint",
    .traits = FLESH_IS_PASSIVE,
    .cells = joint_spring_cells,
    .residual = joint_spring_residual,
    .jacobian = joint_spring_jacobian,
    .potential = joint_spring_potential,
    .energy = joint_spring_energy,
    .destroy = joint_spring_destroy,
    .figures = &(const flesh_effect_figures){.memory = joint_spring_memory},
    .library = &(const flesh_effect_private){
        .ranks = &(const flesh_effect_ranks){.restrict_to_part = joint_spring_restrict, .cells = cells_of_ranks},
        .bonds = &(const flesh_effect_bonds){.count = count_bonds, .get = get_bond}},
};

static int attach(joint_spring *self, const flesh_body *body, int first_count, const double first_point[3],
                  const double second_point[3])
{
  const int second_count = self->count - first_count;
  int status = flesh_carried_weights(body->mesh, first_count, self->nodes, NULL, first_point, 1, self->weights);
  if (!status)
    status = flesh_carried_weights(body->mesh, second_count, self->nodes + first_count, NULL, second_point, -1,
                                   self->weights + first_count);
  if (status) return status;
  sum_up(self);
  self->cells = (flesh_cells){.count = 1, .nodes_per_cell = self->count, .nodes = self->nodes};
  return FLESH_OK;
}

/* Checks *length, and replaces NaN by the distance of the points. */
static int check_length(const double first_point[3], const double second_point[3], double *length)
{
  double d[3];
  for (int c = 0; c < 3; c++) d[c] = first_point[c] - second_point[c];
  const double distance = sqrt(flesh_vec3_dot(d, d));
  if (isnan(*length)) *length = distance;
  if (!(*length >= 0 && *length < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "length is %g m; it must be finite and not negative", *length);
  if (*length > 0 && distance == 0)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "a spring of length %g m has no direction: both of its points are (%g, %g, %g) at rest; move one of "
                      "them, or give the length 0", *length, first_point[0], first_point[1], first_point[2]);
  return FLESH_OK;
}

int flesh_effect_joint_spring(const flesh_body *body, const flesh_carried_point *first,
                              const flesh_carried_point *second, double stiffness, double length, flesh_effect **effect)
{
  FLESH_NEED_BODY({body, "body"}, {first, "first"}, {second, "second"});
  const double *first_point = first->point, *second_point = second->point;
  const int *nodes[2] = {first->nodes.nodes, second->nodes.nodes}, first_count = first->nodes.count;
  FLESH_NEED({nodes[0], "first"}, {nodes[1], "second"});
  int status = flesh_carried_check_groups(body, first->nodes, second->nodes);
  if (!status) status = flesh_carried_check("first_point", first_point, stiffness);
  if (!status) status = flesh_carried_check("second_point", second_point, stiffness);
  if (!status) status = check_length(first_point, second_point, &length);
  if (status) return status;
  const size_t count = (size_t)first_count + (size_t)second->nodes.count;
  joint_spring *self = flesh_calloc(1, sizeof *self);
  if (self) {
    *self = (joint_spring){.count = (int)count, .stiffness = stiffness, .length = length};
    self->nodes = flesh_malloc(count * sizeof *self->nodes);
    self->weights = flesh_malloc(count * sizeof *self->weights);
  }
  if (!self || !self->nodes || !self->weights) {
    joint_spring_destroy(self);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for a spring of %d nodes", (int)count);
  }
  for (size_t k = 0; k < count; k++)
    self->nodes[k] = k < (size_t)first_count ? nodes[0][k] : nodes[1][k - (size_t)first_count];
  status = attach(self, body, first_count, first_point, second_point);
  if (!status && length == 0 && !memcmp(first_point, second_point, 3 * sizeof *first_point)) /* this spring holds its
                                                                                              * surfaces together as a
                                                                                              * ball joint does */
    status = flesh_carried_groups_copy(first->nodes, second->nodes, &self->groups);
  return flesh_effect_create_after(status, &joint_spring_operations, body->mesh, self, effect);
}
