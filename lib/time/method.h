/* method.h: what a fixed-step implicit method is: how its unknown moves the point, and the state it leads to.
 *
 * A new method is one file with a flesh_method_row and one line in FLESH_METHOD_LIST. The unknown of every method
 * is the displacement over the whole step, x_{n+1} = x_n + u, so that differences of nearby positions never cancel.
 * Methods need not mind constraints: where order > 1 the integrator lets the constrained dofs of the stage and of
 * the new state follow the prescribed motion itself, with its velocity and acceleration, and no step crosses a time
 * at which an effect or constraint stops being smooth. */
#ifndef FLESH_TIME_METHOD_H
#define FLESH_TIME_METHOD_H

#include "flesh/integrator.h"
#include "flesh/kinsol.h"

enum { FLESH_METHOD_VECTORS = 2 };

/* The memory of a method between steps. */
typedef struct flesh_method_memory {
  int n;                                 /* unknowns */
  flesh_method_options options;          /* alpha, beta, gamma */
  double *v0, *a0;                       /* [n] room for the stage's base */
  double *vectors[FLESH_METHOD_VECTORS]; /* [n] row->vectors of them are there */
  /* Whether the vectors belong to the state at hand; 0 at the start, after an event and when the caller hands
   * another state than it was given back. */
  int known;
  long serial; /* of the state that they belong to (system/evaluation.h) */
  double h;    /* of the step that led there, where known */
} flesh_method_memory;

typedef struct flesh_method_row {
  int vectors;
  int acceleration; /* 1: vectors[0] is the state's acceleration; the integrator finds it where not known */
  /* The stage of the step of h from `state` to t_end. */
  void (*stage)(const flesh_method_memory *memory, const flesh_state *state, double t_end, double h,
                flesh_stage *stage);
  /* Takes the state's x and v, and the memory, to the end of the step, reached with the unknowns u. */
  void (*finish)(flesh_method_memory *memory, const double *u, double h, flesh_state *state);
} flesh_method_row;

#define FLESH_METHOD_EXTERN(NAME, name, text, order, doc)                                          \
  extern const flesh_method_row flesh_method_##name;
FLESH_METHOD_LIST(FLESH_METHOD_EXTERN)
#undef FLESH_METHOD_EXTERN

/* NULL when there is none. */
const flesh_method_row *flesh_method_find(flesh_method method);

/* Names as in a scene, in the order of the enum, NULL at the end. */
extern const char *const flesh_method_names[];

#endif
