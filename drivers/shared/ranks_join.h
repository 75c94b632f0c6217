/* ranks_join.h: MPI's begin and end, with MPI (ranks_mpi.c) or without (ranks_alone.c). */
#ifndef FLESH_SHARED_RANKS_JOIN_H
#define FLESH_SHARED_RANKS_JOIN_H

#include "flesh/ranks.h"

/* All ranks that the launcher has started, and how many of them are on this machine. Status. */
int flesh_ranks_join(flesh_communicator **communicator, int *here);
/* NULL-safe member; sets it to NULL. */
void flesh_ranks_leave(flesh_communicator **communicator);

#endif
