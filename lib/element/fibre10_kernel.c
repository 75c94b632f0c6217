/* fibre10_kernel.c: energy, force and (projected) Hessian of the fibres in ten-node tets, FLESH_LANES tets at a time.
 *
 * At a point with barycentric coordinates L, corner i has the gradient (4 L_i - 1) w_i along the fibre, and the node on
 * the edge i-k has 4 (L_k w_i + L_i w_k). Here w are the gradients of the linear functions of the straight tet's
 * corners, or of the virtual corners if tets are curved (tet10_lanes.h). */
#include "element/tet10_lanes.h"

#include "element/fibre_batch.h"

typedef struct points {
  fibres at[POINTS];
} points;

static COMPILED_ONCE int load(const flesh_batches *batches, int index, const flesh_tet_point *at, const nearby *near,
                              tets *t, points *p)
{
  ten all, v, x_0, v_0;
  load_fibres(batches, index, t);
  load_ten(t, near->x, &all);
  if (at->v) load_ten(t, near->v, &v);
  if (at->v && at->x_frozen) load_ten(t, near->x_frozen, &x_0);
  if (at->v && at->x_frozen && at->v_frozen) load_ten(t, near->v_frozen, &v_0);
  for (int q = 0; q < POINTS; q++) {
    fibres *b = &p->at[q];
    flesh_real w[4];
    load_weights(batches, index, q, w, &b->volume);
    b->volume *= 1. / POINTS;
    for (int i = 0; i < 4; i++) {
      b->weight[i] = (i == q ? 4 * FLESH_TET10_NEAR - 1 : corner_weight) * w[i];
      for (int k = i + 1; k < 4; k++)
        b->weight[node_of[i][k]] = 4 * (k == q ? FLESH_TET10_NEAR : FLESH_TET10_FAR) * w[i] +
                                   4 * (i == q ? FLESH_TET10_NEAR : FLESH_TET10_FAR) * w[k];
    }
    int status = find_tension(at, all.node, b);
    if (status) return status;
    if (at->v) add_speed(at, v.node, x_0.node, v_0.node, b);
  }
  return FLESH_OK;
}

INLINE int add_residual(const flesh_batches *batches, int index, const flesh_tet_point *at, const nearby *near,
                        double *forces, int with_sums, flesh_real sums[2])
{
  tets t;
  points p;
  flesh_real f[10][3];
  int status = load(batches, index, at, near, &t, &p);
  if (status) return status;
  for (int q = 0; q < POINTS && with_sums; q++) add_energy(&p.at[q], sums);
  if (!forces) return FLESH_OK;
  for (int a = 0; a < 10; a++)
    for (int i = 0; i < 3; i++) {
      f[a][i] = flesh_all(0);
      for (int q = 0; q < POINTS; q++) f[a][i] += p.at[q].volume * p.at[q].at.T * p.at[q].weight[a] * p.at[q].f[i];
    }
  scatter_forces(&t, f, forces);
  return FLESH_OK;
}

static COMPILED_ONCE int add_hessian(const flesh_batches *batches, int index, const flesh_tet_point *at,
                                     const nearby *near, tile_blocks *to)
{
  tets t;
  points p;
  flesh_real H[POINTS][6];
  int status = load(batches, index, at, near, &t, &p);
  if (status) return status;
  for (int q = 0; q < POINTS; q++) fibre_matrix(at, &p.at[q], H[q]);
  for (int a = 0, n = 0; a < 9; a++)
    for (int c = a + 1; c < 10; c++, n++) {
      flesh_real K[9], both[POINTS], sum[6];
      for (int q = 0; q < POINTS; q++) both[q] = p.at[q].weight[a] * p.at[q].weight[c];
      for (int k = 0; k < 6; k++) {
        sum[k] = both[0] * H[0][k];
        for (int q = 1; q < POINTS; q++) sum[k] += both[q] * H[q][k];
      }
      for (int i = 0; i < 9; i++) K[i] = sum[entry_of_six[i]];
      add_block(&t, K, n, to);
    }
  return FLESH_OK;
}

RESIDUAL_KERNEL(fibre_residual, add_residual)
HESSIAN_KERNEL(fibre_hessian, add_hessian)

const flesh_tet_kernel FLESH_OF_ISA(flesh_fibre10) = {fibre_residual, fibre_hessian, NULL};
