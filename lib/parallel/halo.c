/* halo.c: lists of shared nodes, and exchanges along them. */
#include "parallel/halo.h"

#include <string.h>

#include "base/memory.h"
#include "base/sort.h"

void flesh_shared_nodes_add(flesh_shared_nodes *self, int rank, int ghost, int node, int local)
{
  self->failed = self->failed || !flesh_grow(&self->nodes, sizeof *self->nodes, self->count, &self->room);
  if (!self->failed) self->nodes[self->count++] = (flesh_shared_node){rank, ghost, node, local};
}

void flesh_shared_nodes_clear(flesh_shared_nodes *self)
{
  flesh_free(self->nodes);
  *self = (flesh_shared_nodes){0};
}

/* Sorts the list and drops repeats. */
static void thin(flesh_shared_nodes *self)
{
  int kept = 0;
  flesh_sort(self->nodes, (size_t)self->count, sizeof *self->nodes, flesh_compare_three_ints);
  for (int k = 0; k < self->count; k++)
    if (k == 0 || flesh_compare_three_ints(&self->nodes[k], &self->nodes[kept - 1])) self->nodes[kept++] = self->nodes[k];
  self->count = kept;
}

static int allocate(flesh_halo *self, int neighbours, int own, int ghosts)
{
  int failed = 0;
  failed |= !(self->first_own = flesh_calloc((size_t)neighbours + 1, sizeof *self->first_own));
  failed |= !(self->first_ghost = flesh_calloc((size_t)neighbours + 1, sizeof *self->first_ghost));
  failed |= !(self->own = flesh_malloc(((size_t)own + 1) * sizeof *self->own));
  failed |= !(self->ghosts = flesh_malloc(((size_t)ghosts + 1) * sizeof *self->ghosts));
  failed |= !(self->of_own = flesh_malloc(((size_t)own + 1) * FLESH_HALO_WIDTH * sizeof *self->of_own));
  failed |= !(self->of_ghosts = flesh_malloc(((size_t)ghosts + 1) * FLESH_HALO_WIDTH * sizeof *self->of_ghosts));
  failed |= !(self->ranks = flesh_malloc(((size_t)neighbours + 1) * sizeof *self->ranks));
  return failed ? FLESH_ERR_MEMORY : FLESH_OK;
}

int flesh_halo_create(flesh_communicator *communicator, flesh_shared_nodes *shared, flesh_halo *self)
{
  int neighbours = 0, ghosts = 0, own = 0, ghost = 0;
  *self = (flesh_halo){0};
  if (shared->failed) return FLESH_ERR_MEMORY;
  thin(shared);
  const flesh_shared_node *nodes = shared->nodes;
  for (int k = 0; k < shared->count; k++) {
    neighbours += k == 0 || nodes[k].rank != nodes[k - 1].rank;
    ghosts += nodes[k].ghost;
  }
  int status = allocate(self, neighbours, shared->count - ghosts, ghosts);
  if (!status) status = flesh_communicator_reserve(communicator, neighbours);
  if (status) return status;
  for (int k = 0; k < shared->count; k++) {
    if (k == 0 || nodes[k].rank != nodes[k - 1].rank) {
      self->first_own[self->count] = own;
      self->first_ghost[self->count] = ghost;
      self->ranks[self->count++] = nodes[k].rank;
    }
    if (nodes[k].ghost) self->ghosts[ghost++] = nodes[k].local;
    else self->own[own++] = nodes[k].local;
  }
  self->first_own[neighbours] = own;
  self->first_ghost[neighbours] = ghost;
  return FLESH_OK;
}

void flesh_halo_clear(flesh_halo *self)
{
  void *arrays[] = {self->first_own, self->first_ghost, self->own,  self->ghosts,
                    self->of_own,    self->of_ghosts,   self->ranks};
  for (size_t k = 0; k < sizeof arrays / sizeof arrays[0]; k++) flesh_free(arrays[k]);
  *self = (flesh_halo){0};
}

static double *numbers_of(const flesh_team_vector *vector, int node)
{
  return vector->values + (size_t)vector->stride * (size_t)(vector->place ? vector->place[node] : node);
}

static void pack(const flesh_team_vector *vector, int count, const int *nodes, double *packed)
{
  for (int k = 0; k < count; k++) {
    const double *from = numbers_of(vector, nodes[k]);
    for (int c = 0; c < vector->width; c++) *packed++ = from[c];
  }
}

static void exchange(const flesh_halo *self, flesh_communicator *communicator, const flesh_exchange *exchange)
{
  flesh_communicator_begin(communicator, self->count, self->ranks, exchange);
  flesh_communicator_end(communicator);
}

void flesh_halo_update_ghosts(const flesh_halo *self, flesh_communicator *communicator, const flesh_team_vector *vector)
{
  pack(vector, self->first_own[self->count], self->own, self->of_own);
  exchange(self, communicator, &(flesh_exchange){vector->width, self->first_own, self->first_ghost, self->of_own,
                                                 self->of_ghosts});
  const double *packed = self->of_ghosts;
  for (int k = 0; k < self->first_ghost[self->count]; k++) {
    double *to = numbers_of(vector, self->ghosts[k]);
    for (int c = 0; c < vector->width; c++) to[c] = *packed++;
  }
}

void flesh_halo_tell(const flesh_halo *self, flesh_communicator *communicator, const flesh_team_vector *vector)
{
  pack(vector, self->first_ghost[self->count], self->ghosts, self->of_ghosts);
  exchange(self, communicator, &(flesh_exchange){vector->width, self->first_ghost, self->first_own, self->of_ghosts,
                                                 self->of_own});
}

void flesh_halo_add_ghosts(const flesh_halo *self, flesh_communicator *communicator, const flesh_team_vector *vector)
{
  const int ghosts = self->first_ghost[self->count];
  flesh_halo_tell(self, communicator, vector);
  const double *packed = self->of_own;
  for (int k = 0; k < self->first_own[self->count]; k++) {
    double *to = numbers_of(vector, self->own[k]);
    for (int c = 0; c < vector->width; c++) to[c] += *packed++;
  }
  for (int k = 0; k < ghosts; k++) {
    double *ghost = numbers_of(vector, self->ghosts[k]);
    for (int c = 0; c < vector->width; c++) ghost[c] = 0;
  }
}
