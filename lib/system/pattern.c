/* pattern.c: block pattern of the Jacobian from the cells of the effects. */
#include "system/pattern.h"

#include <limits.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "base/sort.h"
#include "base/stop.h"
#include "linear/bisection.h"
#include "linear/block_matrix.h"

/* Moves the rows into the order in which they are read. */
static int lay_out(flesh_pattern *pattern)
{
  const size_t rows = (size_t)pattern->rows, blocks = (size_t)pattern->row_start[rows];
  const flesh_block_matrix A = flesh_pattern_matrix(pattern, NULL);
  int *column = flesh_malloc((blocks + 1) * sizeof *column), count = 0;
  flesh_bisection bisection = {0};
  int status = column ? flesh_bisection_create(&A, NULL, &bisection) : FLESH_ERR_MEMORY;
  for (size_t p = 0; p < rows && !status; p++) {
    const int i = bisection.order[p], from = pattern->row_start[i], length = pattern->row_end[i] - from;
    memcpy(column + count, pattern->column + from, (size_t)length * sizeof *column);
    pattern->row_start[i] = count;
    pattern->row_end[i] = count += length;
  }
  flesh_bisection_clear(&bisection);
  if (status) {
    flesh_free(column);
    return status;
  }
  flesh_free(pattern->column);
  pattern->column = column;
  return FLESH_OK;
}

/* Lists the blocks of `base` (NULL: the diagonal ones) and every pair once for each cell that has it, sorted by row: first
 * entry of each row in start [rows+2], entries in *entries, new. FLESH_ERR_MEMORY. */
static int list_entries(const flesh_pattern *base, int rows, int count, const flesh_cells *const *cells, size_t *start,
                        int **entries)
{
  int status = FLESH_OK;
  for (int i = 0; i < rows; i++) start[i + 1] = base ? (size_t)(base->row_end[i] - base->row_start[i]) : 1;
  for (int k = 0; k < count; k++) {
    const int m = cells[k]->nodes_per_cell;
    for (int e = 0; e < cells[k]->count; e++)
      for (int a = 0; a < m; a++) start[cells[k]->nodes[(size_t)e * m + a] + 1] += (size_t)(m - 1 - a);
  }
  for (int i = 0; i < rows; i++) start[i + 1] += start[i];
  int *list = *entries = flesh_malloc((start[rows] + 1) * sizeof *list);
  size_t *fill = flesh_malloc(((size_t)rows + 1) * sizeof *fill);
  if (list && fill) {
    memcpy(fill, start, (size_t)rows * sizeof *fill);
    for (int i = 0; i < rows; i++) {
      const size_t known = base ? (size_t)(base->row_end[i] - base->row_start[i]) : 1;
      memcpy(list + fill[i], base ? base->column + base->row_start[i] : &i, known * sizeof *list);
      fill[i] += known;
    }
    for (int k = 0; k < count && !status; k++) {
      const int m = cells[k]->nodes_per_cell;
      for (int e = 0; e < cells[k]->count && !(status = flesh_stop_ask_at((size_t)e)); e++) {
        const int *node = cells[k]->nodes + (size_t)e * m;
        for (int a = 0; a < m; a++)
          for (int b = a + 1; b < m; b++) list[fill[node[a]]++] = node[b];
      }
    }
  }
  if (!list || !fill) status = FLESH_ERR_MEMORY;
  flesh_free(fill);
  return status;
}

/* Sorts every row and removes duplicates, in place; the row's length goes to the pattern. FLESH_ERR_ARGUMENT where rows are
 * too long in total, FLESH_ERR_MEMORY. */
static int thin_rows(flesh_pattern *pattern, const size_t *start, int *entries)
{
  const int rows = pattern->rows;
  int *seen_in = flesh_malloc(((size_t)rows + 1) * sizeof *seen_in);
  if (!seen_in) return FLESH_ERR_MEMORY;
  size_t total = 0;
  for (int i = 0; i < rows; i++) seen_in[i] = -1;
  int status = FLESH_OK;
  for (int i = 0; i < rows && total <= INT_MAX / 9 && !(status = flesh_stop_ask_at((size_t)i)); i++) {
    int *row = entries + total; /* not beyond the start of row i's entries */
    size_t kept = 0;
    for (size_t k = start[i]; k < start[i + 1]; k++) {
      const int column = entries[k];
      if (seen_in[column] == i) continue;
      seen_in[column] = i;
      row[kept++] = column;
    }
    flesh_sort(row, kept, sizeof *row, flesh_compare_int);
    pattern->row_start[i] = (int)total;
    total += kept;
    pattern->row_end[i] = (int)total;
  }
  flesh_free(seen_in);
  if (status) return status;
  pattern->row_start[rows] = (int)total;
  return total <= INT_MAX / 9 ? FLESH_OK : FLESH_ERR_ARGUMENT;
}

