/* tile.h: a kernel's copy of the data of its tile (tet_kernel.h), loaded from the body and added back.
 *
 * It fits the first two caches, nothing in it crosses a cache line, and distant data are prefetched in time. */
#ifndef FLESH_ELEMENT_TILE_H
#define FLESH_ELEMENT_TILE_H

#include <string.h>

#include "element/tet_kernel.h"
#include "math/lanes.h"

/* Sizes of the element for which the including source is compiled. */
#ifndef ELEMENT_NODES
#define ELEMENT_NODES 4
#endif
#define ELEMENT_PAIRS (ELEMENT_NODES * (ELEMENT_NODES - 1) / 2)
#define TILE_PAIRS    (ELEMENT_NODES == 4 ? FLESH_TILE_PAIRS : FLESH_TILE_PAIRS_10)

/* The compiler must inline these to keep a batch in registers. */
#define INLINE static inline __attribute__((always_inline))

/* A vector at the tile's nodes, with three numbers for each and one for padding. */
typedef double tile_vector[4 * FLESH_TILE_NODES] __attribute__((aligned(64)));

INLINE int tile_pairs(const flesh_tiles *tiles, int tile)
{
  return tiles->pair_first[tile + 1] - tiles->pair_first[tile];
}

INLINE int tile_nodes(const flesh_tiles *tiles, int tile)
{
  return tiles->node_first[tile + 1] - tiles->node_first[tile];
}

/* Copies x of the body [3*n] into the tile. */
INLINE void tile_gather(const flesh_tiles *tiles, int tile, const double *x, double *own)
{
  const int first = tiles->node_first[tile], count = tile_nodes(tiles, tile);
  for (int k = 0; k < count; k++) {
    const double *place = x + 3 * (size_t)tiles->node[first + k];
    *(flesh_four *)(own + 4 * k) =
        __builtin_shufflevector(*(const flesh_two_at *)place, (flesh_two_at){place[2], 0}, 0, 1, 2, 3);
  }
}

INLINE void tile_clear(const flesh_tiles *tiles, int tile, double *own)
{
  memset(own, 0, 4 * (size_t)tile_nodes(tiles, tile) * sizeof *own);
}

/* Adds the tile's vector to r of the body [3*n]. */
INLINE void tile_add(const flesh_tiles *tiles, int tile, const double *own, double *r)
{
  const int first = tiles->node_first[tile], count = tile_nodes(tiles, tile);
  for (int k = 0; k < count; k++) {
    double *place = r + 3 * (size_t)tiles->node[first + k];
    *(flesh_two_at *)place += *(const flesh_two_at *)(own + 4 * k);
    place[2] += own[4 * k + 2];
  }
}

/* Blocks of the tile's pairs of different nodes: the first eight numbers of each, which fill a cache line, and the
 * ninth. One more block is for unused lanes. */
typedef struct tile_blocks {
  double eight[8 * (TILE_PAIRS + 1)] __attribute__((aligned(64)));
  double ninth[TILE_PAIRS + 1];
} tile_blocks;

/* Returns the slots of the tile's blocks: of its pairs, then of its nodes. */
INLINE const int *tile_slots(const flesh_tiles *tiles, int tile, const int *slots)
{
  return slots + tiles->pair_first[tile] + tiles->node_first[tile];
}

INLINE void tile_open(const flesh_tiles *tiles, int tile, tile_blocks *own)
{
  const size_t count = (size_t)tile_pairs(tiles, tile);
  memset(own->eight, 0, 8 * count * sizeof *own->eight);
  memset(own->ninth, 0, count * sizeof *own->ninth);
}

/* Prefetches the places of the tile's blocks in the body, a share of them for each batch, into the second cache, as the
 * tile's own blocks fill the first. */
INLINE void tile_expect(const flesh_tiles *tiles, int tile, int batch, const int *slots, const double *values)
{
  const int *slot = tile_slots(tiles, tile, slots), count = tile_pairs(tiles, tile) + tile_nodes(tiles, tile);
  const int batches = tiles->batch[tile + 1] - tiles->batch[tile], before = batch - tiles->batch[tile];
  for (int k = count * before / batches, end = count * (before + 1) / batches; k < end; k++) {
    const double *block = values + 9 * (size_t)slot[k];
    __builtin_prefetch(block, 1, 2);
    __builtin_prefetch(block + 8, 1, 2); /* the block may end in another cache line */
  }
}

/* Number of vectors that hold the first eight numbers of a block. */
enum { PARTS_OF_EIGHT = 8 / FLESH_LANES };

/* Sets the body's block to the tile's, or adds it. */
INLINE void put_block(const flesh_real own[PARTS_OF_EIGHT], double ninth, int assign, double *block)
{
  for (int part = 0; part < PARTS_OF_EIGHT; part++) {
    flesh_real_at *place = (flesh_real_at *)(block + part * FLESH_LANES);
    if (assign) *place = own[part];
    else *place += own[part];
  }
  block[8] = assign ? ninth : block[8] + ninth;
}

