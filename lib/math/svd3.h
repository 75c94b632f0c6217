/* svd3.h: the singular value decomposition of a 3x3 matrix with proper rotations. */
#ifndef FLESH_MATH_SVD3_H
#define FLESH_MATH_SVD3_H

/* Computes F = U diag(sigma) V^T, row-major; the columns of U and V are the singular vectors. U and V are proper
 * rotations, sigma[0] >= sigma[1] >= |sigma[2]|, and sigma[2] carries the sign of det F. Accurate to about 1e-15 |F|
 * for every finite F, whatever its rank, scale or orientation. A non-finite F gives NaN in sigma and identity
 * rotations. */
void flesh_svd3(const double F[9], double U[9], double sigma[3], double V[9]);

#endif
