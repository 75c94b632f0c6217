/* pressure_curved.h: a pressure on the curved faces of ten-node tets. */
#ifndef FLESH_EFFECT_PRESSURE_CURVED_H
#define FLESH_EFFECT_PRESSURE_CURVED_H

#include "effect/amplitude.h"
#include "flesh/effects.h"

/* A node's part in G and h of a pair. */
typedef struct flesh_curved_wing {
  int pair[2], node;
  double now, lagged;
} flesh_curved_wing;

/* e_kab. */
typedef struct flesh_curved_rim {
  int k, a, b;
  double e;
} flesh_curved_rim;

typedef struct flesh_curved_pressure {
  flesh_cells pairs; /* of nodes; the Jacobian's cells */
  int *first;        /* [pairs.count+1] */
  int wing_count;
  flesh_curved_wing *wings;       /* sorted by pairs */
  int rim_count;
  flesh_curved_rim *rim;     /* sorted by k */
  int node_count, *nodes; /* whose mean is c; of a part those that the rank owns */
  flesh_cells ties;       /* of a pair with a wing, of the three nodes at the rim: what one rank has to have all of */
  double pressure;   /* Pa */
  double volume;     /* W at rest, where there is no rim */
  flesh_amplitude_copy amplitude;
} flesh_curved_pressure;

extern const flesh_effect_ranks flesh_curved_pressure_ranks;
void flesh_curved_pressure_destroy(void *pressure);

/* flesh_effect_pressure on a mesh of order 2, its arguments checked. */
int flesh_pressure_curved(const flesh_body *body, int count, const int *triangles, double pressure,
                          const flesh_amplitude *amplitude, flesh_effect **effect);

#endif
