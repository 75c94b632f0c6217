/* volume_arc.h: corrects Newton steps to second order, so that nearly incompressible elements get the change of volume that
 * the step predicts to first order. */
#ifndef FLESH_NEWTON_VOLUME_ARC_H
#define FLESH_NEWTON_VOLUME_ARC_H

#include "newton/direction.h"

typedef struct flesh_volume_arc {
  flesh_equations *equations; /* borrowed */
  flesh_direction *direction; /* borrowed; its preconditioner has the volume projection */
  flesh_stiff_rows trial;     /* stiff rows at the end of the step; all zero: no rank has any */
  float *wanted, *error;      /* [rows] wanted changes of volume, and their errors */
  int bent;                   /* the present step was bent, and its volumes are to change as `wanted` says */
} flesh_volume_arc;

/* Makes room for the rows. FLESH_ERR_MEMORY. */
int flesh_volume_arc_init(flesh_equations *equations, flesh_direction *direction, flesh_volume_arc *arc);
void flesh_volume_arc_clear(flesh_volume_arc *arc);

/* Bends the Newton step p [n] at u, where the residual is -b: replaces it by s p, s = 1, 1/2 ..., plus a second-order
 * correction of its volumes, if that lowers the potential as far as s p should. Leaves p unchanged otherwise, and also
 * where straight steps keep volumes well enough, or the preconditioner projects nothing. */
void flesh_volume_arc_bend(flesh_volume_arc *arc, const double *u, const double *b, double *p);

/* Writes into q [n] the step along the arc of the bent step p [n] at twice its length. Returns 0 if p was not bent. To
 * double once more, pass the q of this call as p. */
int flesh_volume_arc_double(flesh_volume_arc *arc, const double *u, const double *p, double *q);

/* Moves a solve's first iterate u [n], which was extrapolated in straight lines, so that volumes are those of the stage's
 * x0, if that lowers the potential. Does nothing if constrained dofs move. */
void flesh_volume_arc_start(flesh_volume_arc *arc, double *u);

#endif
