/* indicator.h: the share of each tet in a mesh's error of a quantity: goal-oriented recovery (Zienkiewicz & Zhu 1992 with
 * the dual problem's weights; Becker & Rannacher 2001). */
#ifndef FLESH_ERROR_INDICATOR_H
#define FLESH_ERROR_INDICATOR_H

#include "flesh/scene.h"

/* Fills indicators [tets], of either sign, of the equilibrium `state` of the scene, whose tets all have ten nodes. `column`
 * is a column of probes. Of a position at a point, which *is_goal tells, the adjoint solves K lambda = dQ/du, and the
 * indicators are shares of its error in m; for all others the displacement stands for lambda, which is the adjoint of the
 * loads' work. They count tets that boxes of body.regions cut, whose shares' sum is *cut_off. FLESH_ERR_MEMORY, FLESH_ERR_SOLVE. */
int flesh_error_indicate(const flesh_scene *scene, const flesh_state *state, const char *column, double *indicators,
                         int *is_goal, double *cut_off);

#endif
