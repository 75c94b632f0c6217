/* pool_orders.h: what the ranks of a pool tell each other. */
#ifndef FLESH_POOL_POOL_ORDERS_H
#define FLESH_POOL_POOL_ORDERS_H

#include "pool/pool_cases.h"

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

/* Works as a rank behind the first, until it is told to leave; returns the exit code that it is told. */
int flesh_pool_serve(int jobs, const flesh_pool_cases *cases);

#endif
