/* extrapolation.h: where the next step leads when a motion goes on as it did. */
#ifndef FLESH_TIME_EXTRAPOLATION_H
#define FLESH_TIME_EXTRAPOLATION_H

#include <stddef.h>

#include "base/archive.h"
#include "flesh/integrator.h"
#include "flesh/threads.h"

enum { FLESH_EXTRAPOLATION_POINTS = 7 };

/* Displacements over the last steps, of one length and each easily solved. */
typedef struct flesh_extrapolation {
  flesh_threads *threads;
  int n, own;   /* numbers of each, and those that products are of: this rank's own */
  int known;    /* how many, newest first */
  double t, h;  /* of the newest; s */
  double *u[FLESH_EXTRAPOLATION_POINTS]; /* [n] each, m */
  double *memory; /* [POINTS * n] where all of u lie, in changing order */
  long serial; /* of the state at the newest's end (system/evaluation.h) */
  double products[FLESH_EXTRAPOLATION_POINTS][FLESH_EXTRAPOLATION_POINTS]; /* u_i . u_j */
} flesh_extrapolation;

/* `threads` (may be NULL) is borrowed. */
int flesh_extrapolation_create(int n, int own, flesh_threads *threads, flesh_extrapolation *self);
void flesh_extrapolation_clear(flesh_extrapolation *self);

void flesh_extrapolation_archive(flesh_extrapolation *self, flesh_archive *archive);

/* Nothing is known. */
void flesh_extrapolation_forget(flesh_extrapolation *self);

/* The displacement u [3*n] of a step of h from the state at t with this serial number, by a recurrence u_0 = w_1 u_1 +
 * w_2 u_2 + ... of those before: that of a polynomial in time, or the one that fits the last step best, such as the
 * vibrations of a few modes obey (linear prediction, Makhoul 1975), whichever would have predicted the last step better
 * from those before it. Of up to three, their polynomial. Returns 0 where nothing is known that leads to this state. */
int flesh_extrapolation_guess(const flesh_extrapolation *self, long serial, double t, double h, double *u);

/* Takes in a step of h by u [3*n] to the state at t with this serial number; one that was hard to solve (`easy` is 0)
 * makes what came before worthless. */
void flesh_extrapolation_remember(flesh_extrapolation *self, const double *u, long serial, double t, double h, int easy);

#endif
