/* end.h: what the end of a run of the battery is: its rest shape, its rank, a minimum or
 * not. */
#ifndef FLESH_HARDCASES_END_H
#define FLESH_HARDCASES_END_H

#include "flesh/scene.h"
#include "hardcases/hardcases.h"

/* The shape that the scene's body rests in with the pins that are left at time t, as a mesh; new,
 * or NULL where there is none or none is found (a form that collapses). */
void flesh_hardcases_rest_shape(const flesh_scene *scene, double t, flesh_mesh **rest);

/* Dimensions that the body fills: 0 a point ... 3; an extent below 1e-6 of the rest shape's length
 * is none. */
int flesh_hardcases_rank(const flesh_mesh *mesh, const double *x);

/* Looks for the equilibrium at the end `x` [3*nodes] by a static solve from there and says what it
 * is in figures->end, gradient, smallest_eigenvalue, negative_eigenvalues. `rest` may be NULL. */
void flesh_hardcases_judge_end(const flesh_scene *scene, double t, const double *x,
                               const flesh_mesh *rest, flesh_hardcases_figures *figures);

#endif
