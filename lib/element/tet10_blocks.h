/* tet10_blocks.h: computes the blocks of the ten nodes from those of virtual corners at the points (tet10_lanes.h).
 *
 * With o = 4 (a - b), the gradient of a node at point q is o times
 *
 *   corner i:    w g_i + [q = i] g_i                                  w = (4 b - 1)/o
 *   edge i-k:    e (g_i + g_k) + [q = k] g_i + [q = i] g_k            e = 4 b/o
 *
 * Let M^q(x, y) be the bilinear form of the blocks of virtual corners at point q, times o^2, and S its sum over the
 * points. Then nodes have the blocks
 *
 *   i, j:        w (w S_ij + M^i_ij + M^j_ij)
 *   i, m-n:      T_ij + w (M^n_im + M^m_in),   T_ij = e (w S(g_i, g_m + g_n) + M^i(g_i, g_m + g_n))
 *   i, i-j:      (1 + w) M^i_ij - w (M^j_ij + M^j(g_i, g_m + g_n)) - T_ij
 *   v-x, v-y:    (1 + 2 e) M^v_xy + e (e X + M^v_xv + M^v_vy - M^x(g_v, g_x + g_z) - M^y(g_y + g_z, g_v))
 *   i-k, m-n:    e (e X + M^k(g_i, g_m + g_n) + M^i(g_k, g_m + g_n) + M^n(g_i + g_k, g_m) + M^m(g_i + g_k, g_n))
 *
 * where X is S of the sums of two gradients. As all g add up to 0, the corners m and n, or z, can always be chosen such
 * that no block of a corner with itself is needed. */
#ifndef FLESH_ELEMENT_TET10_BLOCKS_H
#define FLESH_ELEMENT_TET10_BLOCKS_H

#include "element/tet10_lanes.h"

/* Blocks between virtual corners 01 02 03 12 13 23, at each point, and their sums. */
enum { CORNER_PAIRS = 6 };
typedef struct corner_blocks {
  flesh_real point[POINTS][CORNER_PAIRS][9], sum[CORNER_PAIRS][9];
} corner_blocks;

/* Blocks of the pairs of different nodes (01 02 03 ... 12 13 ...). */
typedef flesh_real ten_blocks[ELEMENT_PAIRS][9];

/* A take_block that keeps the block; `to` is corner_blocks.point[q]. */
INLINE void keep_block(const tets *t, const flesh_real block[9], int pair, void *to)
{
  (void)t;
  for (int c = 0; c < 9; c++) ((flesh_real(*)[9])to)[pair][c] = block[c];
}

/* Index of a pair of virtual corners; pair_of returns that of a pair of nodes a < b. */
static const unsigned char corner_pair[4][4] = {{0, 0, 1, 2}, {0, 0, 3, 4}, {1, 3, 0, 5}, {2, 4, 5, 0}};
INLINE int pair_of(int a, int b) { return a * (19 - a) / 2 + b - a - 1; }

/* The two corners that are neither i nor j. */
static const unsigned char other[4][4] = {{0, 2, 1, 1}, {2, 0, 0, 0}, {1, 0, 0, 0}, {1, 0, 0, 0}};
static const unsigned char last[4][4] = {{0, 3, 3, 2}, {3, 0, 3, 2}, {3, 3, 0, 1}, {2, 2, 1, 0}};

/* Returns number c of the block of i and j at a point; t is the index of the same number in the transposed block. */
INLINE flesh_real entry(const flesh_real blocks[CORNER_PAIRS][9], int i, int j, int c, int t)
{
  return blocks[corner_pair[i][j]][i < j ? c : t];
}

/* Returns number c of the block of g_i with the sum of the gradients of the two corners other than i and j. */
INLINE flesh_real entry_sum(const flesh_real blocks[CORNER_PAIRS][9], int i, int j, int c, int t)
{
  return entry(blocks, i, other[i][j], c, t) + entry(blocks, i, last[i][j], c, t);
}

static const double SQUARE = 16 * (FLESH_TET10_NEAR - FLESH_TET10_FAR) * (FLESH_TET10_NEAR - FLESH_TET10_FAR),
                    CORNER = (4 * FLESH_TET10_FAR - 1) / (4 * (FLESH_TET10_NEAR - FLESH_TET10_FAR)),
                    EDGE = FLESH_TET10_FAR / (FLESH_TET10_NEAR - FLESH_TET10_FAR);

/* A vector for each node, whose products with one another are added to the blocks; `scaled` includes the factor of the
 * products. */
typedef struct ten_product {
  flesh_real a[10][3], scaled[10][3];
} ten_product;

/* Stores number c of the block of nodes m and n. */
INLINE void put_entry(flesh_real entry, const ten_product *product, int m, int n, int c, flesh_real (*restrict K)[9])
{
  K[pair_of(m, n)][c] = product ? entry + product->scaled[m][c / 3] * product->a[n][c % 3] : entry;
}

