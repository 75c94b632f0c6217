/* communicator.h: sums over ranks and messages between them, by MPI; a rank by itself needs none, and all of this does
 * nothing there. Only files of this room that end in _mpi include mpi.h.
 *
 * Errors of MPI go to the error handler of the communicator that was given, by default MPI's own, which ends all ranks. */
#ifndef FLESH_PARALLEL_COMMUNICATOR_H
#define FLESH_PARALLEL_COMMUNICATOR_H

#include <stddef.h>

#include "flesh/status.h"

typedef struct flesh_communicator flesh_communicator;

/* What this rank has exchanged so far. */
typedef struct flesh_communicator_figures {
  long reductions; /* sums, largest numbers and statuses of all ranks */
  long messages;   /* sent to another rank, by reductions too */
  double bytes;    /* in these */
} flesh_communicator_figures;

/* `mpi_comm` points to an MPI_Comm, of which a duplicate is made: collective, after MPI_Init and before MPI_Finalize, as
 * is its end. NULL: one rank without MPI. FLESH_ERR_ARGUMENT where it is not NULL and flesh is built without MPI,
 * FLESH_ERR_MEMORY. Returns new. */
int flesh_communicator_create(const void *mpi_comm, flesh_communicator **communicator);
/* NULL-safe; sets *communicator to NULL. */
void flesh_communicator_destroy(flesh_communicator **communicator);

int flesh_communicator_rank(const flesh_communicator *communicator);
int flesh_communicator_size(const flesh_communicator *communicator);
flesh_communicator_figures flesh_communicator_exchanged(const flesh_communicator *communicator);

/* What all ranks call, in the same order. The numbers of all ranks added up, or the largest: the same bits everywhere,
 * and for the same number of ranks every time. What is no number stays none. */
void flesh_communicator_sum(flesh_communicator *communicator, int count, double *numbers);
void flesh_communicator_largest(flesh_communicator *communicator, int count, double *numbers);
/* The worst status (fatal, then recoverable, then FLESH_OK), of the first rank with one as bad; a fatal one comes with
 * that rank's sentence in flesh_error_text(). */
int flesh_communicator_agree(flesh_communicator *communicator, int status);
/* The numbers of the first rank become everyone's. */
void flesh_communicator_spread(flesh_communicator *communicator, int count, int *numbers);

/* Numbers for another rank, and room for those that it sends. Either knows the other's counts. */
typedef struct flesh_message {
  int rank, send_count, receive_count;
  const double *send;
  double *receive;
} flesh_message;

/* Room for exchanges of as many messages as this. FLESH_ERR_MEMORY. */
int flesh_communicator_reserve(flesh_communicator *communicator, int messages);
/* Sends and receives them; the arrays are in use until the end. One exchange at a time. */
void flesh_communicator_begin(flesh_communicator *communicator, int count, const flesh_message *messages);
void flesh_communicator_end(flesh_communicator *communicator);

#endif
