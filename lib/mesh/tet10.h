/* tet10.h: nodes, quadrature points, weights and constants of the ten-node tet.
 *
 * Nodes are the four corners, in rising order, then those on the edges 01 02 03 12 13 23. */
#ifndef FLESH_MESH_TET10_H
#define FLESH_MESH_TET10_H

/* The four points of degree 2, of weight 1/4 each: at point q, L_q is (5 + 3 sqrt 5)/20 and the others are (5 - sqrt
 * 5)/20 (Hammer, Marlowe & Stroud 1956). Curved tets use them, too: isoparametric elements of degree 2 keep their order
 * with rules of degree 2 (Ciarlet & Raviart 1972), and on a thick sphere 64 points are not more accurate
 * (test/campaign/curved_quadrature.py). */
#define FLESH_TET10_POINTS 4
#define FLESH_TET10_NEAR   .58541019662496845446
#define FLESH_TET10_FAR    .13819660112501051518

#endif
