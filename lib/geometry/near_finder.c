/* near_finder.c: boxes of a surface's faces, and which of them meet. */
#include "geometry/near_finder.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"

/* The tree is regrouped when its leaves are this many times as loose as at the last grouping. */
static const double worn = 1.5;

/* Number of faces and edges in a task that fits boxes; least number of leaves in a task that walks. */
enum { FIT_PART = 2048, WALK_PART = 16 };

typedef struct fitting {
  flesh_near_finder *finder;
  const double *x0, *x1;
  double inflation;
} fitting;

static void fit_boxes(void *data, int part)
{
  const fitting *f = data;
  flesh_near_finder *self = f->finder;
  const flesh_contact_surface *s = self->surface;
  const int begin = part * FIT_PART, all = s->face_count + s->edge_count;
  const int end = begin + FIT_PART < all ? begin + FIT_PART : all;
  for (int k = begin; k < end; k++) {
    const int face = k < s->face_count, at = face ? k : k - s->face_count;
    flesh_near_box *box = face ? &self->face_boxes[at] : &self->edge_boxes[at];
    flesh_box_around(face ? 3 : 2, face ? s->faces + 3 * (size_t)at : s->edges + 2 * (size_t)at, f->x0, f->x1,
                     f->inflation, box->low, box->high);
  }
}

int flesh_near_finder_fit(flesh_near_finder *self, const double *x0, const double *x1, double inflation,
                          flesh_threads *threads)
{
  const flesh_contact_surface *s = self->surface;
  flesh_box_tree_refit(self->tree, x0, x1, inflation, threads);
  const flesh_box_branch *whole = &self->tree->branches[0];
  for (int c = 0; c < 3; c++)
    if (!(whole->high[c] - whole->low[c] < INFINITY))
      return flesh_fail(FLESH_UNDEFINED, "a surface has a place that is not finite");
  if (flesh_box_tree_wear(self->tree) > worn) {
    flesh_box_tree_regroup(self->tree, x0);
    flesh_box_tree_refit(self->tree, x0, x1, inflation, threads);
    self->regrouped++;
  }
  self->fit_inflation = inflation;
  flesh_threads_run(threads, (s->face_count + s->edge_count + FIT_PART - 1) / FIT_PART, fit_boxes,
                    &(fitting){self, x0, x1, inflation});
  return FLESH_OK;
}

typedef struct walk {
  flesh_near_finder *finder;
  const int *owned;
  int parts;
  void (*visit)(void *data, flesh_near_part *part, int f, int g);
  void *data;
} walk;

/* Visits the pairs of faces of a leaf and of another that does not come before it. */
static void visit_leaves(const walk *w, flesh_near_part *part, const flesh_box_branch *a, const flesh_box_branch *b)
{
  const flesh_near_finder *self = w->finder;
  const int *order = self->tree->order;
  for (int p = a->begin; p < a->end; p++) {
    const int f = order[p];
    const flesh_near_box *box = &self->face_boxes[f];
    if (!flesh_boxes_meet(box->low, box->high, b->low, b->high)) continue;
    for (int q = b->begin > p ? b->begin : p + 1; q < b->end; q++) {
      const int g = order[q];
      if (flesh_near_boxes_meet(box, &self->face_boxes[g])) w->visit(w->data, part, f, g);
    }
  }
}

static int has_owned(const walk *w, const flesh_box_branch *b)
{
  return !w->owned || w->owned[b->end] > w->owned[b->begin];
}

static void walk_part(void *data, int number)
{
  const walk *w = data;
  const flesh_near_finder *self = w->finder;
  const flesh_box_tree *tree = self->tree;
  flesh_near_part *part = &w->finder->parts[number];
  const int begin = (int)((size_t)tree->leaf_count * (size_t)number / (size_t)w->parts),
            end = (int)((size_t)tree->leaf_count * ((size_t)number + 1) / (size_t)w->parts);
  for (int k = begin; k < end; k++) {
    const flesh_box_branch *leaf = &tree->branches[tree->leaves[k]];
    const int owned = has_owned(w, leaf);
    int stack[FLESH_BOX_TREE_DEPTH], height = 0;
    for (stack[height++] = 0; height > 0;) {
      const flesh_box_branch *b = &tree->branches[stack[--height]];
      if (b->end <= leaf->begin || !flesh_boxes_meet(b->low, b->high, leaf->low, leaf->high)) continue;
      if (!owned && !has_owned(w, b)) continue;
      if (b->tag >= 0 && leaf->tag >= 0 && !flesh_near_may_meet(self, b->tag, leaf->tag)) continue;
      if (!b->children) {
        visit_leaves(w, part, leaf, b);
        continue;
      }
      stack[height++] = b->children + 1;
      stack[height++] = b->children;
    }
  }
}

