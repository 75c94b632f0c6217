/* pressure_pairs.h: the pairs of nodes that a pressure acts on, with the weights of the terms of its forces.
 *
 * With y = x - c, the volume between a point c and a surface is W = sum of t_abc det(y_a, y_b, y_c), and a third of the
 * integral of N_k y x dy along its rim is the sum of e_kab y_a x y_b; flesh_face_forms has t and e of every kind of face.
 * A pair of nodes k < l has G = sum of t_klc y_c and, at the lagged state, h = sum of (e_klb - e_lkb)/2 y_b. On flat
 * triangles a pair is an edge, and G + h a sixth of the difference of the nodes across it, or of one of them and the
 * edge's middle on the rim.
 *
 * A rank has the faces of its tets. They end where other ranks' begin: what a rim there would add comes to nothing in
 * the sum over the ranks. `rim` leaves it out. Blocks of the Jacobian take it, as G alone is not small there, and each
 * rank filters the negative eigenvalues of its own. */
#ifndef FLESH_EFFECT_PRESSURE_PAIRS_H
#define FLESH_EFFECT_PRESSURE_PAIRS_H

#include <stddef.h>

#include "flesh/body.h"
#include "flesh/ranks.h"

/* A node's weights in G and h of a pair. */
typedef struct flesh_pressure_wing {
  int pair[2], node;
  double now, lagged;
} flesh_pressure_wing;

/* e_kab, a < b. */
typedef struct flesh_pressure_rim {
  int k, a, b;
  double e;
} flesh_pressure_rim;

typedef struct flesh_pressure_pairs {
  int triangle_count, *triangles; /* [3*triangle_count] wound outwards */
  flesh_cells cells;              /* the pairs: two nodes each, ascending */
  int *first;                     /* [cells.count+1] the wings of each pair */
  int wing_count;
  flesh_pressure_wing *wings; /* [wing_count] */
  int rim_count;
  flesh_pressure_rim *rim; /* [rim_count] */
} flesh_pressure_pairs;

/* Finds the pairs of the faces that triangles [3*count] are (flesh_face_quarters). On `part`, triangles are those of its
 * tets, and `whole` has the pairs of the whole body; else both are NULL. Fails as flesh_face_quarters, and is to be
 * cleared then too. */
int flesh_pressure_pairs_create(const flesh_mesh *mesh, int count, const int *triangles,
                                const flesh_pressure_pairs *whole, const flesh_rank_part *part,
                                flesh_pressure_pairs *pairs);
void flesh_pressure_pairs_clear(flesh_pressure_pairs *pairs);
/* Bytes that they hold. */
size_t flesh_pressure_pairs_memory(const flesh_pressure_pairs *pairs);

#endif
