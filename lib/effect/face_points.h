/* face_points.h: the points of quadrature on the surface: flat triangles, quarters of faces of six nodes. */
#ifndef FLESH_EFFECT_FACE_POINTS_H
#define FLESH_EFFECT_FACE_POINTS_H

#include <stddef.h>

#include "effect/face_shares.h"
#include "flesh/block_matrix.h"
#include "flesh/body.h"
#include "flesh/effect.h"
#include "flesh/ranks.h"

/* A rule that is exact for degree 6 has 12 points; a flat triangle has 3 of degree 2. */
enum { FLESH_FACE_NODES = 6, FLESH_FACE_POINTS = 12, FLESH_FLAT_POINTS = 3 };

/* Shape functions N_a at a point of a face and their derivatives along its two coordinates. weight * (t_0 x t_1), with
 * t_k = sum of by[k][a] x_a, is the point's part of the face's area vector. */
typedef struct flesh_face_point {
  double weight, N[FLESH_FACE_NODES], by[2][FLESH_FACE_NODES];
} flesh_face_point;

typedef struct flesh_faces {
  int count;
  flesh_face_quarter *faces; /* [count] */
  flesh_cells cells;         /* their nodes, of 3 or 6; padded at order 2 */
  signed char *rank;         /* [6*count] the place of a face's node within its cell */
  flesh_face_point points[FLESH_FACE_KINDS][FLESH_FACE_POINTS];
} flesh_faces;

/* The faces that triangles [3*count] are, as flesh_face_shares takes them. FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY; _clear
 * frees what was made in any case. */
int flesh_faces_create(const flesh_mesh *mesh, int count, const int *triangles, flesh_faces *faces);
/* The faces that belong to a rank's tets, in the numbers of its part, whose mesh is `mesh`. The same errors. */
int flesh_faces_restrict(const flesh_faces *whole, const flesh_rank_part *part, const flesh_mesh *mesh,
                         flesh_faces *faces);
void flesh_faces_clear(flesh_faces *faces);
size_t flesh_faces_memory(const flesh_faces *faces);

/* How many nodes and points a face has, and its points. */
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

/* Point q of the rule on the part of a triangle whose corners have the barycentric coordinates corners [3][3]: its own
 * coordinates into `at` and its weight, of sum 1; 0 behind the last point. `flat`: the rule of degree 2, else of 6. */
double flesh_face_rule(int flat, int q, const double corners[9], double at[3]);

/* Adds B to the block of a face's nodes a and b of a matrix whose slots are those of the faces' cells: its transpose
 * where the block of the upper triangle is that of b and a. One of (a,b) and (b,a) is to
 * be added. */
void flesh_face_add_block(const flesh_faces *faces, int face, int a, int b, const double B[9],
                          flesh_block_matrix *K, const int *slots);

/* A point of a face in a fluid that goes at `velocity`, m/s: its unit normal on the lagged surface, and its speed along
 * that against the fluid. Returns how much lagged area there is by q->weight; where it is 0, so are normal and speed. */
double flesh_face_flow(const flesh_faces *faces, int face, const flesh_face_point *q, const flesh_point *point,
                       const double velocity[3], double normal[3], double *speed);
/* r_a += f N_a n, for the force f n at the point. */
void flesh_face_add_force(const flesh_faces *faces, int face, const flesh_face_point *q, double f, const double n[3],
                          double *r);
/* Its work from the lagged positions on. */
double flesh_face_work(const flesh_faces *faces, int face, const flesh_face_point *q, double f, const double n[3],
                       const flesh_point *point);
/* K_ab += k N_a N_b n n^T, for a force that changes by k n times the velocity along n. */
void flesh_face_add_stiffness(const flesh_faces *faces, int face, const flesh_face_point *q, double k, const double n[3],
                              flesh_block_matrix *K, const int *slots);

#endif
