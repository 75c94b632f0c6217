/* bisection.c: orders nodes by Cuthill & McKee 1969 from one far end of the mesh to the other, and eliminates them from
 * both ends (a "twisted" factorisation). Incomplete Cholesky needs as many iterations as in Cuthill & McKee's order, half
 * as many as in the order of a mesh generator, and two threads can work on it.
 *
 * Short runs of nodes are sorted by the length of the chain of neighbours that must come before each: the preconditioner
 * stays the same, but neighbours in the order no longer wait for each other. Runs are short because products go through
 * vectors in this order, too. */
#include "linear/bisection.h"

#include <string.h>

#include "base/error.h"
#include "base/memory.h"

enum { RUN = 256 }; /* nodes */

typedef struct graph {
  int rows;
  int *start, *neighbour; /* [rows+1], [start[rows]] */
  int *mark;              /* [rows] */
  const int *numbers;     /* [rows], or NULL */
} graph;

static int graph_create(const flesh_block_matrix *A, const int *numbers, graph *g)
{
  const size_t blocks = (size_t)A->row_start[A->rows], rows = (size_t)A->rows;
  *g = (graph){.rows = A->rows, .numbers = numbers};
  g->start = flesh_calloc(rows + 2, sizeof *g->start);
  g->neighbour = flesh_malloc((2 * blocks + 1) * sizeof *g->neighbour);
  g->mark = flesh_calloc(rows + 1, sizeof *g->mark);
  if (!g->start || !g->neighbour || !g->mark) return 0;
  for (int i = 0; i < A->rows; i++)
    for (int k = A->row_start[i] + 1; k < A->row_end[i]; k++) {
      g->start[i + 2]++;
      g->start[A->column[k] + 2]++;
    }
  for (int i = 0; i < A->rows; i++) g->start[i + 2] += g->start[i + 1];
  for (int i = 0; i < A->rows; i++) /* start[i + 1] becomes the place of i's next neighbour */
    for (int k = A->row_start[i] + 1; k < A->row_end[i]; k++) {
      int j = A->column[k];
      g->neighbour[g->start[i + 1]++] = j;
      g->neighbour[g->start[j + 1]++] = i;
    }
  return 1;
}

static void graph_clear(graph *g)
{
  flesh_free(g->start);
  flesh_free(g->neighbour);
  flesh_free(g->mark);
}

static int degree(const graph *g, int node) { return g->start[node + 1] - g->start[node]; }

/* Whether a comes before b where both are neighbours of one node: fewer neighbours first, then the larger number. Mesh
 * generators number from end to end, and incomplete Cholesky then takes a fifth fewer iterations. */
static int before(const graph *g, int a, int b)
{
  const int da = degree(g, a), db = degree(g, b);
  if (da != db) return da < db;
  return g->numbers ? g->numbers[a] > g->numbers[b] : a > b;
}

/* Lists the nodes that are reached from `first` and not marked `as`, level by level. Returns their number, and in *last
 * where the last of the *levels begins. */
static int spread(graph *g, int first, int as, int *order, int *last, int *levels)
{
  int count = 1, end = 1; /* end of the current level */
  order[0] = first;
  g->mark[first] = as;
  *last = *levels = 0;
  for (int head = 0; head < count; head++) {
    if (head == end) {
      *last = head;
      end = count;
      ++*levels;
    }
    const int begin = count;
    for (int k = g->start[order[head]]; k < g->start[order[head] + 1]; k++) {
      int node = g->neighbour[k];
      if (g->mark[node] == as) continue;
      g->mark[node] = as;
      int place = count++;
      for (; place > begin && before(g, node, order[place - 1]); place--) order[place] = order[place - 1];
      order[place] = node;
    }
  }
  return count;
}

