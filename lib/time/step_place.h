/* step_place.h: how far a step in time has come. */
#ifndef FLESH_TIME_STEP_PLACE_H
#define FLESH_TIME_STEP_PLACE_H

#include "time/recovery/recovery.h"

/* A piece of time without events inside; those at its ends (within rounding of the state's time) are distinguished so
 * that the piece sees what holds between them. */
typedef struct flesh_piece {
  double begin; /* the first time that belongs to it */
  double end;   /* of the piece */
  double event; /* the next event after `begin`; at `end`, later, or INFINITY */
} flesh_piece;

/* Before a part of a step, where the step can be continued from. */
typedef struct flesh_step_place {
  double begin, h;         /* s, of the step */
  int at_begin;            /* no part of the step has been tried */
  int in_piece;            /* `piece` and what follows are of the piece under way; 0: a piece begins here */
  flesh_piece piece;
  flesh_cutbacks cutbacks; /* of the piece, where its parts are given */
  int tries;               /* of parts whose length errors choose, in the step so far */
} flesh_step_place;

#endif
