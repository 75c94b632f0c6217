/* bernstein.h: the Jacobian of a ten-node tet, a cubic, in Bernstein form, and bounds of it.
 *
 * Over a tet with barycentric coordinates L, a cubic is the sum of c_a 3!/(a0! a1! a2! a3!) L^a over
 * the 20 exponents a of sum 3. It lies between its least and its largest coefficient, and where an
 * exponent is 3 the coefficient is its value at that corner (Farin 1986; for Jacobians Johnen,
 * Remacle & Geuzaine 2013). */
#ifndef FLESH_MESH_BERNSTEIN_H
#define FLESH_MESH_BERNSTEIN_H

enum { FLESH_CUBIC = 20, FLESH_SUBDIVISIONS = 400 };

/* The coefficients of det(dx/dxi), 6 V where the edges are straight, for a tet with the given corners
 * and nodes on edges (VTK's order), nodes at x. One compiled body for all callers, so that a body at
 * rest has J = 1 to the last bit. */
void flesh_tet10_jacobian(const double *x, const int corners[4], const int edge_nodes[6],
                          double c[FLESH_CUBIC]);

/* The integral over the tet of the cubic that is det(dx/dxi): its volume. */
double flesh_cubic_integral(const double c[FLESH_CUBIC]);

/* The weights of the coefficients in the value of a cubic at barycentric L, and that value. */
void flesh_cubic_weights(const double L[4], double weights[FLESH_CUBIC]);
double flesh_cubic_sum(const double c[FLESH_CUBIC], const double weights[FLESH_CUBIC]);

/* The least value of c/C over the tet, C positive in it, between `low` and `high`. Both are NaN when
 * a coefficient is. The gap is at most `tolerance` times the largest |c/C| of the coefficients, and 0
 * is not in it, unless the least value is 0 to rounding or FLESH_SUBDIVISIONS do not show it. */
typedef struct flesh_least {
  double low, high;
} flesh_least;
flesh_least flesh_cubic_least(const double c[FLESH_CUBIC], const double C[FLESH_CUBIC],
                              double tolerance);

#endif