void flesh_near_finder_walk(flesh_near_finder *self, flesh_threads *threads, const int *owned,
                            void (*visit)(void *data, flesh_near_part *part, int f, int g), void *data)
{
  const int wanted = 1 + self->tree->leaf_count / WALK_PART;
  const walk w = {self, owned, wanted < FLESH_NEAR_PARTS ? wanted : FLESH_NEAR_PARTS, visit, data};
  for (int k = 0; k < FLESH_NEAR_PARTS; k++) {
    flesh_near_part *part = &self->parts[k];
    part->count[0] = part->count[1] = part->failed = 0;
  }
  flesh_threads_run(threads, w.parts, walk_part, (void *)&w);
}

void flesh_near_part_add(flesh_near_part *part, int kind, int first, int second)
{
  if (!flesh_grow(&part->found[kind], 2 * sizeof **part->found, part->count[kind], &part->room[kind])) {
    part->failed = 1;
    return;
  }
  int *pair = part->found[kind] + 2 * (size_t)part->count[kind]++;
  pair[0] = first, pair[1] = second;
}

int flesh_near_finder_count(const flesh_near_finder *self, int kind)
{
  long long count = 0;
  for (int k = 0; k < FLESH_NEAR_PARTS; k++) {
    if (self->parts[k].failed) return -1;
    count += self->parts[k].count[kind];
  }
  return count < 1 << 29 ? (int)count : -1;
}

/* Sorts the pairs: by counting sort on the first number, then by insertion sort on the second. */
void flesh_near_finder_gather(flesh_near_finder *self, int kind, int firsts, int *pairs)
{
  int *row = self->row;
  memset(row, 0, ((size_t)firsts + 1) * sizeof *row);
  for (int k = 0; k < FLESH_NEAR_PARTS; k++)
    for (int j = 0; j < self->parts[k].count[kind]; j++) row[self->parts[k].found[kind][2 * (size_t)j] + 1]++;
  for (int i = 0; i < firsts; i++) row[i + 1] += row[i];
  /* row[i] is the insertion point for first number i; afterwards it is the end of those of i */
  for (int k = 0; k < FLESH_NEAR_PARTS; k++)
    for (int j = 0; j < self->parts[k].count[kind]; j++) {
      const int *pair = self->parts[k].found[kind] + 2 * (size_t)j;
      memcpy(pairs + 2 * (size_t)row[pair[0]]++, pair, 2 * sizeof *pair);
    }
  for (int i = 0; i < firsts; i++) {
    const int begin = i ? row[i - 1] : 0;
    for (int k = begin + 1; k < row[i]; k++) {
      const int second = pairs[2 * (size_t)k + 1];
      int *at = pairs + 2 * (size_t)k + 1;
      for (; at > pairs + 2 * (size_t)begin + 1 && at[-2] > second; at -= 2) at[0] = at[-2];
      *at = second;
    }
  }
}

int flesh_near_finder_excludes(const flesh_near_finder *self, int kind, int first, int second)
{
  return self->excluded[kind].start && flesh_near_rows_have(&self->excluded[kind], first, second);
}

static int bond_state(const flesh_near_finder *self, int kind, int row)
{
  return self->bonded[kind] ? self->bonded[kind][row] : FLESH_HELD;
}

/* Whether the node with index `place` is seated on the piece of a mesh node. */
static int is_seated_on(const flesh_near_finder *self, int place, int node)
{
  const flesh_contact_surface *s = self->surface;
  const int row = self->bonds->row[0][place];
  if (row < 0 || bond_state(self, 0, row) != FLESH_SEATED) return 0;
  return s->node_piece[s->node_place[s->faces[3 * (size_t)self->bonds->seat[row]]]] == s->node_piece[s->node_place[node]];
}

int flesh_near_finder_holds(const flesh_near_finder *self, int kind, int first, int second)
{
  const flesh_contact_surface *s = self->surface;
  const int row = self->bonds->row[kind][first];
  if (row >= 0 && bond_state(self, kind, row) != FLESH_APART &&
      flesh_near_rows_have(&self->bonds->others[kind], row, second))
    return 1;
  if (!kind) return is_seated_on(self, first, s->faces[3 * (size_t)second]);
  const int *p = s->edges + 2 * (size_t)first, *q = s->edges + 2 * (size_t)second;
  int seated = 0;
  for (int k = 0; k < 2 && !seated; k++)
    seated = is_seated_on(self, s->node_place[p[k]], q[0]) || is_seated_on(self, s->node_place[q[k]], p[0]);
  return seated;
}

int flesh_near_finder_ignores(const flesh_near_finder *self, int kind, int first, int second)
{
  const flesh_contact_patches *patches = self->patches;
  if (!patches) return 0;
  const int a = kind ? patches->edge_patch[first] : patches->node_patch[first],
            b = kind ? patches->edge_patch[second] : patches->face_patch[second];
  return a >= 0 && b >= 0 && flesh_contact_patches_find(patches, a, b) >= 0;
}
