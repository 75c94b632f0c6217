/* method.h: what an implicit one-step method is: how its unknown moves the point, and the state it leads to. */
#ifndef FLESH_INTEGRATOR_METHOD_H
#define FLESH_INTEGRATOR_METHOD_H

#include "flesh/integrator.h"
#include "flesh/kinsol.h"

typedef struct flesh_method_row {
  const char *name; /* as in a scene */
  /* The stage that ends a step of h from `state`; `base` [2*3*n] is room for v0 and a0. */
  void (*stage)(const flesh_state *state, double h, int unknowns, double *base, flesh_stage *stage);
  /* Writes the state at t+h, reached with the unknowns u. */
  void (*finish)(const flesh_stage *stage, const double *u, double h, int unknowns,
                 flesh_state *state);
} flesh_method_row;

const flesh_method_row *flesh_method_find(flesh_method method);

#endif
