/* body_figures.h: figures of a body of which each rank may have only a part. `mesh` is the rank's part; if `team` is
 * NULL, it is the whole. All functions are collective. */
#ifndef FLESH_PARALLEL_BODY_FIGURES_H
#define FLESH_PARALLEL_BODY_FIGURES_H

#include "base/team.h"
#include "mesh/mesh.h"

/* Returns the mean length of the tets' edges at rest, between corners, m. */
double flesh_body_mean_edge(const flesh_mesh *mesh, const flesh_team *team);
/* Computes the box around the body at rest: its low corner, then its high one, m. */
void flesh_body_rest_box(const flesh_mesh *mesh, const flesh_team *team, double box[6]);
/* Returns the longest side of that box, m. */
double flesh_body_longest_side(const flesh_mesh *mesh, const flesh_team *team);
/* Returns the body's volume at x [3*nodes], m^3. */
double flesh_body_volume(const flesh_mesh *mesh, const flesh_team *team, const double *x);
/* Returns the fraction of the body's tets that are inverted at some point at x. */
double flesh_body_inverted(const flesh_mesh *mesh, const flesh_team *team, const double *x);
/* Like flesh_mesh_measure with the bound: `mean` and `least` [tets] are of the rank's tets, *measures of the body. Tets
 * are numbered as in the body; of several with the least J the first is reported. */
void flesh_body_measure(const flesh_mesh *mesh, const flesh_team *team, const double *x, double *mean,
                        double *least, flesh_mesh_measures *measures);
/* Returns the body's tet with the least J at x [3*nodes], that J, and the mean of the tet's corners, m. */
int flesh_body_worst_tet(const flesh_mesh *mesh, const flesh_team *team, const double *x, double *J, double middle[3]);

#endif
