/* background.h: a quadratic model as an effect, in place of the forces on a subdomain that are not from its own elements. */
#ifndef FLESH_NEWTON_BACKGROUND_H
#define FLESH_NEWTON_BACKGROUND_H

#include "flesh/effect.h"

/* The model phi = g.du + du.K du/2 in the change du = (x - x0) / shift of the unknowns. */
typedef struct flesh_background {
  int nodes, pairs;
  int *pair;        /* [2*pairs] nodes, ascending */
  double *g;        /* [3*nodes] gradient */
  double *K;        /* [9*(nodes+pairs)] 3x3 blocks, of the nodes, then of the pairs */
  const double *x0; /* [3*nodes] position where du is 0 */
  double shift;
  flesh_cells cells; /* the pairs */
} flesh_background;

/* Makes a model of zero g and K for the nodes of `mesh` and `pairs` coupled pairs of them; borrows x0 [3*nodes]. The caller
 * fills in pair, g and K. The effect owns the model, which is its data. FLESH_ERR_MEMORY. */
int flesh_background_create(const flesh_mesh *mesh, int pairs, const double *x0, double shift,
                            flesh_background **background, flesh_effect **effect);

/* Gives in i and j the nodes of block k: the same node twice, or a pair. */
void flesh_background_ends(const flesh_background *background, int k, int *i, int *j);

#endif
