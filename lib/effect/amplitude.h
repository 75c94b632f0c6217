/* amplitude.h: the factor by which a load is scaled as a function of time. */
#ifndef FLESH_EFFECT_AMPLITUDE_H
#define FLESH_EFFECT_AMPLITUDE_H

#include "flesh/effects.h"
#include "geometry/motion.h"

typedef struct flesh_amplitude_copy {
  flesh_motion curve; /* its translation's first component is the factor; count 0: the factor is 1 */
  double from, until;
} flesh_amplitude_copy;

/* Checks and copies `amplitude`; NULL stands for a factor of 1 at all times. Free the copy with flesh_amplitude_clear.
 * FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
int flesh_amplitude_take(const flesh_amplitude *amplitude, flesh_amplitude_copy *copy);
/* Makes another copy, to be freed as well. FLESH_ERR_MEMORY. */
int flesh_amplitude_copy_of(const flesh_amplitude_copy *amplitude, flesh_amplitude_copy *copy);
void flesh_amplitude_clear(flesh_amplitude_copy *amplitude);
/* Returns the bytes of memory that the copy uses besides itself. */
size_t flesh_amplitude_memory(const flesh_amplitude_copy *amplitude);

/* Returns the factor at t; 0 unless from <= t < until. */
double flesh_amplitude_at(const flesh_amplitude_copy *amplitude, double t);
double flesh_amplitude_next_event(const flesh_amplitude_copy *amplitude, double t);

#endif