/* Orders every component from one of its ends, as far from the other as the search of George & Liu 1979 finds. */
static void cuthill_mckee(graph *g, int *order)
{
  for (int first = 0, count = 0, as = 0; first < g->rows; first++) {
    if (g->mark[first]) continue;
    int root = first, deepest = -1, levels, last;
    for (;;) {
      const int size = spread(g, root, ++as, order + count, &last, &levels);
      if (levels <= deepest) {
        count += size;
        break;
      }
      deepest = levels;
      root = order[count + last];
      for (int p = last + 1; p < size; p++)
        if (degree(g, order[count + p]) < degree(g, root)) root = order[count + p];
    }
  }
}

/* Sorts order[begin..end) stably by chain length; `length` [3*(rows+1)] is work space. */
static void sort_by_chains(const graph *g, int *order, int begin, int end, const int *place, int *length)
{
  const int most = end - begin;
  int *room = length + g->rows + 1, *counts = room + g->rows + 1;
  memset(counts, 0, ((size_t)most + 1) * sizeof *counts);
  for (int p = begin; p < end; p++) {
    int node = order[p], longest = 0;
    for (int k = g->start[node]; k < g->start[node + 1]; k++) {
      int other = g->neighbour[k];
      if (place[other] >= begin && place[other] < p && length[other] >= longest)
        longest = length[other] + 1;
    }
    length[node] = longest;
    counts[longest + 1]++;
  }
  for (int l = 0; l < most; l++) counts[l + 1] += counts[l];
  for (int p = begin; p < end; p++) room[begin + counts[length[order[p]]]++] = order[p];
  memcpy(order + begin, room + begin, (size_t)(end - begin) * sizeof *order);
}

/* Splits `line`, a line of nodes from end to end, into the halves and the separator of `bisection`. */
static void split(const graph *g, const int *line, const int *place, flesh_bisection *bisection)
{
  const int rows = g->rows, middle = rows / 2;
  int count = 0, separator = 0, *aside = bisection->order + rows; /* filled from the end */
  for (int p = 0; p < middle; p++) {
    int node = line[p], touches = 0;
    for (int k = g->start[node]; k < g->start[node + 1]; k++)
      touches |= place[g->neighbour[k]] >= middle;
    if (touches) aside[-++separator] = node;
    else bisection->order[count++] = node;
  }
  bisection->begin[1] = count;
  for (int p = rows - 1; p >= middle; p--) bisection->order[count++] = line[p];
  bisection->begin[2] = count;
  bisection->begin[3] = rows;
  if (separator > rows / 4) {
    memcpy(bisection->order, line, (size_t)rows * sizeof *line);
    bisection->begin[1] = bisection->begin[2] = rows;
  }
}

int flesh_bisection_create(const flesh_block_matrix *A, const int *numbers, flesh_bisection *bisection)
{
  const size_t rows = (size_t)A->rows;
  graph g;
  *bisection = (flesh_bisection){.order = flesh_malloc((rows + 1) * sizeof(int))};
  int *room = flesh_malloc(5 * (rows + 1) * sizeof *room);
  if (!graph_create(A, numbers, &g) || !bisection->order || !room) {
    graph_clear(&g);
    flesh_free(room);
    flesh_bisection_clear(bisection);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory to order %d nodes", A->rows);
  }
  int *line = room, *place = line + rows + 1, *length = place + rows + 1;
  cuthill_mckee(&g, line);
  for (int p = 0; p < A->rows; p++) place[line[p]] = p;
  split(&g, line, place, bisection);
  for (int p = 0; p < A->rows; p++) place[bisection->order[p]] = p;
  for (int part = 0; part < 3; part++)
    for (int begin = bisection->begin[part], end; begin < bisection->begin[part + 1]; begin = end) {
      end = bisection->begin[part + 1] - begin > RUN ? begin + RUN : bisection->begin[part + 1];
      sort_by_chains(&g, bisection->order, begin, end, place, length);
    }
  graph_clear(&g);
  flesh_free(room);
  return FLESH_OK;
}

void flesh_bisection_clear(flesh_bisection *bisection)
{
  flesh_free(bisection->order);
  *bisection = (flesh_bisection){0};
}
