/* shared_edges.c: ranks tell each other which edges they have between nodes that both have. */
#include "time/recovery/shared_edges.h"

#include <stdint.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/sort.h"
#include "mesh/pieces.h"

/* An edge by the numbers of its nodes in the body, the lower one first, as other ranks know it. */
typedef struct edge {
  int low, high, nodes[2];
} edge;

/* Messages between ranks, two numbers of each edge. */
typedef struct telling {
  int *first_mine, *first_theirs; /* [ranks+1] */
  int *mine;                      /* [first_mine[ranks]] which of this rank's edges */
  double *sent, *received;
} telling;

static int compare(const void *a, const void *b)
{
  const edge *p = a, *q = b;
  if (p->low != q->low) return p->low < q->low ? -1 : 1;
  return (p->high > q->high) - (p->high < q->high);
}

/* Marks the nodes that a rank within reach has as well as this one. */
static void mark(const flesh_team *team, int rank, uint8_t value, uint8_t *marks)
{
  const flesh_team_reach *reach = &team->reach;
  for (int k = reach->first_taken[rank]; k < reach->first_taken[rank + 1]; k++)
    if (reach->taken[k] < team->nodes) marks[reach->taken[k]] = value;
}

/* Every edge between marked nodes, of each piece anew; `edges` NULL: counts them. */
static size_t list_edges(const flesh_mesh *mesh, const flesh_team *team, const uint8_t *marks, edge *edges)
{
  size_t count = 0;
  for (int p = 0; p < flesh_mesh_piece_count(mesh); p++) {
    int node[4];
    flesh_mesh_piece(mesh, p, node);
    for (int k = 1; k < 16; k++) {
      const int a = node[k / 4], b = node[k % 4];
      if (k / 4 >= k % 4 || !marks[a] || !marks[b]) continue;
      const int before = team->numbers[a] < team->numbers[b], low = before ? a : b, high = before ? b : a;
      if (edges) edges[count] = (edge){team->numbers[low], team->numbers[high], {a < b ? a : b, a < b ? b : a}};
      count++;
    }
  }
  return count;
}

/* This rank's edges between nodes that others have, each once, sorted; new. */
static int find_edges(flesh_shared_edges *self, const flesh_mesh *mesh, uint8_t *marks, edge **edges)
{
  const flesh_team *team = self->team;
  for (int r = 0; r < team->reach.count; r++) mark(team, r, 1, marks);
  const size_t all = list_edges(mesh, team, marks, NULL);
  *edges = flesh_malloc((all + 1) * sizeof **edges);
  if (!*edges) return FLESH_ERR_MEMORY;
  list_edges(mesh, team, marks, *edges);
  flesh_sort(*edges, all, sizeof **edges, compare);
  for (size_t k = 0; k < all; k++)
    if (!k || compare(*edges + k, *edges + k - 1)) (*edges)[self->count++] = (*edges)[k];
  self->nodes = flesh_malloc((2 * (size_t)self->count + 1) * sizeof *self->nodes);
  self->own = flesh_malloc(((size_t)self->count + 1) * sizeof *self->own);
  for (int e = 0; e < self->count && self->nodes; e++)
    memcpy(self->nodes + 2 * (size_t)e, (*edges)[e].nodes, sizeof (*edges)[e].nodes);
  memset(marks, 0, (size_t)team->nodes);
  return self->nodes && self->own ? FLESH_OK : FLESH_ERR_MEMORY;
}

/* Lists the edges that each rank is told of; without room for them, counts them. `marks` are 0, and are so again. */
static void list_mine(const flesh_shared_edges *self, const edge *edges, uint8_t *marks, telling *t)
{
  for (int r = 0, count = 0; r < self->team->reach.count; r++) {
    mark(self->team, r, 1, marks);
    for (int e = 0; e < self->count; e++) {
      if (!marks[edges[e].nodes[0]] || !marks[edges[e].nodes[1]]) continue;
      if (t->mine) {
        t->mine[count] = e;
        t->sent[2 * (size_t)count] = edges[e].low; /* a double has every int exactly */
        t->sent[2 * (size_t)count + 1] = edges[e].high;
      }
      count++;
    }
    mark(self->team, r, 0, marks);
    t->first_mine[r + 1] = count;
  }
}

static edge told(const double *pairs, int k) { return (edge){.low = (int)pairs[2 * k], .high = (int)pairs[2 * k + 1]}; }

/* The edges that both this rank and another have: both sides find the same ones, in the same order. */
static void meet(flesh_shared_edges *self, const telling *t)
{
  for (int r = 0, count = 0; r < self->team->reach.count; r++) {
    int k = t->first_mine[r], l = t->first_theirs[r];
    while (k < t->first_mine[r + 1] && l < t->first_theirs[r + 1]) {
      const edge mine = told(t->sent, k), theirs = told(t->received, l);
      const int order = compare(&mine, &theirs);
      if (order == 0) self->place[count++] = t->mine[k];
      k += order <= 0;
      l += order >= 0;
    }
    self->first[r + 1] = count;
  }
}

