/* pool_places.h: internal to the pool: the processes of this rank on this machine, and the messages between ranks. */
#ifndef FLESH_POOL_POOL_PLACES_H
#define FLESH_POOL_POOL_PLACES_H

#include "pool/pool_cases.h"

typedef struct flesh_pool_process flesh_pool_process;

typedef struct flesh_places {
  const flesh_pool_cases *cases;
  int room, limit; /* number of places; limit on those in use */
  int running, stopped;
  flesh_pool_process *processes; /* [room] */
  struct pollfd *polls;          /* [room] */
} flesh_places;

/* Returns how many processes at a time make sense for `count` cases and can be had, at most `jobs` and at least 1: no
 * more than cases, and no more than the limit on open files allows, as each needs a pipe (that limit is raised as far
 * as possible). */
int flesh_places_fit(int jobs, int count);

/* Makes the places. FLESH_ERR_MEMORY. They must be closed even after an error. */
int flesh_places_open(int room, const flesh_pool_cases *cases, flesh_places *places);
/* Kills what runs. */
void flesh_places_close(flesh_places *places);
/* Do the same as flesh_pool_start and flesh_pool_wait; the caller frees the answer of an end. */
int flesh_places_start(flesh_places *places, int number, int *started);
int flesh_places_wait(flesh_places *places, int milliseconds, flesh_pool_end *end);
/* Asks running processes to end, once; those that have not ended 2 s later are killed. */
void flesh_places_stop(flesh_places *places);

/* Orders of the first rank. */
enum {
  FLESH_POOL_RUN,  /* run the case of this number */
  FLESH_POOL_STOP, /* ask running cases to end */
  FLESH_POOL_OVER, /* kill running cases: there are no more; to be answered */
  FLESH_POOL_LEAVE /* leave with this exit code; to be answered */
};

/* Messages to the first rank. */
enum {
  FLESH_POOL_ENDED,    /* a case has ended; its answer is behind the head */
  FLESH_POOL_LACKS,    /* no process could be had for a case; the sentence is behind the head */
  FLESH_POOL_SIGNALLED, /* the rank has received the signal of this number */
  FLESH_POOL_DONE      /* the rank will send nothing more */
};

typedef struct flesh_pool_order {
  int kind, number;
} flesh_pool_order;

typedef struct flesh_pool_head {
  int kind, number;
  int ended, killed;
  double seconds;
} flesh_pool_head;

#endif
