/* watch.h: what is observed while a run of the battery goes on. */
#ifndef FLESH_HARDCASES_WATCH_H
#define FLESH_HARDCASES_WATCH_H

#include "flesh/observer.h"
#include "hardcases/hardcases.h"

typedef struct flesh_hardcases_watch {
  const flesh_mesh *rest; /* the shape to come back to, borrowed; NULL: none */
  const char *folder;     /* frames for pictures go here */
  double early;           /* t of the second of them */
  flesh_hardcases_figures *figures;
  /* Own. */
  int unknowns, phase, kept_first, kept_early;
  double clock, now;
  flesh_state last;       /* of the step before */
  double *point, *zero;   /* [3*unknowns] x, v, a; [unknowns] */
  int count, room, timed; /* steps; of them those of the first phase */
  struct {
    int newton;
    double seconds;
  } * cost;
} flesh_hardcases_watch;

int flesh_hardcases_watch_open(flesh_hardcases_watch *watch, const flesh_mesh *mesh);
void flesh_hardcases_watch_close(flesh_hardcases_watch *watch);
/* From now on the steps are of the next phase. */
void flesh_hardcases_watch_release(flesh_hardcases_watch *watch);
/* The medians and the end, into the figures. */
void flesh_hardcases_watch_finish(flesh_hardcases_watch *watch);

int flesh_hardcases_watch_observe(void *watch, const flesh_step_record *record);

#endif
