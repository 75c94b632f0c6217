/* near_drift.c: displacements of what is near each other, cube by cube. */
#include "geometry/near_drift.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "math/eig3.h"
#include "math/mat3.h"

/* Cubes along an axis, at most, so that their numbers are integers. */
static const double most_cubes = 1e6;

/* Relative rounding of the bounds. */
static const double slack = 1e-9;

/* Faces of a leaf of the tree: all, or those of one body. */
typedef struct flesh_near_drift_leaf {
  int body; /* 0 where bodies are not told apart */
  int count, nodes[3 * FLESH_BOX_TREE_LEAF]; /* of its faces, each once */
  double low[3], high[3];                    /* around them, with half of the distance */
  double middle[3], displacement[3];         /* means over them */
  double squares[9], products[9];            /* of what their places and displacements (rows) are off these means */
} leaf;

/* The leaves that a cube meets: sums over them, then the motion fitted to them and the box of what it leaves over. */
typedef struct flesh_near_drift_cell {
  int place[4]; /* along the axes; the body */
  double count, middle[3], displacement[3]; /* sums, then means; places are relative to the cube's corner */
  double squares[9], products[9];           /* of places with places, of displacements (rows) with places */
  double low[3], high[3];
} cell;

typedef struct job {
  flesh_near_drift *drift;
  const flesh_near_finder *finder;
  const double *from, *x;
  double origin[3], side;
  int of_one, leaf_count;
} job;

static int make_room(void **list, int *room, int wanted, size_t size)
{
  if (wanted <= *room) return 1;
  void *more = realloc(*list, (size_t)wanted * size);
  if (!more) return 0;
  *list = more;
  *room = wanted;
  return 1;
}

static void displacement_of(const job *j, int node, double u[3])
{
  const double *from = j->from + 3 * (size_t)node, *x = j->x + 3 * (size_t)node;
  for (int c = 0; c < 3; c++) u[c] = x[c] - from[c];
}

static void list_nodes(const job *j, int begin, int end, leaf *l)
{
  const flesh_box_tree *tree = j->finder->tree;
  for (int k = 3 * begin; k < 3 * end; k++) {
    const int node = tree->nodes[3 * (size_t)tree->order[k / 3] + (size_t)(k % 3)];
    int at = 0;
    while (at < l->count && l->nodes[at] != node) at++;
    l->nodes[at] = node;
    l->count += at == l->count;
  }
}

/* Adds what the leaf's nodes are off its means. */
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

