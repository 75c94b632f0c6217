/* slip.h: the law of friction as a function of the slip's speed y, as a fraction of the largest friction: f(y) = 2 y/e
 * - (y/e)^2 below the slip speed e, 1 above.
 *
 * Its stiffness is f/y across the slip and f' along it, which is 0 above e. If a point slips in the iterate but sticks
 * in the solution, Newton's iteration therefore moves it to where it slips backwards, as fast as all other forces push
 * it, and a line search cuts the step of the whole body because of this one point. So the force is an unknown of its own,
 * F = f d with |d| <= 1, and Newton's method solves y F = f u (Chan, Golub & Mulet 1999, SIAM Journal on Scientific
 * Computing 20, for images). Made symmetric, the stiffness is then f/y + (f' - f/y) (u d^T + d u^T)/(2 y), which is
 * positive semi-definite. d is what the last matrix predicted, cut to 1: u/y where it predicted right, which gives the
 * tangent. For the first matrix of a solve it is 0: the secant to rest, with which no step goes beyond rest. */
#ifndef FLESH_GEOMETRY_SLIP_H
#define FLESH_GEOMETRY_SLIP_H

/* Returns the integral of f from rest. */
static inline double flesh_slip_potential(double y, double e)
{
  return y < e ? y * y / e * (1 - y / (3 * e)) : y - e / 3;
}

/* Returns f/y. */
static inline double flesh_slip_ratio(double y, double e) { return y < e ? (2 - y / e) / e : 1 / y; }

/* Returns f' - f/y <= 0: the stiffness along the slip minus its secant to rest. */
static inline double flesh_slip_fall(double y, double e) { return y < e ? -y / (e * e) : -1 / y; }

/* Expected friction of a point, for the matrices of a solve. Initialise with {0}. */
typedef struct flesh_slip_expected {
  double u[3], d[3]; /* slip at the last matrix, m/s, and d there */
  int matrix;        /* number of the last matrix; 0: none */
} flesh_slip_expected;

/* Computes the stiffness [9] in s/m, row-major, at the slip u [3] in m/s, which is orthogonal to `normal` (NULL: normals
 * do not change), for the matrix of this number. Numbers grow by one within a solve, by more between solves. The first call
 * for a number predicts d; at another u, and if `self` is NULL or the number 0, the stiffness is the tangent. */
void flesh_slip_stiffness(flesh_slip_expected *self, int matrix, const double u[3], const double *normal, double e,
                          double stiffness[9]);

#endif
