/* tet_tiles.c: a tile's nodes and pairs are numbered in the order in which its tets meet them, but those pairs first
 * that no tile before has. */
#include "effect/tet_tiles.h"

#include <limits.h>
#include <stdlib.h>

#include "base/error.h"
#include "base/large.h"

/* Pairs of nodes, numbered as they are met. */
typedef struct pair_list {
  int count;
  int *last;            /* of a node: the last pair that it is the first of; -1: none */
  int *before, *second; /* of a pair: the one that its first node had before, -1: none; its other node */
} pair_list;

/* The tile at hand. */
typedef struct census {
  int *number; /* [nodes of the mesh] in the tile; -1: it is not there */
  int nodes;
  int *node, *pair;  /* its part of those of all tiles */
  pair_list own;     /* by numbers in the tile */
  pair_list of_mesh; /* that were met in any tile, by the mesh's numbers */
  int named[FLESH_TILE_PAIRS], first[FLESH_TILE_PAIRS]; /* of its pairs: as flesh_cells names them; the first node */
  uint16_t rank[FLESH_TILE_PAIRS];                      /* the order in which they are listed */
} census;

/* The arrays of flesh_tiles while they are made. */
typedef struct tile_lists {
  int count;
  int *batch, *node_first, *node, *pair_first, *pair, *fresh;
  uint16_t *nodes, *pairs;
} tile_lists;

/* Its number in the tile, the next one where it is new. */
static int number_of_node(census *c, int node)
{
  if (c->number[node] < 0) {
    c->own.last[c->nodes] = -1;
    c->node[c->nodes] = node;
    c->number[node] = c->nodes++;
  }
  return c->number[node];
}

/* The pair's number, the next one where it is new. */
static int number_of_pair(pair_list *list, int first, int second)
{
  for (int pair = list->last[first]; pair >= 0; pair = list->before[pair])
    if (list->second[pair] == second) return pair;
  list->before[list->count] = list->last[first];
  list->second[list->count] = second;
  return list->last[first] = list->count++;
}

/* For another batch, whatever its tets share. */
static int has_room(const census *c, int lanes)
{
  return c->nodes + 4 * lanes <= FLESH_TILE_NODES && c->own.count + 10 * lanes <= FLESH_TILE_PAIRS;
}

/* Pairs of lanes that are not used, until all are ranked. */
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
      for (int b = a; b < 4; b++, n++) {
        const int pair = number_of_pair(&c->own, own[a], own[b]);
        c->named[pair] = 10 * tet + n;
        c->first[pair] = own[a];
        *pairs++ = l < used ? (uint16_t)pair : NOT_USED;
      }
  }
}

/* Lists the tile's pairs, those first that no tile before has; returns how many these are. */
static int rank_pairs(census *c)
{
  uint8_t fresh[FLESH_TILE_PAIRS];
  int place[2] = {0, 0}; /* of the next one that is not fresh, and that is */
  for (int k = 0; k < c->own.count; k++) {
    const int met = c->of_mesh.count;
    number_of_pair(&c->of_mesh, c->node[c->first[k]], c->node[c->own.second[k]]);
    fresh[k] = c->of_mesh.count > met;
    place[0] += fresh[k];
  }
  const int count = place[0];
  for (int k = 0; k < c->own.count; k++) {
    c->rank[k] = place[fresh[k]]++;
    c->pair[c->rank[k]] = c->named[k];
  }
  return count;
}

/* Tiles of as many batches of a piece as there is room for. */
static void cut(const flesh_batches *batches, int pieces, int *piece, census *c, tile_lists *to)
{
  const size_t lanes = (size_t)batches->lanes;
  to->node_first[0] = to->pair_first[0] = 0;
  for (int p = 0, b = 0; p < pieces; p++) {
    piece[p] = to->count;
    while (b < piece[p + 1]) {
      const int k = to->count++;
      to->batch[k] = b;
      c->nodes = c->own.count = 0;
      for (; b < piece[p + 1] && has_room(c, batches->lanes); b++)
        add_batch(batches, b, c, to->nodes + 4 * lanes * (size_t)b, to->pairs + 10 * lanes * (size_t)b);
      to->fresh[k] = rank_pairs(c);
      for (size_t l = 10 * lanes * (size_t)to->batch[k]; l < 10 * lanes * (size_t)b; l++)
        to->pairs[l] = (uint16_t)(8 * (to->pairs[l] == NOT_USED ? c->own.count : c->rank[to->pairs[l]]));
      for (int i = 0; i < c->nodes; i++) c->number[c->node[i]] = -1;
      c->node += c->nodes;
      c->pair += c->own.count;
      to->node_first[k + 1] = to->node_first[k] + c->nodes;
      to->pair_first[k + 1] = to->pair_first[k] + c->own.count;
    }
  }
  piece[pieces] = to->count;
  to->batch[to->count] = batches->count;
}

