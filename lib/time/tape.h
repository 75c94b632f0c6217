/* tape.h: what a run tells of the parts of steps that it takes, for whoever differentiates it. */
#ifndef FLESH_TIME_TAPE_H
#define FLESH_TIME_TAPE_H

#include "time/method.h"
#include "time/step_place.h"

/* A part that is accepted, before the state goes to its end. */
typedef struct flesh_taken_part {
  const flesh_method_row *row; /* the method's own, or backward Euler in its stead */
  int own, second;             /* the row is the method's own; constrained dofs follow the prescribed motion itself */
  int acceleration;            /* the method's own row remembers the acceleration */
  int anew;                    /* the method has begun anew at the state */
  int starts;                  /* the part takes no time: with it the method begins */
  const flesh_method_memory *memory;
  const flesh_state *from, *lagged; /* equal where the lagged state is the one at which the part begins */
  double begin, end, h;             /* s; as far as what holds within the part does, and its length */
  double seen;                      /* s; the prescribed motion up to there is that with which the method has begun anew */
} flesh_taken_part;

typedef struct flesh_tape {
  void *data;
  int anew;      /* the method has begun anew since the last part */
  double seen;   /* s; with the prescribed motion up to there */
  double *jump;  /* [2*n] how far x and v have jumped since the last part, as constrained dofs do and free ones follow */
  int untangled; /* nodes have been moved by what is no step */
  /* A try of a part begins: what was solved since the last part that was taken does not count. */
  void (*try_part)(void *data);
  /* The stage memory->at has been solved with the unknowns u [n]; again, where what is lagged is followed. */
  int (*solved)(void *data, const flesh_stage *stage, int at, const double *u);
  int (*taken)(void *data, const flesh_taken_part *part);
  /* The run is between two parts, and the integrator remembers the state; a status other than FLESH_OK ends the step with
   * that status. */
  int (*pass)(void *data, const flesh_step_place *place);
  /* The caller hands the integrator another state than the last step's end. */
  int (*moved)(void *data);
  void (*gone)(void *data); /* the integrator is destroyed */
} flesh_tape;

#endif
