/* pool_slots.h: internal to the pool: the processes of this rank on this machine, and the messages between ranks. */
#ifndef FLESH_POOL_POOL_SLOTS_H
#define FLESH_POOL_POOL_SLOTS_H

#include "pool/pool_cases.h"

typedef struct flesh_pool_process flesh_pool_process;

typedef struct flesh_slots {
  const flesh_pool_cases *cases;
  int room, limit; /* number of slots; limit on those in use */
  int running, stopped;
  flesh_pool_process *processes; /* [room] */
  struct pollfd *polls;          /* [room] */
} flesh_slots;

/* Returns how many processes at a time make sense for `count` cases and can be had, at most `jobs` and at least 1: no
 * more than cases, and no more than the limit on open files allows, as each needs a pipe (that limit is raised as far
 * as possible). */
int flesh_slots_fit(int jobs, int count);

/* Makes the slots. FLESH_ERR_MEMORY. They must be closed even after an error. */
int flesh_slots_open(int room, const flesh_pool_cases *cases, flesh_slots *slots);
/* Kills what runs. */
void flesh_slots_close(flesh_slots *slots);
/* Do the same as flesh_pool_start and flesh_pool_wait; the caller frees the answer of an end. */
int flesh_slots_start(flesh_slots *slots, int number, int *started);
int flesh_slots_wait(flesh_slots *slots, int milliseconds, flesh_pool_end *end);
/* Asks running processes to end, once; those that have not ended 2 s later are killed. */
void flesh_slots_stop(flesh_slots *slots);

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

/* An order or a message; the last three members are of a case that has ended. */
typedef struct flesh_pool_message {
  int kind, number;
  int ended, killed;
  double seconds;
} flesh_pool_message;

#endif