/* As little memory as n numbers take. */
static int *shrink(int *numbers, int n)
{
  int *less = realloc(numbers, ((size_t)n + 1) * sizeof *numbers);
  return less ? less : numbers;
}

static int *room_for(size_t n) { return malloc((n + 1) * sizeof(int)); }

int flesh_tiles_create(flesh_batches *batches, int nodes_of_mesh, int pieces, int *piece)
{
  const size_t most = (size_t)batches->count, seats = most * (size_t)batches->lanes;
  const size_t tets = (size_t)batches->first[batches->count], mesh = (size_t)nodes_of_mesh;
  if (tets > INT_MAX / 10)
    return flesh_fail(FLESH_ERR_MEMORY, "%zu elements have too many pairs of nodes; at most %d have not", tets,
                      INT_MAX / 10);
  tile_lists to = {0, room_for(most), room_for(most), room_for(4 * tets), room_for(most), room_for(10 * tets),
                   room_for(most), flesh_large((4 * seats + 1) * sizeof(uint16_t)),
                   flesh_large((10 * seats + 1) * sizeof(uint16_t))};
  census *c = malloc(sizeof *c);
  int *of_nodes = room_for(2 * mesh), *of_pairs = room_for(20 * tets);
  const int ok = to.batch && to.node_first && to.node && to.pair_first && to.pair && to.fresh && to.nodes && to.pairs &&
                 c && of_nodes && of_pairs;
  if (ok) {
    int last[FLESH_TILE_NODES], before[FLESH_TILE_PAIRS], second[FLESH_TILE_PAIRS];
    *c = (census){.number = of_nodes, .node = to.node, .pair = to.pair, .own = {0, last, before, second},
                  .of_mesh = {0, of_nodes + mesh, of_pairs, of_pairs + 10 * tets}};
    for (size_t i = 0; i < 2 * mesh; i++) of_nodes[i] = -1;
    cut(batches, pieces, piece, c, &to);
    to.batch = shrink(to.batch, to.count);
    to.node_first = shrink(to.node_first, to.count);
    to.node = shrink(to.node, to.node_first[to.count]);
    to.pair_first = shrink(to.pair_first, to.count);
    to.pair = shrink(to.pair, to.pair_first[to.count]);
    to.fresh = shrink(to.fresh, to.count);
  }
  free(c);
  free(of_nodes);
  free(of_pairs);
  batches->tiles = (flesh_tiles){to.count, to.batch, to.node_first, to.node, to.pair_first, to.pair, to.fresh, to.nodes,
                                 to.pairs};
  return ok ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for %zu elements", tets);
}

void flesh_tiles_clear(flesh_tiles *tiles)
{
  free((void *)tiles->batch);
  free((void *)tiles->node_first);
  free((void *)tiles->node);
  free((void *)tiles->pair_first);
  free((void *)tiles->pair);
  free((void *)tiles->fresh);
  free((void *)tiles->nodes);
  free((void *)tiles->pairs);
  *tiles = (flesh_tiles){0};
}

size_t flesh_tiles_memory(const flesh_batches *batches)
{
  const flesh_tiles *tiles = &batches->tiles;
  const size_t listed = (size_t)tiles->node_first[tiles->count] + (size_t)tiles->pair_first[tiles->count];
  return (4 * ((size_t)tiles->count + 1) + listed) * sizeof(int) +
         14 * (size_t)batches->count * (size_t)batches->lanes * sizeof(uint16_t);
}
