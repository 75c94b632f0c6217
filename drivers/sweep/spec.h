/* spec.h: what a spec's keys are read into, within the modules that read it. */
#ifndef FLESH_SWEEP_SPEC_H
#define FLESH_SWEEP_SPEC_H

#include "sweep/sweep.h"

/* In the order of the names of spacings. */
enum { FLESH_SWEEP_LINEAR, FLESH_SWEEP_LOGARITHMIC };

typedef struct flesh_sweep_axis {
  char *key, *name;
  const flesh_node *values;
  double from, to;
  int count, spacing;
  flesh_objects zip;
  struct flesh_sweep_axis_sample {
    int sequence, count, seed, skip;
    flesh_objects axes;
  } sample;
} flesh_sweep_axis;

typedef struct flesh_sweep_derived_row {
  char *name, *is;
} flesh_sweep_derived_row;

typedef struct flesh_sweep_spec {
  char *title, *scene;
  int repeats, seed, keep;
  double max_seconds;
  const flesh_node *set;
  flesh_objects axes, columns;
} flesh_sweep_spec;

extern const flesh_key flesh_sweep_spec_table[]; /* into flesh_sweep_spec */

/* Every constant and every value of every axis must be one that its key takes. What a combination makes of them is for
 * its case to say. */
int flesh_sweep_check_values(flesh_sweep *sweep);
/* Computes sweep->fingerprint, a hash of the plan: a sweep may only be gone on with when it is the same. */
int flesh_sweep_make_fingerprint(flesh_sweep *sweep);

#endif