/* The faces at these places of the tree's order. Returns 0 where a node's place is not finite. */
static int measure_leaf(const job *j, int begin, int end, double inflation, leaf *l)
{
  double sound = 0;
  *l = (leaf){.low = {INFINITY, INFINITY, INFINITY}, .high = {-INFINITY, -INFINITY, -INFINITY}};
  l->body = j->of_one ? j->finder->face_body[j->finder->tree->order[begin]] : 0;
  list_nodes(j, begin, end, l);
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

/* Finds the end of the faces of one body, or of all, among those at the places from `begin` to `end`. */
static int end_of_body(const job *j, int begin, int end)
{
  const int *order = j->finder->tree->order, *body = j->finder->face_body;
  int last = begin + 1;
  while (last < end && (!j->of_one || body[order[last]] == body[order[begin]])) last++;
  return last;
}

/* Boxes of all leaves, and cubes twice as large as the largest, so that a leaf meets few. Returns 0 where there is none, or
 * too many. */
static int measure_leaves(job *j, double within)
{
  const flesh_box_tree *tree = j->finder->tree;
  double high[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (int c = 0; c < 3; c++) j->origin[c] = INFINITY;
  for (int k = 0, begin = 0, end; begin < tree->count; begin = end) {
    leaf *l = &j->drift->leaves[j->leaf_count++];
    const int end_of_leaf = tree->branches[tree->leaves[k]].end;
    end = end_of_body(j, begin, end_of_leaf);
    k += end == end_of_leaf;
    if (!measure_leaf(j, begin, end, within / 2 * (1 + slack), l)) return 0;
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

/* The cube at a place, new where there was none; NULL: there is no memory. */
static cell *cell_at(flesh_near_drift *drift, const int place[4])
{
  const unsigned mask = (unsigned)drift->table_size - 1;
  unsigned at = (unsigned)place[0] * 73856093u ^ (unsigned)place[1] * 19349663u ^ (unsigned)place[2] * 83492791u ^ (unsigned)place[3];
  for (at = (at ^ at >> 15) & mask; drift->table[at] >= 0; at = (at + 1) & mask) {
    cell *known = &drift->cells[drift->table[at]];
    if (!memcmp(known->place, place, sizeof known->place)) return known;
  }
  void *cells = drift->cells;
  const int wanted = drift->cell_count < drift->cell_room ? 0 : drift->cell_count / 2 * 3 + 64;
  if (2 * drift->cell_count >= drift->table_size || !make_room(&cells, &drift->cell_room, wanted, sizeof(cell))) return NULL;
  drift->cells = cells;
  drift->table[at] = drift->cell_count;
  cell *made = &drift->cells[drift->cell_count++];
  *made = (cell){.place = {place[0], place[1], place[2], place[3]}, .low = {INFINITY, INFINITY, INFINITY},
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

/* The box gets what the motion leaves over at the leaf's nodes. */
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

/* Adds every leaf to the cubes that its box meets. Returns 0 where there is no memory for them. */
static int add_leaves(const job *j, int fitted)
{
  for (int k = 0; k < j->leaf_count; k++) {
    const leaf *l = &j->drift->leaves[k];
    int first[3], last[3], place[4] = {0, 0, 0, l->body};
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

/* Faces that are nearly in one plane, with squares S: what is across it is taken to turn as the plane does. */
static void turn_across(const double S[9], double A[9])
{
  static const double flat = 0.1;
  double w[3], Q[9], along[2][3], across[3], was[3], is[3];
  flesh_eigh3(S, w, Q);
  if (!(w[0] < flat * w[1])) return;
  for (int k = 0; k < 2; k++)
    for (int c = 0; c < 3; c++) {
      along[k][c] = Q[3 * c + 1 + k];
      for (int d = 0; d < 3; d++) along[k][c] -= A[3 * c + d] * Q[3 * d + 1 + k];
    }
  flesh_vec3_cross(along[0], along[1], was);
  for (int k = 0; k < 2; k++)
    for (int c = 0; c < 3; c++) along[k][c] = Q[3 * c + 1 + k];
  flesh_vec3_cross(along[0], along[1], is);
  const double length = sqrt(flesh_vec3_dot(was, was));
  for (int c = 0; c < 3; c++) across[c] = is[c] - was[c] / length - flesh_vec3_dot(A + 3 * c, is);
  for (int k = 0; k < 9 && length > 0; k++) A[k] += across[k / 3] * is[k % 3];
}

/* products = the motion's gradient, from the sums. A little is added to the squares: faces in one plane tell nothing of
 * what is across it. */
static void fit(cell *at, int turns)
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
  if (turns) turn_across(S, at->products);
}

static double norm_of(const double A[9])
{
  double square = 0;
  for (int k = 0; k < 9; k++) square += A[k] * A[k];
  return sqrt(square);
}

/* The most that the motion stretches a length, back to where it was: B^T B is 1 where it only turns. */
static double stretch_of(const double A[9])
{
  double B[9], E[9];
  for (int k = 0; k < 9; k++) B[k] = (k % 4 == 0) - A[k];
  for (int k = 0; k < 9; k++)
    E[k] = B[k / 3] * B[k % 3] + B[3 + k / 3] * B[3 + k % 3] + B[6 + k / 3] * B[6 + k % 3] - (k % 4 == 0);
  return sqrt(1 + norm_of(E));
}

/* The largest of all cubes' `part` times `within`, and what their motions leave over. */
static double largest(job *j, double within, double (*part)(const double A[9]))
{
  flesh_near_drift *drift = j->drift;
  const flesh_near_finder *finder = j->finder;
  int leaves = finder->tree->leaf_count;
  for (int k = 0; k < finder->tree->leaf_count && j->of_one; k++)
    if (finder->tree->branches[finder->tree->leaves[k]].tag < 0) leaves += FLESH_BOX_TREE_LEAF - 1;
  int size = 64;
  while (size < 16 * leaves && size < 1 << 28) size *= 2;
  void *list = drift->leaves, *table = drift->table;
  const int enough = make_room(&list, &drift->leaf_room, leaves, sizeof(leaf)) &&
                     make_room(&table, &drift->table_size, size, sizeof *drift->table);
  drift->leaves = list;
  drift->table = table;
  if (!enough || !(within >= 0) || !measure_leaves(j, within)) return INFINITY;
  drift->cell_count = 0;
  memset(drift->table, -1, (size_t)drift->table_size * sizeof *drift->table);
  if (!add_leaves(j, 0)) return INFINITY;
  for (int k = 0; k < drift->cell_count; k++) fit(&drift->cells[k], part == stretch_of);
  if (!add_leaves(j, 1)) return INFINITY;
  double bound = 0;
  for (int k = 0; k < drift->cell_count; k++) {
    const cell *at = &drift->cells[k];
    double rest[3];
    for (int c = 0; c < 3; c++) rest[c] = at->high[c] - at->low[c];
    bound = fmax(bound, part(at->products) * within + sqrt(flesh_vec3_dot(rest, rest)));
  }
  return bound * (1 + slack) + slack * j->side;
}

double flesh_near_drift_bound(flesh_near_drift *drift, const flesh_near_finder *finder, const double *from,
                              const double *x, double within)
{
  return largest(&(job){.drift = drift, .finder = finder, .from = from, .x = x}, within, norm_of);
}

double flesh_near_drift_apart(flesh_near_drift *drift, const flesh_near_finder *finder, const double *from,
                              const double *x, double within, int of_one)
{
  return largest(&(job){.drift = drift, .finder = finder, .from = from, .x = x, .of_one = of_one}, within, stretch_of);
}

void flesh_near_drift_clear(flesh_near_drift *drift)
{
  free(drift->leaves);
  free(drift->cells);
  free(drift->table);
  *drift = (flesh_near_drift){0};
}

size_t flesh_near_drift_memory(const flesh_near_drift *drift)
{
  return (size_t)drift->leaf_room * sizeof(leaf) + (size_t)drift->cell_room * sizeof(cell) +
         (size_t)drift->table_size * sizeof *drift->table;
}
