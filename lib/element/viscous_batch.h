/* viscous_batch.h: operations of viscosity kernels on a batch of tets at a point. They are written for four-node tets;
 * an element with more nodes passes virtual corners (tet10_lanes.h).
 *
 * P = F S with S = 2 shear dev(sym G) + bulk tr(G) I + 2 spin skew(G). Without a frozen state G = F^T F'. With a frozen
 * state (F_0, F_0') on the line on which u moves the point, F - F_0 = sx W and F' - F_0' = sv W,
 *
 *   G = F_0^T F_0' + 1/2 (F + F_0)^T (F' - F_0'),   whose symmetric part is   E_0' + sv/sx (E(F) - E(F_0)),
 *
 * where E is the Green strain and E_0' its rate at the frozen state. Then sym dG = sv sym(F^T dW), and the energy D/sv
 * is a potential of the forces. Frozen at the point itself, G is F^T F'; frozen at the start of a step and at rest, it
 * is the difference of the Green strain over the step. */
#ifndef FLESH_ELEMENT_VISCOUS_BATCH_H
#define FLESH_ELEMENT_VISCOUS_BATCH_H

#include "element/tet_lanes.h"
#include "math/eig3_core.h"

/* F and its rate, now and frozen; those that are not needed are not set. */
typedef struct gradients {
  flesh_real F[9], rate[9], frozen[9], frozen_rate[9];
} gradients;

/* Computes the rate G. */
INLINE void rate_of(const flesh_tet_point *at, const gradients *now, flesh_real G[9])
{
  flesh_real mean[9], change[9];
  if (!at->x_frozen) {
    flesh_mat3_transposed_multiply(now->F, now->rate, G);
    return;
  }
  for (int c = 0; c < 9; c++) {
    mean[c] = 0.5 * (now->F[c] + now->frozen[c]);
    change[c] = 0.5 * (now->F[c] - now->frozen[c]);
  }
  flesh_mat3_transposed_multiply(mean, now->rate, G);
  if (!at->v_frozen) return;
  flesh_mat3_transposed_multiply(change, now->frozen_rate, mean);
  for (int c = 0; c < 9; c++) G[c] -= mean[c];
}

/* Computes S for the rate G; returns D, half of S : G. */
INLINE flesh_real stress(const flesh_viscous *m, const flesh_real G[9], flesh_real S[9])
{
  flesh_real trace = flesh_mat3_trace(G), straight = flesh_all(0), sheared = flesh_all(0), turned = flesh_all(0);
  for (int i = 0; i < 3; i++) {
    int j = (i + 1) % 3;
    flesh_real deviator = G[4 * i] - trace / 3;
    flesh_real even = G[3 * i + j] + G[3 * j + i], odd = G[3 * i + j] - G[3 * j + i];
    S[4 * i] = 2 * m->shear * deviator + m->bulk * trace;
    S[3 * i + j] = m->shear * even + m->spin * odd;
    S[3 * j + i] = m->shear * even - m->spin * odd;
    straight += deviator * deviator;
    sheared += even * even;
    turned += odd * odd;
  }
  return m->shear * (straight + 0.5 * sheared) + 0.5 * m->spin * turned + 0.5 * m->bulk * trace * trace;
}

/* Sets the negative eigenvalues of symmetric S to zero, or to their absolute values. */
INLINE void filter(flesh_eigenvalue_filter project, flesh_real S[9])
{
  flesh_real w[3], Q[9], D[9];
  flesh_eig3_core(S, w, Q);
  for (int k = 0; k < 3; k++)
    w[k] = flesh_select(w[k] < 0, project == FLESH_FILTER_ABSOLUTE ? -w[k] : flesh_all(0), w[k]);
  for (int c = 0; c < 9; c++) D[c] = Q[c] * w[c % 3];
  flesh_mat3_multiply_transposed(D, Q, S);
}

/* Computes from the rate G the stress S with which the forces of a batch turn with F, times its factor in the matrix; 0
 * at rest. */
INLINE void turning_stress(const tets *t, const flesh_tet_point *at, const flesh_real G[9], flesh_real S[9])
{
  if (!at->x) {
    for (int c = 0; c < 9; c++) S[c] = flesh_all(0);
    return;
  }
  stress(&at->viscous[t->material], G, S);
  if (at->filter) filter(at->filter, S);
  for (int c = 0; c < 9; c++) S[c] *= at->scale_x * t->volume;
}

/* Computes the blocks. With p_a = F g_a, K_ab = (shear + spin) (g_a.g_b) F F^T + (shear - spin) p_b p_a^T + (bulk - 2/3
 * shear) p_a p_b^T times scale, + g_a.S g_b I; blocks K_aa follow from the others (tile_close). */
INLINE void viscous_blocks(const tets *t, const flesh_tet_point *at, const flesh_real F[9], const flesh_real S[9],
                           take_block *take, void *to)
{
  flesh_real FF[9], g[4][3], p[4][3], q[4][3];
  const flesh_viscous *m = &at->viscous[t->material];
  flesh_real scale = at->scale * t->volume, same = scale * (m->shear + m->spin);
  flesh_real turned = scale * (m->shear - m->spin), trace = scale * (m->bulk - 2 * m->shear / 3);
  flesh_mat3_multiply_transposed(F, F, FF);
  for (int a = 1; a < 4; a++) {
    shape_gradient(t, a, g[a]);
    flesh_mat3_times(F, g[a], p[a]);
    flesh_mat3_times(S, g[a], q[a]);
  }
  for (int i = 0; i < 3; i++) {
    g[0][i] = -(g[1][i] + g[2][i] + g[3][i]);
    p[0][i] = -(p[1][i] + p[2][i] + p[3][i]);
  }
  for (int a = 0, n = 0; a < 3; a++)
    for (int b = a + 1; b < 4; b++, n++) {
      flesh_real gg = same * flesh_vec3_dot(g[a], g[b]), K[9], turns = flesh_vec3_dot(g[a], q[b]);
      for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++)
          K[3 * i + j] = gg * FF[3 * i + j] + turned * p[b][i] * p[a][j] + trace * p[a][i] * p[b][j];
        K[4 * i] += turns;
      }
      take(t, K, n, to);
    }
}

#endif
