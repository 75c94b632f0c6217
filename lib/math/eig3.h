/* eig3.h: eigenvalues and eigenvectors of a symmetric 3x3 matrix. */
#ifndef FLESH_MATH_EIG3_H
#define FLESH_MATH_EIG3_H

/* Computes A = Q diag(w) Q^T for symmetric A (only its upper triangle is read): w ascending, column k of the row-major
 * Q the unit eigenvector of w[k], det Q = 1. Accurate to about 1e-15 |A| for every finite A; a non-finite A gives NaN
 * in w and Q = I. */
void flesh_eigh3(const double A[9], double w[3], double Q[9]);

#endif
