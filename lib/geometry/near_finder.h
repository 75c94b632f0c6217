/* near_finder.h: shared by near_pairs.c and surface_intersections.c: a tree of the boxes of faces, and a walk over
 * faces whose boxes meet.
 *
 * One tree serves all features: every node and edge is assigned to one of its faces, and whatever is near a feature is
 * near that face. */
#ifndef FLESH_GEOMETRY_NEAR_FINDER_H
#define FLESH_GEOMETRY_NEAR_FINDER_H

#include "geometry/box_tree.h"
#include "geometry/contact_surface.h"
#include "geometry/near_bonds.h"
#include "geometry/near_patches.h"

enum { FLESH_NEAR_PARTS = 64 };

typedef struct flesh_near_box {
  double low[3], high[3];
} flesh_near_box;

/* Pairs found by one task: first points with faces (or edges with faces), second edges with edges. */
typedef struct flesh_near_part {
  int count[2], room[2];
  int *found[2]; /* [2*room], the pairs */
  int failed;    /* whether memory was missing */
} flesh_near_part;

/* Created by flesh_near_finder_create (near_pairs.h). */
typedef struct flesh_near_finder {
  const flesh_contact_surface *surface;
  unsigned char *may_meet; /* [body_count*body_count] */
  int *edge_body, *face_body;
  unsigned char *kept; /* [face_count] bits 0-2: corners whose node is assigned to the face; bits 3-5: edges assigned to it */
  flesh_box_tree *tree;
  flesh_near_box *face_boxes, *edge_boxes; /* [face_count], [edge_count] boxes of the last fit */
  double fit_inflation;
  flesh_near_rows excluded[2]; /* pairs excluded for their distance at rest: faces of points and edges of edges, ascending */
  const flesh_near_bonds *bonds; /* borrowed; NULL: nothing is held together */
  const unsigned char *bonded[2]; /* [bonds->count] state of each bonded feature (FLESH_HELD, ...); borrowed; NULL: all
                                   * are held */
  const flesh_contact_patches *patches; /* patches that ignore each other, borrowed; NULL: none */
  int own;    /* only pairs whose first node is below this are searched for: those of a rank (team.h); INT_MAX: all */
  int *owned; /* [face_count+1] number of faces, before each position of the tree's order, to which a node or edge of
               * this rank is assigned; NULL: all */
  int *row;                    /* [max(node_count, edge_count) + 1] scratch for sorting */
  flesh_near_part parts[FLESH_NEAR_PARTS];
  int regrouped; /* how often the tree has been regrouped */
} flesh_near_finder;

/* Fits all boxes, including the tree's, and regroups the tree if it has become loose. FLESH_UNDEFINED if a position is
 * not finite. */
int flesh_near_finder_fit(flesh_near_finder *finder, const double *x0, const double *x1, double inflation,
                          flesh_threads *threads);

/* Calls visit(data, part, f, g) once for every two faces f and g whose boxes meet and whose bodies may touch. Parts run
 * in parallel; each adds what it finds to finder->parts[part]. Pairs of leaves neither of which has a face in `owned`
 * (finder->owned; NULL: all) are skipped. */
void flesh_near_finder_walk(flesh_near_finder *finder, flesh_threads *threads, const int *owned,
                            void (*visit)(void *data, flesh_near_part *part, int f, int g), void *data);

/* Adds a pair to list `kind` (0 or 1). */
void flesh_near_part_add(flesh_near_part *part, int kind, int first, int second);

/* Returns the number of pairs of a kind in all parts; -1 if memory was missing. */
int flesh_near_finder_count(const flesh_near_finder *finder, int kind);
/* Writes the pairs to `pairs` [2*count], ascending. Their first numbers are below `firsts`. */
void flesh_near_finder_gather(flesh_near_finder *finder, int kind, int firsts, int *pairs);

/* Whether a pair is excluded for its distance at rest. */
int flesh_near_finder_excludes(const flesh_near_finder *finder, int kind, int first, int second);

/* Whether a pair does not touch because it is held together or has not come apart since its bond broke. */
int flesh_near_finder_holds(const flesh_near_finder *finder, int kind, int first, int second);

/* Whether a pair belongs to patches that ignore each other. */
int flesh_near_finder_ignores(const flesh_near_finder *finder, int kind, int first, int second);

static inline int flesh_near_may_meet(const flesh_near_finder *finder, int a, int b)
{
  return finder->may_meet[(size_t)a * (size_t)finder->surface->body_count + (size_t)b];
}

static inline int flesh_near_boxes_meet(const flesh_near_box *a, const flesh_near_box *b)
{
  return flesh_boxes_meet(a->low, a->high, b->low, b->high);
}

#endif
