/* mixing.h: a fixed point x = g(x) by Anderson's mixing (Anderson 1965; Walker & Ni 2011, SIAM J. Numer. Anal. 49): it is
 * found also where x -> g(x), repeated, swings ever wider. */
#ifndef FLESH_TIME_MIXING_H
#define FLESH_TIME_MIXING_H

#include "flesh/threads.h"

enum { FLESH_MIXING_DEPTH = 5 };

typedef struct flesh_mixing {
  flesh_threads *threads;
  int n, count; /* numbers of x; values of g so far */
  double *x;    /* [n] where g is to be taken next; where all arrays lie */
  double *value, *change; /* [n] the last g(x), and g(x) - x */
  /* [n] how both differ from those before; of k in k modulo the depth. */
  double *values[FLESH_MIXING_DEPTH], *changes[FLESH_MIXING_DEPTH];
} flesh_mixing;

/* Room for n > 0 numbers, else for nothing; borrows `threads`. FLESH_ERR_MEMORY. */
int flesh_mixing_create(int n, flesh_threads *threads, flesh_mixing *self);
void flesh_mixing_clear(flesh_mixing *self);

void flesh_mixing_begin(flesh_mixing *self, const double *x);
/* Takes g(x) [n]. The next x is g(x) after the first two values, then that at which g(x) - x would be least if g were linear
 * between the last ones. */
void flesh_mixing_go_on(flesh_mixing *self, const double *value);

#endif
