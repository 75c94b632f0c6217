/* communicator.h: sums over ranks and messages between them, by MPI; a rank by itself needs none, and all of this does
 * nothing there. Only files of this room that end in _mpi include mpi.h. */
#ifndef FLESH_PARALLEL_COMMUNICATOR_H
#define FLESH_PARALLEL_COMMUNICATOR_H

#include "base/team.h"
#include "flesh/ranks.h"

/* All ranks call these, in the same order. The numbers of all ranks are added up, or the largest taken: the same bits
 * everywhere, and for the same number of ranks every time. NaN in any rank's number gives NaN. */
void flesh_communicator_sum(flesh_communicator *communicator, int count, double *numbers);
void flesh_communicator_largest(flesh_communicator *communicator, int count, double *numbers);
/* The numbers of the first rank become everyone's. */
void flesh_communicator_spread(flesh_communicator *communicator, int count, int *numbers);

/* Its MPI_Comm; NULL: it has none. Borrowed. */
const void *flesh_communicator_comm(const flesh_communicator *communicator);

/* Room for exchanges with as many ranks as this, or more. FLESH_ERR_MEMORY. */
int flesh_communicator_reserve(flesh_communicator *communicator, int ranks);
/* Sends to and receives from these ranks; the numbers are in use until the end. One exchange at a time. */
void flesh_communicator_begin(flesh_communicator *communicator, int count, const int *ranks,
                              const flesh_exchange *exchange);
void flesh_communicator_end(flesh_communicator *communicator);

/* Counts of this rank's exchanges so far. */
typedef struct flesh_communicator_figures {
  long reductions; /* sums, largest numbers and statuses of all ranks */
  long messages;   /* sent to another rank, by reductions too */
  double bytes;    /* in these */
} flesh_communicator_figures;

flesh_communicator_figures
flesh_communicator_exchanged(const flesh_communicator *communicator);

#endif
