/* ties.c: linear combinations of nodes held at zero, implemented as springs between pairs of nodes. */
#include "effect/ties.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/rank_share.h"

/* Makes room for another `count` pairs. */
static int make_room(flesh_ties *ties, int count)
{
  ties->failed |= !flesh_grow_to(&ties->pairs, sizeof *ties->pairs, ties->count + count, &ties->room);
  return !ties->failed;
}

void flesh_ties_add(flesh_ties *ties, int count, const int *nodes, const double *weights, double stiffness)
{
  if (ties->failed || !make_room(ties, count * (count - 1) / 2)) return;
  for (int a = 0; a < count; a++)
    for (int b = a + 1; b < count; b++) {
      const double s = -stiffness * weights[a] * weights[b];
      const int up = nodes[a] < nodes[b];
      if (s == 0 || nodes[a] == nodes[b]) continue;
      ties->pairs[ties->count++] = (flesh_tie_pair){{nodes[up ? a : b], nodes[up ? b : a]}, s};
    }
}

/* Orders pairs by nodes, and equal ones by stiffness, so that their sum does not depend on the sorting algorithm. */
static int compare(const void *a, const void *b)
{
  const flesh_tie_pair *p = a, *q = b;
  for (int k = 0; k < 2; k++)
    if (p->node[k] != q->node[k]) return p->node[k] < q->node[k] ? -1 : 1;
  return (p->stiffness > q->stiffness) - (p->stiffness < q->stiffness);
}

void flesh_ties_begin_group(flesh_ties *ties)
{
  if (ties->failed) return;
  ties->failed = !flesh_grow_to(&ties->group_start, sizeof *ties->group_start, ties->groups + 2, &ties->group_room);
  if (ties->failed) return;
  ties->group_start[ties->groups++] = ties->count;
  ties->group_start[ties->groups] = ties->count;
}

/* Moves the pairs from `begin` to `end` to `to`, sorted and with equal ones summed up. Returns the end of the
 * result. */
static int sum_up(flesh_tie_pair *pairs, int begin, int end, int to)
{
  const int first = to;
  qsort(pairs + begin, (size_t)(end - begin), sizeof *pairs, compare);
  for (int k = begin; k < end; k++) {
    const flesh_tie_pair next = pairs[k];
    flesh_tie_pair *last = to > first ? &pairs[to - 1] : NULL;
    if (last && last->node[0] == next.node[0] && last->node[1] == next.node[1]) last->stiffness += next.stiffness;
    else pairs[to++] = next;
  }
  return to;
}

/* Sums up the pairs of each group; without groups, all pairs. */
static int sum_up_groups(flesh_ties *ties)
{
  int kept = 0;
  if (!ties->groups) return sum_up(ties->pairs, 0, ties->count, 0);
  ties->group_start[ties->groups] = ties->count;
  for (int g = 0; g < ties->groups; g++) {
    const int begin = ties->group_start[g], end = ties->group_start[g + 1];
    ties->group_start[g] = kept;
    kept = sum_up(ties->pairs, begin, end, kept);
  }
  ties->group_start[ties->groups] = kept;
  return kept;
}

static int make_cells(flesh_ties *ties)
{
  int *nodes = malloc(((size_t)ties->count + 1) * 2 * sizeof *nodes);
  if (!nodes || ties->failed) {
    free(nodes);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for a weld or joint of %d pairs of nodes", ties->count);
  }
  for (int k = 0; k < 2 * ties->count; k++) nodes[k] = ties->pairs[k / 2].node[k % 2];
  ties->cells = (flesh_cells){.count = ties->count, .nodes_per_cell = 2, .nodes = nodes};
  return FLESH_OK;
}

int flesh_ties_finish(flesh_ties *ties)
{
  ties->count = ties->failed ? 0 : sum_up_groups(ties);
  return make_cells(ties);
}

/* Adds the pairs from begin to end whose first node the rank owns or, if `together`, all of them if it owns the first
 * node of the first pair. They keep their order, so sums have the same bits on all ranks. */
static void take_pairs(const flesh_ties *whole, const flesh_rank_part *part, int begin, int end, int all, int together,
                       flesh_ties *ties)
{
  for (int k = begin; k < end; k++) {
    const flesh_tie_pair *pair = &whole->pairs[k];
    if (!all && flesh_rank_share_node(part, whole->pairs[together ? begin : k].node[0]) < 0) continue;
    const int a = flesh_rank_part_find(part, pair->node[0]), b = flesh_rank_part_find(part, pair->node[1]);
    ties->pairs[ties->count++] = (flesh_tie_pair){{a < b ? a : b, a < b ? b : a}, pair->stiffness};
  }
}

