/* patch.h: minimises a stage's potential over the few nodes that carry its residual, all others held. */
#ifndef FLESH_INTEGRATOR_PATCH_H
#define FLESH_INTEGRATOR_PATCH_H

#include "sundials/problem.h"

/* Nonlinear elimination (Lanzkron, Rose & Wilkes 1996): w [3*n], 0 but at the patch's nodes, so that u + w has less
 * potential than u, as far as a model of all that is no sum over elements tells; the caller makes sure. r [3*n] is the
 * residual at u, and the problem's K was assembled near it. FLESH_OK; FLESH_NOT_CONVERGED where the patch would be no
 * small part of the body; < 0: errors. Counts in problem->stats. */
int flesh_patch_solve(flesh_problem *problem, const double *u, const double *r, double *w);

#endif
