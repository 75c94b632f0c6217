/* face_shares.h: the nodes' shares of a load that is uniform on some triangles of the surface. */
#ifndef FLESH_EFFECT_FACE_SHARES_H
#define FLESH_EFFECT_FACE_SHARES_H

#include "flesh/mesh.h"

/* Adds to shares [nodes] the integrals [m^2] of the nodes' shape functions over triangles [3*count] of the rest shape.
 * On a mesh of order 2 they must be triangles of flesh_mesh_surface, else FLESH_ERR_ARGUMENT; also for a node out of
 * range. FLESH_ERR_MEMORY. */
int flesh_face_shares(const flesh_mesh *mesh, int count, const int *triangles, double *shares);

/* Finds the numbers in flesh_mesh_surface of triangles [3*count]. Errors as above. */
int flesh_face_numbers(const flesh_mesh *mesh, int count, const int *triangles, int *numbers);

/* Kinds of triangles: quarters 0 to 3 of a six-node face, or the flat face of a four-node tet. */
enum { FLESH_FACE_FLAT = 4, FLESH_FACE_KINDS };

/* A quarter of the face with the corners node[0 to 2] and the nodes node[3 to 5] on its edges 01 12 20. FLESH_FACE_FLAT
 * is the whole face of the first three. */
typedef struct flesh_face_quarter {
  int node[6], quarter;
} flesh_face_quarter;

/* Finds the kinds of triangles [3*count]. On a mesh of order 2 they must be in its surface, else FLESH_ERR_ARGUMENT;
 * also for a node out of range or repeated in a triangle. FLESH_ERR_MEMORY. */
int flesh_face_quarters(const flesh_mesh *mesh, int count, const int *triangles, flesh_face_quarter *quarters);

/* Computes the shape functions of corners 0 1 2 and edge nodes on 01 12 20 of a face, and their derivatives by the
 * face's barycentric coordinates, at the point of a quarter with the coordinates `at` within the quarter. A flat face
 * has only those of its corners. */
void flesh_face_shapes(int quarter, const double at[3], double N[6], double by_L[6][3]);

/* The pairs and triples of the numbers 0 to 5, each ascending. */
enum { FLESH_FACE_PAIRS = 15, FLESH_FACE_TRIPLES = 20 };
extern const signed char flesh_face_pair[FLESH_FACE_PAIRS][2], flesh_face_triple[FLESH_FACE_TRIPLES][3];

/* Computes coefficients of a quarter with nodes at y_a: the volume between it and the origin is the sum of volume[t]
 * det(y_a, y_b, y_c) over the triples; a third of the integral of N_k y x dy around its rim is the sum of rim[k][p] y_a
 * x y_b over the pairs. */
void flesh_face_forms(int quarter, double volume[FLESH_FACE_TRIPLES], double rim[6][FLESH_FACE_PAIRS]);

#endif