int flesh_ties_restrict(const flesh_ties *whole, const flesh_rank_part *part, int all, flesh_ties *ties)
{
  *ties = (flesh_ties){.room = whole->count, .groups = whole->groups, .group_room = whole->groups + 1};
  ties->pairs = malloc(((size_t)whole->count + 1) * sizeof *ties->pairs);
  ties->group_start = whole->groups ? malloc(((size_t)whole->groups + 1) * sizeof *ties->group_start) : NULL;
  ties->failed = !ties->pairs || (whole->groups && !ties->group_start);
  if (!ties->failed && !whole->groups) take_pairs(whole, part, 0, whole->count, all, 0, ties);
  for (int g = 0; g < whole->groups && !ties->failed; g++) {
    ties->group_start[g] = ties->count;
    take_pairs(whole, part, whole->group_start[g], whole->group_start[g + 1], all, 1, ties);
    ties->group_start[g + 1] = ties->count;
  }
  return make_cells(ties);
}

void flesh_ties_clear(flesh_ties *ties)
{
  free((int *)ties->cells.nodes);
  flesh_free(ties->group_start);
  flesh_free(ties->pairs);
  *ties = (flesh_ties){0};
}

size_t flesh_ties_memory(const flesh_ties *ties)
{
  return (size_t)ties->room * sizeof *ties->pairs + ((size_t)ties->count * 2 + (size_t)ties->group_room) * sizeof(int);
}

/* A range of pairs that hold: those of one group, or all. */
typedef struct span {
  int begin, end;
} span;

/* Finds the next range of pairs that hold, starting at *group (initially 0). A group is broken if its internal variable
 * is not 0. Returns 0 after the last one. */
static int next_span(const flesh_ties *ties, const double *internal, int *group, span *at)
{
  if (!ties->groups || !internal) {
    *at = (span){0, ties->count};
    return (*group)++ == 0;
  }
  while (*group < ties->groups && internal[*group] != 0) ++*group;
  if (*group >= ties->groups) return 0;
  *at = (span){ties->group_start[*group], ties->group_start[*group + 1]};
  ++*group;
  return 1;
}

static void add_residual(const flesh_ties *ties, const span *at, const double *x, double *r)
{
  for (const flesh_tie_pair *p = ties->pairs + at->begin; p < ties->pairs + at->end; p++) {
    const size_t i = 3 * (size_t)p->node[0], j = 3 * (size_t)p->node[1];
    for (size_t c = 0; c < 3; c++) {
      const double f = p->stiffness * (x[i + c] - x[j + c]);
      r[i + c] += f;
      r[j + c] -= f;
    }
  }
}

static void add_jacobian(const flesh_ties *ties, const span *at, double factor, flesh_block_matrix *K, const int *slots)
{
  slots += 3 * (size_t)at->begin;
  for (const flesh_tie_pair *p = ties->pairs + at->begin; p < ties->pairs + at->end; p++, slots += 3)
    for (int block = 0; block < 3; block++)
      for (int c = 0; c < 3; c++)
        K->values[9 * (size_t)slots[block] + 4 * (size_t)c] += (block == 1 ? -factor : factor) * p->stiffness;
}

/* Adds the energy to *value and the magnitudes of its terms to *size. */
static void add_energy(const flesh_ties *ties, const span *at, const double *x, double *value, double *size)
{
  for (const flesh_tie_pair *p = ties->pairs + at->begin; p < ties->pairs + at->end; p++) {
    const double *a = x + 3 * (size_t)p->node[0], *b = x + 3 * (size_t)p->node[1];
    double square = 0;
    for (int c = 0; c < 3; c++) square += (a[c] - b[c]) * (a[c] - b[c]);
    *value += p->stiffness / 2 * square;
    *size += fabs(p->stiffness) / 2 * square;
  }
}

double flesh_ties_group_energy(const flesh_ties *ties, int group, const double *x)
{
  double value = 0, size = 0;
  add_energy(ties, &(span){ties->group_start[group], ties->group_start[group + 1]}, x, &value, &size);
  return value;
}

static double energy_of(const flesh_ties *ties, const flesh_point *point, double *size)
{
  double value = 0;
  span at;
  for (int group = 0; next_span(ties, point->internal, &group, &at);) add_energy(ties, &at, point->x, &value, size);
  return value;
}

const flesh_cells *flesh_tied_cells(const flesh_effect *effect)
{
  const flesh_ties *ties = effect->data;
  return &ties->cells;
}

int flesh_tied_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const flesh_ties *ties = effect->data;
  span at;
  for (int group = 0; next_span(ties, point->internal, &group, &at);) add_residual(ties, &at, point->x, r);
  return FLESH_OK;
}

int flesh_tied_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                         flesh_block_matrix *K, const int *slots)
{
  const flesh_ties *ties = effect->data;
  span at;
  if (shift->x == 0) return FLESH_OK;
  for (int group = 0; next_span(ties, point->internal, &group, &at);) add_jacobian(ties, &at, shift->x, K, slots);
  return FLESH_OK;
}

int flesh_tied_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *phi,
                          double *magnitude)
{
  const flesh_ties *ties = effect->data;
  double size = 0;
  if (shift->x == 0) return FLESH_OK;
  *phi += energy_of(ties, point, &size) / shift->x;
  *magnitude += size / shift->x;
  return FLESH_OK;
}

int flesh_tied_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  const flesh_ties *ties = effect->data;
  double size = 0;
  *energy = energy_of(ties, point, &size);
  return FLESH_OK;
}
