/* contact_pair.h: the barrier between two features of surfaces that come near each other.
 *
 * A pair is a point and a point, edge or triangle, or two edges. Its potential is weight * w * B(d/w) with their
 * distance d, the thickness w and the law B of barrier.h; that of two edges is multiplied by the mollifier of Li et al.
 * 2020, "Incremental Potential Contact", equation 24,
 *   m = y/e (2 - y/e) for y = |u x v|^2 < e, else 1, with the edges' vectors u, v and e = `parallel`,
 * since the nearest points of parallel edges jump from end to end.
 *
 * With the shares c, normal n, tangents t_i and turns a_i of the nearest points (contact_closest.h) the distance has the
 * gradient c n and the Hessian
 *   1/d sum of (c m)(c m)^T - sum of d (a_i n)(a_i n)^T + (a_i n)(c t_i)^T + (c t_i)(a_i n)^T,
 * m being the directions at right angles to n and all t_i. So the barrier's Hessian is one of at most 5 x 5 in the
 * orthonormal basis (vectors of nodes that sum to 0) n, c/|c| t_i, beside its eigenvectors c m; its eigenvalues are
 * filtered there. That of mollified edges takes 9 x 9. */
#ifndef FLESH_GEOMETRY_CONTACT_PAIR_H
#define FLESH_GEOMETRY_CONTACT_PAIR_H

#include "flesh/material.h"
#include "geometry/contact_closest.h"

typedef struct flesh_contact_pair {
  int nodes[4]; /* the point, then those of the other feature; of two edges two and two; -1 behind them */
  flesh_contact_kind kind;
  int within;       /* see flesh_contact_find_closest */
  int owner;        /* its point's place among the nodes of a flesh_contact_surface; -1: two edges */
  double weight;    /* N; negative in signed sums */
  double thickness; /* m, > 0 */
  double parallel;  /* m^4, of two edges; 0: no mollifier */
  double expected;  /* the gap over the thickness to which the Hessian has the barrier's secant, and of whose force it is; 0: its tangent */
} flesh_contact_pair;

/* The threshold of the mollifier for edges with these squares of their rest lengths: 1e-3 of their product (Li et al.
 * 2020, section 5.2). */
double flesh_contact_parallel(double first_squared, double second_squared);

/* The value [J] and, unless NULL, the gradient [12], N, in the order of the pair's nodes, 0 behind them; nodes at
 * x [3*n], where its nearest points are `at`. FLESH_UNDEFINED, with zeros, where the distance is not positive. */
int flesh_contact_pair_gradient(const flesh_contact_pair *pair, const flesh_contact_closest *at, const double *x, double *value,
                                double *gradient);

/* The Hessian [144], N/m, row-major, 0 behind the nodes, its negative eigenvalues filtered. FLESH_UNDEFINED as above. */
int flesh_contact_pair_hessian(const flesh_contact_pair *pair, const flesh_contact_closest *at, const double *x,
                               flesh_eigenvalue_filter filter, double *hessian);

/* The normal force by which the features part [N], negative where the weight is; 0 beyond the thickness, and where the
 * distance is not positive. Also tells the nearest points. */
double flesh_contact_pair_force(const flesh_contact_pair *pair, const double *x, flesh_contact_closest *closest);

#endif
