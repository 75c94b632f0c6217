/* pressure_curved_ranks.c: what a rank computes of a pressure on curved faces: the pairs of nodes, and the terms of the rim,
 * whose first node it owns. */
#include <stdlib.h>

#include "base/error.h"
#include "effect/pressure_curved.h"
#include "effect/rank_share.h"
#include "flesh/ranks.h"

typedef flesh_curved_wing wing;
typedef flesh_curved_rim rim_term;
typedef flesh_curved_pressure pressure;

static int owns(const flesh_rank_part *part, int node) { return flesh_rank_share_node(part, node) >= 0; }

/* The pairs whose first node the rank owns, with all of their wings. */
static void keep_pairs(const pressure *whole, const flesh_rank_part *part, pressure *self, int *nodes)
{
  int count = 0;
  for (int k = 0; k < whole->pairs.count; k++) {
    if (!owns(part, whole->pairs.nodes[2 * k])) continue;
    /* Own nodes come first, so that pairs still ascend. */
    for (int a = 0; a < 2; a++) nodes[2 * count + a] = flesh_rank_part_find(part, whole->pairs.nodes[2 * k + a]);
    self->first[count++] = self->wing_count;
    for (int w = whole->first[k]; w < whole->first[k + 1]; w++) {
      wing *to = &self->wings[self->wing_count++];
      *to = whole->wings[w];
      to->node = flesh_rank_part_find(part, to->node);
    }
  }
  self->first[count] = self->wing_count;
  self->pairs = (flesh_cells){.count = count, .nodes_per_cell = 2, .nodes = nodes};
}

/* The same of the rim, and of the nodes in the middle of which c is. */
static void keep_rim(const pressure *whole, const flesh_rank_part *part, pressure *self)
{
  for (int i = 0; i < whole->rim_count; i++) {
    const rim_term *t = &whole->rim[i];
    if (owns(part, t->k))
      self->rim[self->rim_count++] = (rim_term){flesh_rank_part_find(part, t->k), flesh_rank_part_find(part, t->a),
                                                flesh_rank_part_find(part, t->b), t->e};
  }
  for (int i = 0; i < whole->node_count; i++)
    if (owns(part, whole->nodes[i])) self->nodes[self->node_count++] = flesh_rank_part_find(part, whole->nodes[i]);
}

static int pressure_restrict(const flesh_effect *whole, const flesh_rank_part *part, const flesh_body *body,
                             flesh_effect **restricted)
{
  const pressure *from = whole->data;
  const size_t pairs = (size_t)from->pairs.count + 1;
  pressure *self = calloc(1, sizeof *self);
  int *nodes = malloc(2 * pairs * sizeof *nodes);
  (void)body;
  if (self) {
    self->pressure = from->pressure;
    self->first = malloc(pairs * sizeof *self->first);
    self->wings = malloc(((size_t)from->wing_count + 1) * sizeof *self->wings);
    self->rim = malloc(((size_t)from->rim_count + 1) * sizeof *self->rim);
    self->nodes = malloc(((size_t)from->node_count + 1) * sizeof *self->nodes);
  }
  int status = self && nodes && self->first && self->wings && self->rim && self->nodes
                   ? flesh_amplitude_copy_of(&from->amplitude, &self->amplitude)
                   : flesh_fail(FLESH_ERR_MEMORY, "no memory for a pressure");
  if (status) {
    free(nodes);
    flesh_curved_pressure_destroy(self);
    return status;
  }
  keep_pairs(from, part, self, nodes);
  keep_rim(from, part, self);
  /* W at rest is counted by one rank. */
  self->volume = from->pairs.count && owns(part, from->pairs.nodes[0]) ? from->volume : 0;
  return flesh_effect_create(whole->operations, body->mesh, self, restricted);
}

static const flesh_cells *pressure_ties(const flesh_effect *whole, int *everywhere)
{
  const pressure *self = whole->data;
  (void)everywhere;
  return &self->ties;
}

/* The sum of the nodes in the middle of which c is at the lagged state, and their number. */
static void pressure_sum(const flesh_effect *effect, const flesh_point *point, double *sums)
{
  const pressure *self = effect->data;
  for (int k = 0; k < self->node_count; k++)
    for (int i = 0; i < 3; i++) sums[i] += point->lagged.x[3 * (size_t)self->nodes[k] + (size_t)i];
  sums[3] = self->node_count;
}

const flesh_effect_ranks flesh_curved_pressure_ranks = {
    .restrict_to_part = pressure_restrict, .cells = pressure_ties, .sum_count = 4, .sum = pressure_sum};
