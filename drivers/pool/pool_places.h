/* pool_places.h: the processes of a pool that are on this machine, of this rank. */
#ifndef FLESH_POOL_POOL_PLACES_H
#define FLESH_POOL_POOL_PLACES_H

#include "pool/pool_cases.h"

typedef struct flesh_pool_process flesh_pool_process;

typedef struct flesh_places {
  const flesh_pool_cases *cases;
  int room, limit; /* places there are, and that may be taken */
  int running, stopped;
  flesh_pool_process *processes; /* [room] */
  struct pollfd *polls;          /* [room] */
} flesh_places;

/* FLESH_ERR_MEMORY. To be closed in any case. */
int flesh_places_open(int room, const flesh_pool_cases *cases, flesh_places *places);
/* Ends what runs. */
void flesh_places_close(flesh_places *places);
/* The next three as those of a pool; the answer of an end is the caller's to free. */
int flesh_places_start(flesh_places *places, int number, int *started);
int flesh_places_wait(flesh_places *places, int milliseconds, flesh_pool_end *end);
void flesh_places_stop(flesh_places *places);

#endif
