/* viscous_kernel.c: forces of linear tets against the rate of their strain, FLESH_LANES tets at a time.
 *
 * P = F S with S = 2 shear dev(sym G) + bulk tr(G) I + 2 spin skew(G) and G = F^T F'. */
#include "effect/tet_lanes.h"

INLINE void frame_at(const tets *t, const double *x, flesh_real F[9])
{
  flesh_real edges[3][3];
  if (x) gradient_of(t, x, edges, F);
  else flesh_mat3_identity(F);
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

static COMPILED_ONCE int first_order(const flesh_batches *batches, int tile, const flesh_tet_point *at, double *r,
                                     double *sums)
{
  const flesh_tiles *tiles = &batches->tiles;
  flesh_real sum = flesh_all(0);
  tile_vector x, v, forces;
  if (at->x) tile_gather(tiles, tile, at->x, x);
  tile_gather(tiles, tile, at->v, v);
  if (r) tile_clear(tiles, tile, forces);
  for (int k = tiles->batch[tile]; k < tiles->batch[tile + 1]; k++) {
    tets t;
    flesh_real edges[3][3], F[9], rate[9], G[9], S[9], f[4][3];
    load_tets(batches, k, &t);
    frame_at(&t, at->x ? x : NULL, F);
    gradient_of(&t, v, edges, rate);
    flesh_mat3_transposed_multiply(F, rate, G);
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

/* With p_a = F g_a: K_ab = (shear + spin) (g_a.g_b) F F^T + (shear - spin) p_b p_a^T
 * + (bulk - 2/3 shear) p_a p_b^T; blocks K_aa follow from the others (tile_close). */
static int second_order(const flesh_batches *batches, int tile, const flesh_tet_point *at, const int *slots,
                        double *values)
{
  const flesh_tiles *tiles = &batches->tiles;
  tile_vector x;
  tile_blocks own;
  if (at->x) tile_gather(tiles, tile, at->x, x);
  tile_open(tiles, tile, &own);
  for (int k = tiles->batch[tile]; k < tiles->batch[tile + 1]; k++) {
    tets t;
    flesh_real F[9], FF[9], g[4][3], p[4][3];
    load_tets(batches, k, &t);
    frame_at(&t, at->x ? x : NULL, F);
    const flesh_viscous *m = &at->viscous[t.material];
    flesh_real scale = at->scale * t.volume, same = scale * (m->shear + m->spin);
    flesh_real turned = scale * (m->shear - m->spin), trace = scale * (m->bulk - 2 * m->shear / 3);
    flesh_mat3_multiply_transposed(F, F, FF);
    for (int a = 1; a < 4; a++) {
      shape_gradient(&t, a, g[a]);
      flesh_mat3_times(F, g[a], p[a]);
    }
    for (int i = 0; i < 3; i++) {
      g[0][i] = -(g[1][i] + g[2][i] + g[3][i]);
      p[0][i] = -(p[1][i] + p[2][i] + p[3][i]);
    }
    for (int a = 0, n = 0; a < 3; a++)
      for (int b = a + 1; b < 4; b++, n++) {
        flesh_real gg = same * flesh_vec3_dot(g[a], g[b]), K[9];
        for (int i = 0; i < 3; i++)
          for (int j = 0; j < 3; j++)
            K[3 * i + j] = gg * FF[3 * i + j] + turned * p[b][i] * p[a][j] + trace * p[a][i] * p[b][j];
        add_block(&t, K, n, &own);
      }
    tile_expect(tiles, tile, k, slots, values);
  }
  tile_close(tiles, tile, &own, at->anew, slots, values);
  return FLESH_OK;
}

const flesh_tet_kernel FLESH_OF_SET(flesh_viscous) = {first_order, second_order};
