/* pcg_request.h: what conjugate gradients are asked for, and what they tell. */
#ifndef FLESH_LINEAR_PCG_REQUEST_H
#define FLESH_LINEAR_PCG_REQUEST_H

#include "linear/preconditioner.h"

typedef struct flesh_pcg_result {
  int iterations;
  double first, residual; /* weighted 2-norms at the start and at the end */
  int single;             /* it was solved in single precision */
} flesh_pcg_result;

/* Times p.Mp, M being the preconditioner: a direction p with a smaller p.Ap counts as one without curvature. Where A is
 * singular, rounding leaves some, and the way along p would be endless. */
#define FLESH_PCG_FLAT 1e-12

/* A system A x = b and how it is solved. Members from `after_indefinite` on are 0 where nothing more is wanted. */
typedef struct flesh_pcg_request {
  const flesh_block_matrix *A;
  flesh_preconditioner_data *preconditioner;
  const double *b;       /* [3*rows] */
  const double *weights; /* [3*rows] of the residual; NULL: ones */
  double tolerance;      /* of the weighted residual's 2-norm */
  int max_iterations;
  /* How many iterations to go on after the first direction without curvature, or with a negative one. The conjugate
   * directions p part the quadratic model into parabolas of one variable each, so x then goes
   * downhill along every one: by |rz / p.Ap|, but no farther than the preconditioned gradient would
   * be followed, rz / p.Mp (from that direction on). The status is FLESH_NOT_POSITIVE and x descends. */
  int after_indefinite;
  /* Asked every few iterations: a status that is not FLESH_OK ends the solve with it. NULL: not asked. */
  int (*stop)(void *data);
  void *stop_data;
  /* A may be rounded to single precision, and what is not summed up, too. It is where that leaves the tolerance, and
   * weights are all the same. All ranks of a team say the same. */
  int single;
  int same; /* A is that of the last solve in this space */
} flesh_pcg_request;

#endif
