/* coupling.h: how the residual depends on a state that effects read beside the point's own: the lagged or the frozen one,
 * which the Jacobian treats as constants (flesh_argument). By the effect's own products where it has them; else found by
 * differences, so that effects of any kind have it: of all tets at once where the effect can be torn into them, or of many
 * nodes at once, those that share no row (Curtis, Powell & Reid 1974, "On the estimation of sparse Jacobian matrices"). */
#ifndef FLESH_SENSITIVITY_COUPLING_H
#define FLESH_SENSITIVITY_COUPLING_H

#include "effect/private.h"
#include "flesh/system.h"

static inline int flesh_argument_is_of_v(flesh_argument argument)
{
  return argument == FLESH_LAGGED_V || argument == FLESH_FROZEN_V || argument == FLESH_OWN_V;
}

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

enum { FLESH_COLOURINGS = 5 };

/* The body torn into its tets. */
typedef struct flesh_torn_body {
  flesh_mesh *mesh; /* NULL: not made */
  int n;            /* 3 * its nodes */
  int *from;        /* [n/3] the body's nodes */
  flesh_system **of; /* [effects] of each that can be torn alone; NULL: not made */
  double *room;     /* [17*n] of which a point has the first 7 */
} flesh_torn_body;

typedef struct flesh_couplings {
  const flesh_system *system; /* borrowed */
  const unsigned char *left_out; /* [effects] 1: counts as having no residual; borrowed; NULL: all count */
  int n, nodes;
  double length;                             /* m, between nodes */
  flesh_colouring colourings[FLESH_COLOURINGS];
  int blocks;                                /* of K, when these were made */
  int cells_of;                              /* the effect of whose cells one of them is */
  flesh_coupling by[FLESH_ARGUMENTS];
  flesh_point point;                         /* where they are; its arrays are borrowed */
  unsigned own[FLESH_ARGUMENTS];             /* whether effects with products of their own may read it */
  flesh_torn_body torn_body;
  unsigned char *kinds;                      /* [effects][FLESH_ARGUMENTS] the colouring that an effect needs */
  double *room;                              /* [7*n] */
} flesh_couplings;

/* Borrows the finished system. FLESH_ERR_MEMORY. */
int flesh_couplings_create(const flesh_system *system, flesh_couplings *couplings);
void flesh_couplings_clear(flesh_couplings *couplings);

/* Finds `by` at the point, whose arrays must stay, for the bits of flesh_argument in `arguments`. Nodes that K couples are
 * where an effect may be local. FLESH_ERR_ARGUMENT with a sentence where an effect couples so many nodes far from each other
 * that this would take too long, or is not smooth there. */
int flesh_couplings_find(flesh_couplings *couplings, const flesh_point *point, unsigned arguments,
                         const flesh_block_matrix *K);
static inline int flesh_couplings_leave(const flesh_couplings *couplings, int effect)
{
  return couplings->left_out && couplings->left_out[effect];
}
/* Whether the residual depends on what is read. */
static inline int flesh_couplings_any(const flesh_couplings *couplings, flesh_argument argument)
{
  return couplings->by[argument].count > 0 || couplings->own[argument];
}
/* Implements flesh_block_add for a flesh_coupling: adds a block, unless it is 0. FLESH_ERR_MEMORY. */
int flesh_coupling_append(void *coupling, int row, int column, const double block[9]);
/* Finds the derivative of an effect that can be torn by what is read, by differences with the step (torn_body.c).
 * FLESH_ERR_MEMORY, and what the effect returns. */
int flesh_couplings_find_torn(flesh_couplings *couplings, int effect, const flesh_point *point, flesh_argument argument,
                              double step);
/* Tears a mesh, with room; to be cleared also when it fails. FLESH_ERR_MEMORY. */
int flesh_torn_body_open(const flesh_mesh *mesh, flesh_torn_body *torn_body);
/* The point of the torn body, in its room: the same arrays stay the same. */
flesh_point flesh_torn_body_point(const flesh_torn_body *torn_body, const flesh_point *point);
/* Clears one of `effects` systems. */
void flesh_torn_body_clear(int effects, flesh_torn_body *torn_body);
/* y [n] += scale D x, or D^T x if `transposed`, D being the derivative by what is read. */
void flesh_couplings_add(const flesh_couplings *couplings, flesh_argument argument, int transposed, double scale,
                         const double *x, double *y);

#endif
