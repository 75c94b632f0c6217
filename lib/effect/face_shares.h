/* face_shares.h: what the nodes of a surface bear of a load that is uniform on some of its triangles. */
#ifndef FLESH_EFFECT_FACE_SHARES_H
#define FLESH_EFFECT_FACE_SHARES_H

#include "flesh/mesh.h"

/* Adds to shares [nodes] the integrals of the nodes' shape functions over triangles [3*count] of the rest shape, m^2. At
 * order 2 they must be of flesh_mesh_surface: FLESH_ERR_ARGUMENT otherwise, and for a node out of range. */
int flesh_face_shares(const flesh_mesh *mesh, int count, const int *triangles, double *shares);

/* Which triangles of flesh_mesh_surface triangles [3*count] are; fails as above. */
int flesh_face_numbers(const flesh_mesh *mesh, int count, const int *triangles, int *numbers);

/* Kinds of triangles: quarters 0 to 3 of a face of six nodes, or the face of a tet of four. */
enum { FLESH_FACE_FLAT = 4, FLESH_FACE_KINDS };

/* A quarter of the face with these corners and, behind them, nodes on the edges 01 12 20; FLESH_FACE_FLAT is all of the
 * face with the first three. */
typedef struct flesh_face_quarter {
  int node[6], quarter;
} flesh_face_quarter;

/* Finds the kinds of triangles [3*count]; a mesh of order 2 must have them in its surface: FLESH_ERR_ARGUMENT otherwise,
 * and for a node out of range or twice in a triangle. Further errors: FLESH_ERR_MEMORY. */
int flesh_face_quarters(const flesh_mesh *mesh, int count, const int *triangles, flesh_face_quarter *quarters);

/* The shape functions of corners 0 1 2 and nodes on 01 12 20 of a face, and their derivatives by the face's coordinates,
 * at the place of its quarter that has the coordinates `at` there. A flat face has those of its corners alone. */
void flesh_face_shapes(int quarter, const double at[3], double N[6], double by_L[6][3]);

/* The places of the pairs and triples of six numbers, rising. */
enum { FLESH_FACE_PAIRS = 15, FLESH_FACE_TRIPLES = 20 };
extern const signed char flesh_face_pair[FLESH_FACE_PAIRS][2], flesh_face_triple[FLESH_FACE_TRIPLES][3];

/* Coefficients for a quarter with its nodes at y_a: the volume between it and the origin is the sum of volume[t]
 * det(y_a, y_b, y_c) over the triples; a third of the integral of N_k y x dy around it is the sum of rim[k][p] y_a x
 * y_b over the pairs. */
void flesh_face_forms(int quarter, double volume[FLESH_FACE_TRIPLES], double rim[6][FLESH_FACE_PAIRS]);

#endif
