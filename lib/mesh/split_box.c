/* split_box.c: splits boxes into blocks of cells, one file after the other. */
#include <math.h>
#include <string.h>

#include "base/archive.h"
#include "base/error.h"
#include "base/memory.h"
#include "mesh/box.h"
#include "mesh/split.h"

/* A grid of cells in blocks[0] x blocks[1] x blocks[2] blocks. Along an axis block b begins with cell cells b / blocks,
 * rounded down. */
typedef struct grid {
  const int *cells;
  const double *size, *origin;
  int blocks[3];
} grid;

static int first_cell(const grid *g, int axis, int block)
{
  return (int)((int64_t)g->cells[axis] * block / g->blocks[axis]);
}

static int block_of(const grid *g, int axis, int cell)
{
  int block = (int)((int64_t)cell * g->blocks[axis] / g->cells[axis]);
  while (first_cell(g, axis, block) > cell) block--;
  while (first_cell(g, axis, block + 1) <= cell) block++;
  return block;
}

/* Chooses the blocks with the fewest cells in the faces between parts. */
static int choose_blocks(const int cells[3], int parts, int blocks[3])
{
  double least = INFINITY;
  for (int a = 1; a <= parts; a++)
    for (int b = 1; b <= parts / a; b++) {
      const int c = parts / a / b;
      if (a * b * c != parts || a > cells[0] || b > cells[1] || c > cells[2]) continue;
      const double x = cells[0], y = cells[1], z = cells[2];
      const double between = (a - 1) * y * z + (b - 1) * x * z + (c - 1) * x * y;
      if (between < least) least = between, blocks[0] = a, blocks[1] = b, blocks[2] = c;
    }
  return isfinite(least) ? FLESH_OK
                         : flesh_fail(FLESH_ERR_ARGUMENT,
                                      "%d parts cannot be blocks of %d x %d x %d cells; choose a product of three numbers, "
                                      "each at most the number of cells along its axis", parts, cells[0], cells[1], cells[2]);
}

/* The cells of a part, low <= cell < high along each axis: its own and two layers around them. */
typedef struct range {
  int low[3], high[3];
} range;

static range range_of(const grid *g, int part)
{
  const int place[3] = {part % g->blocks[0], part / g->blocks[0] % g->blocks[1], part / g->blocks[0] / g->blocks[1]};
  range r;
  for (int d = 0; d < 3; d++) {
    const int low = first_cell(g, d, place[d]) - FLESH_SPLIT_LAYERS, high = first_cell(g, d, place[d] + 1) + FLESH_SPLIT_LAYERS;
    r.low[d] = low < 0 ? 0 : low;
    r.high[d] = high > g->cells[d] ? g->cells[d] : high;
  }
  return r;
}

static void fill_nodes(const grid *g, const range *r, flesh_split_arrays *a)
{
  const int nx = g->cells[0] + 1, ny = g->cells[1] + 1;
  double *X = a->positions;
  int *number = a->node_numbers;
  for (int k = r->low[2]; k <= r->high[2]; k++)
    for (int j = r->low[1]; j <= r->high[1]; j++)
      for (int i = r->low[0]; i <= r->high[0]; i++) {
        const int at[3] = {i, j, k};
        for (int d = 0; d < 3; d++) *X++ = flesh_box_place(g->origin[d], g->size[d], at[d], g->cells[d]);
        *number++ = (k * ny + j) * nx + i;
      }
}

static void fill_tets(const grid *g, const range *r, flesh_split_arrays *a)
{
  const int nx = r->high[0] - r->low[0] + 1, ny = r->high[1] - r->low[1] + 1;
  size_t t = 0;
  for (int k = r->low[2]; k < r->high[2]; k++)
    for (int j = r->low[1]; j < r->high[1]; j++)
      for (int i = r->low[0]; i < r->high[0]; i++) {
        const int first = 6 * ((k * g->cells[1] + j) * g->cells[0] + i);
        const int owner = (block_of(g, 2, k) * g->blocks[1] + block_of(g, 1, j)) * g->blocks[0] + block_of(g, 0, i);
        for (int e = 0; e < 6; e++, t++) {
          for (int c = 0; c < 4; c++) {
            const int corner = flesh_box_tets[e][c], x = i - r->low[0] + (corner & 1),
                      y = j - r->low[1] + (corner >> 1 & 1), z = k - r->low[2] + (corner >> 2);
            a->tet_nodes[4 * t + (size_t)c] = (z * ny + y) * nx + x;
          }
          a->tet_numbers[t] = first + e;
          a->owners[t] = owner;
          a->regions[t] = 0;
        }
      }
}

static int write_part(const grid *g, flesh_split *split, const char *folder, int part)
{
  const range r = range_of(g, part);
  int nodes = 1, tets = 6;
  flesh_split_arrays arrays;
  for (int d = 0; d < 3; d++) {
    nodes *= r.high[d] - r.low[d] + 1;
    tets *= r.high[d] - r.low[d];
  }
  int status = flesh_split_arrays_take(&arrays, &(flesh_split_row){.nodes = nodes, .tets = tets}, 1);
  if (!status) {
    fill_nodes(g, &r, &arrays);
    fill_tets(g, &r, &arrays);
    status = flesh_split_write_part(split, folder, part, &arrays);
  }
  flesh_split_arrays_clear(&arrays);
  return status;
}

/* Fills the index except for its rows. */
static int describe(const grid *g, int parts, flesh_split *split)
{
  uint64_t sum = flesh_archive_sum(0, g->cells, 3 * sizeof *g->cells);
  sum = flesh_archive_sum(sum, g->size, 3 * sizeof *g->size);
  sum = flesh_archive_sum(sum, g->origin, 3 * sizeof *g->origin);
  sum = flesh_archive_sum(sum, &parts, sizeof parts);
  *split = (flesh_split){.mark = (int64_t)(sum >> 1), .order = 1, .nodes = 1, .tets = 6, .parts = parts, .region_count = 1};
  for (int d = 0; d < 3; d++) {
    split->nodes *= g->cells[d] + 1;
    split->tets *= g->cells[d];
  }
  split->regions = flesh_calloc(1, sizeof *split->regions);
  split->rows = flesh_calloc((size_t)parts, sizeof *split->rows);
  return split->regions && split->rows ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "out of memory for %d parts", parts);
}

int flesh_split_box(const int cells[3], const double size[3], const double origin[3], int parts, const char *folder,
                    flesh_split *split)
{
  grid g = {.cells = cells, .size = size, .origin = origin};
  *split = (flesh_split){0};
  int status = flesh_box_check(cells, size, origin);
  if (!status) status = choose_blocks(cells, parts, g.blocks);
  if (!status) status = describe(&g, parts, split);
  if (!status) status = flesh_split_begin(folder);
  for (int part = 0; part < parts && !status; part++) status = write_part(&g, split, folder, part);
  return status ? status : flesh_split_write_index(split, folder);
}