/* Transposes a block, given its first eight numbers. */
INLINE void transpose_block(flesh_real own[PARTS_OF_EIGHT])
{
#if FLESH_LANES == 8
  own[0] = __builtin_shufflevector(own[0], own[0], 0, 3, 6, 1, 4, 7, 2, 5);
#else
  static const int upper[3] = {1, 2, 5}, lower[3] = {3, 6, 7};
  double eight[8];
  for (int c = 0; c < 8; c++) eight[c] = flesh_lane(own[c / FLESH_LANES], c % FLESH_LANES);
  for (int k = 0; k < 3; k++) {
    const double other = eight[upper[k]];
    eight[upper[k]] = eight[lower[k]];
    eight[lower[k]] = other;
  }
  for (int c = 0; c < 8; c++) flesh_set_lane(&own[c / FLESH_LANES], c % FLESH_LANES, eight[c]);
#endif
}

/* Replaces a block by its symmetric part, given the first eight numbers. */
INLINE void make_symmetric(flesh_real own[PARTS_OF_EIGHT])
{
#if FLESH_LANES == 8
  own[0] = 0.5 * (own[0] + __builtin_shufflevector(own[0], own[0], 0, 3, 6, 1, 4, 7, 2, 5));
#else
  static const int upper[3] = {1, 2, 5}, lower[3] = {3, 6, 7};
  double eight[8];
  for (int c = 0; c < 8; c++) eight[c] = flesh_lane(own[c / FLESH_LANES], c % FLESH_LANES);
  for (int k = 0; k < 3; k++) eight[upper[k]] = eight[lower[k]] = 0.5 * (eight[upper[k]] + eight[lower[k]]);
  for (int c = 0; c < 8; c++) flesh_set_lane(&own[c / FLESH_LANES], c % FLESH_LANES, eight[c]);
#endif
}

/* Subtracts the blocks from *star to `end` in two alternating sums, as each addition to a single sum would wait for the
 * one before. */
INLINE void subtract_pairs(const tile_blocks *own, const uint16_t **star, const uint16_t *end,
                           flesh_real sum[PARTS_OF_EIGHT], double *ninth)
{
  flesh_real second[PARTS_OF_EIGHT] = {{0}};
  double second_ninth = 0;
  for (; *star < end; *star += 2) {
    const flesh_real *block = (const flesh_real *)(own->eight + (*star)[0]);
    const flesh_real *next = (const flesh_real *)(own->eight + (*star)[1]);
    for (int part = 0; part < PARTS_OF_EIGHT; part++) {
      sum[part] -= block[part];
      second[part] -= next[part];
    }
    *ninth -= *(const double *)((const char *)own->ninth + (*star)[0]);
    second_ninth -= *(const double *)((const char *)own->ninth + (*star)[1]);
  }
  for (int part = 0; part < PARTS_OF_EIGHT; part++) sum[part] += second[part];
  *ninth += second_ninth;
}

/* Adds the tile's blocks to the body's; with `assign`, sets those that belong to no tile before. Blocks of nodes with
 * themselves follow from the others, as a rigid displacement has no forces: K_aa = -sum of K_ab, of which the symmetric
 * parts suffice. */
INLINE void tile_close(const flesh_tiles *tiles, int tile, tile_blocks *own, int assign, const int *slots,
                       double *values)
{
  const int *slot = tile_slots(tiles, tile, slots), pairs = tile_pairs(tiles, tile), nodes = tile_nodes(tiles, tile);
  const int *fresh = tiles->fresh + 2 * tile;
  const uint16_t *degree = tiles->degree + tiles->node_first[tile];
  const uint16_t *star = tiles->star + 2 * (size_t)tiles->pair_first[tile];
  const uint8_t *turned = ELEMENT_NODES == 4 ? NULL : tiles->turned + tiles->pair_first[tile];
  for (int k = 0; k < pairs; k++) {
    if (turned && turned[k]) transpose_block((flesh_real *)(own->eight + 8 * k));
    put_block((const flesh_real *)(own->eight + 8 * k), own->ninth[k], assign && k < fresh[0],
              values + 9 * (size_t)slot[k]);
  }
  for (int i = 0; i < nodes; i++) {
    flesh_real sum[PARTS_OF_EIGHT] = {{0}};
    double ninth = 0;
#if ELEMENT_NODES > 4
    subtract_pairs(own, &star, star + degree[i] / 2 * 2, sum, &ninth);
    for (const uint16_t *end = star + degree[i] % 2; star < end; star++) {
#else
    for (const uint16_t *end = star + degree[i]; star < end; star++) {
#endif
      const flesh_real *block = (const flesh_real *)(own->eight + *star);
      for (int part = 0; part < PARTS_OF_EIGHT; part++) sum[part] -= block[part];
      ninth -= *(const double *)((const char *)own->ninth + *star);
    }
    make_symmetric(sum);
    put_block(sum, ninth, assign && i < fresh[1], values + 9 * (size_t)slot[pairs + i]);
  }
}

#endif
