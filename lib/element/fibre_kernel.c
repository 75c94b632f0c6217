/* fibre_kernel.c: energy, force and (projected) Hessian of the fibres in linear tets, FLESH_LANES tets at a time. */
#include "element/fibre_batch.h"

static COMPILED_ONCE int load(const flesh_batches *batches, int index, const flesh_tet_point *at, const nearby *near,
                              tets *t, fibres *b)
{
  flesh_real d[4][3], v[4][3], x_0[4][3], v_0[4][3];
  load_fibres(batches, index, t);
  load_weights(batches, index, 0, b->weight, &b->volume);
  edges_of(t, near->x, d + 1);
  int status = find_tension(at, d, b);
  if (status || !at->v) return status;
  edges_of(t, near->v, v + 1);
  if (at->x_frozen) edges_of(t, near->x_frozen, x_0 + 1);
  if (at->x_frozen && at->v_frozen) edges_of(t, near->v_frozen, v_0 + 1);
  add_speed(at, v, x_0, v_0, b);
  return FLESH_OK;
}

INLINE int add_residual(const flesh_batches *batches, int index, const flesh_tet_point *at, const nearby *near,
                        double *forces, int with_sums, flesh_real sums[2])
{
  tets t;
  fibres b;
  flesh_real f[4][3];
  int status = load(batches, index, at, near, &t, &b);
  if (status) return status;
  if (with_sums) add_energy(&b, sums);
  if (!forces) return FLESH_OK;
  for (int a = 0; a < 4; a++)
    for (int i = 0; i < 3; i++) f[a][i] = b.volume * b.at.T * b.weight[a] * b.f[i];
  scatter_forces(&t, f, forces);
  return FLESH_OK;
}

INLINE int add_hessian(const flesh_batches *batches, int index, const flesh_tet_point *at, const nearby *near,
                       tile_blocks *to)
{
  tets t;
  fibres b;
  flesh_real H[6];
  int status = load(batches, index, at, near, &t, &b);
  if (status) return status;
  fibre_matrix(at, &b, H);
  for (int a = 0, n = 0; a < 3; a++)
    for (int c = a + 1; c < 4; c++, n++) {
      flesh_real K[9], both = b.weight[a] * b.weight[c];
      for (int i = 0; i < 9; i++) K[i] = both * H[entry_of_six[i]];
      add_block(&t, K, n, to);
    }
  return FLESH_OK;
}

RESIDUAL_KERNEL(fibre_residual, add_residual)
HESSIAN_KERNEL(fibre_hessian, add_hessian)

const flesh_tet_kernel FLESH_OF_ISA(flesh_fibre4) = {fibre_residual, fibre_hessian, NULL};