/* Does the work of flesh_pattern_create and, with a `base`, of flesh_pattern_extend. */
static int create(const flesh_pattern *base, int rows, int count, const flesh_cells *const *cells,
                  flesh_pattern *pattern)
{
  *pattern = (flesh_pattern){.rows = rows};
  size_t *start = flesh_calloc((size_t)rows + 2, sizeof *start);
  pattern->row_start = flesh_malloc(((size_t)rows + 1) * sizeof *pattern->row_start);
  pattern->row_end = flesh_malloc(((size_t)rows + 1) * sizeof *pattern->row_end);
  int status = start && pattern->row_start && pattern->row_end ? FLESH_OK : FLESH_ERR_MEMORY;
  if (!status) status = list_entries(base, rows, count, cells, start, &pattern->column);
  if (!status) status = thin_rows(pattern, start, pattern->column);
  if (!status) status = lay_out(pattern);
  flesh_free(start);
  if (!status) return FLESH_OK;
  flesh_pattern_clear(pattern);
  const int stopped = flesh_stop_ask();
  if (stopped) return stopped;
  return status == FLESH_ERR_ARGUMENT
             ? flesh_fail(status, "the Jacobian has more than %d blocks", INT_MAX / 9)
             : flesh_fail(FLESH_ERR_MEMORY, "no memory for the pattern of %d nodes", rows);
}

int flesh_pattern_create(int rows, int count, const flesh_cells *const *cells, flesh_pattern *pattern)
{
  return create(NULL, rows, count, cells, pattern);
}

int flesh_pattern_extend(const flesh_pattern *base, int count, const flesh_cells *const *cells, flesh_pattern *pattern,
                         int **place)
{
  const int rows = base->rows;
  int *places = *place = flesh_malloc(((size_t)base->row_start[rows] + 1) * sizeof **place);
  int status = places ? create(base, rows, count, cells, pattern)
                      : flesh_fail(FLESH_ERR_MEMORY, "no memory for the pattern of %d nodes", rows);
  if (status) {
    flesh_free(places);
    *place = NULL;
    return status;
  }
  for (int i = 0; i < rows; i++)
    for (int k = base->row_start[i], to = pattern->row_start[i]; k < base->row_end[i]; k++, to++) {
      while (pattern->column[to] != base->column[k]) to++;
      places[k] = to;
    }
  return FLESH_OK;
}

void flesh_pattern_clear(flesh_pattern *pattern)
{
  flesh_free(pattern->row_start);
  flesh_free(pattern->row_end);
  flesh_free(pattern->column);
  *pattern = (flesh_pattern){0};
}

static size_t pairs_per_cell(const flesh_cells *cells)
{
  return (size_t)cells->nodes_per_cell * ((size_t)cells->nodes_per_cell + 1) / 2;
}

size_t flesh_pattern_pairs(const flesh_cells *cells)
{
  return cells->pairs ? (size_t)cells->pair_count : (size_t)cells->count * pairs_per_cell(cells);
}

int flesh_pattern_check(const char *effect, int nodes, const flesh_cells *cells)
{
  const int m = cells->nodes_per_cell;
  for (int e = 0; e < cells->count; e++)
    for (int a = 0; a < m; a++) {
      const int *node = cells->nodes + (size_t)e * (size_t)m + a;
      const int *last = cells->nodes + (size_t)e * (size_t)m + m - 1, repeats = cells->padded && *node == *last;
      if (*node < 0 || *node >= nodes || (a > 0 && (repeats ? *node < node[-1] : *node <= node[-1])))
        return flesh_fail(FLESH_ERR_ARGUMENT,
                          "effect %s: cell %d has node %d at place %d; nodes of a cell must ascend within 0 to %d",
                          effect, e, *node, a, nodes - 1);
    }
  const long long all = (long long)cells->count * (long long)pairs_per_cell(cells);
  for (int k = 0; cells->pairs && k < cells->pair_count; k++)
    if (cells->pairs[k] < 0 || cells->pairs[k] >= all)
      return flesh_fail(FLESH_ERR_ARGUMENT, "effect %s: pair %d is %d; its cells have the pairs 0 to %lld", effect, k,
                        cells->pairs[k], all - 1);
  return FLESH_OK;
}

int flesh_pattern_slots(const flesh_pattern *pattern, const flesh_cells *cells, int **slots)
{
  const size_t count = flesh_pattern_pairs(cells), per_cell = pairs_per_cell(cells), m = (size_t)cells->nodes_per_cell;
  const flesh_block_matrix A = flesh_pattern_matrix(pattern, NULL);
  *slots = flesh_huge_pages_alloc((count + 1) * sizeof **slots);
  if (!*slots)
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the slots of %d cells", cells->count);
  for (size_t k = 0; k < count; k++) {
    const size_t named = cells->pairs ? (size_t)cells->pairs[k] : k;
    const int *node = cells->nodes + named / per_cell * m;
    size_t a = 0, b = named % per_cell;
    const int status = flesh_stop_ask_at(k / 16);
    if (status) {
      flesh_free(*slots);
      *slots = NULL;
      return status;
    }
    for (; b >= m - a; a++) b -= m - a;
    (*slots)[k] = flesh_block_find(&A, node[a], node[a + b]);
  }
  return FLESH_OK;
}

int flesh_pattern_rest(const flesh_pattern *pattern, size_t pairs, const int *slots, int *count, int **rest)
{
  const int blocks = pattern->row_start[pattern->rows];
  char *named = flesh_calloc((size_t)blocks + 1, 1);
  int n = 0;
  *rest = NULL;
  for (size_t k = 0; named && k < pairs; k++) named[slots[k]] = 1;
  for (int k = 0; named && k < blocks; k++) n += !named[k];
  if (named) *rest = flesh_malloc(((size_t)n + 1) * sizeof **rest);
  *count = 0;
  for (int k = 0; *rest && k < blocks; k++)
    if (!named[k]) (*rest)[(*count)++] = k;
  flesh_free(named);
  return *rest ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for the slots of %d blocks", blocks);
}
