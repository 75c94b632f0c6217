/* box_tree.c: a binary tree of axis-aligned boxes.
 *
 * Grouping sorts the primitives of a branch by the sums of their corners' coordinates along the branch's longest side
 * and bisects them. The sort is stable, so the tree depends only on the positions. */
#include "geometry/box_tree.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"

enum { PART = 64 }; /* leaves in a part, at least */

/* Sums over a part's boxes before they are enlarged for motion and inflation. */
typedef struct part_sum {
  double leaves, primitives; /* sums of the sides of the leaves' boxes and of the primitives' boxes */
  flesh_box_branch whole;    /* box around the part */
} part_sum;

typedef struct ranked {
  double key;
  int primitive;
} ranked;

void flesh_box_around(int corners, const int *nodes, const double *x0, const double *x1, double inflation,
                      double low[3], double high[3])
{
  const double *first = x0 + 3 * (size_t)nodes[0];
  double sound = 0; /* becomes NaN if a position is not finite */
  for (int c = 0; c < 3; c++) low[c] = high[c] = first[c];
  for (int end = 0; end < (x1 ? 2 : 1); end++)
    for (int k = 0; k < corners; k++) {
      const double *p = (end ? x1 : x0) + 3 * (size_t)nodes[k];
      for (int c = 0; c < 3; c++) {
        low[c] = p[c] < low[c] ? p[c] : low[c];
        high[c] = p[c] > high[c] ? p[c] : high[c];
        sound += 0 * p[c];
      }
    }
  const double rounding = inflation > 0 ? 4 * DBL_EPSILON : 0;
  for (int c = 0; c < 3; c++) {
    low[c] -= inflation + rounding * fabs(low[c]) - sound;
    high[c] += inflation + rounding * fabs(high[c]) + sound;
  }
}

/* Enlarges b to contain another box; a NaN in either stays. */
static void join(flesh_box_branch *b, const double low[3], const double high[3])
{
  for (int c = 0; c < 3; c++) {
    b->low[c] = low[c] >= b->low[c] ? b->low[c] : low[c] + 0 * b->low[c];
    b->high[c] = high[c] <= b->high[c] ? b->high[c] : high[c] + 0 * b->high[c];
  }
}

static double sides(const double low[3], const double high[3])
{
  return high[0] - low[0] + (high[1] - low[1]) + (high[2] - low[2]);
}

static const int *nodes_at(const flesh_box_tree *self, int place)
{
  return self->nodes + (size_t)self->corners * (size_t)self->order[place];
}

/* Fits a leaf's box; returns the sum of the sides of its primitives' boxes. */
static double fit_leaf(const flesh_box_tree *self, flesh_box_branch *b, const double *x0, const double *x1,
                       double inflation)
{
  double sum = 0, low[3], high[3];
  for (int p = b->begin; p < b->end; p++) {
    flesh_box_around(self->corners, nodes_at(self, p), x0, x1, inflation, low, high);
    sum += sides(low, high);
    if (p == b->begin) memcpy(b->low, low, sizeof low), memcpy(b->high, high, sizeof high);
    else join(b, low, high);
  }
  return sum;
}

static void fit_inner(flesh_box_tree *self)
{
  for (int k = self->branch_count - 1; k >= 0; k--) {
    flesh_box_branch *b = &self->branches[k];
    if (!b->children) continue;
    const flesh_box_branch *child = &self->branches[b->children];
    memcpy(b->low, child[0].low, sizeof b->low);
    memcpy(b->high, child[0].high, sizeof b->high);
    join(b, child[1].low, child[1].high);
  }
}

typedef struct fitting {
  flesh_box_tree *tree;
  const double *x0, *x1;
  double inflation;
  int parts;
} fitting;

static void fit_leaves(void *data, int part)
{
  const fitting *f = data;
  flesh_box_tree *self = f->tree;
  part_sum sum = {.leaves = 0};
  const int begin = (int)((size_t)self->leaf_count * (size_t)part / (size_t)f->parts),
            end = (int)((size_t)self->leaf_count * ((size_t)part + 1) / (size_t)f->parts);
  for (int k = begin; k < end; k++) {
    flesh_box_branch *b = &self->branches[self->leaves[k]];
    sum.primitives += fit_leaf(self, b, f->x0, NULL, 0);
    sum.leaves += sides(b->low, b->high);
    if (k == begin) sum.whole = *b;
    else join(&sum.whole, b->low, b->high);
    if (f->x1 || f->inflation > 0) fit_leaf(self, b, f->x0, f->x1, f->inflation);
  }
  ((part_sum *)self->part_sums)[part] = sum;
}

void flesh_box_tree_refit(flesh_box_tree *self, const double *x0, const double *x1, double inflation,
                          flesh_threads *threads)
{
  const int wanted = 1 + self->leaf_count / PART,
            parts = wanted < FLESH_BOX_TREE_PARTS ? wanted : FLESH_BOX_TREE_PARTS;
  flesh_threads_run(threads, parts, fit_leaves, &(fitting){self, x0, x1, inflation, parts});
  fit_inner(self);
  part_sum *parts_of = self->part_sums, *all = &parts_of[0];
  for (int k = 1; k < parts; k++) {
    all->leaves += parts_of[k].leaves;
    all->primitives += parts_of[k].primitives;
    join(&all->whole, parts_of[k].whole.low, parts_of[k].whole.high);
  }
  /* A point's box has no sides, so points are compared with the box of all. */
  const double scale = self->corners > 1 ? all->primitives : sides(all->whole.low, all->whole.high);
  self->coherence = scale > 0 ? all->leaves / scale : all->leaves == 0 ? 1 : INFINITY;
}

