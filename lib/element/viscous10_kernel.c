/* viscous10_kernel.c: forces of ten-node tets against the rate of their strain, FLESH_LANES tets at a time. */
#include "element/tet10_blocks.h"
#include "element/viscous_batch.h"

/* Vectors of a batch; those that are not needed are not set. */
typedef struct near_ten {
  ten x, v, x_frozen, v_frozen;
} near_ten;

static COMPILED_ONCE void load_near(const tets *t, const flesh_tet_point *at, const nearby *near, near_ten *to)
{
  if (at->x) load_ten(t, near->x, &to->x);
  load_ten(t, near->v, &to->v);
  if (at->x_frozen) load_ten(t, near->x_frozen, &to->x_frozen);
  if (at->x_frozen && at->v_frozen) load_ten(t, near->v_frozen, &to->v_frozen);
}

/* Computes F, which is I at rest, and the rate G at point q. */
static COMPILED_ONCE void rate_at(const tets *t, const flesh_tet_point *at, const near_ten *near, int q,
                                  flesh_real F[9], flesh_real G[9])
{
  flesh_real edges[3][3];
  gradients now;
  if (at->x) gradient_at(t, &near->x, q, edges, now.F);
  else flesh_mat3_identity(now.F);
  gradient_at(t, &near->v, q, edges, now.rate);
  if (at->x_frozen) gradient_at(t, &near->x_frozen, q, edges, now.frozen);
  if (at->x_frozen && at->v_frozen) gradient_at(t, &near->v_frozen, q, edges, now.frozen_rate);
  rate_of(at, &now, G);
  for (int c = 0; c < 9; c++) F[c] = now.F[c];
}

INLINE int add_residual(const flesh_batches *batches, int index, const flesh_tet_point *at, const nearby *near,
                        double *forces, int with_sums, flesh_real sums[2])
{
  tets t;
  near_ten of_batch;
  ten_forces f;
  open_forces(&f);
  for (int q = 0; q < POINTS; q++) {
    flesh_real F[9], G[9], S[9], of_point[4][3];
    load_point(batches, index, q, &t);
    if (q == 0) load_near(&t, at, near, &of_batch);
    rate_at(&t, at, &of_batch, q, F, G);
    flesh_real density = stress(&at->viscous[t.material], G, S), scale = at->scale * t.volume;
    if (with_sums) sums[0] += scale * density, sums[1] = sums[0];
    for (int i = 0; i < 3; i++) {
      flesh_real P[3];
      flesh_mat3_transposed_times(S, F + 3 * i, P); /* row i of F S */
      for (int j = 0; j < 3; j++) P[j] *= scale;
      force_row(&t, i, P, of_point);
    }
    add_virtual_forces(of_point, q, &f);
  }
  if (!forces) return FLESH_OK;
  close_forces(&f);
  scatter_forces(&t, f.node, forces);
  return FLESH_OK;
}

INLINE int add_hessian(const flesh_batches *batches, int index, const flesh_tet_point *at, const nearby *near,
                       tile_blocks *to)
{
  tets t;
  near_ten of_batch;
  corner_blocks of_corners;
  ten_blocks of_nodes;
  for (int q = 0; q < POINTS; q++) {
    flesh_real F[9], G[9], S[9];
    load_point(batches, index, q, &t);
    if (q == 0 && at->x) load_near(&t, at, near, &of_batch);
    if (at->x) rate_at(&t, at, &of_batch, q, F, G);
    else flesh_mat3_identity(F);
    turning_stress(&t, at, G, S);
    viscous_blocks(&t, at, F, S, keep_block, of_corners.point[q]);
  }
  blocks_of_nodes(&of_corners, of_nodes);
  add_blocks(&t, of_nodes, to);
  return FLESH_OK;
}

RESIDUAL_KERNEL(residual_kernel, add_residual)
HESSIAN_KERNEL(hessian_kernel, add_hessian)

const flesh_tet_kernel FLESH_OF_ISA(flesh_viscous10) = {residual_kernel, hessian_kernel, NULL};
