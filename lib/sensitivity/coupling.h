/* coupling.h: derivatives of the residual by states that effects read beside the point's own: the lagged or the frozen one,
 * which the Jacobian treats as constants (flesh_argument). They come from an effect's own products or, so that effects of
 * any kind have them, from differences: of all tets at once if the effect can be torn into them, or of many nodes at once,
 * those that share no row (Curtis, Powell & Reid 1974, "On the estimation of sparse Jacobian matrices"). */
#ifndef FLESH_SENSITIVITY_COUPLING_H
#define FLESH_SENSITIVITY_COUPLING_H

#include "effect/private.h"
#include "flesh/system.h"

static inline int flesh_argument_is_of_v(flesh_argument argument)
{
  return argument == FLESH_LAGGED_V || argument == FLESH_FROZEN_V || argument == FLESH_OWN_V;
}

/* A matrix of 3x3 blocks, as a list. */
typedef struct flesh_coupling {
  int count, room;
  int *nodes;     /* [2*count] row and column of each block */
  double *blocks; /* [9*count] blocks, row-major */
} flesh_coupling;

/* Nodes that an effect may couple, and their colours: no two nodes of a colour have a neighbour in common. */
typedef struct flesh_colouring {
  int colours;     /* 0: not made */
  int *starts;     /* [nodes+1] first neighbour of each node in `neighbours` */
  int *neighbours; /* neighbours of each node, itself among them */
  int *colour;     /* [nodes]; -1: the node is left out */
} flesh_colouring;

enum { FLESH_COLOURINGS = 5 };

/* The body torn into its tets. */
typedef struct flesh_torn_body {
  flesh_mesh *mesh; /* not made if NULL */
  int n;            /* 3 * its nodes */
  int *from;        /* [n/3] the body's node of each node */
  flesh_system **of; /* [effects] a system of each effect that can be torn, alone; NULL: not made */
  double *room;     /* [17*n] work space; the first 7 n are the arrays of a point */
} flesh_torn_body;

typedef struct flesh_couplings {
  const flesh_system *system; /* borrowed */
  const unsigned char *left_out; /* [effects] 1: the effect's residual counts as 0; borrowed; NULL: all count */
  int n, nodes;
  double length;                             /* m, distance between nodes */
  flesh_colouring colourings[FLESH_COLOURINGS];
  int blocks;                                /* number of K's blocks when the colourings were made */
  int cells_of;                              /* effect whose cells the colouring BY_CELLS is for */
  flesh_coupling by[FLESH_ARGUMENTS];
  flesh_point point;                         /* point of the derivatives; its arrays are borrowed */
  unsigned own[FLESH_ARGUMENTS];             /* 1: effects with products of their own may read the argument */
  flesh_torn_body torn_body;
  unsigned char *kinds;                      /* [effects][FLESH_ARGUMENTS] kind of coupling that an effect needs */
  double *room;                              /* [7*n] */
} flesh_couplings;

/* Makes couplings for the finalized system, which it borrows. FLESH_ERR_MEMORY. */
int flesh_couplings_create(const flesh_system *system, flesh_couplings *couplings);
void flesh_couplings_clear(flesh_couplings *couplings);

/* Finds `by` at the point, whose arrays must stay, for the bits of flesh_argument in `arguments`. Effects that may be local
 * are assumed to couple the nodes that K couples. FLESH_ERR_ARGUMENT with a sentence if an effect couples so many nodes far
 * from each other that this would take too long, or is not smooth there. */
int flesh_couplings_find(flesh_couplings *couplings, const flesh_point *point, unsigned arguments,
                         const flesh_block_matrix *K);
static inline int flesh_couplings_leave(const flesh_couplings *couplings, int effect)
{
  return couplings->left_out && couplings->left_out[effect];
}
/* Whether the residual depends on the argument. */
static inline int flesh_couplings_any(const flesh_couplings *couplings, flesh_argument argument)
{
  return couplings->by[argument].count > 0 || couplings->own[argument];
}
/* Adds a block to a flesh_coupling, unless it is 0; a flesh_block_add. FLESH_ERR_MEMORY. */
int flesh_coupling_append(void *coupling, int row, int column, const double block[9]);
/* Finds the derivative of an effect that can be torn, by the argument, by differences with the step (torn_body.c).
 * FLESH_ERR_MEMORY, and the errors of the effect. */
int flesh_couplings_find_torn(flesh_couplings *couplings, int effect, const flesh_point *point, flesh_argument argument,
                              double step);
/* Tears a mesh into its tets, with work space; clear it also after a failure. FLESH_ERR_MEMORY. */
int flesh_torn_body_open(const flesh_mesh *mesh, flesh_torn_body *torn_body);
/* Returns the point on the torn body, in its work space: arrays that are equal in `point` remain equal. */
flesh_point flesh_torn_body_point(const flesh_torn_body *torn_body, const flesh_point *point);
/* Frees the torn body and its systems, one for each of `effects`. */
void flesh_torn_body_clear(int effects, flesh_torn_body *torn_body);
/* Adds scale D x, or D^T x if `transposed`, to y [n], D being the derivative by the argument. */
void flesh_couplings_add(const flesh_couplings *couplings, flesh_argument argument, int transposed, double scale,
                         const double *x, double *y);

#endif
