/* eig_small.h: eigenvalues and eigenvectors of small symmetric matrices, by Jacobi's cyclic rotations. */
#ifndef FLESH_MATH_EIG_SMALL_H
#define FLESH_MATH_EIG_SMALL_H

enum { FLESH_EIGH_LARGEST = 12 };

/* Computes A = Q diag(w) Q^T for symmetric A [n*n], n <= FLESH_EIGH_LARGEST, which is overwritten: column k of the
 * row-major Q [n*n] is the unit eigenvector of w[k], in no order. Errors are about 1e-15 |A|; a non-finite A gives some
 * non-finite w. (Golub & Van Loan, "Matrix Computations", section 8.5.) */
void flesh_eigh_small(int n, double *A, double *w, double *Q);

#endif
