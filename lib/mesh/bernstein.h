/* bernstein.h: the Jacobian of a ten-node tet, a cubic, in Bernstein form, and bounds of it.
 *
 * Over a tet with barycentric coordinates L, a cubic is the sum of c_a 3!/(a0! a1! a2! a3!) L^a over
 * the 20 exponents a of sum 3. It lies between its least and its largest coefficient, and where an
 * exponent is 3 the coefficient is its value at that corner (Farin 1986; for Jacobians Johnen,
 * Remacle & Geuzaine 2013). */
#ifndef FLESH_MESH_BERNSTEIN_H
#define FLESH_MESH_BERNSTEIN_H

enum { FLESH_CUBIC = 20, FLESH_SUBDIVISIONS = 400 };

/* Computes the coefficients of det(dx/dxi), which is 6 V for straight edges, of a tet with the given corners and nodes
 * on edges (VTK's order), nodes at x. It is compiled once for all callers, so that a body at rest has J = 1 to the last
 * bit. */
void flesh_tet10_jacobian(const double *x, const int corners[4], const int edge_nodes[6],
                          double c[FLESH_CUBIC]);

/* Returns the integral over the tet of the cubic; for det(dx/dxi) this is the tet's volume. */
double flesh_cubic_integral(const double c[FLESH_CUBIC]);

/* flesh_cubic_weights finds the weights of the coefficients in a cubic's value at barycentric L; flesh_cubic_sum
 * returns the value. */
void flesh_cubic_weights(const double L[4], double weights[FLESH_CUBIC]);
double flesh_cubic_sum(const double c[FLESH_CUBIC], const double weights[FLESH_CUBIC]);

/* Bounds of the minimum of c/C over a tet in which C is positive: low <= minimum <= high, or both NaN if a coefficient
 * is. The gap is at most `tolerance` times the largest |c/C| of the coefficients, and 0 lies outside it, unless the
 * minimum is 0 to rounding or FLESH_SUBDIVISIONS cuts are not enough. */
typedef struct flesh_least {
  double low, high;
} flesh_least;
flesh_least flesh_cubic_least(const double c[FLESH_CUBIC], const double C[FLESH_CUBIC],
                              double tolerance);

#endif
