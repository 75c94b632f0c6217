/* near_drift.c: bounds relative displacements of near features, cube by cube. */
#include "geometry/near_drift.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "math/mat3.h"

/* Largest number of cubes along an axis, so that their indices fit integers. */
static const double most_cubes = 1e6;

/* Relative margin for rounding. */
static const double slack = 1e-9;

typedef struct flesh_near_drift_leaf {
  int count, nodes[3 * FLESH_BOX_TREE_LEAF]; /* nodes of its faces, without duplicates */
  double low[3], high[3];                    /* box around them, enlarged by half of the distance */
  double middle[3], displacement[3];         /* means over the nodes */
  double squares[9], products[9];            /* second moments about these means: of positions with positions, and of
                                              * displacements (rows) with positions */
} leaf;

/* A cube with the leaves it meets: sums over them, then the fitted motion and the box of the remainders. */
typedef struct flesh_near_drift_cell {
  int place[3];
  double count, middle[3], displacement[3]; /* sums, then means; positions are relative to the cube's corner */
  double squares[9], products[9];           /* moments of positions with positions, and of displacements (rows) with positions */
  double low[3], high[3];
} cell;

typedef struct job {
  flesh_near_drift *drift;
  const flesh_near_finder *finder;
  const double *from, *x;
  double origin[3], side;
} job;

static void displacement_of(const job *j, int node, double u[3])
{
  const double *from = j->from + 3 * (size_t)node, *x = j->x + 3 * (size_t)node;
  for (int c = 0; c < 3; c++) u[c] = x[c] - from[c];
}

static void list_nodes(const job *j, const flesh_box_branch *branch, leaf *l)
{
  const flesh_box_tree *tree = j->finder->tree;
  for (int k = 3 * branch->begin; k < 3 * branch->end; k++) {
    const int node = tree->nodes[3 * (size_t)tree->order[k / 3] + (size_t)(k % 3)];
    int at = 0;
    while (at < l->count && l->nodes[at] != node) at++;
    l->nodes[at] = node;
    l->count += at == l->count;
  }
}

/* Adds the nodes' moments about the leaf's means. */
static void add_nodes(const job *j, leaf *l)
{
  const double part = 1. / l->count;
  for (int k = 0; k < l->count; k++) {
    double u[3], x[3];
    displacement_of(j, l->nodes[k], u);
    for (int c = 0; c < 3; c++) {
      x[c] = j->x[3 * (size_t)l->nodes[k] + (size_t)c] - l->middle[c];
      u[c] -= l->displacement[c];
    }
    for (int c = 0; c < 3; c++)
      for (int d = 0; d < 3; d++) l->squares[3 * c + d] += part * x[c] * x[d], l->products[3 * c + d] += part * u[c] * x[d];
  }
}

/* Measures a leaf. Returns 0 if a position is not finite. */
static int measure_leaf(const job *j, const flesh_box_branch *branch, double inflation, leaf *l)
{
  double sound = 0;
  *l = (leaf){.low = {INFINITY, INFINITY, INFINITY}, .high = {-INFINITY, -INFINITY, -INFINITY}};
  list_nodes(j, branch, l);
  for (int k = 0; k < l->count; k++) {
    const double *x = j->x + 3 * (size_t)l->nodes[k], part = 1. / l->count;
    double u[3];
    displacement_of(j, l->nodes[k], u);
    for (int c = 0; c < 3; c++) {
      l->low[c] = x[c] < l->low[c] ? x[c] : l->low[c];
      l->high[c] = x[c] > l->high[c] ? x[c] : l->high[c];
      l->middle[c] += part * x[c];
      l->displacement[c] += part * u[c];
      sound += 0 * u[c];
    }
  }
  for (int c = 0; c < 3; c++) l->low[c] -= inflation, l->high[c] += inflation;
  add_nodes(j, l);
  return sound == 0;
}

/* Measures all leaves and chooses cubes twice as large as the largest, so that a leaf meets few. Returns 0 if a
 * position is not finite or there are too many cubes. */