/* Computes number c of the blocks of edges with edges. */
INLINE void edges_with_edges(const corner_blocks *restrict of, const ten_product *restrict product, int c, int t,
                             flesh_real (*restrict K)[9])
{
  const flesh_real(*S)[9] = of->sum;
  FLESH_UNROLL(4)
  for (int v = 0; v < 4; v++)
    FLESH_UNROLL(4)
    for (int x = 0; x < 4; x++)
      FLESH_UNROLL(4)
      for (int y = x + 1; y < 4; y++) {
        if (x == v || y == v) continue;
        const int z = 6 - v - x - y;
        const flesh_real X = entry_sum(S, x, z, c, t) - entry_sum(S, v, y, c, t);
        const flesh_real near = entry(of->point[v], x, v, c, t) + entry(of->point[v], v, y, c, t);
        const flesh_real far = entry_sum(of->point[x], v, y, c, t) + entry_sum(of->point[y], v, x, t, c);
        const flesh_real own = SQUARE * (1 + 2 * EDGE) * entry(of->point[v], x, y, c, t);
        put_entry(own + SQUARE * EDGE * (EDGE * X + (near - far)), product, node_of[v][x], node_of[v][y], c, K);
      }
  FLESH_UNROLL(3)
  for (int k = 1; k < 4; k++) {
    const int m = other[0][k], n = last[0][k];
    const flesh_real X = entry_sum(S, 0, k, c, t) + entry_sum(S, k, 0, c, t);
    const flesh_real right = entry_sum(of->point[k], 0, k, c, t) + entry_sum(of->point[0], k, 0, c, t);
    const flesh_real left = entry_sum(of->point[n], m, n, t, c) + entry_sum(of->point[m], n, m, t, c);
    put_entry(SQUARE * EDGE * (EDGE * X + (right + left)), product, node_of[0][k], node_of[m][n], c, K);
  }
}

/* Computes number c of the blocks of corners with corners and with edges. */
INLINE void corners_with_all(const corner_blocks *restrict of, const ten_product *restrict product, int c, int t,
                             flesh_real (*restrict K)[9])
{
  FLESH_UNROLL(4)
  for (int i = 0; i < 4; i++)
    FLESH_UNROLL(4)
    for (int j = 0; j < 4; j++) {
      if (i == j) continue;
      const int m = other[i][j], n = last[i][j];
      const flesh_real own = entry(of->point[i], i, j, c, t), its = entry(of->point[j], i, j, c, t);
      const flesh_real with_all = entry_sum(of->sum, i, j, c, t), with_own = entry_sum(of->point[i], i, j, c, t);
      const flesh_real T = SQUARE * EDGE * (CORNER * with_all + with_own);
      const flesh_real across = entry(of->point[n], i, m, c, t) + entry(of->point[m], i, n, c, t);
      const flesh_real with_its = its + entry_sum(of->point[j], i, j, c, t);
      put_entry(SQUARE * CORNER * across + T, product, i, node_of[m][n], c, K);
      put_entry(SQUARE * (1 + CORNER) * own - SQUARE * CORNER * with_its - T, product, i, node_of[i][j], c, K);
      if (i > j) continue;
      put_entry(SQUARE * CORNER * (CORNER * entry(of->sum, i, j, c, t) + (own + its)), product, i, j, c, K);
    }
}

/* Computes the blocks of the nodes, one of their nine numbers after the other. */
INLINE void blocks_and_product(corner_blocks *restrict of, const ten_product *restrict product,
                               flesh_real (*restrict K)[9])
{
  for (int k = 0; k < CORNER_PAIRS; k++)
    for (int c = 0; c < 9; c++)
      of->sum[k][c] = (of->point[0][k][c] + of->point[1][k][c]) + (of->point[2][k][c] + of->point[3][k][c]);
  for (int c = 0; c < 9; c++) edges_with_edges(of, product, c, 3 * (c % 3) + c / 3, K);
  for (int c = 0; c < 9; c++) corners_with_all(of, product, c, 3 * (c % 3) + c / 3, K);
}

static COMPILED_ONCE void blocks_of_nodes(corner_blocks *restrict of, flesh_real (*restrict K)[9])
{
  blocks_and_product(of, NULL, K);
}

/* Like add_block, for a block in memory: it loads lanes in fours, which saves a third of the exchanges between
 * vectors. */
INLINE void add_stored_block(const tets *t, const flesh_real block[9], int pair, tile_blocks *to)
{
#if FLESH_LANES == 8
  flesh_real by_tet[8];
  const double *row = (const double *)block;
  FLESH_UNROLL(4)
  for (int c = 0; c < 4; c++) {
    by_tet[c] = flesh_two_fours(row + 8 * c, row + 8 * (c + 4));
    by_tet[c + 4] = flesh_two_fours(row + 8 * c + 4, row + 8 * (c + 4) + 4);
  }
  flesh_mix_four(by_tet);
  flesh_mix_four(by_tet + 4);
  FLESH_UNROLL(8)
  for (int l = 0; l < 8; l++) {
    const size_t place = t->pair[ELEMENT_PAIRS * l + pair];
    *(flesh_real_at *)(to->eight + place) += by_tet[l];
    *(double *)((char *)to->ninth + place) += row[64 + l];
  }
#else
  add_block(t, block, pair, to);
#endif
}

/* Adds the blocks of all pairs of different nodes to those of the tile. */
INLINE void add_blocks(const tets *t, const ten_blocks K, tile_blocks *to)
{
  for (int pair = 0; pair < ELEMENT_PAIRS; pair++) add_stored_block(t, K[pair], pair, to);
}

#endif
