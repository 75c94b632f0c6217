/* bisection.h: a body's nodes in two halves that share no block, and the few nodes between them, in an order that
 * incomplete factorisations, products and threads like. */
#ifndef FLESH_LINEAR_BISECTION_H
#define FLESH_LINEAR_BISECTION_H

#include "flesh/block_matrix.h"

typedef struct flesh_bisection {
  /* [rows] nodes: the first half from begin[0] to begin[1], the second from begin[1] to begin[2], those between from
   * begin[2] to begin[3] = rows. Both halves run from the body's far ends to the middle. Factorisations go this way,
   * and so lie vectors of four lanes a node and a pattern's rows. */
  int *order;
  int begin[4];
} flesh_bisection;

/* Depends on the pattern alone. One half is empty where too many nodes would lie between. */
int flesh_bisection_create(const flesh_block_matrix *A, flesh_bisection *halves);
void flesh_bisection_clear(flesh_bisection *halves);

#endif
