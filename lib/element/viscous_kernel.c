/* viscous_kernel.c: forces of linear tets against the rate of their strain, FLESH_LANES tets at a time. */
#include "element/viscous_batch.h"

/* Computes F, which is I at rest, and the rate G of a batch. */
INLINE void rate_at(const tets *t, const flesh_tet_point *at, const nearby *near, flesh_real F[9], flesh_real G[9])
{
  flesh_real edges[3][3];
  gradients now;
  if (at->x) gradient_of(t, near->x, edges, now.F);
  else flesh_mat3_identity(now.F);
  gradient_of(t, near->v, edges, now.rate);
  if (at->x_frozen) gradient_of(t, near->x_frozen, edges, now.frozen);
  if (at->x_frozen && at->v_frozen) gradient_of(t, near->v_frozen, edges, now.frozen_rate);
  rate_of(at, &now, G);
  for (int c = 0; c < 9; c++) F[c] = now.F[c];
}

static COMPILED_ONCE int add_residual(const flesh_batches *batches, int index, const flesh_tet_point *at,
                                      const nearby *near, double *forces, int with_sums, flesh_real sums[2])
{
  tets t;
  flesh_real F[9], G[9], S[9], f[4][3];
  load_tets(batches, index, &t);
  rate_at(&t, at, near, F, G);
  flesh_real density = stress(&at->viscous[t.material], G, S), scale = at->scale * t.volume;
  if (with_sums) sums[0] += scale * density, sums[1] = sums[0];
  if (!forces) return FLESH_OK;
  for (int i = 0; i < 3; i++) {
    flesh_real P[3];
    flesh_mat3_transposed_times(S, F + 3 * i, P); /* row i of F S */
    for (int j = 0; j < 3; j++) P[j] *= scale;
    force_row(&t, i, P, f);
  }
  scatter_forces(&t, f, forces);
  return FLESH_OK;
}

INLINE int add_hessian(const flesh_batches *batches, int index, const flesh_tet_point *at, const nearby *near,
                       tile_blocks *to)
{
  tets t;
  flesh_real F[9], G[9], S[9];
  load_tets(batches, index, &t);
  if (at->x) rate_at(&t, at, near, F, G);
  else flesh_mat3_identity(F);
  turning_stress(&t, at, G, S);
  viscous_blocks(&t, at, F, S, add_block, to);
  return FLESH_OK;
}

RESIDUAL_KERNEL(residual_kernel, add_residual)
HESSIAN_KERNEL(hessian_kernel, add_hessian)

const flesh_tet_kernel FLESH_OF_ISA(flesh_viscous) = {residual_kernel, hessian_kernel, NULL};
