/* tet_tiles.c: makes tiles. A tile's pairs are numbered in the order in which its tets meet them, and its nodes by the
 * number of pairs that contain them, so that consecutive loops over these pairs have equal lengths; pairs and nodes
 * that belong to no tile before come first. */
#include "element/tet_tiles.h"

#include <limits.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "base/stop.h"

enum { MOST_NODES = 10, MOST_PAIRS = FLESH_TILE_PAIRS_10 }; /* of a tet, of a tile */

/* Pairs of nodes, numbered as they are met. */
typedef struct pair_list {
  int count;
  int *last;            /* last pair in which each node is the first; -1: none */
  int *before, *second; /* for each pair: the pair before in the list of its first node, -1: none; its second node */
} pair_list;

/* The tile being made. Its numbering is final only at the end. */
typedef struct census {
  int *number;  /* [nodes of the mesh] index in the tile; -1: not in it */
  uint8_t *met; /* [nodes of the mesh] 1: an earlier tile has it */
  int nodes;
  int *node, *block; /* the tile's entries in the arrays of all tiles */
  uint16_t *degree, *star;
  uint8_t *turned;
  pair_list own;     /* of different nodes, by indices in the tile */
  pair_list of_mesh; /* met in any tile, by numbers in the mesh */
  /* For each node of the tile: its number in the mesh; the pair with itself, as flesh_cells names it. */
  int here[FLESH_TILE_NODES], with_itself[FLESH_TILE_NODES];
  /* For each pair of the tile: its name in flesh_cells; its first node. */
  int named[MOST_PAIRS], first[MOST_PAIRS];
  uint16_t node_rank[FLESH_TILE_NODES], pair_rank[MOST_PAIRS]; /* their final indices */
} census;

/* The arrays of flesh_tiles while they are made. */
typedef struct tile_lists {
  int count;
  int *batch, *node_first, *node, *pair_first, *block, *fresh;
  uint16_t *degree, *star, *nodes, *pairs;
  uint8_t *turned;
} tile_lists;

/* Returns the node's index in the tile; a new node gets the next one. */
static int number_of_node(census *c, int node, int with_itself)
{
  if (c->number[node] < 0) {
    c->own.last[c->nodes] = -1;
    c->here[c->nodes] = node;
    c->with_itself[c->nodes] = with_itself;
    c->number[node] = c->nodes++;
  }
  return c->number[node];
}

/* Returns the pair's index; a new pair gets the next one. */
static int number_of_pair(pair_list *list, int first, int second)
{
  for (int pair = list->last[first]; pair >= 0; pair = list->before[pair])
    if (list->second[pair] == second) return pair;
  list->before[list->count] = list->last[first];
  list->second[list->count] = second;
  return list->last[first] = list->count++;
}

/* Returns whether the tile has room for another batch, whatever its tets share. */
static int has_room(const census *c, const flesh_batches *batches)
{
  const int m = batches->nodes_per_tet, most = m == 4 ? FLESH_TILE_PAIRS : FLESH_TILE_PAIRS_10;
  return c->nodes + m * batches->lanes <= FLESH_TILE_NODES && c->own.count + m * (m - 1) / 2 * batches->lanes <= most;
}

/* Mark of pairs in unused lanes, until all pairs are ranked. */
enum { NOT_USED = UINT16_MAX };

/* Returns the name in flesh_cells of the pair of a tet's nodes i and j, which are indices in rising order of nodes. */
static int name_of(int tet, int nodes, int i, int j)
{
  const int first = i < j ? i : j, second = i < j ? j : i;
  return tet * (nodes * (nodes + 1) / 2) + first * nodes - first * (first - 1) / 2 + second - first;
}

static void add_batch(const flesh_batches *batches, int batch, census *c, uint16_t *nodes, uint16_t *pairs)
{
  const int m = batches->nodes_per_tet;
  const int first = batches->first[batch], used = batches->first[batch + 1] - first;
  for (int l = 0; l < batches->lanes; l++) {
    const int tet = first + (l < used ? l : used - 1);
    const int *node = batches->nodes + (size_t)m * (size_t)tet;
    int own[MOST_NODES], rank[MOST_NODES];
    for (int a = 0; a < m; a++) {
      rank[a] = 0;
      for (int b = 0; b < m; b++) rank[a] += node[b] < node[a];
      *nodes++ = (uint16_t)(own[a] = number_of_node(c, node[a], name_of(tet, m, rank[a], rank[a])));
    }
    for (int a = 0; a < m; a++)
      for (int b = a + 1; b < m; b++) {
        const int pair = number_of_pair(&c->own, own[a], own[b]);
        c->named[pair] = name_of(tet, m, rank[a], rank[b]);
        c->first[pair] = own[a];
        *pairs++ = l < used ? (uint16_t)pair : NOT_USED;
      }
  }
}

