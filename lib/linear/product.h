/* product.h: the product y = A x by threads, in double or single precision, on vectors of four lanes per node in the
 * order of a bisection. */
#ifndef FLESH_LINEAR_PRODUCT_H
#define FLESH_LINEAR_PRODUCT_H

#include "base/isa.h"
#include "flesh/threads.h"
#include "linear/bisection.h"

/* Vectors are padded to a multiple of this number of nodes, so that as many can be summed up at a time. */
enum { FLESH_PRODUCT_PADDING = 4 };

typedef struct flesh_product {
  int *rows;    /* [begin[3]] order of the bisection: x and y hold node rows[p] at p */
  int *first;   /* [begin[3]+1] first block of each of these rows; the rows follow one another */
  int begin[4];
  int blocks;
  unsigned *place; /* [blocks] four times the place in x and y of each block's column */
  int nodes;    /* number of nodes for which x and y have room */
  /* For single precision, if asked for: rows side by side in slices of as many as a register has lanes. */
  int slices[4];   /* first slice of each part */
  int *column;     /* [slices+1] first column of blocks of each slice */
  unsigned *own;   /* [slices][lanes] four times the place of each row */
  unsigned *other; /* [columns][lanes] four times the place of each block's column */
  float *rounded;  /* last matrix, scaled: columns of blocks, then the diagonal ones; NULL: not asked for */
  double *nothing; /* [9*longest] a row of zeros */
  int longest;     /* largest number of blocks in a row */
} flesh_product;

/* Makes a product for matrices of A's pattern, whose rows lie in the order of `bisection`, which may be freed then.
 * `single`: products in single precision will be asked for. */
FLESH_PER_ISA int flesh_product_create(const flesh_block_matrix *A, const flesh_bisection *bisection, int single,
                                       flesh_product *product);
FLESH_PER_ISA void flesh_product_clear(flesh_product *product);

/* Makes x ready for begin <= p < end; called once for every p, by the thread that will need it next. */
typedef struct flesh_product_maker {
  void (*make)(void *data, int begin, int end);
  void *data;
} flesh_product_maker;

/* Computes y = A x, both [4*nodes]: the first 4*rows, padded, are the vectors, the fourth lane of x finite and that of y
 * anything; the rest belongs to the product. Returns x.A x. `maker` NULL: x is ready. */
FLESH_PER_ISA double flesh_product_multiply(flesh_product *product, const flesh_block_matrix *A,
                                            flesh_threads *threads, const flesh_product_maker *maker, double *x,
                                            double *y);

/* Multiplies by scale * A, rounded to single precision, in single precision. A NULL: the matrix of the last time. */
FLESH_PER_ISA double flesh_product_multiply_single(flesh_product *product, const flesh_block_matrix *A, double scale,
                                                   flesh_threads *threads, const flesh_product_maker *maker, float *x,
                                                   float *y);

#endif
