/* face_points.h: quadrature points on the surface: on flat triangles and on quarters of six-node faces. */
#ifndef FLESH_EFFECT_FACE_POINTS_H
#define FLESH_EFFECT_FACE_POINTS_H

#include <stddef.h>

#include "effect/face_shares.h"
#include "flesh/block_matrix.h"
#include "flesh/body.h"
#include "flesh/effect.h"
#include "flesh/ranks.h"

/* Rules: a quarter has 12 points, exact for degree 6; a flat triangle has 3, exact for degree 2. */
enum { FLESH_FACE_NODES = 6, FLESH_FACE_POINTS = 12, FLESH_FLAT_POINTS = 3 };

/* A quadrature point: weight, shape functions N_a, and their derivatives `by` along the face's two coordinates. weight
 * * (t_0 x t_1), with t_k = sum of by[k][a] x_a, is the point's part of the face's area vector. */
typedef struct flesh_face_point {
  double weight, N[FLESH_FACE_NODES], by[2][FLESH_FACE_NODES];
} flesh_face_point;

typedef struct flesh_faces {
  int count;
  flesh_face_quarter *faces; /* [count] */
  flesh_cells cells;         /* nodes of the faces, 3 or 6 each; padded at order 2 */
  signed char *rank;         /* [6*count] index of each of a face's nodes within its cell */
  flesh_face_point points[FLESH_FACE_KINDS][FLESH_FACE_POINTS];
} flesh_faces;

/* Creates the faces that the triangles [3*count] are or belong to (see flesh_face_quarters). FLESH_ERR_ARGUMENT,
 * FLESH_ERR_MEMORY; call flesh_faces_clear also after an error. */
int flesh_faces_create(const flesh_mesh *mesh, int count, const int *triangles, flesh_faces *faces);
/* Restricts the faces to those of a rank's tets, numbered as in its part, whose mesh is `mesh`. Errors as above. */
int flesh_faces_restrict(const flesh_faces *whole, const flesh_rank_part *part, const flesh_mesh *mesh,
                         flesh_faces *faces);
void flesh_faces_clear(flesh_faces *faces);
size_t flesh_faces_memory(const flesh_faces *faces);

/* The functions below return whether a face is flat, and the numbers of its nodes and points. */
static inline int flesh_face_is_flat(const flesh_faces *faces, int face)
{
  return faces->faces[face].quarter == FLESH_FACE_FLAT;
}

static inline int flesh_face_nodes(const flesh_faces *faces, int face)
{
  return flesh_face_is_flat(faces, face) ? 3 : FLESH_FACE_NODES;
}

static inline int flesh_face_points(const flesh_faces *faces, int face, const flesh_face_point **points)
{
  *points = faces->points[faces->faces[face].quarter];
  return flesh_face_is_flat(faces, face) ? FLESH_FLAT_POINTS : FLESH_FACE_POINTS;
}

/* Returns the weight of point q of the rule on a part of a triangle, whose corners have the barycentric coordinates
 * corners [3][3], and its coordinates `at`. The weights sum to 1; 0 after the last point. `flat`: the rule of degree 2,
 * else that of degree 6. */
double flesh_face_rule(int flat, int q, const double corners[9], double at[3]);

/* Adds B to the block of a face's nodes a and b in a matrix whose slots are those of the faces' cells, transposed if
 * the upper triangle holds the block of b and a. Call it for only one of (a,b) and (b,a). */
void flesh_face_add_block(const flesh_faces *faces, int face, int a, int b, const double B[9],
                          flesh_block_matrix *K, const int *slots);

/* Computes, for a point of a face in a fluid that moves at `velocity` [m/s], the unit normal of the lagged surface and
 * the speed along it relative to the fluid. Returns the lagged area per q->weight; if it is 0, so are normal and
 * speed. */
double flesh_face_flow(const flesh_faces *faces, int face, const flesh_face_point *q, const flesh_point *point,
                       const double velocity[3], double normal[3], double *speed);
/* Adds f N_a n to r_a, for the force f n at the point. */
void flesh_face_add_force(const flesh_faces *faces, int face, const flesh_face_point *q, double f, const double n[3],
                          double *r);
/* Returns the work of the force f n from the lagged positions on. */
double flesh_face_work(const flesh_faces *faces, int face, const flesh_face_point *q, double f, const double n[3],
                       const flesh_point *point);
/* Adds k N_a N_b n n^T to K_ab, for a force that changes by k n times the velocity along n. */
void flesh_face_add_stiffness(const flesh_faces *faces, int face, const flesh_face_point *q, double k, const double n[3],
                              flesh_block_matrix *K, const int *slots);

#endif
