/* contact_seat.h: keeps a node that a broken bond has released, and that still lies on the face it was held to, from
 * passing through that face.
 *
 * A barrier cannot start at distance 0, nor if round-off or the bond's compliance has put the node behind the face. A
 * seat is a one-sided spring that starts at the signed distance `least` of the node from the face's plane at release: V
 * = stiffness/2 min(o - least, 0)^2, with o the present distance. It starts with neither energy nor force.
 *
 * With the normal n, the node's barycentric coordinates l_k in the plane and their gradients g_k there, w = dp - sum of
 * l_k dx_k, and a_k = n.dx_k: do = n.w and d2o = -2 sum of a_k g_k.w - o sum of a_j a_k g_j.g_k. */
#ifndef FLESH_GEOMETRY_CONTACT_SEAT_H
#define FLESH_GEOMETRY_CONTACT_SEAT_H

#include "flesh/material.h"

typedef struct flesh_contact_seat {
  int nodes[4];             /* the node, then the face's corners */
  double least, stiffness;  /* m, N/m */
} flesh_contact_seat;

/* Returns the signed distance [m] of the first node from the plane of the others at x [3*n], positive outside. */
double flesh_contact_seat_opening(const int nodes[4], const double *x);

/* Returns the energy [J] and computes, unless NULL, its gradient [12] in N, in the order of the nodes. */
double flesh_contact_seat_gradient(const flesh_contact_seat *seat, const double *x, double *gradient);

/* Computes the Hessian [144] in N/m; if filtered, only its positive semi-definite part stiffness do do^T. */
void flesh_contact_seat_hessian(const flesh_contact_seat *seat, const double *x, flesh_eigenvalue_filter filter,
                                double *hessian);

#endif
