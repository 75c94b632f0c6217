/* communicator.h: sums over ranks and messages between them, by MPI. A single rank needs no communicator; all functions
 * then do nothing. Only files of this room that end in _mpi include mpi.h. */
#ifndef FLESH_PARALLEL_COMMUNICATOR_H
#define FLESH_PARALLEL_COMMUNICATOR_H

#include "base/team.h"
#include "flesh/ranks.h"

/* Replace the numbers by their sums over all ranks, or by the largest. All ranks call these functions in the same
 * order, and all get the same bits, every time for the same number of ranks. NaN on any rank gives NaN. */
void flesh_communicator_sum(flesh_communicator *communicator, int count, double *numbers);
void flesh_communicator_largest(flesh_communicator *communicator, int count, double *numbers);
/* Copies the numbers of the first rank to all ranks. */
void flesh_communicator_spread(flesh_communicator *communicator, int count, int *numbers);

/* Returns the MPI_Comm, borrowed; NULL: there is none. */
const void *flesh_communicator_comm(const flesh_communicator *communicator);

/* Makes room for exchanges with at least that many ranks. FLESH_ERR_MEMORY. */
int flesh_communicator_reserve(flesh_communicator *communicator, int ranks);
/* Begins to send to and receive from these ranks; the numbers are in use until flesh_communicator_end. Only one
 * exchange at a time. */
void flesh_communicator_begin(flesh_communicator *communicator, int count, const int *ranks,
                              const flesh_exchange *exchange);
void flesh_communicator_end(flesh_communicator *communicator);

/* Counts of this rank's exchanges so far. */
typedef struct flesh_communicator_figures {
  long reductions; /* sums, maxima and statuses over all ranks */
  long messages;   /* messages sent to another rank, including those of reductions */
  double bytes;    /* bytes in these messages */
} flesh_communicator_figures;

flesh_communicator_figures
flesh_communicator_exchanged(const flesh_communicator *communicator);

#endif
