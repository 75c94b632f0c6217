/* mixing.h: finds a fixed point x = g(x) by Anderson's mixing (Anderson 1965; Walker & Ni 2011, SIAM J. Numer. Anal.
 * 49), also where x -> g(x), repeated, swings ever wider. */
#ifndef FLESH_TIME_MIXING_H
#define FLESH_TIME_MIXING_H

#include "flesh/threads.h"

enum { FLESH_MIXING_DEPTH = 5 };

typedef struct flesh_mixing {
  flesh_threads *threads;
  int n, count; /* size of x; number of values of g so far */
  double *x;    /* [n] next place to evaluate g; memory of all arrays */
  double *value, *change; /* [n] last g(x), and g(x) - x */
  /* [n] differences of both between values; those of value k are at k modulo the depth */
  double *values[FLESH_MIXING_DEPTH], *changes[FLESH_MIXING_DEPTH];
} flesh_mixing;

/* Allocates room for n > 0 numbers, else nothing; borrows `threads`. FLESH_ERR_MEMORY. */
int flesh_mixing_create(int n, flesh_threads *threads, flesh_mixing *self);
void flesh_mixing_clear(flesh_mixing *self);

void flesh_mixing_begin(flesh_mixing *self, const double *x);
/* Takes in g(x) [n]. The next x is g(x) after the first two values; then it is where g(x) - x would be smallest if g
 * were linear between the last values. */
void flesh_mixing_go_on(flesh_mixing *self, const double *value);

#endif
