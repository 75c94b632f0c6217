/* pcg.h: preconditioned conjugate gradients that notice negative curvature. */
#ifndef FLESH_LINEAR_PCG_H
#define FLESH_LINEAR_PCG_H

#include "flesh/threads.h"
#include "linear/preconditioner.h"
#include "linear/isa_names.h"

typedef struct flesh_pcg_result {
  int iterations;
  double first, residual; /* weighted 2-norms at the start and at the end */
  int single;             /* it was solved in single precision */
} flesh_pcg_result;

/* The vectors of a solve and the order of its products. */
typedef struct flesh_pcg_space flesh_pcg_space;

/* For matrices of A's pattern; `single`: solves in single precision may be asked for. `threads` (may be NULL) is
 * borrowed. Returns new. */
int flesh_pcg_space_create(const flesh_block_matrix *A, int single, flesh_threads *threads, flesh_pcg_space **space);
void flesh_pcg_space_destroy(flesh_pcg_space **space);
size_t flesh_pcg_space_memory(const flesh_pcg_space *space);

/* Solves A x = b from x = 0 until || weights . (b - A x) ||_2 <= tolerance (weights [3*rows], NULL: ones). FLESH_OK;
 * FLESH_NOT_CONVERGED at the iteration limit, x the last iterate (a descent direction all the same);
 * FLESH_NOT_POSITIVE at the first direction p with p.Ap <= 0, x the iterate before it; FLESH_NONFINITE. */
int flesh_pcg(flesh_pcg_space *space, const flesh_block_matrix *A, flesh_preconditioner_data *preconditioner,
              const double *weights, double tolerance, int max_iterations, const double *b, double *x,
              flesh_pcg_result *result);

/* || r - (A x - b) ||_2 of the last solve's x: how far r [3*rows] is from what the linear model predicts where x
 * leads. Before the first solve || r ||_2. */
double flesh_pcg_model_error(const flesh_pcg_space *space, const double *r);

/* What a caller may want beyond that; zeros: nothing. */
typedef struct flesh_pcg_guide {
  /* How many iterations to go on after the first direction of negative curvature. The conjugate
   * directions p part the quadratic model into parabolas of one variable each, so x then goes
   * downhill along every one: by |rz / p.Ap|, but no farther than the preconditioned gradient would
   * be followed, rz / p.Mp (from that direction on). The status is FLESH_NOT_POSITIVE and x descends. */
  int after_indefinite;
  /* Asked every few iterations: a status that is not FLESH_OK ends the solve with it. NULL: not asked. */
  int (*stop)(void *data);
  void *stop_data;
  /* A may be rounded to single precision, and what is not summed up, too. It is where that leaves the tolerance, and
   * weights are all the same. */
  int single;
  int same; /* A is that of the last solve in this space */
} flesh_pcg_guide;

int flesh_pcg_guided(flesh_pcg_space *space, const flesh_block_matrix *A,
                     flesh_preconditioner_data *preconditioner, const flesh_pcg_guide *guide,
                     const double *weights, double tolerance, int max_iterations, const double *b,
                     double *x, flesh_pcg_result *result);

#endif
