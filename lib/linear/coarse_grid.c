/* coarse_grid.c: makes the grid of the coarse level, the finest one with few enough vertices near nodes. Vertices are split
 * where the nodes that they would move are not connected, and grouped in patches of 2 x 2 across the longest axis. */
#include "linear/coarse_grid.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "base/sort.h"

enum { CORNERS = 8 };

/* Largest number of cells in the box around a body: ALWAYS, plus the smaller of SPARSE for each node and EMPTY for each
 * vertex, as most cells may be empty. */
enum { ALWAYS = 4096, SPARSE = 64, EMPTY = 4096 };

enum { MARKS = 1024 /* marks that ranks exchange at a time */ };

typedef struct layout {
  double low[3], size[3]; /* origin of the grid, and size of a cell */
  int count[3];           /* cells along each axis */
} layout;

/* A thing to be sorted by its name. */
typedef struct named {
  int64_t name;
  int thing;
} named;

/* A node, to be sorted by its cell. */
typedef struct located {
  int64_t cell;
  int corner[CORNERS];
  int node;
} located;

typedef struct builder {
  int rows;
  const double *X;
  const int *stored;
  layout grid;
  int (*at)[3];  /* [rows] cell of each node along each axis */
  /* [8*rows] union-find of the corners of each node's cell: next corner towards the one that represents their vertex */
  int *parent;
  int *vertex;   /* [8*rows] numbers of these vertices */
  int (*where)[3]; /* [8*rows], with a team [vertices+8]: place of each vertex along each axis */
  const flesh_team *team;
  int64_t most;    /* largest number of names that a grid may have */
  uint8_t *marks;  /* [most] marks of the names that vertices have */
  int *number;     /* [most], only with a team: the vertex of each name */
} builder;

static int by_name(const void *a, const void *b)
{
  const named *p = a, *q = b;
  return p->name != q->name ? (p->name > q->name) - (p->name < q->name) : (p->thing > q->thing) - (p->thing < q->thing);
}

static int by_cell(const void *a, const void *b)
{
  const located *p = a, *q = b;
  if (p->cell != q->cell) return p->cell < q->cell ? -1 : 1;
  for (int c = 0; c < CORNERS; c++)
    if (p->corner[c] != q->corner[c]) return p->corner[c] < q->corner[c] ? -1 : 1;
  return p->node - q->node;
}

static layout layout_of(const double low[3], const double high[3], double size)
{
  layout grid;
  for (int k = 0; k < 3; k++) {
    const double extent = high[k] - low[k];
    grid.low[k] = low[k];
    grid.count[k] = (int)fmax(1, ceil(extent / size - 1e-9));
    grid.size[k] = extent > 0 ? extent / grid.count[k] : 1;
  }
  return grid;
}

/* Finds the cell of x, and the position of x in it. */
static void locate(const layout *grid, const double *x, int at[3], flesh_float4 *local)
{
  *local = (flesh_float4){0};
  for (int k = 0; k < 3; k++) {
    const double place = (x[k] - grid->low[k]) / grid->size[k];
    at[k] = (int)fmin(place, grid->count[k] - 1);
    (*local)[k] = (float)(place - at[k]);
  }
}

static int64_t name_of(const layout *grid, const int at[3])
{
  return ((int64_t)at[2] * (grid->count[1] + 1) + at[1]) * (grid->count[0] + 1) + at[0];
}

static int64_t names(const layout *grid)
{
  return (int64_t)(grid->count[0] + 1) * (grid->count[1] + 1) * (grid->count[2] + 1);
}

static void corner_at(const int at[3], int a, int place[3])
{
  for (int k = 0; k < 3; k++) place[k] = at[k] + (a >> k & 1);
}

/* Unites the ranks' marks; returns their number. */
static int mark_in_team(const flesh_team *team, int64_t count, uint8_t *marks)
{
  double room[MARKS];
  int marked = 0;
  for (int64_t begin = 0; begin < count; begin += MARKS) {
    const int some = count - begin < MARKS ? (int)(count - begin) : MARKS;
    for (int k = 0; k < some; k++) room[k] = marks[begin + k];
    flesh_team_largest(team, some, room);
    for (int k = 0; k < some; k++) marked += marks[begin + k] = room[k] > 0;
  }
  return marked;
}

