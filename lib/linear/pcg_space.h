/* pcg_space.h: memory of a solve by conjugate gradients, for a single rank (pcg.c) and for teams (pcg_team.c). */
#ifndef FLESH_LINEAR_PCG_SPACE_H
#define FLESH_LINEAR_PCG_SPACE_H

#include "base/team.h"
#include "linear/lanes.h"
#include "linear/pcg_request.h"
#include "linear/product.h"

typedef struct flesh_pcg_space flesh_pcg_space;

enum {
  FLESH_PCG_CHUNK = 512,                  /* nodes of a task; fixed, so that sums do not depend on the threads */
  FLESH_PCG_PARTS = FLESH_PRODUCT_PADDING /* partial sums, so that additions need not wait for each other */
};

struct flesh_pcg_space {
  int rows, chunks;
  flesh_threads *threads;
  const flesh_team *team; /* NULL: none */
  int *place;             /* [rows] place of each node in vectors; NULL without a team */
  flesh_product product;
  int single;     /* precision of r, p and z in the last solve */
  double unit;    /* factor that restores the units of its r */
  double holds;   /* scale of the product's rounded matrix, which is this times A; 0: it is another matrix */
  flesh_double4 *x, *weights; /* [rows], then zeros up to a multiple of FLESH_PCG_PARTS */
  void *r, *p, *z;            /* as x, in either precision; z is A p, or A u with a team */
  void *u, *s;                /* with a team: result of the preconditioner, and A p */
  flesh_float4 *rounded;      /* r for the preconditioner; r itself in single precision */
  flesh_float4 *room;         /* memory of `rounded` for r in double precision */
  double *sums, *squares;     /* [chunks] */
};

typedef struct flesh_pcg_work {
  flesh_pcg_space *space;
  const flesh_pcg_request *request;
  const double *weights; /* NULL: all are `common` */
  double *x, common;
  double scale, unscale; /* scale from b to the system that is solved, and from its solution to x */
  double alpha;    /* r is reduced by alpha z */
  double to_round, back; /* scale of r for the preconditioner, and of its result */
  double beta;
  double downhill; /* length that x has yet to go along p: alpha, except after negative curvature */
} flesh_pcg_work;

static inline void flesh_pcg_range(const flesh_pcg_space *self, int chunk, int *begin, int *end)
{
  *begin = chunk * FLESH_PCG_CHUNK;
  *end = *begin + FLESH_PCG_CHUNK < self->rows ? *begin + FLESH_PCG_CHUNK : self->rows;
}

/* Returns node i of a vector in either precision. */
static inline flesh_double4 flesh_pcg_get(const void *vector, int single, int i)
{
  return single ? FLESH_LANES_WIDE(((const flesh_float4 *)vector)[i]) : ((const flesh_double4 *)vector)[i];
}

static inline void flesh_pcg_put(void *vector, int single, int i, flesh_double4 value)
{
  if (single) ((flesh_float4 *)vector)[i] = FLESH_LANES_NARROW(value);
  else ((flesh_double4 *)vector)[i] = value;
}

/* Computes v.A v, and A v in the space's z, in the precision of the solve; in single precision with scale A. `maker` as in
 * flesh_product_multiply. */
static inline double flesh_pcg_product(flesh_pcg_space *self, const flesh_block_matrix *A, double scale,
                                       const flesh_product_maker *maker, void *v)
{
  if (!self->single) return flesh_product_multiply(&self->product, A, self->threads, maker, v, self->z);
  const flesh_block_matrix *anew = self->holds == scale ? NULL : A;
  self->holds = scale;
  return flesh_product_multiply_single(&self->product, anew, scale, self->threads, maker, v, self->z);
}

static inline double flesh_pcg_sum_of(const flesh_double4 parts[FLESH_PCG_PARTS])
{
  flesh_double4 sum = (parts[0] + parts[1]) + (parts[2] + parts[3]);
  return (sum[0] + sum[1]) + sum[2];
}

#endif
