/* ranks_join.h: MPI's begin and end, with MPI (ranks_mpi.c) or without (ranks_alone.c). */
#ifndef FLESH_SHARED_RANKS_JOIN_H
#define FLESH_SHARED_RANKS_JOIN_H

#include "flesh/ranks.h"

/* All ranks that the launcher has started, and how many of them are on this machine. Status. */
int flesh_ranks_join(flesh_communicator **communicator, int *here);
/* Those of them that take part, which all call; NULL for one that does not. Status. */
int flesh_ranks_split(int takes_part, flesh_communicator **communicator);
/* NULL-safe member; sets it to NULL. */
void flesh_ranks_leave(flesh_communicator **communicator);

#endif
