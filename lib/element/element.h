/* element.h: the elements of a body, and the data of tets and materials that kernels need. */
#ifndef FLESH_ELEMENT_ELEMENT_H
#define FLESH_ELEMENT_ELEMENT_H

#include "element/tet_kernel.h"
#include "flesh/body.h"

/* Fails with FLESH_ERR_ARGUMENT if no tet of the mesh can have the body's element. */
int flesh_body_check_element(const flesh_body *body);

/* Returns the element of the tets of `size` nodes with one of the body's materials, or with any (-1); never AUTO. */
flesh_element flesh_body_element_of(const flesh_body *body, int material, int size);

/* Gives the nodes of a ten-node tet: corners, in rising order, then those on their edges 01 02 03 12 13 23. */
void flesh_tet10_nodes(const flesh_mesh *mesh, int tet, int nodes[10]);

/* Integrates density N_a N_b over a ten-node tet in this order of nodes, a <= b, kg. */
void flesh_tet10_masses(const flesh_mesh *mesh, int tet, double density, double masses[55]);

/* Returns the number of shapes of a ten-node tet that the kernels need: 1, or one for each point if tets are curved. */
int flesh_element_shapes(const flesh_mesh *mesh);

/* Computes the gradients g_1, g_2, g_3 (rows) of the linear shape functions of corners at the positions X; returns the
 * volume, negative for the opposite winding. */
double flesh_tet4_shape(const double *X, const int node[4], double gradient[9]);

/* Like flesh_tet4_shape, for the virtual corners at point q of a ten-node tet. */
double flesh_tet10_shape(const double *X, const int node[10], int q, double gradient[9]);

/* Finds the part of the material's volume term that depends on the mean of J: all but twice the shear modulus, which
 * stays with the points. FLESH_ERR_ARGUMENT for a user's psi without a lambda. */
int flesh_volume_share_of(const flesh_material *material, flesh_volume_share *share);

/* Computes the share at J, Pa, with two derivatives by J, at a point (`local` is that of the share) or for the mean
 * (flesh_local_of_mean); returns nonzero if a user's U has no value. */
int flesh_volume_share_at(const flesh_volume_share *share, const flesh_material *material, double J, double local,
                          flesh_volume_part *part);

#endif
