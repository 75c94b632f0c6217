/* communicator_mpi.c: communication between ranks by MPI.
 *
 * Reductions use recursive doubling (Thakur, Rabenseifner & Gropp 2005, section 4): in turn k every rank exchanges its
 * numbers with the rank whose number differs in bit k. Both add the same two numbers, so that all ranks end with the
 * same bits, and the order of additions depends only on the number of ranks. MPI_Allreduce promises neither. Ranks
 * beyond the largest power of two first hand their numbers to a rank below it, and get the result at the end. */
#include <math.h>
#include <mpi.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "parallel/communicator.h"

enum { ROOM = 1024 /* numbers reduced at a time */, TEXT = 1024 /* bytes of a sentence */, TAG = 1 };

struct flesh_communicator {
  MPI_Comm comm;
  int rank, size, most; /* most: the largest power of two that is at most `size` */
  flesh_communicator_figures figures;
  MPI_Request *requests;
  int request_room, request_count;
  double room[ROOM];
};

int flesh_communicator_create(const void *mpi_comm, flesh_communicator **communicator)
{
  FLESH_NEED({communicator, "communicator"});
  flesh_communicator *self = *communicator = flesh_calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a communicator");
  self->comm = MPI_COMM_NULL;
  self->size = self->most = 1;
  if (!mpi_comm) return FLESH_OK;
  int ready = 0;
  MPI_Initialized(&ready);
  if (!ready || MPI_Comm_dup(*(const MPI_Comm *)mpi_comm, &self->comm)) {
    flesh_communicator_destroy(communicator);
    return flesh_fail(FLESH_ERR_ARGUMENT, "the MPI_Comm cannot be duplicated; it must be one of MPI after MPI_Init");
  }
  MPI_Comm_rank(self->comm, &self->rank);
  MPI_Comm_size(self->comm, &self->size);
  while (2 * self->most <= self->size) self->most *= 2;
  return FLESH_OK;
}

void flesh_communicator_destroy(flesh_communicator **communicator)
{
  if (!communicator || !*communicator) return;
  flesh_communicator *self = *communicator;
  if (self->comm != MPI_COMM_NULL) MPI_Comm_free(&self->comm);
  flesh_free(self->requests);
  flesh_free(self);
  *communicator = NULL;
}

int flesh_communicator_rank(const flesh_communicator *communicator) { return communicator->rank; }

int flesh_communicator_size(const flesh_communicator *communicator) { return communicator->size; }

flesh_communicator_figures flesh_communicator_exchanged(const flesh_communicator *communicator)
{
  return communicator->figures;
}

const void *flesh_communicator_comm(const flesh_communicator *self)
{
  return self->comm == MPI_COMM_NULL ? NULL : &self->comm;
}

static void count(flesh_communicator *self, size_t bytes)
{
  self->figures.messages++;
  self->figures.bytes += (double)bytes;
}

static void send(flesh_communicator *self, int rank, int n, const double *numbers)
{
  MPI_Send(numbers, n, MPI_DOUBLE, rank, TAG, self->comm);
  count(self, (size_t)n * sizeof *numbers);
}

static void receive(flesh_communicator *self, int rank, int n, double *numbers)
{
  MPI_Recv(numbers, n, MPI_DOUBLE, rank, TAG, self->comm, MPI_STATUS_IGNORE);
}

static double larger(double a, double b) { return isnan(a) || isnan(b) ? NAN : a > b ? a : b; }

/* Combines the other rank's numbers with this rank's. */
static void combine(const flesh_communicator *self, int is_sum, int n, double *numbers)
{
  for (int k = 0; k < n; k++)
    numbers[k] = is_sum ? numbers[k] + self->room[k] : larger(numbers[k], self->room[k]);
}