static int agree(const flesh_team *team, int has_memory)
{
  const int status = has_memory ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for the edges between ranks");
  return flesh_team_agree(team, status);
}

static int find_common(flesh_shared_edges *self, const edge *edges, uint8_t *marks, telling *t)
{
  const size_t ranks = (size_t)self->team->reach.count;
  self->first = flesh_calloc(ranks + 1, sizeof *self->first);
  t->first_mine = flesh_calloc(ranks + 1, sizeof *t->first_mine);
  t->first_theirs = flesh_calloc(ranks + 1, sizeof *t->first_theirs);
  t->received = flesh_malloc((2 * ranks + 1) * sizeof *t->received);
  int status = agree(self->team, self->first && t->first_mine && t->first_theirs && t->received);
  if (status) return status;
  list_mine(self, edges, marks, t);
  flesh_exchange_counts(self->team, t->first_mine, t->received, t->first_theirs);
  flesh_free(t->received);
  const size_t mine = (size_t)t->first_mine[ranks], theirs = (size_t)t->first_theirs[ranks];
  t->mine = flesh_malloc((mine + 1) * sizeof *t->mine);
  t->sent = flesh_malloc((2 * mine + 1) * sizeof *t->sent);
  t->received = flesh_malloc((2 * theirs + 1) * sizeof *t->received);
  self->place = flesh_malloc((mine + 1) * sizeof *self->place);
  self->sent = flesh_malloc((mine + 1) * sizeof *self->sent);
  self->received = flesh_malloc((mine + 1) * sizeof *self->received);
  status = agree(self->team, t->mine && t->sent && t->received && self->place && self->sent && self->received);
  if (status) return status;
  list_mine(self, edges, marks, t);
  flesh_exchange_now(self->team, &(flesh_exchange){2, t->first_mine, t->first_theirs, t->sent, t->received});
  meet(self, t);
  return FLESH_OK;
}

int flesh_shared_edges_create(const flesh_mesh *mesh, const flesh_team *team, flesh_shared_edges *self)
{
  *self = (flesh_shared_edges){0};
  if (!team) return FLESH_OK;
  edge *edges = NULL;
  telling t = {0};
  uint8_t *marks = flesh_calloc((size_t)team->nodes + 1, 1);
  int status = agree(team, marks != NULL);
  if (!status) status = flesh_team_narrow(team, marks, &self->team); /* of ghosts those that tets have */
  if (!status) status = agree(team, !find_edges(self, mesh, marks, &edges));
  if (!status) status = find_common(self, edges, marks, &t);
  flesh_free(marks);
  flesh_free(edges);
  flesh_free(t.first_mine);
  flesh_free(t.first_theirs);
  flesh_free(t.mine);
  flesh_free(t.sent);
  flesh_free(t.received);
  return status;
}

void flesh_shared_edges_clear(flesh_shared_edges *self)
{
  flesh_free(self->nodes);
  flesh_free(self->own);
  flesh_free(self->first);
  flesh_free(self->place);
  flesh_free(self->sent);
  flesh_free(self->received);
  flesh_team_narrow_end(&self->team);
  memset(self, 0, sizeof *self);
}

size_t flesh_shared_edges_memory(const flesh_shared_edges *self)
{
  if (!self->team) return 0;
  const size_t ranks = (size_t)self->team->reach.count, common = (size_t)self->first[ranks];
  return (size_t)self->count * (2 * sizeof(int) + sizeof(double)) + common * (sizeof(int) + 2 * sizeof(double)) +
         (ranks + 1) * sizeof(int);
}

static void add(const flesh_shared_edges *self, int from_rank, int until_rank, double *numbers)
{
  for (int k = self->first[from_rank]; k < self->first[until_rank]; k++) numbers[self->place[k]] += self->received[k];
}

void flesh_shared_edges_sum(const flesh_shared_edges *self, double *numbers)
{
  if (!self->team) return;
  const flesh_team_reach *reach = &self->team->reach;
  for (int k = 0; k < self->first[reach->count]; k++) self->sent[k] = numbers[self->place[k]];
  flesh_exchange_now(self->team, &(flesh_exchange){1, self->first, self->first, self->sent, self->received});
  memcpy(self->own, numbers, (size_t)self->count * sizeof *numbers);
  memset(numbers, 0, (size_t)self->count * sizeof *numbers);
  add(self, 0, reach->before, numbers);
  for (int e = 0; e < self->count; e++) numbers[e] += self->own[e];
  add(self, reach->before, reach->count, numbers);
}
