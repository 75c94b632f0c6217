/* viscous_kernel.c: forces of linear tets against the rate of their strain, FLESH_LANES tets at a time.
 *
 * P = F S with S = 2 shear dev(sym G) + bulk tr(G) I + 2 spin skew(G). Where nothing is frozen G = F^T F'. With a
 * frozen state (F_0, F_0') on the line on which u moves the point, F - F_0 = sx W and F' - F_0' = sv W,
 *
 *   G = F_0^T F_0' + 1/2 (F + F_0)^T (F' - F_0'),   whose symmetric part is   E_0' + sv/sx (E(F) - E(F_0)),
 *
 * E the Green strain and E_0' its rate at the frozen state: then sym dG = sv sym(F^T dW), and the energy D/sv is a
 * potential of the forces. Frozen at the point it is F^T F', at the start of a step and at rest the difference of the
 * Green strain over the step. */
#include "element/tet_lanes.h"
#include "math/eig3_core.h"

/* A tile's vectors, as far as they are there. */
typedef struct nearby {
  tile_vector x, v, x_frozen, v_frozen;
} nearby;

INLINE void gather(const flesh_tiles *tiles, int tile, const flesh_tet_point *at, nearby *tile_of)
{
  if (at->x) tile_gather(tiles, tile, at->x, tile_of->x);
  tile_gather(tiles, tile, at->v, tile_of->v);
  if (at->x_frozen) tile_gather(tiles, tile, at->x_frozen, tile_of->x_frozen);
  if (at->x_frozen && at->v_frozen) tile_gather(tiles, tile, at->v_frozen, tile_of->v_frozen);
}

/* F and the rate G of a batch. */
INLINE void rate_at(const tets *t, const flesh_tet_point *at, const nearby *near, flesh_real F[9], flesh_real G[9])
{
  flesh_real edges[3][3], rate[9], frozen[9], mean[9], change[9];
  if (at->x) gradient_of(t, near->x, edges, F);
  else flesh_mat3_identity(F);
  gradient_of(t, near->v, edges, rate);
  if (!at->x_frozen) {
    flesh_mat3_transposed_multiply(F, rate, G);
    return;
  }
  gradient_of(t, near->x_frozen, edges, frozen);
  for (int c = 0; c < 9; c++) {
    mean[c] = 0.5 * (F[c] + frozen[c]);
    change[c] = 0.5 * (F[c] - frozen[c]);
  }
  flesh_mat3_transposed_multiply(mean, rate, G);
  if (!at->v_frozen) return;
  gradient_of(t, near->v_frozen, edges, frozen);
  flesh_mat3_transposed_multiply(change, frozen, mean);
  for (int c = 0; c < 9; c++) G[c] -= mean[c];
}

/* S for the rate G; returns D, the half of S : G. */
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

static COMPILED_ONCE int residual_kernel(const flesh_batches *batches, int tile, const flesh_tet_point *at, double *r,
                                     double *sums)
{
  const flesh_tiles *tiles = &batches->tiles;
  flesh_real sum = flesh_all(0);
  nearby near;
  tile_vector forces;
  gather(tiles, tile, at, &near);
  if (r) tile_clear(tiles, tile, forces);
  for (int k = tiles->batch[tile]; k < tiles->batch[tile + 1]; k++) {
    tets t;
    flesh_real F[9], G[9], S[9], f[4][3];
    load_tets(batches, k, &t);
    rate_at(&t, at, &near, F, G);
    flesh_real density = stress(&at->viscous[t.material], G, S), scale = at->scale * t.volume;
    if (sums) sum += scale * density;
    if (!r) continue;
    for (int i = 0; i < 3; i++) {
      flesh_real P[3];
      flesh_mat3_transposed_times(S, F + 3 * i, P); /* row i of F S */
      for (int j = 0; j < 3; j++) P[j] *= scale;
      force_row(&t, i, P, f);
    }
    scatter_forces(&t, f, forces);
  }
  if (r) tile_add(tiles, tile, forces, r);
  add_sums(sum, sum, sums);
  return FLESH_OK;
}

/* Symmetric S with its negative eigenvalues set to zero, or their absolute values in their place. */
INLINE void filter(flesh_eigenvalue_filter project, flesh_real S[9])
{
  flesh_real w[3], Q[9], D[9];
  flesh_eig3_core(S, w, Q);
  for (int k = 0; k < 3; k++)
    w[k] = flesh_select(w[k] < 0, project == FLESH_FILTER_ABSOLUTE ? -w[k] : flesh_all(0), w[k]);
  for (int c = 0; c < 9; c++) D[c] = Q[c] * w[c % 3];
  flesh_mat3_multiply_transposed(D, Q, S);
}

/* The stress by which the forces of a batch turn with F, times its part of the matrix; 0 at rest. */
INLINE void stress_of(const tets *t, const flesh_tet_point *at, const nearby *near, flesh_real F[9], flesh_real S[9])
{
  flesh_real G[9];
  if (!at->x) {
    flesh_mat3_identity(F);
    for (int c = 0; c < 9; c++) S[c] = flesh_all(0);
    return;
  }
  rate_at(t, at, near, F, G);
  stress(&at->viscous[t->material], G, S);
  if (at->filter) filter(at->filter, S);
  for (int c = 0; c < 9; c++) S[c] *= at->scale_x * t->volume;
}

/* With p_a = F g_a: K_ab = (shear + spin) (g_a.g_b) F F^T + (shear - spin) p_b p_a^T + (bulk - 2/3 shear) p_a p_b^T
 * times scale, + scale_x (g_a.S g_b) I; blocks K_aa follow from the others (tile_close). */
static int hessian_kernel(const flesh_batches *batches, int tile, const flesh_tet_point *at, const int *slots,
                        double *values)
{
  const flesh_tiles *tiles = &batches->tiles;
  nearby near;
  tile_blocks own;
  if (at->x) gather(tiles, tile, at, &near);
  tile_open(tiles, tile, &own);
  for (int k = tiles->batch[tile]; k < tiles->batch[tile + 1]; k++) {
    tets t;
    flesh_real F[9], S[9], FF[9], g[4][3], p[4][3], q[4][3];
    load_tets(batches, k, &t);
    stress_of(&t, at, &near, F, S);
    const flesh_viscous *m = &at->viscous[t.material];
    flesh_real scale = at->scale * t.volume, same = scale * (m->shear + m->spin);
    flesh_real turned = scale * (m->shear - m->spin), trace = scale * (m->bulk - 2 * m->shear / 3);
    flesh_mat3_multiply_transposed(F, F, FF);
    for (int a = 1; a < 4; a++) {
      shape_gradient(&t, a, g[a]);
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
        add_block(&t, K, n, &own);
      }
    tile_expect(tiles, tile, k, slots, values);
  }
  tile_close(tiles, tile, &own, at->anew, slots, values);
  return FLESH_OK;
}

const flesh_tet_kernel FLESH_OF_ISA(flesh_viscous) = {residual_kernel, hessian_kernel};
