/* node_ranks.c: lists the ranks of each node, and extends the lists from tet to tet. */
#include "parallel/node_ranks.h"

#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/sort.h"

typedef struct pair {
  int node, rank;
} pair;

typedef struct pairs {
  int count, room, failed;
  pair *list;
} pairs;

static void add(pairs *self, int node, int rank)
{
  self->failed = self->failed || !flesh_grow(&self->list, sizeof *self->list, self->count, &self->room);
  if (!self->failed) self->list[self->count++] = (pair){node, rank};
}

/* Calls each(data, tet, count, nodes) for all tets, with their corners and nodes on edges. */
static void for_tets(const flesh_mesh *whole, void (*each)(void *data, int tet, int count, const int *nodes), void *data)
{
  const int *corners = flesh_mesh_tets(whole), *edges = flesh_mesh_tet_edges(whole);
  for (int t = 0; t < flesh_mesh_tet_count(whole); t++) {
    int nodes[10], count = 4;
    memcpy(nodes, corners + 4 * (size_t)t, 4 * sizeof *nodes);
    for (int e = 0; e < 6 && edges; e++)
      if (edges[6 * (size_t)t + (size_t)e] >= 0) nodes[count++] = edges[6 * (size_t)t + (size_t)e];
    each(data, t, count, nodes);
  }
}

/* Makes the lists from pairs, which it sorts and frees. */
static int make(pairs *all, int nodes, flesh_node_ranks *self)
{
  flesh_node_ranks made = {.nodes = nodes, .first = flesh_calloc((size_t)nodes + 1, sizeof *made.first),
                           .ranks = flesh_malloc(((size_t)all->count + 1) * sizeof *made.ranks)};
  if (all->failed || !made.first || !made.ranks) {
    flesh_free(all->list);
    flesh_node_ranks_clear(&made);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the ranks of %d nodes", nodes);
  }
  flesh_sort(all->list, (size_t)all->count, sizeof *all->list, flesh_compare_two_ints);
  int count = 0;
  for (int k = 0; k < all->count; k++) {
    if (k > 0 && !flesh_compare_two_ints(&all->list[k], &all->list[k - 1])) continue;
    made.ranks[count++] = all->list[k].rank;
    made.first[all->list[k].node + 1]++;
  }
  for (int i = 0; i < nodes; i++) made.first[i + 1] += made.first[i];
  flesh_free(all->list);
  flesh_node_ranks_clear(self);
  *self = made;
  return FLESH_OK;
}

typedef struct search {
  const int *part;
  int *last; /* [nodes] rank that was added last; -1: none */
  pairs pairs;
} search;

static void look(void *data, int tet, int count, const int *nodes)
{
  search *s = data;
  for (int a = 0; a < count; a++) {
    if (s->last[nodes[a]] == s->part[tet]) continue;
    s->last[nodes[a]] = s->part[tet];
    add(&s->pairs, nodes[a], s->part[tet]);
  }
}

int flesh_node_ranks_create(const flesh_mesh *whole, const int *part, flesh_node_ranks *self)
{
  const int nodes = flesh_mesh_node_count(whole);
  search s = {.part = part, .last = flesh_malloc(((size_t)nodes + 1) * sizeof *s.last), .pairs = {.failed = 0}};
  *self = (flesh_node_ranks){0};
  if (!s.last) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the ranks of %d nodes", nodes);
  memset(s.last, -1, (size_t)nodes * sizeof *s.last);
  for_tets(whole, look, &s);
  flesh_free(s.last);
  return make(&s.pairs, nodes, self);
}

int flesh_node_ranks_has(const flesh_node_ranks *self, int node, int rank)
{
  for (int k = self->first[node]; k < self->first[node + 1]; k++)
    if (self->ranks[k] == rank) return 1;
  return 0;
}

static void add_all(pairs *self, const flesh_node_ranks *lists)
{
  for (int i = 0; i < lists->nodes; i++)
    for (int k = lists->first[i]; k < lists->first[i + 1]; k++) add(self, i, lists->ranks[k]);
}

typedef struct growth {
  const flesh_node_ranks *lists;
  pairs pairs;
} growth;

static void spread(void *data, int tet, int count, const int *nodes)
{
  growth *g = data;
  const flesh_node_ranks *lists = g->lists;
  (void)tet;
  for (int a = 0; a < count; a++)
    for (int k = lists->first[nodes[a]]; k < lists->first[nodes[a] + 1]; k++)
      for (int b = 0; b < count; b++)
        if (!flesh_node_ranks_has(lists, nodes[b], lists->ranks[k])) add(&g->pairs, nodes[b], lists->ranks[k]);
}

int flesh_node_ranks_grow(const flesh_mesh *whole, flesh_node_ranks *self)
{
  growth g = {.lists = self, .pairs = {.failed = 0}};
  add_all(&g.pairs, self);
  for_tets(whole, spread, &g);
  return make(&g.pairs, self->nodes, self);
}

int flesh_node_ranks_add_cells(flesh_node_ranks *self, int count, int width, const int *cells, const int *owner, int everywhere)
{
  pairs all = {.failed = 0};
  add_all(&all, self);
  for (int c = 0; c < count; c++) {
    const int *nodes = cells + (size_t)c * (size_t)width, computes = owner[nodes[0]];
    for (int a = 0; a < width; a++)
      for (int rank = everywhere ? 0 : computes; rank < (everywhere ? everywhere : computes + 1); rank++)
        if (rank >= 0 && owner[nodes[a]] >= 0 && !flesh_node_ranks_has(self, nodes[a], rank)) add(&all, nodes[a], rank);
  }
  return make(&all, self->nodes, self);
}

int flesh_node_ranks_add(flesh_node_ranks *self, const flesh_node_ranks *other)
{
  pairs all = {.failed = 0};
  add_all(&all, self);
  add_all(&all, other);
  return make(&all, self->nodes, self);
}

void flesh_node_ranks_clear(flesh_node_ranks *self)
{
  flesh_free(self->first);
  flesh_free(self->ranks);
  *self = (flesh_node_ranks){0};
}
