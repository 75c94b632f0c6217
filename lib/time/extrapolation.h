/* extrapolation.h: predicts where the next step leads from the displacements of the last ones. */
#ifndef FLESH_TIME_EXTRAPOLATION_H
#define FLESH_TIME_EXTRAPOLATION_H

#include "base/archive.h"
#include "flesh/integrator.h"
#include "flesh/threads.h"

enum { FLESH_EXTRAPOLATION_POINTS = 7 };

/* Displacements of the last steps, all of one length and easily solved. */
typedef struct flesh_extrapolation {
  flesh_threads *threads;
  int n, own;   /* numbers of each; numbers in products: this rank's own */
  int known;    /* number of displacements, newest first */
  double t, h;  /* s, length of the newest */
  double *u[FLESH_EXTRAPOLATION_POINTS]; /* [n] each, m */
  double *memory; /* [POINTS * n] memory of all u, in changing order */
  long serial; /* serial number of the state at the newest's end (system/evaluation.h) */
  double products[FLESH_EXTRAPOLATION_POINTS][FLESH_EXTRAPOLATION_POINTS]; /* u_i . u_j */
} flesh_extrapolation;

/* `threads` (may be NULL) is borrowed. */
int flesh_extrapolation_create(int n, int own, flesh_threads *threads, flesh_extrapolation *self);
void flesh_extrapolation_clear(flesh_extrapolation *self);

void flesh_extrapolation_archive(flesh_extrapolation *self, flesh_archive *archive);

/* Nothing is known. */
void flesh_extrapolation_forget(flesh_extrapolation *self);

/* Predicts the displacement u [3*n] of a step of h from the state at t with this serial number, by a recurrence u_0 =
 * w_1 u_1 + w_2 u_2 + ... of the displacements before: a polynomial in time, or the recurrence that fits the last step
 * best, as vibrations of a few modes obey one (linear prediction, Makhoul 1975), whichever would have predicted the
 * last step better. With up to three displacements it is their polynomial. Returns 0 if no displacement leads to this
 * state. */
int flesh_extrapolation_guess(const flesh_extrapolation *self, long serial, double t, double h, double *u);

/* Takes in a step of h by u [3*n] to the state at t with this serial number. A step that was hard to solve (`easy` is
 * 0) drops the displacements before it. */
void flesh_extrapolation_remember(flesh_extrapolation *self, const double *u, long serial, double t, double h, int easy);

#endif