double flesh_box_tree_wear(const flesh_box_tree *self)
{
  const double wear = self->coherence / self->freshness;
  return wear >= 0 ? wear : INFINITY;
}

/* Sorts stably by key (merge sort; Knuth, The Art of Computer Programming 3, section 5.2.4). */
static void sort_ranked(ranked *things, int count, ranked *room)
{
  if (count <= 8) {
    for (int k = 1; k < count; k++) {
      const ranked carried = things[k];
      int at = k;
      for (; at > 0 && things[at - 1].key > carried.key; at--) things[at] = things[at - 1];
      things[at] = carried;
    }
    return;
  }
  const int half = count / 2;
  sort_ranked(things, half, room);
  sort_ranked(things + half, count - half, room);
  if (!(things[half - 1].key > things[half].key)) return;
  memcpy(room, things, (size_t)half * sizeof *room);
  for (int first = 0, second = half, to = 0; first < half; to++)
    things[to] = second < count && room[first].key > things[second].key ? things[second++] : room[first++];
}

/* Sorts the primitives of a branch along its longest side and bisects them recursively. Returns the number of branches
 * made so far. */
static int halve(flesh_box_tree *self, int index, int begin, int end, int branches, const double *x)
{
  flesh_box_branch *b = &self->branches[index];
  *b = (flesh_box_branch){.begin = begin, .end = end, .tag = self->tags ? self->tags[self->order[begin]] : 0};
  fit_leaf(self, b, x, NULL, 0);
  for (int p = begin; p < end && self->tags; p++)
    if (self->tags[self->order[p]] != b->tag) b->tag = -1;
  if (end - begin <= FLESH_BOX_TREE_LEAF) {
    self->leaves[self->leaf_count++] = index;
    return branches;
  }
  int longest = 0;
  for (int c = 1; c < 3; c++)
    if (b->high[c] - b->low[c] > b->high[longest] - b->low[longest]) longest = c;
  ranked *things = self->room;
  for (int p = begin; p < end; p++) {
    ranked *thing = &things[p - begin];
    *thing = (ranked){0, self->order[p]};
    for (int k = 0; k < self->corners; k++) thing->key += x[3 * (size_t)nodes_at(self, p)[k] + (size_t)longest];
  }
  sort_ranked(things, end - begin, things + (end - begin));
  for (int p = begin; p < end; p++) self->order[p] = things[p - begin].primitive;
  const int children = branches, middle = begin + (end - begin) / 2;
  b->children = children;
  branches = halve(self, children, begin, middle, branches + 2, x);
  return halve(self, children + 1, middle, end, branches, x);
}

void flesh_box_tree_regroup(flesh_box_tree *self, const double *x)
{
  self->leaf_count = 0;
  self->branch_count = halve(self, 0, 0, self->count, 1, x);
  flesh_box_tree_refit(self, x, NULL, 0, NULL);
  self->freshness = self->coherence;
}

/* Returns the number of branches of a tree of `count` primitives. */
static int branches_over(int count)
{
  return count <= FLESH_BOX_TREE_LEAF ? 1 : 1 + branches_over(count / 2) + branches_over(count - count / 2);
}

int flesh_box_tree_create(int count, int corners, const int *nodes, const int *tags, const double *x,
                          flesh_box_tree **tree)
{
  *tree = NULL;
  flesh_box_tree *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a tree of boxes");
  const int branches = branches_over(count), leaves = (branches + 1) / 2;
  *self = (flesh_box_tree){.count = count, .corners = corners, .nodes = nodes, .tags = tags, .branch_count = branches,
                           .order = malloc((size_t)count * sizeof *self->order),
                           .branches = malloc((size_t)branches * sizeof *self->branches),
                           .leaves = malloc((size_t)leaves * sizeof *self->leaves),
                           .part_sums = malloc(FLESH_BOX_TREE_PARTS * sizeof(part_sum)),
                           .room = malloc(((size_t)count + (size_t)count / 2 + 1) * sizeof(ranked))};
  if (!self->order || !self->branches || !self->leaves || !self->part_sums || !self->room) {
    flesh_box_tree_destroy(&self);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for a tree of %d boxes", count);
  }
  for (int k = 0; k < count; k++) self->order[k] = k;
  flesh_box_tree_regroup(self, x);
  *tree = self;
  return FLESH_OK;
}

void flesh_box_tree_destroy(flesh_box_tree **tree)
{
  if (!tree || !*tree) return;
  free((*tree)->order);
  free((*tree)->branches);
  free((*tree)->leaves);
  free((*tree)->part_sums);
  free((*tree)->room);
  free(*tree);
  *tree = NULL;
}

void flesh_box_tree_keep_boxes(flesh_box_tree *self)
{
  free(self->order);
  free(self->leaves);
  free(self->part_sums);
  free(self->room);
  self->order = self->leaves = NULL;
  self->part_sums = NULL;
  self->room = NULL;
  self->nodes = self->tags = NULL;
}

size_t flesh_box_tree_memory(const flesh_box_tree *self)
{
  const size_t count = (size_t)self->count, boxes = sizeof *self + (size_t)self->branch_count * sizeof *self->branches;
  if (!self->order) return boxes;
  return boxes + count * sizeof *self->order +
         (size_t)self->leaf_count * sizeof *self->leaves + FLESH_BOX_TREE_PARTS * sizeof(part_sum) +
         (count + count / 2 + 1) * sizeof(ranked);
}
