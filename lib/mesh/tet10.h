/* tet10.h: the ten-node tet's nodes, points, weights and constants.
 *
 * Nodes are four corners, ascending, then those on the edges 01 02 03 12 13 23. */
#ifndef FLESH_MESH_TET10_H
#define FLESH_MESH_TET10_H

/* The four points of degree 2, of weight 1/4 each: L_q at point q and the other L, (5 + 3 sqrt 5)/20 and (5 - sqrt 5)/20
 * (Hammer, Marlowe & Stroud 1956). Curved tets have them too: isoparametric elements of degree 2 keep their order with
 * rules of degree 2 (Ciarlet & Raviart 1972), and on a thick sphere 64 points are not more accurate
 * (test/campaign/curved_quadrature.py). */
#define FLESH_TET10_POINTS 4
#define FLESH_TET10_NEAR   .58541019662496845446
#define FLESH_TET10_FAR    .13819660112501051518

#endif
