/* product.h: the product y = A x by threads, on vectors of four lanes per node. */
#ifndef FLESH_SPARSE_PRODUCT_H
#define FLESH_SPARSE_PRODUCT_H

#include <stddef.h>

#include "sparse/halves.h"

typedef struct flesh_product {
  int *rows;         /* [begin[3]] as in halves, each part ascending */
  int begin[4];
  double *spill[2];  /* [4 * between] what each half adds to the nodes between */
  int *between;      /* [rows] number among the nodes between, -1: in a half */
} flesh_product;

/* For matrices of A's pattern. `halves` may be forgotten. */
int flesh_product_create(const flesh_block_matrix *A, const flesh_halves *halves, flesh_product *product);
void flesh_product_clear(flesh_product *product);
size_t flesh_product_memory(const flesh_product *product);

/* y = A x, both [4*rows], the fourth lane of x finite and that of y anything; *curvature = x.A x. */
void flesh_product_multiply(flesh_product *product, const flesh_block_matrix *A, flesh_threads *threads,
                            const double *x, double *y, double *curvature);

#endif
