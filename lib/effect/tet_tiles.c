/* tet_tiles.c: a tile's nodes and pairs are numbered in the order in which its tets meet them. */
#include "effect/tet_tiles.h"

#include <stdlib.h>

#include "base/error.h"
#include "base/large.h"

/* The tile at hand. */
typedef struct census {
  int *number; /* [nodes of the mesh] in the tile; -1: it is not there */
  int nodes, pairs;
  int *node, *pair;                /* its part of those of all tiles */
  int last[FLESH_TILE_NODES];      /* of a node: the last pair that it is the first of; -1: none */
  int before[FLESH_TILE_PAIRS];    /* of a pair: the one that its first node had before; -1: none */
  int second[FLESH_TILE_PAIRS];    /* its other node */
} census;

static int number_of_node(census *c, int node)
{
  if (c->number[node] < 0) {
    c->last[c->nodes] = -1;
    c->node[c->nodes] = node;
    c->number[node] = c->nodes++;
  }
  return c->number[node];
}

/* `place` is ten times a tet that has it and which of its pairs it is. */
static int number_of_pair(census *c, int first, int second, int place)
{
  for (int pair = c->last[first]; pair >= 0; pair = c->before[pair])
    if (c->second[pair] == second) return pair;
  c->before[c->pairs] = c->last[first];
  c->second[c->pairs] = second;
  c->pair[c->pairs] = place;
  return c->last[first] = c->pairs++;
}

static int has_room(const census *c, int lanes)
{
  return c->nodes + 4 * lanes <= FLESH_TILE_NODES && c->pairs + 10 * lanes <= FLESH_TILE_PAIRS;
}

/* Pairs of lanes that are not used, until the tile's last pair is known. */
enum { NOT_USED = UINT16_MAX };

static void add_batch(const flesh_batches *batches, int batch, census *c, uint16_t *nodes, uint16_t *pairs)
{
  const int first = batches->first[batch], used = batches->first[batch + 1] - first;
  for (int l = 0; l < batches->lanes; l++) {
    const int tet = first + (l < used ? l : used - 1);
    int own[4];
    for (int a = 0; a < 4; a++) {
      own[a] = number_of_node(c, batches->nodes[4 * (size_t)tet + (size_t)a]);
      *nodes++ = (uint16_t)(4 * own[a]);
    }
    for (int a = 0, n = 0; a < 4; a++)
      for (int b = a; b < 4; b++, n++)
        *pairs++ = l < used ? (uint16_t)(8 * number_of_pair(c, own[a], own[b], 10 * tet + n)) : NOT_USED;
  }
}

/* Tiles of as many batches of a piece as there is room for. */
static void cut(const flesh_batches *batches, int pieces, int *piece, census *c, flesh_tiles *tiles, int *batch,
                int *node_first, int *pair_first, uint16_t *nodes, uint16_t *pairs)
{
  const size_t lanes = (size_t)batches->lanes;
  node_first[0] = pair_first[0] = 0;
  for (int p = 0, b = 0; p < pieces; p++) {
    piece[p] = tiles->count;
    while (b < piece[p + 1]) {
      const int k = tiles->count++;
      batch[k] = b;
      c->nodes = c->pairs = 0;
      for (; b < piece[p + 1] && has_room(c, batches->lanes); b++)
        add_batch(batches, b, c, nodes + 4 * lanes * (size_t)b, pairs + 10 * lanes * (size_t)b);
      for (size_t l = 10 * lanes * (size_t)batch[k]; l < 10 * lanes * (size_t)b; l++)
        if (pairs[l] == NOT_USED) pairs[l] = (uint16_t)(8 * c->pairs);
      for (int i = 0; i < c->nodes; i++) c->number[c->node[i]] = -1;
      c->node += c->nodes;
      c->pair += c->pairs;
      node_first[k + 1] = node_first[k] + c->nodes;
      pair_first[k + 1] = pair_first[k] + c->pairs;
    }
  }
  piece[pieces] = tiles->count;
  batch[tiles->count] = batches->count;
}

/* As little memory as n numbers take. */
static int *shrink(int *numbers, int n)
{
  int *less = realloc(numbers, ((size_t)n + 1) * sizeof *numbers);
  return less ? less : numbers;
}

int flesh_tiles_create(flesh_batches *batches, int nodes_of_mesh, int pieces, int *piece)
{
  const size_t most = (size_t)batches->count, seats = most * (size_t)batches->lanes;
  const size_t tets = (size_t)batches->first[batches->count];
  int *batch = malloc((most + 1) * sizeof *batch);
  int *node_first = malloc((most + 1) * sizeof *node_first), *pair_first = malloc((most + 1) * sizeof *pair_first);
  int *node = malloc((4 * tets + 1) * sizeof *node), *pair = malloc((10 * tets + 1) * sizeof *pair);
  uint16_t *nodes = flesh_large((4 * seats + 1) * sizeof *nodes);
  uint16_t *pairs = flesh_large((10 * seats + 1) * sizeof *pairs);
  census *c = malloc(sizeof *c);
  int *number = malloc(((size_t)nodes_of_mesh + 1) * sizeof *number);
  const int ok = batch && node_first && pair_first && node && pair && nodes && pairs && c && number;
  flesh_tiles *tiles = &batches->tiles;
  *tiles = (flesh_tiles){0};
  if (ok) {
    for (int i = 0; i < nodes_of_mesh; i++) number[i] = -1;
    c->number = number;
    c->node = node;
    c->pair = pair;
    cut(batches, pieces, piece, c, tiles, batch, node_first, pair_first, nodes, pairs);
    node = shrink(node, node_first[tiles->count]);
    pair = shrink(pair, pair_first[tiles->count]);
    batch = shrink(batch, tiles->count);
    node_first = shrink(node_first, tiles->count);
    pair_first = shrink(pair_first, tiles->count);
  }
  free(c);
  free(number);
  tiles->batch = batch;
  tiles->node_first = node_first;
  tiles->node = node;
  tiles->pair_first = pair_first;
  tiles->pair = pair;
  tiles->nodes = nodes;
  tiles->pairs = pairs;
  return ok ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for %zu elements", tets);
}

void flesh_tiles_clear(flesh_tiles *tiles)
{
  free((void *)tiles->batch);
  free((void *)tiles->node_first);
  free((void *)tiles->node);
  free((void *)tiles->pair_first);
  free((void *)tiles->pair);
  free((void *)tiles->nodes);
  free((void *)tiles->pairs);
  *tiles = (flesh_tiles){0};
}

size_t flesh_tiles_memory(const flesh_batches *batches)
{
  const flesh_tiles *tiles = &batches->tiles;
  const size_t listed = (size_t)tiles->node_first[tiles->count] + (size_t)tiles->pair_first[tiles->count];
  return (3 * ((size_t)tiles->count + 1) + listed) * sizeof(int) +
         14 * (size_t)batches->count * (size_t)batches->lanes * sizeof(uint16_t);
}
