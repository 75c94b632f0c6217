/* pool_cases.h: the cases of a pool, and what is known of a case that has ended. */
#ifndef FLESH_POOL_POOL_CASES_H
#define FLESH_POOL_POOL_CASES_H

#include "scene/arena.h"

/* The cases, with the data that they share, the same on all ranks. */
typedef struct flesh_pool_cases {
  /* Does a case, in a process of its own, and writes its answer. Borrows `data`. */
  void (*work)(const void *data, int number, flesh_text *answer);
  const void *data;
  double max_seconds; /* time after which the case's process is killed; 0: never */
} flesh_pool_cases;

/* The end of a case. */
typedef struct flesh_pool_end {
  int number;        /* -1: no case has ended */
  int ended, killed; /* status of waitpid for its process; 1: killed because its time was over */
  double seconds;    /* that it took */
  flesh_text answer; /* borrowed until the next wait */
} flesh_pool_end;

#endif