/* Returns the number of vertices with nodes in a cell around them; `marks` [names] is work space. */
static int count_vertices(const builder *b, const layout *grid, uint8_t *marks)
{
  int count = 0;
  memset(marks, 0, (size_t)names(grid));
  for (int p = 0; p < b->rows; p++) {
    int at[3], place[3];
    flesh_float4 local;
    locate(grid, b->X + 3 * (size_t)b->stored[p], at, &local);
    for (int a = 0; a < CORNERS; a++) {
      corner_at(at, a, place);
      uint8_t *mark = &marks[name_of(grid, place)];
      count += !*mark;
      *mark = 1;
    }
  }
  return b->team ? mark_in_team(b->team, names(grid), marks) : count;
}

static int64_t most_names(const builder *b, int vertices)
{
  const int64_t sparse = SPARSE * (int64_t)flesh_team_all(b->team, b->rows), empty = EMPTY * (int64_t)vertices;
  return ALWAYS + (sparse < empty ? sparse : empty);
}

static void choose_layout(builder *b, int vertices)
{
  static const double finer = 0.9;
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, size = 0;
  for (int i = 0; i < b->rows; i++)
    for (int k = 0; k < 3; k++) {
      low[k] = fmin(low[k], b->X[3 * (size_t)i + k]);
      high[k] = fmax(high[k], b->X[3 * (size_t)i + k]);
    }
  flesh_team_unite_boxes(b->team, low, high);
  for (int k = 0; k < 3; k++) size = fmax(size, high[k] - low[k]);
  b->grid = layout_of(low, high, INFINITY);
  while (size > 0) {
    size *= finer;
    const layout next = layout_of(low, high, size);
    if (names(&next) > b->most || count_vertices(b, &next, b->marks) > vertices) break;
    b->grid = next;
  }
}

/* Unites the corners of two neighbours' cells that are the same vertex. */
static void join(builder *b, int p, int q)
{
  for (int a = 0; a < CORNERS; a++) {
    int other = 0, shared = 1;
    for (int k = 0; k < 3; k++) {
      const int bit = b->at[p][k] + (a >> k & 1) - b->at[q][k];
      shared &= bit == 0 || bit == 1;
      other |= (bit & 1) << k;
    }
    if (shared) flesh_sets_join(b->parent, CORNERS * p + a, CORNERS * q + other);
  }
}

/* Unites all corners at one place, whether connected or not. */
static int join_all(builder *b)
{
  int *first = flesh_malloc((size_t)names(&b->grid) * sizeof *first);
  if (!first) return FLESH_ERR_MEMORY;
  for (int64_t n = 0; n < names(&b->grid); n++) first[n] = -1;
  for (int e = 0; e < CORNERS * b->rows; e++) {
    int place[3];
    corner_at(b->at[e / CORNERS], e % CORNERS, place);
    int *one = &first[name_of(&b->grid, place)];
    if (*one < 0) *one = e;
    b->parent[e] = *one;
  }
  flesh_free(first);
  return FLESH_OK;
}

