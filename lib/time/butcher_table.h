/* butcher_table.h: the coefficients of diagonally implicit Runge-Kutta methods. */
#ifndef FLESH_TIME_BUTCHER_TABLE_H
#define FLESH_TIME_BUTCHER_TABLE_H

#include "flesh/integrator.h"

enum { FLESH_TABLE_STAGES = 5 };

/* Stage i is at t + c[i] h, with the derivatives of the stages j <= i weighted by a[i][j]; the first stage is explicit,
 * the others have the same diagonal. The last row of a has the weights b of the step (stiffly accurate). */
typedef struct flesh_butcher_table {
  int stages, order;
  double c[FLESH_TABLE_STAGES], a[FLESH_TABLE_STAGES][FLESH_TABLE_STAGES];
  double embedded[FLESH_TABLE_STAGES]; /* weights of a method of another order, for the error */
} flesh_butcher_table;

/* Returns the table of that name, which is not FLESH_TABLE_AUTO. */
const flesh_butcher_table *flesh_butcher_table_of(flesh_table table);

/* Backward Euler as a table; its error is its difference from the trapezoidal rule. */
extern const flesh_butcher_table flesh_butcher_backward_euler;

/* Names of the tables in a scene, in the order of the enum; NULL ends them. */
extern const char *const flesh_table_names[];

#endif
