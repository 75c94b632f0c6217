/* contact_set.h: the barrier between surfaces: a signed sum over pairs of their features.
 *
 * Every node p of area A has k w A/2 times the barrier B(d/w) of the surfaces near it (half, since both surfaces have
 * nodes), with the sum over triangles, less that over edges once for each triangle but the first, plus that over nodes
 * so that each counts once in all (the improved maximum of Li et al. 2023, "Convergent Incremental Potential Contact",
 * section 3, over those triangles that p may meet): so it does not depend on how a flat face is cut, and has no kinks in
 * inner corners. With the thickness greater than the features, the sum is that of the Euler characteristic of what lies
 * within a ball around p, over its radius. Terms of one feature are merged; above a flat face one pair remains.
 *
 * Two edges have k w' (A + A')/4 B(d/w') with a smaller thickness w' and no signs: the nodes bear ordinary contact, in
 * which no edges are that near, and edges that cross bear what nodes cannot, down to any distance. (A signed sum over
 * edges, as Li et al. 2023 have it, counts an edge as often as it crosses others above a flat face, 2 to 4 times for
 * triangles at random; over a net of edges finer than the thickness it is the Euler characteristic of a graph,
 * nodes - edges < 0, which attracts.)
 *
 * Ties, such as a node exactly above a node, are decided as from a place beside it, so that they too leave one pair.
 *
 * Pressed together, flat faces a distance d apart have the pressure k |B'(d/w)|, as a face above an obstacle has. */
#ifndef FLESH_GEOMETRY_CONTACT_SET_H
#define FLESH_GEOMETRY_CONTACT_SET_H

#include <stddef.h>

#include "flesh/threads.h"
#include "geometry/contact_pair.h"
#include "geometry/contact_surface.h"

/* w'/w: a flat face reaches it at a pressure of 13 k. */
#define FLESH_CONTACT_EDGE_THICKNESS 0.25

typedef struct flesh_contact_law {
  double stiffness, thickness; /* Pa, m; > 0 */
  double edge_thickness;       /* m, of two edges; > 0, at most the thickness */
} flesh_contact_law;

/* Pairs that may be near each other, from a search that misses nothing within the thickness. */
typedef struct flesh_contact_candidates {
  int point_count;
  const int *point_faces; /* [2*point_count] place among the surface's nodes, face; ascending, each once; the node is no
                           * corner of the face */
  int edge_count;
  const int *edge_pairs; /* [2*edge_count] two edges without a common node; each once */
} flesh_contact_candidates;

typedef struct flesh_contact_set {
  const flesh_contact_surface *surface; /* borrowed */
  flesh_contact_law law;
  int count;                 /* pairs nearer than their thickness and with weight: all pairs of a point in a row, */
  flesh_contact_pair *pairs; /* points ascending, then those of edges */
  flesh_contact_closest *closest; /* [count] their nearest points */
  int own; /* pairs whose first node is below are evaluated: those of a rank that owns these nodes (team.h); INT_MAX: all */
  double distance;           /* m, the least of theirs, to 1e-9 of the thickness; INFINITY where there is none */
  /* The members below are the set's own. */
  double *edge_squared; /* [edge_count] rest lengths squared, m^2 */
  size_t capacity, scratch_size;
  int value_room;             /* at least count */
  double *values, *gradients; /* [value_room], [12*value_room]; closest has value_room, too */
  int room[2];                /* pairs of a part of the points, and of the edges */
  void *scratch;
} flesh_contact_set;

/* Whether it is for this rank to evaluate. */
static inline int flesh_contact_set_owns(const flesh_contact_set *set, const flesh_contact_pair *pair)
{
  return pair->nodes[0] < set->own;
}

/* For rest positions X [3*n]. Returns FLESH_ERR_MEMORY where there is none. */
int flesh_contact_set_create(const flesh_contact_surface *surface, const double *X, const flesh_contact_law *law,
                             flesh_contact_set *set);
void flesh_contact_set_clear(flesh_contact_set *set);

/* Finds the pairs at x [3*n]; the same for any number of threads. Takes more memory only where there is less than any
 * earlier call needed: FLESH_ERR_MEMORY. FLESH_UNDEFINED, with no pairs, where features meet or x has NaN. */
int flesh_contact_set_update(flesh_contact_set *set, const flesh_contact_candidates *candidates, const double *x,
                             flesh_threads *threads);

/* Adds the energy [J], the sum of its terms' sizes and the residual r [3*n] of the pairs that are its own at x, the place of
 * the last update, to what is not NULL. FLESH_UNDEFINED as above. */
int flesh_contact_set_evaluate(flesh_contact_set *set, const double *x, flesh_threads *threads, double *energy,
                               double *size, double *r);

/* Hessians [144*count] of the pairs that are its own times `scale`, N/m, in the order of their nodes, each filtered. */
void flesh_contact_set_hessians(const flesh_contact_set *set, const double *x, double scale,
                                flesh_eigenvalue_filter filter, flesh_threads *threads, double *hessians);

#endif