/* Ranks the items: fresh ones first, then by rising `key`, if there is one; returns how many are fresh. */
static int rank(int count, const uint8_t *fresh, const uint16_t *key, uint16_t *ranks)
{
  int next = 0, first = 0, largest = 0;
  for (int k = 0; k < count && key; k++) largest = key[k] > largest ? key[k] : largest;
  for (int turn = 1; turn >= 0; turn--) {
    for (int now = 0; now <= largest; now++)
      for (int k = 0; k < count; k++)
        if (fresh[k] == turn && (!key || key[k] == now)) ranks[k] = (uint16_t)next++;
    if (turn) first = next;
  }
  return first;
}

/* Lists the tile's nodes and pairs; `fresh` [2] as in flesh_tiles. */
static void list(census *c, int *fresh)
{
  uint8_t is_fresh[MOST_PAIRS];
  uint16_t degree[FLESH_TILE_NODES] = {0};
  int first_of_star[FLESH_TILE_NODES + 1] = {0};
  for (int k = 0; k < c->own.count; k++) {
    const int met = c->of_mesh.count;
    number_of_pair(&c->of_mesh, c->here[c->first[k]], c->here[c->own.second[k]]);
    is_fresh[k] = c->of_mesh.count > met;
    degree[c->first[k]]++;
    degree[c->own.second[k]]++;
  }
  fresh[0] = rank(c->own.count, is_fresh, NULL, c->pair_rank);
  for (int i = 0; i < c->nodes; i++) is_fresh[i] = !c->met[c->here[i]];
  fresh[1] = rank(c->nodes, is_fresh, degree, c->node_rank);
  for (int i = 0; i < c->nodes; i++) {
    const int place = c->node_rank[i];
    c->met[c->here[i]] = 1;
    c->number[c->here[i]] = -1;
    c->node[place] = c->here[i];
    c->degree[place] = degree[i];
    c->block[c->own.count + place] = c->with_itself[i];
  }
  for (int i = 0; i < c->nodes; i++) first_of_star[i + 1] = first_of_star[i] + c->degree[i];
  for (int k = 0; k < c->own.count; k++) {
    const int ends[2] = {c->node_rank[c->first[k]], c->node_rank[c->own.second[k]]};
    for (int end = 0; end < 2; end++) c->star[first_of_star[ends[end]]++] = (uint16_t)(8 * c->pair_rank[k]);
    c->block[c->pair_rank[k]] = c->named[k];
    if (c->turned) c->turned[c->pair_rank[k]] = c->here[c->first[k]] > c->here[c->own.second[k]];
  }
}

/* Makes tiles, each of as many batches of a piece as fit. */
static int cut(const flesh_batches *batches, int pieces, int *piece, census *c, tile_lists *to)
{
  const size_t lanes = (size_t)batches->lanes, m = (size_t)batches->nodes_per_tet, pairs = m * (m - 1) / 2;
  to->node_first[0] = to->pair_first[0] = 0;
  for (int p = 0, b = 0; p < pieces; p++) {
    piece[p] = to->count;
    while (b < piece[p + 1]) {
      const int status = flesh_stop_ask_at(64 * (size_t)to->count + 63); /* tets */
      if (status) return status;
      const int k = to->count++;
      to->batch[k] = b;
      c->nodes = c->own.count = 0;
      for (; b < piece[p + 1] && has_room(c, batches); b++)
        add_batch(batches, b, c, to->nodes + m * lanes * (size_t)b, to->pairs + pairs * lanes * (size_t)b);
      list(c, to->fresh + 2 * k);
      for (size_t l = m * lanes * (size_t)to->batch[k]; l < m * lanes * (size_t)b; l++)
        to->nodes[l] = (uint16_t)(4 * c->node_rank[to->nodes[l]]);
      for (size_t l = pairs * lanes * (size_t)to->batch[k]; l < pairs * lanes * (size_t)b; l++)
        to->pairs[l] = (uint16_t)(8 * (to->pairs[l] == NOT_USED ? c->own.count : c->pair_rank[to->pairs[l]]));
      c->node += c->nodes;
      c->degree += c->nodes;
      c->star += 2 * c->own.count;
      if (c->turned) c->turned += c->own.count;
      c->block += c->nodes + c->own.count;
      to->node_first[k + 1] = to->node_first[k] + c->nodes;
      to->pair_first[k + 1] = to->pair_first[k] + c->own.count;
    }
  }
  piece[pieces] = to->count;
  to->batch[to->count] = batches->count;
  return FLESH_OK;
}

/* Gives back the memory beyond n bytes. */
static void *shrink(void *memory, size_t n)
{
  void *less = flesh_realloc(memory, n + 1);
  return less ? less : memory;
}

static void *room_for(size_t n, size_t size) { return flesh_malloc((n + 1) * size); }

