/* background.h: a quadratic model as an effect: what acts on a subdomain beside its own elements. */
#ifndef FLESH_NEWTON_BACKGROUND_H
#define FLESH_NEWTON_BACKGROUND_H

#include "flesh/effect.h"

/* phi = g.du + du.K du/2 of the change du = (x - x0) / shift of the unknowns. */
typedef struct flesh_background {
  int nodes, pairs;
  int *pair;        /* [2*pairs] nodes, ascending */
  double *g;        /* [3*nodes] */
  double *K;        /* [9*(nodes+pairs)] blocks of the nodes, then of the pairs */
  const double *x0; /* [3*nodes] du = (x - x0) / shift */
  double shift;
  flesh_cells cells; /* the pairs */
} flesh_background;

/* A model of zero g and K for the nodes of `mesh`, of which `pairs` pairs are coupled; x0 [3*nodes] is borrowed. The
 * caller fills in pair, g and K. The effect, whose data it is, owns it. FLESH_ERR_MEMORY. */
int flesh_background_create(const flesh_mesh *mesh, int pairs, const double *x0, double shift,
                            flesh_background **background, flesh_effect **effect);

/* The nodes of block k: the same one twice, or a pair. */
void flesh_background_ends(const flesh_background *background, int k, int *i, int *j);

#endif
