/* element.h: which element a body has, and what its kernels need to know of tets and materials. */
#ifndef FLESH_ELEMENT_ELEMENT_H
#define FLESH_ELEMENT_ELEMENT_H

#include "element/tet_kernel.h"
#include "flesh/body.h"

/* FLESH_ERR_ARGUMENT where no tet of the mesh can have the body's element. */
int flesh_body_check_element(const flesh_body *body);

/* The element of the tets of `size` nodes of one of the body's materials, or of none in particular (-1); never AUTO. */
flesh_element flesh_body_element_of(const flesh_body *body, int material, int size);

/* The nodes of a tet of ten: corners, ascending, then those on the edges 01 02 03 12 13 23 of these. */
void flesh_tet10_nodes(const flesh_mesh *mesh, int tet, int nodes[10]);

/* The integrals of density N_a N_b over a tet of ten nodes in this order, a <= b, kg. */
void flesh_tet10_masses(const flesh_mesh *mesh, int tet, double density, double masses[55]);

/* How many shapes the kernels need of a tet of ten nodes: 1, or, where tets are curved, one of each point. */
int flesh_element_shapes(const flesh_mesh *mesh);

/* The gradients g_1, g_2, g_3 (rows) of the linear shape functions of corners at the positions X; returns the volume,
 * negative where the corners wind the other way. */
double flesh_tet4_shape(const double *X, const int node[4], double gradient[9]);

/* Like flesh_tet4_shape, for the virtual corners at point q of a tet of ten nodes. */
double flesh_tet10_shape(const double *X, const int node[10], int q, double gradient[9]);

/* Finds the part of the material's volume term that depends on the mean of J: all but twice the shear modulus, which
 * stays with the points. FLESH_ERR_ARGUMENT for a user's psi without a lambda. */
int flesh_volume_share_of(const flesh_material *material, flesh_volume_share *share);

/* The share at J, Pa, with two derivatives by J, of a point (`local` that of the share) or of the mean
 * (flesh_local_of_mean); nonzero where a user's U has no value. */
int flesh_volume_share_at(const flesh_volume_share *share, const flesh_material *material, double J, double local,
                          flesh_volume_part *part);

#endif
