/* ranks_join.h: MPI's begin and end, with MPI (ranks_mpi.c) or without (ranks_alone.c). */
#ifndef FLESH_RUN_RANKS_JOIN_H
#define FLESH_RUN_RANKS_JOIN_H

#include <stddef.h>

#include "flesh/ranks.h"

/* All ranks that the launcher has started, and how many of them are on this machine. Status. */
int flesh_ranks_join(flesh_communicator **communicator, int *here);
/* The communicator of the ranks that take part, which all ranks call for; NULL on one that does not. Status. */
int flesh_ranks_split(int takes_part, flesh_communicator **communicator);
/* Bytes from one of all ranks to another; does not wait until they are received. */
void flesh_ranks_send(int to, size_t size, const void *bytes);
/* Whether a message is there, from whom, and its size; then receives it. */
int flesh_ranks_probe(int *from, size_t *size);
void flesh_ranks_receive(int from, size_t size, void *bytes);
/* Ends MPI where it has begun. NULL-safe member; sets it to NULL. */
void flesh_ranks_leave(flesh_communicator **communicator);

#endif
