/* amplitude.h: how much of a load acts at a time. */
#ifndef FLESH_EFFECT_AMPLITUDE_H
#define FLESH_EFFECT_AMPLITUDE_H

#include "flesh/effects.h"
#include "geometry/motion.h"

typedef struct flesh_amplitude_copy {
  flesh_motion curve; /* the factor is its translation's first component; count 0: 1 */
  double from, until;
} flesh_amplitude_copy;

/* Checks and copies; NULL: 1 at all times. Free with flesh_amplitude_clear. */
int flesh_amplitude_take(const flesh_amplitude *amplitude, flesh_amplitude_copy *copy);
/* Another copy, to be freed as well. FLESH_ERR_MEMORY. */
int flesh_amplitude_copy_of(const flesh_amplitude_copy *amplitude, flesh_amplitude_copy *copy);
void flesh_amplitude_clear(flesh_amplitude_copy *amplitude);
/* Bytes that it holds. */
size_t flesh_amplitude_memory(const flesh_amplitude_copy *amplitude);

/* The factor at t; 0 outside of from <= t < until. */
double flesh_amplitude_at(const flesh_amplitude_copy *amplitude, double t);
double flesh_amplitude_next_event(const flesh_amplitude_copy *amplitude, double t);

#endif
