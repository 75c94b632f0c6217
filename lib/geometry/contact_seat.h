/* contact_seat.h: keeps a node that a broken bond has let go, and that still lies on the face that it was held to, from
 * going through it.
 *
 * A barrier cannot begin at a distance of 0, nor where round-off or the bond's compliance have put the node behind the
 * face. A seat is a spring that only pushes, from the signed distance o of the node from the face's plane at which the
 * bond let go: V = stiffness/2 min(o - least, 0)^2, which begins with neither energy nor force.
 *
 * With the normal n, the node's barycentric coordinates l_k in the plane and their gradients g_k there, and w = dp - sum
 * of l_k dx_k, a_k = n.dx_k: do = n.w and d2o = -2 sum of a_k g_k.w - o sum of a_j a_k g_j.g_k. */
#ifndef FLESH_GEOMETRY_CONTACT_SEAT_H
#define FLESH_GEOMETRY_CONTACT_SEAT_H

#include "flesh/material.h"

typedef struct flesh_contact_seat {
  int nodes[4];             /* the node, then the face's corners */
  double least, stiffness;  /* m, N/m */
} flesh_contact_seat;

/* The signed distance [m] of the first node from the plane of the others at x [3*n], positive outside. */
double flesh_contact_seat_opening(const int nodes[4], const double *x);

/* The energy [J] and, unless NULL, its gradient [12], N, in the order of the nodes. */
double flesh_contact_seat_gradient(const flesh_contact_seat *seat, const double *x, double *gradient);

/* The Hessian [144], N/m; filtered, it is its positive part do do^T. */
void flesh_contact_seat_hessian(const flesh_contact_seat *seat, const double *x, flesh_eigenvalue_filter filter,
                                double *hessian);

#endif
