/* gather.c: each rank sends its own values to the first rank, which knows their places in the whole. */
#include "parallel/gather.h"

#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "parallel/communicator.h"

struct flesh_gather {
  flesh_communicator *communicator;
  int rank, size, own, received; /* nodes, or tets: of this rank, and on the first rank of all others */
  const int *nodes;              /* [own] numbers in the whole of this rank's; the part's */
  int *first;                    /* [size+1] where each rank's begin among those received; the first rank has none there */
  int *places;                   /* [received] their numbers in the whole */
  double *numbers;               /* [3*received] on the first rank; [3*own] on others */
  int *ranks, *nothing;          /* [size] ranks to exchange with; [size] zeros */
};

/* Sends `width` numbers per node from this rank, or receives those of the others on the first rank. */
static void send_to_first(flesh_gather *self, int width)
{
  const int own[2] = {0, self->own};
  const flesh_exchange out = {width, own, self->nothing, self->numbers, NULL},
                       in = {width, self->nothing, self->first + 1, NULL, self->numbers};
  flesh_communicator_begin(self->communicator, self->rank ? 1 : self->size - 1, self->ranks, self->rank ? &out : &in);
  flesh_communicator_end(self->communicator);
}

/* Finds how many nodes each rank owns, counts [size], and allocates. */
static int allocate(flesh_gather *self, double *counts)
{
  counts[self->rank] = self->own;
  flesh_communicator_sum(self->communicator, self->size, counts);
  for (int k = 0; k < self->size; k++) self->first[k + 1] = self->first[k] + (k ? (int)counts[k] : 0);
  for (int k = 1; self->rank == 0 && k < self->size; k++) self->ranks[k - 1] = k;
  self->nothing = self->ranks + self->size;
  self->received = self->rank ? 0 : self->first[self->size];
  const size_t numbers = (size_t)(self->rank ? self->own : self->received);
  self->numbers = flesh_malloc((3 * numbers + 1) * sizeof *self->numbers);
  self->places = flesh_malloc(((size_t)self->received + 1) * sizeof *self->places);
  if (!self->numbers || !self->places) return FLESH_ERR_MEMORY;
  return flesh_communicator_reserve(self->communicator, self->size);
}

static int create(flesh_communicator *communicator, int own, const int *nodes, flesh_gather **gather)
{
  const size_t size = (size_t)flesh_communicator_size(communicator);
  double *counts = flesh_calloc(size, sizeof *counts);
  flesh_gather *self = *gather = flesh_calloc(1, sizeof *self);
  int status = counts && self ? FLESH_OK : FLESH_ERR_MEMORY;
  if (self)
    *self = (flesh_gather){.communicator = communicator, .rank = flesh_communicator_rank(communicator), .size = (int)size,
                           .own = own, .nodes = nodes,
                           .first = flesh_calloc(size + 1, sizeof *self->first),
                           .ranks = flesh_calloc(2 * size, sizeof *self->ranks)};
  if (!status && !(self->first && self->ranks)) status = FLESH_ERR_MEMORY;
  if (status) flesh_fail(status, "no memory to gather from %d ranks", (int)size);
  status = flesh_communicator_agree(communicator, status);
  if (!status) {
    status = allocate(self, counts);
    if (status) flesh_fail(status, "no memory to gather %d nodes", self->received);
    status = flesh_communicator_agree(communicator, status);
  }
  if (!status) { /* a double holds every int exactly */
    for (int i = 0; self->rank && i < self->own; i++) self->numbers[i] = self->nodes[i];
    send_to_first(self, 1);
    for (int i = 0; i < self->received; i++) self->places[i] = (int)self->numbers[i];
  }
  flesh_free(counts);
  if (status) flesh_gather_destroy(gather);
  return status;
}

int flesh_gather_create(flesh_communicator *communicator, const flesh_rank_part *part, flesh_gather **gather)
{
  return create(communicator, flesh_rank_part_own(part), flesh_rank_part_nodes(part), gather);
}

int flesh_gather_create_tets(flesh_communicator *communicator, const flesh_rank_part *part, flesh_gather **gather)
{
  const int tets = flesh_mesh_tet_count(flesh_rank_part_mesh(part));
  return create(communicator, tets, flesh_rank_part_tets(part), gather);
}

void flesh_gather_destroy(flesh_gather **gather)
{
  if (!gather || !*gather) return;
  flesh_gather *self = *gather;
  flesh_free(self->first);
  flesh_free(self->places);
  flesh_free(self->numbers);
  flesh_free(self->ranks); /* one block with `nothing` */
  flesh_free(self);
  *gather = NULL;
}

static void put(size_t width, int count, const int *places, const double *numbers, double *whole)
{
  for (size_t i = 0; i < (size_t)count; i++)
    memcpy(whole + width * (size_t)places[i], numbers + width * i, width * sizeof *whole);
}

static void gather_numbers(flesh_gather *self, size_t width, const double *numbers, double *whole)
{
  if (self->rank) memcpy(self->numbers, numbers, width * (size_t)self->own * sizeof *numbers);
  send_to_first(self, (int)width);
  if (self->rank) return;
  put(width, self->own, self->nodes, numbers, whole);
  put(width, self->received, self->places, self->numbers, whole);
}

void flesh_gather_vector(flesh_gather *self, const double *vector, double *whole)
{
  gather_numbers(self, 3, vector, whole);
}

void flesh_gather_numbers(flesh_gather *self, const double *numbers, double *whole)
{
  gather_numbers(self, 1, numbers, whole);
}