static int measure_leaves(job *j, double within)
{
  const flesh_box_tree *tree = j->finder->tree;
  double high[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (int c = 0; c < 3; c++) j->origin[c] = INFINITY;
  for (int k = 0; k < tree->leaf_count; k++) {
    leaf *l = &j->drift->leaves[k];
    if (!measure_leaf(j, &tree->branches[tree->leaves[k]], within / 2 * (1 + slack), l)) return 0;
    for (int c = 0; c < 3; c++) {
      j->side = fmax(j->side, l->high[c] - l->low[c]);
      j->origin[c] = fmin(j->origin[c], l->low[c]);
      high[c] = fmax(high[c], l->high[c]);
    }
  }
  j->side *= 2;
  for (int c = 0; c < 3; c++)
    if (!(high[c] - j->origin[c] < most_cubes * j->side)) return 0;
  return 1;
}

/* Returns the cube at a position, creating it if necessary; NULL: no memory. */
static cell *cell_at(flesh_near_drift *drift, const int place[3])
{
  const unsigned mask = (unsigned)drift->table_size - 1;
  unsigned at = (unsigned)place[0] * 73856093u ^ (unsigned)place[1] * 19349663u ^ (unsigned)place[2] * 83492791u;
  for (at = (at ^ at >> 15) & mask; drift->table[at] >= 0; at = (at + 1) & mask) {
    cell *known = &drift->cells[drift->table[at]];
    if (known->place[0] == place[0] && known->place[1] == place[1] && known->place[2] == place[2]) return known;
  }
  if (2 * drift->cell_count >= drift->table_size ||
      !flesh_grow(&drift->cells, sizeof *drift->cells, drift->cell_count, &drift->cell_room))
    return NULL;
  drift->table[at] = drift->cell_count;
  cell *made = &drift->cells[drift->cell_count++];
  *made = (cell){.place = {place[0], place[1], place[2]}, .low = {INFINITY, INFINITY, INFINITY},
                 .high = {-INFINITY, -INFINITY, -INFINITY}};
  return made;
}

static double corner_of(const job *j, const cell *at, int c) { return j->origin[c] + at->place[c] * j->side; }

static void add_to_sums(const job *j, const leaf *l, cell *to)
{
  double x[3];
  for (int c = 0; c < 3; c++) x[c] = l->middle[c] - corner_of(j, to, c);
  to->count++;
  for (int c = 0; c < 3; c++) {
    to->middle[c] += x[c];
    to->displacement[c] += l->displacement[c];
    for (int d = 0; d < 3; d++) {
      to->squares[3 * c + d] += l->squares[3 * c + d] + x[c] * x[d];
      to->products[3 * c + d] += l->products[3 * c + d] + l->displacement[c] * x[d];
    }
  }
}

/* Extends the cube's box by the remainders at the leaf's nodes. */
static void add_to_box(const job *j, const leaf *l, cell *to)
{
  for (int k = 0; k < l->count; k++) {
    double u[3], x[3];
    displacement_of(j, l->nodes[k], u);
    for (int c = 0; c < 3; c++) x[c] = j->x[3 * (size_t)l->nodes[k] + (size_t)c] - corner_of(j, to, c) - to->middle[c];
    for (int c = 0; c < 3; c++) {
      const double left = u[c] - to->displacement[c] - flesh_vec3_dot(to->products + 3 * c, x);
      to->low[c] = left < to->low[c] ? left : to->low[c];
      to->high[c] = left > to->high[c] ? left : to->high[c];
    }
  }
}

/* Adds every leaf to the cubes its box meets. Returns 0 if memory is missing. */
static int add_leaves(const job *j, int fitted)
{
  const flesh_box_tree *tree = j->finder->tree;
  for (int k = 0; k < tree->leaf_count; k++) {
    const leaf *l = &j->drift->leaves[k];
    int first[3], last[3], place[3];
    for (int c = 0; c < 3; c++) {
      first[c] = (int)floor((l->low[c] - j->origin[c]) / j->side - slack);
      last[c] = (int)floor((l->high[c] - j->origin[c]) / j->side + slack);
    }
    for (place[0] = first[0]; place[0] <= last[0]; place[0]++)
      for (place[1] = first[1]; place[1] <= last[1]; place[1]++)
        for (place[2] = first[2]; place[2] <= last[2]; place[2]++) {
          cell *to = cell_at(j->drift, place);
          if (!to) return 0;
          if (fitted) add_to_box(j, l, to);
          else add_to_sums(j, l, to);
        }
  }
  return 1;
}

/* Fits the motion: sets at->products to its gradient. The second moments are regularised slightly, because coplanar
 * faces do not determine the gradient across their plane. */
static void fit(cell *at)
{
  double S[9], P[9], inverse[9], trace = 0;
  for (int c = 0; c < 3; c++) at->middle[c] /= at->count, at->displacement[c] /= at->count;
  for (int c = 0; c < 3; c++)
    for (int d = 0; d < 3; d++) {
      S[3 * c + d] = at->squares[3 * c + d] - at->count * at->middle[c] * at->middle[d];
      P[3 * c + d] = at->products[3 * c + d] - at->count * at->displacement[c] * at->middle[d];
      trace += c == d ? at->squares[3 * c + d] : 0;
    }
  for (int c = 0; c < 3; c++) S[4 * c] += 1e-6 * trace;
  flesh_vec3_cross(S + 3, S + 6, inverse);
  flesh_vec3_cross(S + 6, S, inverse + 3);
  flesh_vec3_cross(S, S + 3, inverse + 6);
  const double determinant = flesh_vec3_dot(S, inverse);
  for (int c = 0; c < 3; c++)
    for (int d = 0; d < 3; d++)
      at->products[3 * c + d] = determinant > 0 ? flesh_vec3_dot(P + 3 * c, inverse + 3 * d) / determinant : 0;
}

static double bound_of(const cell *at, double within)
{
  double square = 0, diagonal = 0;
  for (int k = 0; k < 9; k++) square += at->products[k] * at->products[k];
  for (int c = 0; c < 3; c++) diagonal += (at->high[c] - at->low[c]) * (at->high[c] - at->low[c]);
  return sqrt(square) * within + sqrt(diagonal);
}

double flesh_near_drift_bound(flesh_near_drift *drift, const flesh_near_finder *finder, const double *from,
                              const double *x, double within)
{
  job j = {.drift = drift, .finder = finder, .from = from, .x = x};
  const int leaves = finder->tree->leaf_count;
  int size = 64;
  while (size < 16 * leaves && size < 1 << 28) size *= 2;
  int *table = size > drift->table_size ? flesh_realloc(drift->table, (size_t)size * sizeof *table) : NULL;
  if (table) drift->table = table, drift->table_size = size;
  const int enough = drift->table_size >= size &&
                     flesh_grow_to(&drift->leaves, sizeof *drift->leaves, leaves, &drift->leaf_room);
  if (!enough || !(within >= 0) || !measure_leaves(&j, within)) return INFINITY;
  drift->cell_count = 0;
  memset(drift->table, -1, (size_t)drift->table_size * sizeof *drift->table);
  if (!add_leaves(&j, 0)) return INFINITY;
  for (int k = 0; k < drift->cell_count; k++) fit(&drift->cells[k]);
  if (!add_leaves(&j, 1)) return INFINITY;
  double bound = 0;
  for (int k = 0; k < drift->cell_count; k++) bound = fmax(bound, bound_of(&drift->cells[k], within));
  return bound * (1 + slack) + slack * j.side;
}

void flesh_near_drift_clear(flesh_near_drift *drift)
{
  flesh_free(drift->leaves);
  flesh_free(drift->cells);
  flesh_free(drift->table);
  *drift = (flesh_near_drift){0};
}
