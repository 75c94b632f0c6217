/* halves.h: a body's nodes in two halves that share no block, and the few nodes between them, in an order that
 * incomplete factorisations, products and threads like. */
#ifndef FLESH_SPARSE_HALVES_H
#define FLESH_SPARSE_HALVES_H

#include "flesh/effect.h"

typedef struct flesh_halves {
  /* [rows] nodes: the first half from begin[0] to begin[1], the second from begin[1] to begin[2], those between from
   * begin[2] to begin[3] = rows. Both halves run from the body's far ends to the middle. Factorisations go this way,
   * and so lie vectors of four lanes a node and a pattern's rows. */
  int *order;
  int begin[4];
} flesh_halves;

/* Depends on the pattern alone. One half is empty where too many nodes would lie between. */
int flesh_halves_create(const flesh_block_matrix *A, flesh_halves *halves);
void flesh_halves_clear(flesh_halves *halves);

#endif