int flesh_tiles_create(flesh_batches *batches, int nodes_of_mesh, int pieces, int *piece)
{
  const size_t most = (size_t)batches->count, seats = most * (size_t)batches->lanes;
  const size_t tets = (size_t)batches->first[batches->count], mesh = (size_t)nodes_of_mesh;
  const size_t m = (size_t)batches->nodes_per_tet, most_pairs = m * (m - 1) / 2;
  if (tets > INT_MAX / (most_pairs + m))
    return flesh_fail(FLESH_ERR_MEMORY, "%zu elements have too many pairs of nodes; at most %zu are supported", tets,
                      INT_MAX / (most_pairs + m));
  tile_lists to = {.batch = room_for(most, sizeof(int)),
                   .node_first = room_for(most, sizeof(int)),
                   .node = room_for(m * tets, sizeof(int)),
                   .pair_first = room_for(most, sizeof(int)),
                   .block = room_for((m + most_pairs) * tets, sizeof(int)),
                   .fresh = room_for(2 * most, sizeof(int)),
                   .degree = room_for(m * tets, sizeof(uint16_t)),
                   .star = room_for(2 * most_pairs * tets, sizeof(uint16_t)),
                   .turned = m == 4 ? NULL : room_for(most_pairs * tets, 1),
                   .nodes = flesh_huge_pages_alloc((m * seats + 1) * sizeof(uint16_t)),
                   .pairs = flesh_huge_pages_alloc((most_pairs * seats + 1) * sizeof(uint16_t))};
  census *c = flesh_malloc(sizeof *c);
  int *of_nodes = room_for(2 * mesh, sizeof(int)), *of_pairs = room_for(2 * most_pairs * tets, sizeof(int));
  uint8_t *met = flesh_calloc(mesh + 1, 1);
  const int ok = to.batch && to.node_first && to.node && to.pair_first && to.block && to.fresh && to.degree &&
                 to.star && to.nodes && to.pairs && (to.turned || m == 4) && c && of_nodes && of_pairs && met;
  int status = ok ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for %zu elements", tets);
  if (ok) {
    int last[FLESH_TILE_NODES], before[MOST_PAIRS], second[MOST_PAIRS];
    *c = (census){.number = of_nodes,
                  .met = met,
                  .node = to.node,
                  .block = to.block,
                  .degree = to.degree,
                  .star = to.star,
                  .turned = to.turned,
                  .own = {0, last, before, second},
                  .of_mesh = {0, of_nodes + mesh, of_pairs, of_pairs + most_pairs * tets}};
    for (size_t i = 0; i < 2 * mesh; i++) of_nodes[i] = -1;
    status = cut(batches, pieces, piece, c, &to);
    const size_t tiles = (size_t)to.count, nodes = (size_t)to.node_first[tiles], pairs = (size_t)to.pair_first[tiles];
    to.batch = shrink(to.batch, (tiles + 1) * sizeof(int));
    to.node_first = shrink(to.node_first, (tiles + 1) * sizeof(int));
    to.node = shrink(to.node, nodes * sizeof(int));
    to.pair_first = shrink(to.pair_first, (tiles + 1) * sizeof(int));
    to.block = shrink(to.block, (nodes + pairs) * sizeof(int));
    to.fresh = shrink(to.fresh, 2 * tiles * sizeof(int));
    to.degree = shrink(to.degree, nodes * sizeof(uint16_t));
    to.star = shrink(to.star, 2 * pairs * sizeof(uint16_t));
    if (to.turned) to.turned = shrink(to.turned, pairs);
  }
  flesh_free(c);
  flesh_free(of_nodes);
  flesh_free(of_pairs);
  flesh_free(met);
  batches->tiles = (flesh_tiles){to.count, to.batch, to.node_first, to.node, to.pair_first,
                                 to.degree, to.star, to.block, to.fresh, to.nodes, to.pairs, to.turned};
  return status;
}

void flesh_tiles_clear(flesh_tiles *tiles)
{
  flesh_free((void *)tiles->batch);
  flesh_free((void *)tiles->node_first);
  flesh_free((void *)tiles->node);
  flesh_free((void *)tiles->pair_first);
  flesh_free((void *)tiles->degree);
  flesh_free((void *)tiles->star);
  flesh_free((void *)tiles->block);
  flesh_free((void *)tiles->fresh);
  flesh_free((void *)tiles->nodes);
  flesh_free((void *)tiles->pairs);
  flesh_free((void *)tiles->turned);
  *tiles = (flesh_tiles){0};
}

int flesh_tiles_blocks(const flesh_tiles *tiles)
{
  return tiles->pair_first[tiles->count] + tiles->node_first[tiles->count];
}

size_t flesh_tiles_memory(const flesh_batches *batches)
{
  const flesh_tiles *tiles = &batches->tiles;
  const size_t nodes = (size_t)tiles->node_first[tiles->count], pairs = (size_t)tiles->pair_first[tiles->count];
  const size_t m = (size_t)batches->nodes_per_tet;
  return (5 * ((size_t)tiles->count + 1) + 2 * nodes + pairs) * sizeof(int) + (nodes + 2 * pairs) * sizeof(uint16_t) +
         (m + m * (m - 1) / 2) * (size_t)batches->count * (size_t)batches->lanes * sizeof(uint16_t) +
         (tiles->turned ? pairs : 0);
}
