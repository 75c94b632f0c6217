/* contact_set.h: the barrier between surfaces: a signed sum over pairs of their features.
 *
 * Every node p of area A has k w A/2 times the barrier B(d/w) of the surfaces near it (half, because the nodes of both
 * surfaces count). The barrier is summed over triangles, minus edges once for each of their triangles but the first,
 * plus nodes so that each counts once in total: the improved maximum of Li et al. 2023, "Convergent Incremental
 * Potential Contact", section 3, over the triangles that p may touch. The result does not depend on the triangulation
 * of a flat face and has no kinks at inner corners. If the thickness exceeds the features, the sum is that of the Euler
 * characteristic of the surface within a ball around p, over the ball's radius. Terms of one feature are merged; above
 * a flat face one pair remains.
 *
 * Two edges have k w' (A + A')/4 B(d/w') with a smaller thickness w' and no signs. In ordinary contact the nodes bear
 * the load and no edges are that near; crossing edges bear what nodes cannot, down to any distance. (A signed sum over
 * edges, as in Li et al. 2023, counts an edge as often as it crosses others above a flat face, 2 to 4 times for random
 * triangles; over a net of edges finer than the thickness it is the Euler characteristic of a graph, nodes - edges < 0,
 * which attracts.)
 *
 * Ties, such as a node exactly above a node, are decided as seen from a slightly displaced position, so that they too
 * leave one pair.
 *
 * Flat faces pressed together at a distance d have the pressure k |B'(d/w)|, as a face above an obstacle does. */
#ifndef FLESH_GEOMETRY_CONTACT_SET_H
#define FLESH_GEOMETRY_CONTACT_SET_H

#include <stddef.h>

#include "flesh/threads.h"
#include "geometry/contact_pair.h"
#include "geometry/contact_surface.h"

/* Ratio w'/w of the edges' thickness to the nodes': a flat face reaches it at a pressure of 13 k. */
#define FLESH_CONTACT_EDGE_THICKNESS 0.25

typedef struct flesh_contact_law {
  double stiffness, thickness; /* Pa and m; > 0 */
  double edge_thickness;       /* m, thickness for two edges; > 0, at most `thickness` */
} flesh_contact_law;

/* Pairs that may be near each other, from a search that misses none within the thickness. */
typedef struct flesh_contact_candidates {
  int point_count;
  const int *point_faces; /* [2*point_count] index among the surface's nodes, then face; ascending, without duplicates;
                           * the node is no corner of the face */
  int edge_count;
  const int *edge_pairs; /* [2*edge_count] two edges without a common node; without duplicates */
} flesh_contact_candidates;

typedef struct flesh_contact_set {
  const flesh_contact_surface *surface; /* borrowed */
  flesh_contact_law law;
  int count;                 /* number of pairs within their thickness and with non-zero weight */
  flesh_contact_pair *pairs; /* [count] those of points in ascending order of the points, then those of edges */
  flesh_contact_closest *closest; /* [count] their nearest points */
  int own; /* only pairs whose first node is below this are evaluated: those of a rank that owns these nodes (team.h);
            * INT_MAX: all */
  double distance;           /* m, least distance of any pair, to 1e-9 of the thickness; INFINITY if there is none */
  /* The members below are private. */
  double *edge_squared; /* [edge_count] rest lengths squared, m^2 */
  size_t capacity, scratch_size;
  int value_room;             /* room in pairs of the arrays below and of `closest` */
  double *values, *gradients; /* [value_room] and [12*value_room] */
  int room[2];                /* room in pairs of each part of the points, and of each part of the edges */
  void *scratch;
} flesh_contact_set;

/* Whether this rank evaluates the pair. */
static inline int flesh_contact_set_owns(const flesh_contact_set *set, const flesh_contact_pair *pair)
{
  return pair->nodes[0] < set->own;
}

/* Creates a set for the rest positions X [3*n]. FLESH_ERR_MEMORY. */
int flesh_contact_set_create(const flesh_contact_surface *surface, const double *X, const flesh_contact_law *law,
                             flesh_contact_set *set);
void flesh_contact_set_clear(flesh_contact_set *set);

/* Finds the pairs at x [3*n]; the same for any number of threads. Allocates only if more room is needed than in all
 * earlier calls. FLESH_ERR_MEMORY; FLESH_UNDEFINED, with no pairs, if features touch or x has NaN. */
int flesh_contact_set_update(flesh_contact_set *set, const flesh_contact_candidates *candidates, const double *x,
                             flesh_threads *threads);

/* Adds to each output that is not NULL: the energy [J], the sum of its terms' magnitudes and the residual r [3*n] of
 * the set's own pairs at x, the positions of the last update. FLESH_UNDEFINED as above. */
int flesh_contact_set_evaluate(flesh_contact_set *set, const double *x, flesh_threads *threads, double *energy,
                               double *size, double *r);

/* Computes the Hessians [144*count] of the set's own pairs times `scale` in N/m, in the order of their nodes, each
 * filtered. */
void flesh_contact_set_hessians(const flesh_contact_set *set, const double *x, double scale,
                                flesh_eigenvalue_filter filter, flesh_threads *threads, double *hessians);

#endif