static void reduce_some(flesh_communicator *self, int is_sum, int n, double *numbers)
{
  const int beyond = self->size - self->most;
  if (self->rank >= self->most) {
    send(self, self->rank - self->most, n, numbers);
    receive(self, self->rank - self->most, n, numbers);
    return;
  }
  if (self->rank < beyond) {
    receive(self, self->rank + self->most, n, self->room);
    combine(self, is_sum, n, numbers);
  }
  for (int bit = 1; bit < self->most; bit *= 2) {
    const int other = self->rank ^ bit;
    MPI_Sendrecv(numbers, n, MPI_DOUBLE, other, TAG, self->room, n, MPI_DOUBLE, other, TAG, self->comm,
                 MPI_STATUS_IGNORE);
    count(self, (size_t)n * sizeof *numbers);
    combine(self, is_sum, n, numbers);
  }
  if (self->rank < beyond) send(self, self->rank + self->most, n, numbers);
}

static void reduce(flesh_communicator *self, int is_sum, int n, double *numbers)
{
  if (self->size == 1) return;
  self->figures.reductions++;
  for (int k = 0; k < n; k += ROOM) reduce_some(self, is_sum, n - k < ROOM ? n - k : ROOM, numbers + k);
}

void flesh_communicator_sum(flesh_communicator *self, int n, double *numbers) { reduce(self, 1, n, numbers); }

void flesh_communicator_largest(flesh_communicator *self, int n, double *numbers) { reduce(self, 0, n, numbers); }

int flesh_communicator_agree(flesh_communicator *self, int status)
{
  FLESH_NEED({self, "communicator"});
  if (self->size == 1) return status;
  const int severity = status < 0 ? 2 : status > 0, size = self->size;
  double worst = severity ? severity * (double)size + (size - 1 - self->rank) : 0;
  reduce(self, 0, 1, &worst);
  if (worst == 0) return FLESH_OK;
  const int first = size - 1 - (int)fmod(worst, size);
  MPI_Bcast(&status, 1, MPI_INT, first, self->comm);
  if (status >= 0) return status;
  char text[TEXT] = "";
  if (self->rank == first) strncpy(text, flesh_error_text(), TEXT - 1);
  MPI_Bcast(text, TEXT, MPI_CHAR, first, self->comm);
  return self->rank == first ? status : flesh_fail(status, "%s", text);
}

void flesh_communicator_spread(flesh_communicator *self, int n, int *numbers)
{
  if (self->size > 1) MPI_Bcast(numbers, n, MPI_INT, 0, self->comm);
}

int flesh_communicator_reserve(flesh_communicator *self, int ranks)
{
  if (2 * ranks < self->request_room) return FLESH_OK;
  MPI_Request *grown = flesh_realloc(self->requests, (2 * (size_t)ranks + 1) * sizeof *grown);
  if (!grown) return flesh_fail(FLESH_ERR_MEMORY, "no memory for messages with %d ranks", ranks);
  self->requests = grown;
  self->request_room = 2 * ranks + 1;
  return FLESH_OK;
}

/* Returns how many numbers rank k of an exchange has; *begin: the index of the first. */
static int numbers_of(int width, const int *first, int k, size_t *begin)
{
  *begin = (size_t)width * (size_t)(first ? first[k] : k);
  return first ? width * (first[k + 1] - first[k]) : width;
}

void flesh_communicator_begin(flesh_communicator *self, int n, const int *ranks, const flesh_exchange *exchange)
{
  size_t begin;
  self->request_count = 0;
  for (int k = 0; k < n; k++) {
    const int numbers = numbers_of(exchange->width, exchange->first_received, k, &begin);
    if (numbers)
      MPI_Irecv(exchange->received + begin, numbers, MPI_DOUBLE, ranks[k], TAG, self->comm,
                &self->requests[self->request_count++]);
  }
  for (int k = 0; k < n; k++) {
    const int numbers = numbers_of(exchange->width, exchange->first_sent, k, &begin);
    if (!numbers) continue;
    MPI_Isend(exchange->sent + begin, numbers, MPI_DOUBLE, ranks[k], TAG, self->comm,
              &self->requests[self->request_count++]);
    count(self, (size_t)numbers * sizeof(double));
  }
}

void flesh_communicator_end(flesh_communicator *self)
{
  MPI_Waitall(self->request_count, self->requests, MPI_STATUSES_IGNORE);
  self->request_count = 0;
}
