/* body_figures.h: figures of a body, of which a rank may have a part alone. The mesh is that of the rank's part; where `team` is
 * NULL, it is the whole. All are collective. */
#ifndef FLESH_PARALLEL_BODY_FIGURES_H
#define FLESH_PARALLEL_BODY_FIGURES_H

#include "base/team.h"
#include "mesh/mesh.h"

/* The mean over the six edges of every tet, at rest, between corners, m. */
double flesh_body_mean_edge(const flesh_mesh *mesh, const flesh_team *team);
/* The box around the body at rest: its low corner, then its high one, m. */
void flesh_body_rest_box(const flesh_mesh *mesh, const flesh_team *team, double box[6]);
/* Its volume at x [3*nodes], m^3. */
double flesh_body_volume(const flesh_mesh *mesh, const flesh_team *team, const double *x);
/* The share of its tets that are inverted anywhere at x. */
double flesh_body_inverted(const flesh_mesh *mesh, const flesh_team *team, const double *x);
/* Does what flesh_mesh_measure does, with the bound: `mean` and `least` [tets] are of the rank's tets, *measures of the
 * body. Tets have their numbers in the body, and the first of several with the least J is told. */
void flesh_body_measure(const flesh_mesh *mesh, const flesh_team *team, const double *x, double *mean,
                        double *least, flesh_mesh_measures *measures);
/* The body's tet with the least J at x [3*nodes], that J, and the middle of its corners, m. */
int flesh_body_worst_tet(const flesh_mesh *mesh, const flesh_team *team, const double *x, double *J, double middle[3]);

#endif
