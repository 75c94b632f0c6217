/* near_finder.h: what near_pairs.c and surface_intersections.c share: boxes of faces in a tree, and a walk over faces
 * whose boxes meet.
 *
 * One tree has all: every node and edge is kept by one of its faces, and what is near a primitive is near its face. */
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

/* Pairs that one task found, points and faces, or edges and faces, first; pairs of edges second. */
typedef struct flesh_near_part {
  int count[2], room[2];
  int *found[2]; /* [2*room] */
  int failed;    /* for want of memory */
} flesh_near_part;

/* Made by flesh_near_finder_create (near_pairs.h). */
typedef struct flesh_near_finder {
  const flesh_contact_surface *surface;
  unsigned char *may_meet; /* [body_count*body_count] */
  int *edge_body, *face_body;
  unsigned char *kept; /* [face_count] bits 0-2: corners whose node the face keeps; 3-5: edges */
  flesh_box_tree *tree;
  flesh_near_box *face_boxes, *edge_boxes; /* [face_count], [edge_count] of the last fit */
  double fit_inflation;
  flesh_near_rows excluded[2]; /* pairs to leave out: faces of points, edges of edges, ascending */
  const flesh_near_bonds *bonds; /* borrowed; NULL: nothing is held together */
  const unsigned char *bonded[2]; /* [bonds->count] whether it is FLESH_HELD, ...; borrowed; NULL: all are */
  const flesh_contact_patches *patches; /* that ignore each other, borrowed; NULL: none do */
  int own;    /* pairs are searched for whose first node is below: those of a rank (team.h); INT_MAX: all */
  int *owned; /* [face_count+1] how many faces before each place of the tree keep such a node or edge; NULL: all do */
  int *row;                    /* [max(node_count, edge_count) + 1] for sorting */
  flesh_near_part parts[FLESH_NEAR_PARTS];
  int regrouped; /* how often the tree was grouped anew, as it was worn */
} flesh_near_finder;

/* Fits all boxes, those of the tree too, and groups it anew where it is worn. FLESH_UNDEFINED: not finite. */
int flesh_near_finder_fit(flesh_near_finder *finder, const double *x0, const double *x1, double inflation,
                          flesh_threads *threads);

/* Calls visit(data, part, f, g) for all faces f and g whose boxes meet and whose bodies may, once for each two, in parts
 * at a time; what a part finds goes into finder->parts[part]. Where `owned` (finder->owned; NULL: all do) says that
 * neither of two leaves has anything, their faces are passed over. */
void flesh_near_finder_walk(flesh_near_finder *finder, flesh_threads *threads, const int *owned,
                            void (*visit)(void *data, flesh_near_part *part, int f, int g), void *data);

/* Adds a pair of a kind (0, 1). */
void flesh_near_part_add(flesh_near_part *part, int kind, int first, int second);

/* How many pairs of a kind the parts have; -1: memory was missing. */
int flesh_near_finder_count(const flesh_near_finder *finder, int kind);
/* Writes them to `pairs` [2*count], ascending; their first numbers are below `firsts`. */
void flesh_near_finder_gather(flesh_near_finder *finder, int kind, int firsts, int *pairs);

/* Whether a pair of a kind is left out for its distance at rest. */
int flesh_near_finder_excludes(const flesh_near_finder *finder, int kind, int first, int second);

/* Whether a pair of a kind does not touch, as it is held together or has not come apart since. */
int flesh_near_finder_holds(const flesh_near_finder *finder, int kind, int first, int second);

/* Whether a pair of a kind is of patches that ignore each other. */
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
