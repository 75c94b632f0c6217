/* links.c: the operations of a team, by lists of nodes. */
#include "parallel/links.h"

static void links_sum(const void *data, int count, double *numbers)
{
  flesh_communicator_sum(((const flesh_links *)data)->communicator, count, numbers);
}

static void links_largest(const void *data, int count, double *numbers)
{
  flesh_communicator_largest(((const flesh_links *)data)->communicator, count, numbers);
}

static int links_agree(const void *data, int status)
{
  return flesh_communicator_agree(((const flesh_links *)data)->communicator, status);
}

static void links_update_ghosts(const void *data, const flesh_team_vector *vector)
{
  const flesh_links *self = data;
  flesh_halo_update_ghosts(vector->overlap ? &self->overlap : &self->halo, self->communicator, vector);
}

static void links_add_ghosts(const void *data, const flesh_team_vector *vector)
{
  const flesh_links *self = data;
  flesh_halo_add_ghosts(vector->overlap ? &self->overlap : &self->halo, self->communicator, vector);
}

static void links_exchange_begin(const void *data, int count, const int *ranks, const flesh_exchange *exchange)
{
  flesh_communicator_begin(((const flesh_links *)data)->communicator, count, ranks, exchange);
}

static void links_exchange_end(const void *data) { flesh_communicator_end(((const flesh_links *)data)->communicator); }

const flesh_team_operations flesh_links_operations = {
    .sum = links_sum, .largest = links_largest, .agree = links_agree,
    .update_ghosts = links_update_ghosts, .add_ghosts = links_add_ghosts,
    .exchange_begin = links_exchange_begin, .exchange_end = links_exchange_end, .narrow = flesh_links_narrow,
    .narrow_end = flesh_links_narrow_end};

flesh_team_neighbours flesh_links_neighbours(const flesh_links *self, int rank)
{
  const flesh_halo *rows = &self->rows;
  flesh_team_neighbours neighbours = {.count = rows->count, .ranks = rows->ranks, .first_given = rows->first_own,
                                      .given = rows->own, .first_taken = rows->first_ghost, .taken = rows->ghosts};
  for (int k = 0; k < rows->count; k++) neighbours.before += rows->ranks[k] < rank;
  return neighbours;
}

void flesh_links_clear(flesh_links *self)
{
  flesh_halo_clear(&self->halo);
  flesh_halo_clear(&self->overlap);
  flesh_halo_clear(&self->rows);
  *self = (flesh_links){0};
}
