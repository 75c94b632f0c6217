/* pool_places.h: within the pool: the processes that are on this machine, of this rank, and what the ranks tell each other. */
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

/* How many of `jobs` processes at a time make sense for `count` pieces of work, and can be had: no more than there is
 * work for, and than files may be open, a pipe for each (that limit is raised as far as it may be). At least 1. */
int flesh_places_fit(int jobs, int count);

/* FLESH_ERR_MEMORY. To be closed in any case. */
int flesh_places_open(int room, const flesh_pool_cases *cases, flesh_places *places);
/* Ends what runs. */
void flesh_places_close(flesh_places *places);
/* The next two as those of a pool; the answer of an end is the caller's to free. */
int flesh_places_start(flesh_places *places, int number, int *started);
int flesh_places_wait(flesh_places *places, int milliseconds, flesh_pool_end *end);
/* Asks what runs to end, once; what has not, 2 s later, is killed. */
void flesh_places_stop(flesh_places *places);

/* From the first rank. */
enum {
  FLESH_POOL_RUN,  /* the case of this number */
  FLESH_POOL_STOP, /* what runs is asked to */
  FLESH_POOL_OVER, /* no more cases: what runs is ended; to be answered */
  FLESH_POOL_LEAVE /* with this exit code; to be answered */
};

/* To the first rank. */
enum {
  FLESH_POOL_ENDED,    /* a case, with its answer behind the head */
  FLESH_POOL_LACKS,    /* no process could be had for it; the sentence is behind the head */
  FLESH_POOL_SIGNALLED, /* the rank was, by this number */
  FLESH_POOL_DONE      /* it has nothing more to say */
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
