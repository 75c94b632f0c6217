/* coupling.h: how the residual depends on a state that effects read beside the point's own: the lagged or the frozen one,
 * which the Jacobian treats as constants. Found by differences, so that effects of any kind have it: of many nodes at
 * once, those that share no row (Curtis, Powell & Reid 1974, "On the estimation of sparse Jacobian matrices"). */
#ifndef FLESH_SENSITIVITY_COUPLING_H
#define FLESH_SENSITIVITY_COUPLING_H

#include "flesh/system.h"

/* The states that are read: lagged.x, lagged.v, frozen.x, frozen.v; and the point's own v by effects that freeze, whose
 * Jacobian is that of x and v together. */
typedef enum flesh_reading {
  FLESH_LAGGED_X, FLESH_LAGGED_V, FLESH_FROZEN_X, FLESH_FROZEN_V, FLESH_OWN_V, FLESH_READINGS
} flesh_reading;

/* A matrix of 3x3 blocks. */
typedef struct flesh_coupling {
  int count, room;
  int *nodes;     /* [2*count] row and column */
  double *blocks; /* [9*count] row by row */
} flesh_coupling;

/* Nodes that an effect may couple, with colours: no two nodes of a colour have a neighbour in common. */
typedef struct flesh_colouring {
  int colours;     /* 0: not made */
  int *starts;     /* [nodes+1] in `neighbours` */
  int *neighbours; /* each node's, itself among them */
  int *colour;     /* [nodes]; -1: the node is left out */
} flesh_colouring;

enum { FLESH_COLOURINGS = 4 };

typedef struct flesh_couplings {
  const flesh_system *system; /* borrowed */
  int n, nodes;
  double length;                             /* m, between nodes */
  flesh_colouring colourings[FLESH_COLOURINGS];
  int blocks;                                /* of K, when these were made */
  flesh_coupling by[FLESH_READINGS];
  unsigned char *kinds;                      /* [effects][FLESH_READINGS] the colouring that an effect needs */
  double *room;                              /* [7*n] */
} flesh_couplings;

/* Borrows the finished system. FLESH_ERR_MEMORY. */
int flesh_couplings_create(const flesh_system *system, flesh_couplings *couplings);
void flesh_couplings_clear(flesh_couplings *couplings);

/* Finds `by` at the point, for the bits of flesh_reading in `readings`. Nodes that K couples are where an effect may be
 * local. FLESH_ERR_ARGUMENT with a sentence where
 * an effect couples so many nodes far from each other that this would take too long. */
int flesh_couplings_find(flesh_couplings *couplings, const flesh_point *point, unsigned readings,
                         const flesh_block_matrix *K);
/* Whether the residual depends on what is read. */
static inline int flesh_couplings_any(const flesh_couplings *couplings, flesh_reading reading)
{
  return couplings->by[reading].count > 0;
}
/* y [n] += scale D x, or D^T x if `transposed`, D being the derivative by what is read. */
void flesh_couplings_add(const flesh_couplings *couplings, flesh_reading reading, int transposed, double scale,
                         const double *x, double *y);

#endif
