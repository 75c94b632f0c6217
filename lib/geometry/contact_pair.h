/* contact_pair.h: the barrier between two features of surfaces that come near each other.
 *
 * A pair is a point and a point, edge or triangle, or two edges. Its potential is weight * w * B(d/w) with their
 * distance d, the thickness w and the law B of barrier.h; that of two edges is multiplied by the mollifier of Li et al.
 * 2020, "Incremental Potential Contact", equation 24,
 *   m = y/e (2 - y/e) for y = |u x v|^2 < e, else 1, with the edges' vectors u, v and e = `parallel`,
 * because the nearest points of parallel edges jump from end to end.
 *
 * With the shares c, normal n, tangents t_i and turns a_i of the nearest points (contact_closest.h) the distance has
 * the gradient c n and the Hessian
 *   1/d sum of (c m)(c m)^T - sum of d (a_i n)(a_i n)^T + (a_i n)(c t_i)^T + (c t_i)(a_i n)^T,
 * where m are the directions orthogonal to n and all t_i. So the barrier's Hessian has the eigenvectors c m and, in the
 * orthonormal basis (vectors of nodes that sum to 0) n, c/|c| t_i, a block of at most 5 x 5, whose eigenvalues are
 * filtered. Mollified edges need 9 x 9. */
#ifndef FLESH_GEOMETRY_CONTACT_PAIR_H
#define FLESH_GEOMETRY_CONTACT_PAIR_H

#include "flesh/material.h"
#include "geometry/contact_closest.h"

typedef struct flesh_contact_pair {
  int nodes[4]; /* the point or first edge, the nodes of the other feature, then others of one of its triangles, which
                 * tell how an edge or a node rotates */
  flesh_contact_kind kind;
  int within;       /* see flesh_contact_find_closest */
  int owner;        /* index of its point among the nodes of the flesh_contact_surface; -1 for two edges */
  double weight;    /* N; negative in signed sums */
  double thickness; /* m, > 0 */
  double parallel;  /* m^4, threshold of the mollifier of two edges; 0: no mollifier */
  double expected;  /* gap over thickness at the expected solution: the Hessian uses the barrier's secant to there and
                     * its force; 0: the tangent */
} flesh_contact_pair;

/* Returns the threshold of the mollifier for edges with these squared rest lengths: 1e-3 times their product (Li et al.
 * 2020, section 5.2). */
double flesh_contact_parallel(double first_squared, double second_squared);

/* Computes the potential [J] and, unless NULL, its gradient [12] in N, in the order of the pair's nodes and padded with
 * 0. The nodes are at x [3*n] and the nearest points are `at`. FLESH_UNDEFINED, with zeros, if the distance is not
 * positive. */
int flesh_contact_pair_gradient(const flesh_contact_pair *pair, const flesh_contact_closest *at, const double *x, double *value,
                                double *gradient);

/* Computes the Hessian [144] in N/m, row-major and padded with 0, with its negative eigenvalues filtered.
 * FLESH_UNDEFINED as above. */
int flesh_contact_pair_hessian(const flesh_contact_pair *pair, const flesh_contact_closest *at, const double *x,
                               flesh_eigenvalue_filter filter, double *hessian);

/* Returns the repulsive normal force [N], negative if the weight is; 0 beyond the thickness and if the distance is not
 * positive. Also outputs the nearest points. */
double flesh_contact_pair_force(const flesh_contact_pair *pair, const double *x, flesh_contact_closest *closest);

#endif
