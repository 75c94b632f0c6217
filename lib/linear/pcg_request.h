/* pcg_request.h: request and result of conjugate gradients. */
#ifndef FLESH_LINEAR_PCG_REQUEST_H
#define FLESH_LINEAR_PCG_REQUEST_H

#include "linear/preconditioner.h"

typedef struct flesh_pcg_result {
  int iterations;
  double first, residual; /* weighted 2-norms at the start and at the end */
  int single;             /* 1: the solve was in single precision */
} flesh_pcg_result;

/* Ratio of p.Ap to p.Mp, M being the preconditioner, below which a direction p has no curvature. Where A is singular,
 * rounding leaves some curvature, and the step along p would be endless. */
#define FLESH_PCG_FLAT 1e-12

/* A system A x = b and how to solve it. Members from `after_indefinite` on are optional: 0 turns them off. */
typedef struct flesh_pcg_request {
  const flesh_block_matrix *A;
  flesh_preconditioner_data *preconditioner;
  const double *b;       /* [3*rows] */
  const double *weights; /* [3*rows] weights of the residual; NULL: ones */
  double tolerance;      /* for the weighted residual's 2-norm */
  int max_iterations;
  /* Number of further iterations after the first direction without curvature, or with a negative one. The conjugate
   * directions p split the quadratic model into parabolas of one variable each, so x then goes downhill along every one: by
   * |rz / p.Ap|, but no farther than the preconditioned gradient would be followed, rz / p.Mp (counted from that direction
   * on). The status is FLESH_NOT_POSITIVE, and x descends. */
  int after_indefinite;
  /* Asked every few iterations; the solve ends with its status unless that is FLESH_OK. NULL: not asked. */
  int (*stop)(void *data);
  void *stop_data;
  /* 1: A and the vectors may be rounded to single precision, which is done if that allows the tolerance and all weights are
   * equal. The same on all ranks of a team. */
  int single;
  int same; /* 1: A is that of the last solve in this space */
} flesh_pcg_request;

#endif
