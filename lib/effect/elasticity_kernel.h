/* elasticity_kernel.h: what elasticity does with its tets, several side by side: one source,
 * compiled once per instruction set. */
#ifndef FLESH_EFFECT_ELASTICITY_KERNEL_H
#define FLESH_EFFECT_ELASTICITY_KERNEL_H

#include "flesh/effect.h"
#include "flesh/material.h"

/* Tets in batches of at most as many as the kernel has lanes, of one material each. */
typedef struct flesh_batches {
  int count;
  const int *first;     /* [count+1] first tet of each */
  const int *material;  /* [count] index into materials */
  const double *shapes; /* [count][10][lanes]: gradients g_1, g_2, g_3 of shape functions, volume;
                           lanes that are not used repeat the last tet with no volume */
  const int *nodes;     /* [tets][4], ascending within a tet */
  const flesh_material *materials;
} flesh_batches;

/* Everything for the batches from <= b < until, in that order, which is that of the additions.
 * Returns FLESH_OK, FLESH_UNDEFINED or FLESH_NONFINITE. */
typedef struct flesh_elasticity_kernel {
  const char *name;
  int lanes;
  /* r += dV/dx. */
  int (*residual)(const flesh_batches *batches, int from, int until, const double *x, double *r);
  /* values += scale d2V/dx2, its tets' negative eigenvalues treated as `project` says. */
  int (*jacobian)(const flesh_batches *batches, int from, int until, const double *x, double scale,
                  flesh_projected project, const int *slots, double *values);
  /* sums[0] += V; sums[1] += the size of its terms, |psi| and |psi_I| I_C. */
  int (*energy)(const flesh_batches *batches, int from, int until, const double *x, double sums[2]);
  /* Residual and energy in one pass. */
  int (*evaluate)(const flesh_batches *batches, int from, int until, const double *x, double *r,
                  double sums[2]);
} flesh_elasticity_kernel;

extern const flesh_elasticity_kernel flesh_elasticity_portable, flesh_elasticity_avx2,
    flesh_elasticity_avx512;

#endif
