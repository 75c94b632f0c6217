/* box_tree.h: a tree of boxes around points, edges or triangles, to find which of them are near.
 *
 * Made once, refitted to new places without asking for memory, and grouped anew when its boxes are worn: when what lay
 * together at first has come apart. All results have the same bits for any number of threads. */
#ifndef FLESH_GEOMETRY_BOX_TREE_H
#define FLESH_GEOMETRY_BOX_TREE_H

#include <stddef.h>

#include "flesh/threads.h"

/* A leaf has FLESH_BOX_TREE_LEAF primitives at most; no branch is deeper than FLESH_BOX_TREE_DEPTH, so that a walk with
 * a stack of so many never runs out of it. */
enum { FLESH_BOX_TREE_LEAF = 4, FLESH_BOX_TREE_DEPTH = 64, FLESH_BOX_TREE_PARTS = 64 };

typedef struct flesh_box_branch {
  double low[3], high[3];
  int begin, end; /* of the places of its primitives in `order` */
  int children;   /* the first of two, which follow each other; 0: a leaf */
  int tag;        /* that all its primitives have; -1: they have several */
} flesh_box_branch;

typedef struct flesh_box_tree {
  int count, corners;         /* primitives, and nodes of each */
  const int *nodes;           /* [corners*count] borrowed */
  const int *tags;            /* [count] borrowed, or NULL: all 0 */
  int *order;                 /* [count] the primitive at each place */
  int branch_count;
  flesh_box_branch *branches; /* the first has all; children come after their parents */
  int leaf_count, *leaves;    /* branches, in the order of their places */
  double freshness;           /* of the boxes when the tree was grouped last, and now: see flesh_box_tree_wear */
  double coherence;
  void *part_sums;            /* of the parts that threads fit */
  void *room;                 /* for grouping anew */
} flesh_box_tree;

/* The tree of `count` >= 1 primitives of `corners` (1 to 3) nodes each at x [3*...]; `nodes` and `tags` are borrowed.
 * Branches are halved at the middle of their primitives along their longest side. FLESH_ERR_MEMORY. */
int flesh_box_tree_create(int count, int corners, const int *nodes, const int *tags, const double *x,
                          flesh_box_tree **tree);
/* NULL-safe. */
void flesh_box_tree_destroy(flesh_box_tree **tree);
size_t flesh_box_tree_memory(const flesh_box_tree *tree);

/* Fits the boxes around the primitives at x0, or on their way from there to x1 (NULL: they stay), and makes them larger
 * by `inflation` [m] on every side. A place that is not finite makes boxes that overlap all. Allocates nothing. */
void flesh_box_tree_refit(flesh_box_tree *tree, const double *x0, const double *x1, double inflation,
                          flesh_threads *threads);

/* How much looser the leaves are than when they were grouped: the sum of their sides over the sum of the sides of their
 * primitives' boxes (of points: over the sides of all) at the x0 of the last refit, over the same then. 1 when fresh;
 * infinite where a place is not finite. */
double flesh_box_tree_wear(const flesh_box_tree *tree);
/* Groups the primitives anew by where they are at x, and fits boxes there. Allocates nothing. */
void flesh_box_tree_regroup(flesh_box_tree *tree, const double *x);

/* Frees all but the boxes, for what never moves: the tree can be walked, and no more. */
void flesh_box_tree_keep_boxes(flesh_box_tree *tree);

/* The box around the nodes [corners] at x0 and, unless it is NULL, x1, larger by `inflation`. */
void flesh_box_around(int corners, const int *nodes, const double *x0, const double *x1, double inflation,
                      double low[3], double high[3]);

/* Whether two boxes have a point in common; NaN has one with everything. */
static inline int flesh_boxes_meet(const double low[3], const double high[3], const double other_low[3],
                                   const double other_high[3])
{
  return !(low[0] > other_high[0]) & !(other_low[0] > high[0]) & !(low[1] > other_high[1]) &
         !(other_low[1] > high[1]) & !(low[2] > other_high[2]) & !(other_low[2] > high[2]);
}

#endif