/* Numbers the vertices, at most twice `vertices`; `place` [rows]: the place of each of the mesh's nodes in vectors. */
static int find_vertices(builder *b, const flesh_block_matrix *A, const int *place, int vertices,
                         flesh_coarse_grid *grid)
{
  int parts = 0;
  for (int p = 0; p < b->rows; p++) locate(&b->grid, b->X + 3 * (size_t)b->stored[p], b->at[p], &grid->local[p]);
  for (int e = 0; e < CORNERS * b->rows; e++) b->parent[e] = e;
  for (int i = 0; i < A->rows; i++)
    for (int k = A->row_start[i] + 1; k < A->row_end[i]; k++)
      if (!A->own || A->own[k]) join(b, place[i], place[A->column[k]]);
  for (int e = 0; e < CORNERS * b->rows; e++) parts += b->parent[e] == e;
  if (parts / 2 > vertices && parts > CORNERS && join_all(b)) return FLESH_ERR_MEMORY;
  for (int e = 0; e < CORNERS * b->rows; e++) {
    const int root = flesh_set_of(b->parent, e);
    if (root == e) {
      corner_at(b->at[e / CORNERS], e % CORNERS, b->where[grid->vertices]);
      b->vertex[e] = grid->vertices++;
    } else {
      b->vertex[e] = b->vertex[root]; /* roots come first */
    }
  }
  return FLESH_OK;
}

/* Finds the vertices of all ranks of a team together, by their places. */
static void find_vertices_of_team(builder *b, flesh_coarse_grid *grid)
{
  const layout *lay = &b->grid;
  int place[3];
  for (int p = 0; p < b->rows; p++) locate(lay, b->X + 3 * (size_t)b->stored[p], b->at[p], &grid->local[p]);
  count_vertices(b, lay, b->marks);
  for (place[2] = 0; place[2] <= lay->count[2]; place[2]++)
    for (place[1] = 0; place[1] <= lay->count[1]; place[1]++)
      for (place[0] = 0; place[0] <= lay->count[0]; place[0]++) {
        if (!b->marks[name_of(lay, place)]) continue;
        memcpy(b->where[grid->vertices], place, sizeof place);
        b->number[name_of(lay, place)] = grid->vertices++;
      }
  for (int e = 0; e < CORNERS * b->rows; e++) {
    corner_at(b->at[e / CORNERS], e % CORNERS, place);
    b->vertex[e] = b->number[name_of(lay, place)];
  }
}

/* Makes the cells and their corners; `nodes` [rows] is work space. */
static int find_cells(const builder *b, located *nodes, flesh_coarse_grid *grid)
{
  for (int p = 0; p < b->rows; p++) {
    nodes[p] = (located){.cell = name_of(&b->grid, b->at[p]), .node = p};
    memcpy(nodes[p].corner, b->vertex + CORNERS * (size_t)p, sizeof nodes[p].corner);
  }
  flesh_sort(nodes, (size_t)b->rows, sizeof *nodes, by_cell);
  for (int n = 0; n < b->rows; n++) {
    grid->cells += n == 0 || memcmp(nodes[n].corner, nodes[n - 1].corner, sizeof nodes[n].corner) != 0;
    grid->cell[nodes[n].node] = grid->cells - 1;
  }
  grid->corner = flesh_malloc((CORNERS * (size_t)grid->cells + 1) * sizeof *grid->corner);
  if (!grid->corner) return FLESH_ERR_MEMORY;
  for (int n = 0; n < b->rows; n++)
    memcpy(grid->corner + CORNERS * (size_t)grid->cell[nodes[n].node], nodes[n].corner, sizeof nodes[n].corner);
  return FLESH_OK;
}

/* Groups vertices in patches of 2 x 2 across the longest axis, numbered along it; vertices at one place are in different
 * patches. `sorted` [vertices] is work space. */
