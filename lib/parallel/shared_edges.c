/* shared_edges.c: finds places among all ranks' shared edges for the edges between nodes of several ranks. */
#include "parallel/shared_edges.h"

#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/sort.h"
#include "mesh/pieces.h"

/* Lists this rank's edges between nodes that others have, by the nodes' numbers in the body; if `pair` is NULL, only
 * counts them. */
static int list_shared(flesh_shared_edges *self, const flesh_mesh_edges *edges, const double *ranks_of, double *pair)
{
  const int *numbers = self->team->numbers;
  int count = 0;
  for (int e = 0; e < edges->count; e++) {
    const int a = edges->ends[2 * (size_t)e], b = edges->ends[2 * (size_t)e + 1];
    if (!(ranks_of[a] > 1 && ranks_of[b] > 1)) continue;
    self->edges[count] = e;
    const int before = numbers[a] < numbers[b];
    if (pair) pair[2 * (size_t)count] = numbers[before ? a : b];
    if (pair) pair[2 * (size_t)count + 1] = numbers[before ? b : a];
    count++;
  }
  return count;
}

/* Finds the places from the ends `pairs` [2*total] of all ranks' edges; this rank's begin at `first`. */
static void find_places(flesh_shared_edges *self, int first, int total, const double *pairs, int (*edges)[2])
{
  for (int d = 0; d < 2 * total; d++) edges[d / 2][d % 2] = (int)pairs[d];
  flesh_sort(edges, (size_t)total, sizeof *edges, flesh_compare_two_ints);
  for (int k = 0; k < total; k++)
    if (!k || flesh_compare_two_ints(edges[k], edges[self->of_all - 1])) memmove(edges[self->of_all++], edges[k], sizeof *edges);
  for (int k = 0; k < self->count; k++) {
    const double *own = pairs + 2 * (size_t)(first + k);
    const int mine[2] = {(int)own[0], (int)own[1]};
    const int(*found)[2] = bsearch(mine, edges, (size_t)self->of_all, sizeof *edges, flesh_compare_two_ints);
    self->place[k] = (int)(found - (const int(*)[2])edges);
  }
}

/* Exchanges the edges; every rank sorts those of all ranks in the same way. `room` [nodes+ranks] is work space. */
static int meet(flesh_shared_edges *self, const flesh_mesh_edges *of, double *room)
{
  const flesh_team *team = self->team;
  int total;
  flesh_team_count_ranks(team, team->nodes, 1, room);
  self->count = list_shared(self, of, room, NULL);
  const int first = flesh_team_count_before(team, self->count, room + team->nodes, &total);
  double *pairs = flesh_calloc(2 * (size_t)total + 1, sizeof *pairs); /* a double holds every int exactly */
  int(*edges)[2] = flesh_malloc(((size_t)total + 1) * sizeof *edges);
  self->place = flesh_malloc(((size_t)self->count + 1) * sizeof *self->place);
  self->between = flesh_malloc(((size_t)total + 1) * sizeof *self->between);
  const int enough = pairs && edges && self->place && self->between;
  const int status = flesh_team_agree(team, enough ? FLESH_OK : FLESH_ERR_MEMORY);
  if (!status) {
    list_shared(self, of, room, pairs + 2 * (size_t)first);
    flesh_team_sum(team, 2 * total, pairs);
    find_places(self, first, total, pairs, edges);
  }
  flesh_free(pairs);
  flesh_free(edges);
  return status;
}

int flesh_shared_edges_create(const flesh_team *team, const flesh_mesh_edges *edges, int status, flesh_shared_edges *self)
{
  *self = (flesh_shared_edges){.team = team};
  if (!team) return status;
  double *room = flesh_malloc((size_t)(team->nodes + team->ranks) * sizeof *room);
  if (!status) self->edges = flesh_malloc((size_t)edges->count * sizeof *self->edges + 1);
  if (!room || !self->edges) status = FLESH_ERR_MEMORY;
  status = flesh_team_agree(team, status);
  if (!status) status = meet(self, edges, room);
  flesh_free(room);
  return status;
}

void flesh_shared_edges_clear(flesh_shared_edges *self)
{
  flesh_free(self->edges);
  flesh_free(self->place);
  flesh_free(self->between);
  *self = (flesh_shared_edges){0};
}

void flesh_shared_edges_sum(const flesh_shared_edges *self, double *sums)
{
  if (!self->team) return;
  memset(self->between, 0, (size_t)self->of_all * sizeof *self->between);
  for (int k = 0; k < self->count; k++) self->between[self->place[k]] = sums[self->edges[k]];
  flesh_team_sum(self->team, self->of_all, self->between);
  for (int k = 0; k < self->count; k++) sums[self->edges[k]] = self->between[self->place[k]];
}

/* Counts shared edges once for each of their tets, and as much again for sorting. */
size_t flesh_shared_edges_room(const flesh_team *team, const flesh_mesh *mesh, double *work)
{
  double shared = 0;
  if (!team) return 0;
  flesh_team_count_ranks(team, team->nodes, 1, work);
  for (int t = 0; t < flesh_mesh_piece_count(mesh); t++) {
    int node[4], corners = 0;
    flesh_mesh_piece(mesh, t, node);
    for (int a = 0; a < 4; a++) corners += work[node[a]] > 1;
    shared += corners * (corners - 1) / 2;
  }
  return 8 * (size_t)(team->nodes + team->ranks) + 64 * (size_t)flesh_team_total(team, shared);
}
