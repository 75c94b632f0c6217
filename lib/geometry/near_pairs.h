/* near_pairs.h: finds which nodes and faces, and which edges, of bodies' surfaces can be near each other. */
#ifndef FLESH_GEOMETRY_NEAR_PAIRS_H
#define FLESH_GEOMETRY_NEAR_PAIRS_H

#include "flesh/threads.h"
#include "geometry/near_finder.h"

/* Pairs without a common node whose bodies may touch; ascending by the first, then by the second. */
typedef struct flesh_near_pairs {
  int point_count;
  int *point_faces; /* [2*point_count] index among the surface's nodes, then face */
  int edge_count;
  int *edge_pairs;  /* [2*edge_count] edges, the lower first */
  double distance;  /* m: no pair within this distance is missing, at the positions of the search or between them */
  int point_room, edge_room; /* private */
} flesh_near_pairs;

/* Creates a finder of near pairs of one surface (borrowed) at rest at X [3*mesh_nodes]. It reuses its memory from
 * search to search and serves one caller at a time. may_meet [body_count*body_count] says whether two bodies, or a body
 * and itself, may touch; it is symmetric; NULL: all may. Edges and faces between nodes of several bodies belong to the
 * highest. Pairs of one connected piece of a body that are nearer than rest_distance [m] at rest are excluded
 * permanently. The distance may exceed an edge's length; the excluded pairs take memory for as many faces per node, and
 * edges per edge, as lie within it. FLESH_ERR_MEMORY; FLESH_ERR_ARGUMENT if X is not finite or the distance is
 * negative. */
int flesh_near_finder_create(const flesh_contact_surface *surface, const double *X, const unsigned char *may_meet,
                             double rest_distance, flesh_threads *threads, flesh_near_finder **finder);
/* NULL-safe. */
void flesh_near_finder_destroy(flesh_near_finder **finder);
/* Restricts later searches to pairs whose first node is one of the first `own` of the mesh, so that ranks owning these
 * nodes divide the search (team.h) and each pair is found by one rank. FLESH_ERR_MEMORY. */
int flesh_near_finder_restrict(flesh_near_finder *finder, int own);

/* Finds all pairs at most `distance` apart at x0 [3*mesh_nodes] or, if x1 is not NULL, at any time on the straight
 * paths from x0 to x1, and a few more: those that no single plane separates by more. `pairs` is initialised with {0}
 * and keeps its memory; more is allocated only for more pairs than ever before. The same for any number of threads.
 * FLESH_UNDEFINED, with no pairs, if a position is not finite; FLESH_ERR_MEMORY.
 *
 * A search with the distance d + 2 s at one position (x1 NULL) remains complete for the distance d while no node has
 * moved more than s, because a distance changes by at most the sum of its ends' moves. So for x0 and x1 both that near,
 * d = 0 gives all pairs that touch on the straight paths between them. */
int flesh_near_pairs_find(flesh_near_finder *finder, const double *x0, const double *x1, double distance,
                          flesh_threads *threads, flesh_near_pairs *pairs);
/* Selects the pairs at most points [m] (a node and a face) or edges [m] (two edges) apart at x [3*mesh_nodes], and a
 * few more, in their order. `to` keeps its memory as above. The same for any number of threads. FLESH_ERR_MEMORY. */
int flesh_near_pairs_choose(const flesh_near_finder *finder, const flesh_near_pairs *from, const double *x, double points,
                            double edges, flesh_threads *threads, flesh_near_pairs *to);
/* Makes room for this many pairs. FLESH_ERR_MEMORY. */
int flesh_near_pairs_reserve(flesh_near_pairs *pairs, int points, int edges);
void flesh_near_pairs_clear(flesh_near_pairs *pairs);

/* Returns the largest fraction of the straight path from x0 to x1 along which all pairs stay at least `keep` times
 * their distance apart (see flesh_feasible_fraction); 1 without pairs. Pairs more than `apart` [m] from each other at
 * x0 are known to do so and skipped (INFINITY: none is). The same for any number of threads. */
double flesh_near_pairs_feasible_step(const flesh_near_finder *finder, const flesh_near_pairs *pairs, const double *x0,
                                      const double *x1, double keep, double apart,
                                      flesh_threads *threads);

#endif
