/* method_map.h: a step of a method as a linear map: each of its stages is affine in the vectors known at the beginning of
 * the step and in the earlier stages, and so is its end, with the same coefficients for every dof. The method itself gives
 * the coefficients, when it is applied to one dof, so that every method has them (time/method.h). */
#ifndef FLESH_SENSITIVITY_METHOD_MAP_H
#define FLESH_SENSITIVITY_METHOD_MAP_H

#include "time/method.h"

/* Columns of the known vectors: x, v, the method's vectors, and x and v of the state at which forces are lagged. */
enum {
  FLESH_KNOWN_X, FLESH_KNOWN_V, FLESH_KNOWN_VECTORS,
  FLESH_KNOWN_LAGGED_X = FLESH_KNOWN_VECTORS + FLESH_METHOD_VECTORS, FLESH_KNOWN_LAGGED_V, FLESH_KNOWN,
  FLESH_MAP_STAGES = 4, FLESH_MAP_COLUMNS = FLESH_KNOWN + FLESH_MAP_STAGES
};

/* Columns: the known vectors, then the unknowns of the stages. */
typedef struct flesh_method_map {
  int stages, vectors; /* number of vectors that last from step to step */
  double x0[FLESH_MAP_STAGES][FLESH_MAP_COLUMNS], v0[FLESH_MAP_STAGES][FLESH_MAP_COLUMNS],
      a0[FLESH_MAP_STAGES][FLESH_MAP_COLUMNS];         /* bases of the stages */
  flesh_shift shift[FLESH_MAP_STAGES];
  double end[FLESH_KNOWN][FLESH_MAP_COLUMNS]; /* known vectors at the end */
} flesh_method_map;

/* Finds the map of a step of h by `row`. Reads all of `memory` but the vectors. `takes_over`: `row` replaces a method that
 * remembers the acceleration, which is then that of the stage. */
void flesh_method_map_find(const flesh_method_row *row, const flesh_method_memory *memory, int vectors, double h,
                           int takes_over, flesh_method_map *map);

#endif
