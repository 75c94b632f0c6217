/* indicator.h: the share of each tet in a mesh's error of a quantity: goal-oriented recovery (Zienkiewicz & Zhu 1992 with
 * the dual problem's weights; Becker & Rannacher 2001). */
#ifndef FLESH_ERROR_INDICATOR_H
#define FLESH_ERROR_INDICATOR_H

#include "flesh/scene.h"

/* Fills indicators [tets], not negative, of the equilibrium `state` of the scene, whose tets all have ten nodes. `column`
 * is a column of probes: of a position at a point the adjoint solves K lambda = dQ/du; for all others the displacement
 * stands for lambda, which is the adjoint of the loads' work. *sum gets the estimate |main| + |vol|, in the quantity's
 * unit, of a position at a point; NaN of others. FLESH_ERR_MEMORY, FLESH_ERR_SOLVE. */
int flesh_error_indicate(const flesh_scene *scene, const flesh_state *state, const char *column, double *indicators,
                         double *sum);

#endif
