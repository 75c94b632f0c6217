/* pool_cases.h: what the cases of a pool are, and what is known of one that has ended. */
#ifndef FLESH_POOL_POOL_CASES_H
#define FLESH_POOL_POOL_CASES_H

#include "scene/arena.h"

/* The data that all cases share, on all ranks. */
typedef struct flesh_pool_cases {
  /* Does one, in a process of its own, and writes what is to be known of it. Borrows `data`. */
  void (*work)(const void *data, int number, flesh_text *answer);
  const void *data;
  double max_seconds; /* after which its process is ended; 0: never */
} flesh_pool_cases;

/* A case that has ended. */
typedef struct flesh_pool_end {
  int number;        /* -1: none has */
  int ended, killed; /* what waitpid says of its process; 1: its time was spent */
  double seconds;    /* it took */
  flesh_text answer; /* borrowed until the next wait */
} flesh_pool_end;

#endif
