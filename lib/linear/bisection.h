/* bisection.h: splits a body's nodes into two halves that share no block and a separator, the few nodes between them
 * (George & Liu 1981). In this order incomplete factorisations need few iterations, and two threads can work at once. */
#ifndef FLESH_LINEAR_BISECTION_H
#define FLESH_LINEAR_BISECTION_H

#include "flesh/block_matrix.h"

typedef struct flesh_bisection {
  /* [rows] nodes: the first half from begin[0] to begin[1], the second from begin[1] to begin[2], the separator from
   * begin[2] to begin[3] = rows. Both halves run from the body's far ends to the middle. Factorisations eliminate in
   * this order, and vectors of four lanes a node and a pattern's rows are stored in it. */
  int *order;
  int begin[4];
} flesh_bisection;

/* Makes the bisection of A's pattern. `numbers` [rows], all different, decide between neighbours with equally many
 * neighbours: on a rank they are the body's numbers, so that ghosts have their place from the mesh generator and not the
 * last. NULL: the rows' own numbers. Second half and separator are empty where the separator would be too large. */
int flesh_bisection_create(const flesh_block_matrix *A, const int *numbers, flesh_bisection *bisection);
void flesh_bisection_clear(flesh_bisection *bisection);

#endif
