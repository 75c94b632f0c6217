/* tape.h: reports the parts of steps that a run takes to a tape, which differentiates the run. */
#ifndef FLESH_TIME_TAPE_H
#define FLESH_TIME_TAPE_H

#include "time/method.h"
#include "time/step_place.h"

/* An accepted part, before the state goes to its end. */
typedef struct flesh_taken_part {
  const flesh_method_row *row; /* the method's own row, or that of what stands in */
  int own, second;             /* the row is of the method's kind; constrained dofs follow the prescribed motion itself */
  int acceleration;            /* the method's own row remembers the acceleration */
  int anew;                    /* the method has begun anew at the state */
  int starts;                  /* the part takes no time: with it the method begins */
  const flesh_method_memory *memory;
  const flesh_state *from, *lagged; /* equal if the lagged state is the one at which the part begins */
  double begin, end, h;             /* s; the part's span, short of events at its ends, and its length */
  double seen;                      /* s; end of the prescribed motion with which the method has begun anew */
} flesh_taken_part;

typedef struct flesh_tape {
  void *data;
  int anew;      /* the method has begun anew since the last part */
  double seen;   /* s; end of the prescribed motion with which it has */
  double *jump;  /* [2*n] jumps of x and v since the last part: of constrained dofs, and of free ones that follow */
  int untangled; /* nodes have moved other than by a step */
  /* A try of a part begins: what was solved since the last part that was taken does not count. */
  void (*try_part)(void *data);
  /* The stage memory->at has been solved with the unknowns u [n]; again, if it was solved again for lagged loads. */
  int (*solved)(void *data, const flesh_stage *stage, int at, const double *u);
  int (*taken)(void *data, const flesh_taken_part *part);
  /* The run is between two parts, and the integrator remembers the state; a status other than FLESH_OK ends the step
   * with that status. */
  int (*pass)(void *data, const flesh_step_place *place);
  /* The caller hands the integrator another state than the last step's end. */
  int (*moved)(void *data);
  void (*gone)(void *data); /* The integrator is destroyed. */
} flesh_tape;

#endif
