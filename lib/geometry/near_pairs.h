/* near_pairs.h: which nodes and faces, and which edges, of bodies' surfaces can be near each other. */
#ifndef FLESH_GEOMETRY_NEAR_PAIRS_H
#define FLESH_GEOMETRY_NEAR_PAIRS_H

#include <stddef.h>

#include "flesh/threads.h"
#include "geometry/near_finder.h"

/* Pairs without a common node, whose bodies may meet; ascending by the first, then by the second. */
typedef struct flesh_near_pairs {
  int point_count;
  int *point_faces; /* [2*point_count] place among the surface's nodes, face */
  int edge_count;
  int *edge_pairs;  /* [2*edge_count] edges, the lower first */
  double distance;  /* m: within it nothing is missing at the places of the search, or between them */
  int point_room, edge_room; /* the pairs' own */
} flesh_near_pairs;

/* Finds near pairs of one surface, again and again, in memory that it keeps, for one caller at a time. For the surface
 * (borrowed) at rest at X [3*mesh_nodes]. may_meet [body_count*body_count]: whether two bodies, and a body with itself,
 * may meet, the same for (a, b) and (b, a); NULL: all may. Edges and faces between nodes of several bodies count as of
 * the highest. Pairs of one connected piece of a body that are nearer than rest_distance [m] at rest are left out for
 * good, which may be more than an edge's length; these pairs take memory, about as many for each node as there are
 * faces within that distance, and for each edge as edges. FLESH_ERR_MEMORY; FLESH_ERR_ARGUMENT where X is not finite or
 * the distance is negative. */
int flesh_near_finder_create(const flesh_contact_surface *surface, const double *X, const unsigned char *may_meet,
                             double rest_distance, flesh_threads *threads, flesh_near_finder **finder);
/* NULL-safe. */
void flesh_near_finder_destroy(flesh_near_finder **finder);
/* From now on pairs are searched for whose first node is one of the first `own` of the mesh, so that ranks which own
 * these share a search out (team.h): each pair is found by one of them. FLESH_ERR_MEMORY. */
int flesh_near_finder_restrict(flesh_near_finder *finder, int own);

/* All pairs that are at most `distance` apart at x0 [3*mesh_nodes] or, where x1 is not NULL, at any time on straight
 * ways from x0 to x1; and few others: those that no plane keeps further apart. `pairs` begins as {0} and keeps its
 * memory from one search to the next; more is asked for only where there were never as many. The same for any number of
 * threads. FLESH_UNDEFINED, with no pairs, where a place is not finite; FLESH_ERR_MEMORY.
 *
 * What was found with the distance d + 2 s at rest (x1 NULL) has all pairs at most d apart as long as no node moved more
 * than s from where it was: a distance changes by no more than two of its ends move. So for x0 and x1 that are both so
 * near it has all pairs that touch on the straight ways between them, with d = 0. */
int flesh_near_pairs_find(flesh_near_finder *finder, const double *x0, const double *x1, double distance,
                          flesh_threads *threads, flesh_near_pairs *pairs);
/* Chooses from pairs those that are at most points [m] apart at x [3*mesh_nodes], a node and a face, or edges [m], two
 * edges, and few others; in their order, in memory that is kept as above. The same for any number of threads.
 * FLESH_ERR_MEMORY. */
int flesh_near_pairs_choose(const flesh_near_finder *finder, const flesh_near_pairs *from, const double *x, double points,
                            double edges, flesh_threads *threads, flesh_near_pairs *to);
/* Room for so many pairs. FLESH_ERR_MEMORY. */
int flesh_near_pairs_reserve(flesh_near_pairs *pairs, int points, int edges);
void flesh_near_pairs_clear(flesh_near_pairs *pairs);

/* The largest fraction of the straight way from x0 to x1 on which all pairs keep the part `keep` of their distance (see
 * flesh_feasible_fraction); 1 where there are none. Pairs more than `apart` [m] from each other at x0 are known to keep it
 * (INFINITY: that is not known of any). The same for any number of threads. */
double flesh_near_pairs_feasible_step(const flesh_near_finder *finder, const flesh_near_pairs *pairs, const double *x0,
                                      const double *x1, double keep, double apart,
                                      flesh_threads *threads);

#endif
