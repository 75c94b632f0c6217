/* tet_order.c: orders tets by Morton's Z-order curve (1966) through their centres, splits them into pieces and colours
 * these greedily. The regions of the curve are processed one after the other, and each colour by colour, so that data
 * shared by a region's colours are still in the cache. */
#include "element/tet_order.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/sort.h"

/* PIECE: most tets of a piece, unless there are very many. They fit a tile, whose blocks nearly fit the first cache,
 * and leave several pieces to share among threads. */
enum { PIECE = 352, MOST_PIECES = 60000 };

/* Number of pieces in a region: their blocks fit the caches, and there are several of each colour to share among
 * threads. */
enum { REGION = 256 };

typedef struct place {
  uint64_t code;
  int tet, group;
} place;

/* Key by which pieces are ordered. */
typedef struct turn {
  int region, colour, piece;
} turn;

static int by_code(const void *a, const void *b)
{
  const place *p = a, *q = b;
  if (p->code != q->code) return p->code < q->code ? -1 : 1;
  return p->tet - q->tet;
}

static int by_group(const void *a, const void *b)
{
  const place *p = a, *q = b;
  return p->group != q->group ? (p->group < q->group ? -1 : 1) : by_code(a, b);
}

/* Spreads the 21 bits of n, with two zeros after each. */
static uint64_t spread(uint64_t n)
{
  n = (n | n << 32) & 0x1f00000000ffff;
  n = (n | n << 16) & 0x1f0000ff0000ff;
  n = (n | n << 8) & 0x100f00f00f00f00f;
  n = (n | n << 4) & 0x10c30c30c30c30c3;
  return (n | n << 2) & 0x1249249249249249;
}

static void find_places(const flesh_mesh *mesh, int count, const int *chosen, const int *group, place *places)
{
  const double *X = flesh_mesh_positions(mesh);
  const int *nodes = flesh_mesh_tets(mesh);
  int tets = flesh_mesh_tet_count(mesh);
  double low[3] = {INFINITY, INFINITY, INFINITY}, extent = 0;
  for (int k = 0; k < 4 * tets; k++)
    for (int i = 0; i < 3; i++) low[i] = fmin(low[i], X[3 * (size_t)nodes[k] + i]);
  for (int k = 0; k < 4 * tets; k++)
    for (int i = 0; i < 3; i++) extent = fmax(extent, X[3 * (size_t)nodes[k] + i] - low[i]);
  for (int p = 0; p < count; p++) {
    const int e = chosen ? chosen[p] : p;
    uint64_t code = 0;
    for (int i = 0; i < 3; i++) {
      double sum = 0;
      for (int a = 0; a < 4; a++) sum += X[3 * (size_t)nodes[4 * (size_t)e + a] + i] - low[i];
      code |= spread((uint64_t)(sum / 4 / extent * 0x1fffff)) << i;
    }
    places[p] = (place){code, e, group ? group[e] : 0};
  }
  flesh_sort(places, (size_t)count, sizeof *places, by_code);
}

/* Gives every piece a colour: the first that none of its nodes has met. Colours beyond the 64 that a mask holds have
 * one piece each. */
static int colour_pieces(const flesh_mesh *mesh, const place *places, const flesh_tet_order *cut,
                         turn *turns)
{
  const int *nodes = flesh_mesh_tets(mesh);
  uint64_t *met = flesh_calloc((size_t)flesh_mesh_node_count(mesh), sizeof *met);
  if (!met) return FLESH_ERR_MEMORY;
  for (int p = 0, extra = 64; p < cut->pieces; p++) {
    uint64_t taken = 0;
    int c = 0, from = 4 * cut->piece_first[p], until = 4 * cut->piece_first[p + 1];
    for (int k = from; k < until; k++) taken |= met[nodes[4 * (size_t)places[k / 4].tet + k % 4]];
    while (c < 64 && taken >> c & 1) c++;
    turns[p] = (turn){p / REGION, c < 64 ? c : extra++, p};
    for (int k = from; k < until && c < 64; k++)
      met[nodes[4 * (size_t)places[k / 4].tet + k % 4]] |= (uint64_t)1 << c;
  }
  flesh_free(met);
  return FLESH_OK;
}

/* Writes the order from the pieces and their turns: each region has colours of its own. */
static void arrange(const place *places, const flesh_tet_order *cut, turn *turns, flesh_tet_order *order)
{
  flesh_sort(turns, (size_t)cut->pieces, sizeof *turns, flesh_compare_three_ints);
  order->colours = 0;
  for (int p = 0, tet = 0; p < cut->pieces; p++) {
    const turn *now = &turns[p];
    if (p == 0 || now->region != now[-1].region || now->colour != now[-1].colour)
      order->colour_first[order->colours++] = p;
    order->piece_first[p] = tet;
    for (int k = cut->piece_first[now->piece]; k < cut->piece_first[now->piece + 1]; k++)
      order->tet[tet++] = places[k].tet;
  }
  order->colour_first[order->colours] = cut->pieces;
  order->piece_first[cut->pieces] = cut->piece_first[cut->pieces];
}

int flesh_tet_order_create(const flesh_mesh *mesh, int tets, const int *chosen, const int *group,
                           flesh_tet_order *order)
{
  int pieces = tets <= PIECE ? 1 : tets / PIECE < MOST_PIECES ? (tets - 1) / PIECE + 1 : MOST_PIECES;
  place *places = flesh_malloc(((size_t)tets + 1) * sizeof *places);
  flesh_tet_order cut = {.pieces = pieces,
                         .piece_first = flesh_malloc(((size_t)pieces + 1) * sizeof *cut.piece_first)};
  turn *turns = flesh_malloc(((size_t)pieces + 1) * sizeof *turns);
  *order = (flesh_tet_order){
      .tet = flesh_malloc(((size_t)tets + 1) * sizeof *order->tet),
      .pieces = pieces,
      .piece_first = flesh_malloc(((size_t)pieces + 1) * sizeof *order->piece_first),
      .colour_first = flesh_malloc(((size_t)pieces + 1) * sizeof *order->colour_first),
  };
  int ok = places && cut.piece_first && turns && order->tet && order->piece_first && order->colour_first;
  if (ok) {
    find_places(mesh, tets, chosen, group, places);
    for (int p = 0; p <= pieces; p++) cut.piece_first[p] = (int)((int64_t)tets * p / pieces);
    for (int p = 0; p < pieces; p++)
      flesh_sort(places + cut.piece_first[p], (size_t)(cut.piece_first[p + 1] - cut.piece_first[p]),
            sizeof *places, by_group);
    ok = colour_pieces(mesh, places, &cut, turns) == FLESH_OK;
    if (ok) arrange(places, &cut, turns, order);
  }
  flesh_free(places);
  flesh_free(cut.piece_first);
  flesh_free(turns);
  if (ok) return FLESH_OK;
  flesh_tet_order_clear(order);
  return flesh_fail(FLESH_ERR_MEMORY, "no memory to order %d tets", tets);
}

void flesh_tet_order_clear(flesh_tet_order *order)
{
  flesh_free(order->tet);
  flesh_free(order->piece_first);
  flesh_free(order->colour_first);
  *order = (flesh_tet_order){0};
}