static void find_patches(const builder *b, named *sorted, flesh_coarse_grid *grid)
{
  const int *count = b->grid.count;
  const int longest = count[0] >= count[1] && count[0] >= count[2] ? 0 : count[1] >= count[2] ? 1 : 2;
  const int first = longest == 0, second = longest == 2 ? 1 : 2;
  int *copy = grid->patch, copies = 0;
  for (int v = 0; v < grid->vertices; v++) sorted[v] = (named){name_of(&b->grid, b->where[v]), v};
  flesh_sort(sorted, (size_t)grid->vertices, sizeof *sorted, by_name);
  for (int n = 0; n < grid->vertices; n++) {
    const int again = n > 0 && sorted[n].name == sorted[n - 1].name;
    copy[sorted[n].thing] = again ? copy[sorted[n - 1].thing] + 1 : 0;
    if (copy[sorted[n].thing] >= copies) copies = copy[sorted[n].thing] + 1;
  }
  for (int v = 0; v < grid->vertices; v++) {
    const int *place = b->where[v];
    const int64_t layer = (int64_t)place[longest] * (count[first] / 2 + 1) + place[first] / 2;
    grid->slot[v] = (place[first] & 1) | (place[second] & 1) << 1;
    sorted[v] = (named){(layer * (count[second] / 2 + 1) + place[second] / 2) * copies + copy[v], v};
  }
  flesh_sort(sorted, (size_t)grid->vertices, sizeof *sorted, by_name);
  for (int n = 0; n < grid->vertices; n++) {
    grid->patches += n == 0 || sorted[n].name != sorted[n - 1].name;
    grid->patch[sorted[n].thing] = grid->patches - 1;
  }
}

static int make(builder *b, const flesh_block_matrix *A, int vertices, int *place, flesh_coarse_grid *grid)
{
  int status = FLESH_OK;
  choose_layout(b, vertices);
  for (int p = 0; p < b->rows; p++) place[b->stored[p]] = p;
  if (b->team) find_vertices_of_team(b, grid);
  else status = find_vertices(b, A, place, vertices, grid);
  if (status) return status;
  const size_t found = (size_t)grid->vertices + 1, rows = (size_t)b->rows + 1;
  located *nodes = flesh_malloc(rows * sizeof *nodes);
  named *sorted = flesh_malloc(found * sizeof *sorted);
  grid->patch = flesh_malloc(found * sizeof *grid->patch);
  grid->slot = flesh_malloc(found * sizeof *grid->slot);
  status = nodes && sorted && grid->patch && grid->slot ? find_cells(b, nodes, grid) : FLESH_ERR_MEMORY;
  if (!status) find_patches(b, sorted, grid);
  flesh_free(nodes);
  flesh_free(sorted);
  return status;
}

int flesh_coarse_grid_create(const flesh_block_matrix *A, const double *positions, const int *stored, int vertices,
                             const flesh_team *team, flesh_coarse_grid *grid)
{
  const size_t rows = (size_t)A->rows + 1;
  *grid = (flesh_coarse_grid){.cell = flesh_huge_pages_alloc(rows * sizeof(int)),
                              .local = flesh_huge_pages_alloc(rows * sizeof(flesh_float4))};
  builder b = {.rows = A->rows, .X = positions, .stored = stored, .team = team};
  b.at = flesh_malloc(rows * sizeof *b.at);
  b.parent = flesh_malloc(CORNERS * rows * sizeof *b.parent);
  b.vertex = flesh_malloc(CORNERS * rows * sizeof *b.vertex);
  b.where = flesh_malloc((team ? (size_t)vertices + CORNERS : CORNERS * rows) * sizeof *b.where);
  b.most = most_names(&b, vertices);
  b.marks = flesh_malloc((size_t)b.most);
  if (team) b.number = flesh_malloc((size_t)b.most * sizeof *b.number);
  int *place = flesh_malloc(rows * sizeof *place);
  int status = FLESH_ERR_MEMORY;
  if (grid->cell && grid->local && b.at && b.parent && b.vertex && b.where && b.marks && (b.number || !team) && place)
    status = FLESH_OK;
  status = flesh_team_agree(team, status);
  if (!status) status = make(&b, A, vertices, place, grid);
  void *const arrays[] = {b.at, b.parent, b.vertex, b.where, b.marks, b.number, place};
  for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++) flesh_free(arrays[k]);
  return status ? flesh_fail(FLESH_ERR_MEMORY, "no memory for a grid over %d nodes", A->rows) : FLESH_OK;
}

void flesh_coarse_grid_clear(flesh_coarse_grid *grid)
{
  flesh_free(grid->cell);
  flesh_free(grid->local);
  flesh_free(grid->corner);
  flesh_free(grid->patch);
  flesh_free(grid->slot);
  *grid = (flesh_coarse_grid){0};
}
