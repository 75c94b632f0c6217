/* step_place.h: how far a step in time has come. */
#ifndef FLESH_TIME_STEP_PLACE_H
#define FLESH_TIME_STEP_PLACE_H

#include "time/recovery/recovery.h"

/* A piece of time without events inside. Events at its ends (within rounding of the state's time) belong to it or not,
 * so that the piece sees the effects that hold between them. */
typedef struct flesh_piece {
  double begin; /* first time that belongs to it */
  double end;   /* of the piece */
  double event; /* next event after `begin`: at `end`, later, or INFINITY */
} flesh_piece;

/* The place before a part of a step, from which the step can be continued. */
typedef struct flesh_step_place {
  double begin, h;         /* s, of the step */
  int at_begin;            /* no part of the step has been tried */
  int in_piece;            /* `piece` and what follows are of the piece under way; 0: a piece begins here */
  flesh_piece piece;
  flesh_cutbacks cutbacks; /* parts of the piece, where their lengths are given */
  int tries;               /* number of parts so far in the step, where errors choose their lengths */
} flesh_step_place;

#endif
