/* box_tree.h: a tree of boxes around points, edges or triangles, to find which of them are near.
 *
 * A tree is created once and refitted to new positions without allocating. It is regrouped when its boxes have become
 * loose because primitives of one leaf have moved apart. All results have the same bits for any number of threads. */
#ifndef FLESH_GEOMETRY_BOX_TREE_H
#define FLESH_GEOMETRY_BOX_TREE_H

#include <stddef.h>

#include "flesh/threads.h"

/* A leaf has at most FLESH_BOX_TREE_LEAF primitives. No branch is deeper than FLESH_BOX_TREE_DEPTH, so a walk needs a
 * stack of that many entries. Refits are split into at most FLESH_BOX_TREE_PARTS parts. */
enum { FLESH_BOX_TREE_LEAF = 4, FLESH_BOX_TREE_DEPTH = 64, FLESH_BOX_TREE_PARTS = 64 };

typedef struct flesh_box_branch {
  double low[3], high[3];
  int begin, end; /* range of its primitives in `order` */
  int children;   /* index of the first of its two children, which are adjacent; 0 for a leaf */
  int tag;        /* tag shared by all its primitives; -1 if they differ */
} flesh_box_branch;

typedef struct flesh_box_tree {
  int count, corners;         /* number of primitives, and of nodes of each */
  const int *nodes;           /* [corners*count] borrowed */
  const int *tags;            /* [count] borrowed; NULL: all tags are 0 */
  int *order;                 /* [count] permutation of the primitives: branches are ranges of it */
  int branch_count;
  flesh_box_branch *branches; /* the first is the root; children come after their parents */
  int leaf_count, *leaves;    /* indices of the leaf branches, in the order of their primitives in `order` */
  double freshness;           /* looseness of the boxes when the tree was grouped last; `coherence` is that now (see
                               * flesh_box_tree_wear) */
  double coherence;
  void *part_sums;            /* sums over the parts that threads refit */
  void *room;                 /* scratch for regrouping */
} flesh_box_tree;

/* Creates the tree of `count` >= 1 primitives of `corners` (1 to 3) nodes each at x [3*...]; `nodes` and `tags` are
 * borrowed. Branches are bisected along their longest side into equal numbers of primitives. FLESH_ERR_MEMORY. */
int flesh_box_tree_create(int count, int corners, const int *nodes, const int *tags, const double *x,
                          flesh_box_tree **tree);
/* NULL-safe. */
void flesh_box_tree_destroy(flesh_box_tree **tree);
size_t flesh_box_tree_memory(const flesh_box_tree *tree);

/* Refits the boxes to the primitives at x0 or, unless x1 is NULL, to their straight paths from x0 to x1, and enlarges
 * them by `inflation` [m] on every side. A position that is not finite gives boxes that overlap all others. Allocates
 * nothing. */
void flesh_box_tree_refit(flesh_box_tree *tree, const double *x0, const double *x1, double inflation,
                          flesh_threads *threads);

/* Returns how much looser the leaves are than when they were grouped: the ratio of the sums of their sides to those of
 * their primitives' boxes (for points, to the sides of the box of all) at the x0 of the last refit, divided by that
 * ratio at grouping. It is 1 for a fresh tree and infinite if a position is not finite. */
double flesh_box_tree_wear(const flesh_box_tree *tree);
/* Regroups the primitives by their positions x and fits the boxes to them. Allocates nothing. */
void flesh_box_tree_regroup(flesh_box_tree *tree, const double *x);

/* Frees all but the boxes, for a tree that never moves. It can still be walked, but neither refitted nor regrouped. */
void flesh_box_tree_keep_boxes(flesh_box_tree *tree);

/* Computes the box around the nodes [corners] at x0 and, unless it is NULL, x1, enlarged by `inflation`. */
void flesh_box_around(int corners, const int *nodes, const double *x0, const double *x1, double inflation,
                      double low[3], double high[3]);

/* Whether two boxes have a point in common; a box with NaN meets every box. */
static inline int flesh_boxes_meet(const double low[3], const double high[3], const double other_low[3],
                                   const double other_high[3])
{
  return !(low[0] > other_high[0]) & !(other_low[0] > high[0]) & !(low[1] > other_high[1]) &
         !(other_low[1] > high[1]) & !(low[2] > other_high[2]) & !(other_low[2] > high[2]);
}

#endif
