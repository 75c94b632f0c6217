/* run_trace.h: what is kept of every step of a run, to judge it at its end. */
#ifndef FLESH_RUN_RUN_TRACE_H
#define FLESH_RUN_RUN_TRACE_H

#include "flesh/observer.h"

/* Zero-initialise. */
typedef struct flesh_run_trace {
  int count, room;
  struct {
    double t, kinetic, strain; /* s, J, J relative to the mesh's rest shape */
    long newton, linear;       /* iterations */
    long step;                 /* 0: the start */
  } *rows;
} flesh_run_trace;

int flesh_run_trace_observe(void *trace, const flesh_step_record *record);
void flesh_run_trace_clear(flesh_run_trace *trace);

#endif
