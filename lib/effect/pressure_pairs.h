/* pressure_pairs.h: the pairs of nodes that a pressure acts on, with the weights of the terms of its forces.
 *
 * With y = x - c, the volume between a point c and a surface is W = sum of t_abc det(y_a, y_b, y_c), and a third of the
 * integral of N_k y x dy along its rim is the sum of e_kab y_a x y_b; flesh_face_forms has t and e for every kind of
 * face. A pair of nodes k < l has G = sum of t_klc y_c and, at the lagged state, h = sum of (e_klb - e_lkb)/2 y_b. On
 * flat triangles a pair is an edge, and G + h is a sixth of the difference of the nodes opposite to it or, on the rim,
 * of the one opposite node and the edge's middle.
 *
 * A rank has the faces of its tets. Where they border on other ranks' faces, the contributions of a rim there cancel in
 * the sum over the ranks, so `rim` omits them. Blocks of the Jacobian include them, because G alone is not small there,
 * and each rank filters the negative eigenvalues of its own blocks. */
#ifndef FLESH_EFFECT_PRESSURE_PAIRS_H
#define FLESH_EFFECT_PRESSURE_PAIRS_H

#include <stddef.h>

#include "flesh/body.h"
#include "flesh/ranks.h"

/* A node's weights in G (now) and h (lagged) of a pair. */
typedef struct flesh_pressure_wing {
  int pair[2], node;
  double now, lagged;
} flesh_pressure_wing;

/* The coefficient e_kab, a < b. */
typedef struct flesh_pressure_rim {
  int k, a, b;
  double e;
} flesh_pressure_rim;

typedef struct flesh_pressure_pairs {
  int triangle_count, *triangles; /* [3*triangle_count] wound outwards */
  flesh_cells cells;              /* the pairs as cells of two nodes each, ascending */
  int *first;                     /* [cells.count+1] index of each pair's first wing */
  int wing_count;
  flesh_pressure_wing *wings; /* [wing_count] */
  int rim_count;
  flesh_pressure_rim *rim; /* [rim_count] */
} flesh_pressure_pairs;

/* Finds the pairs of the faces given by triangles [3*count] (see flesh_face_quarters). For a rank's part, `triangles`
 * are those of its tets and `whole` has the pairs of the whole body; else `part` and `whole` are NULL. Errors as for
 * flesh_face_quarters; clear the pairs also after an error. */
int flesh_pressure_pairs_create(const flesh_mesh *mesh, int count, const int *triangles,
                                const flesh_pressure_pairs *whole, const flesh_rank_part *part,
                                flesh_pressure_pairs *pairs);
void flesh_pressure_pairs_clear(flesh_pressure_pairs *pairs);
/* Returns the bytes of memory that the pairs use. */
size_t flesh_pressure_pairs_memory(const flesh_pressure_pairs *pairs);

#endif
