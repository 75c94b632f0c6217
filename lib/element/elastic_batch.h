/* elastic_batch.h: operations of elasticity kernels on a batch of tets at a point: psi, the blocks of the exact and of
 * the filtered Hessian, and the stress of a rate. They are written for four-node tets; an element with more nodes
 * passes virtual corners (tet10_lanes.h).
 *
 * The pair (a,b) has the block K_ab = volume * (dP g_a) in direction e_j g_b^T. */
#ifndef FLESH_ELEMENT_ELASTIC_BATCH_H
#define FLESH_ELEMENT_ELASTIC_BATCH_H

#include "element/tet_lanes.h"
#include "material/psi.h"
#include "material/spectrum.h"
#include "material/stretch_forms.h"
#include "math/svd3.h"
#include "math/svd3_core.h"

/* Bounds of I_C and J within which no built-in energy overflows and the batched logarithm and decomposition stay in
 * their domain; other tets are computed one by one. */
#define LARGEST  1e50
#define SMALLEST 1e-50

/* Not a status: the batch's form depends on the singular values, and decompose() computes its psi. */
enum { BY_STRETCHES = 1000 };

/* A batch at a point. */
typedef struct batch {
  tets t;
  const flesh_material *material;
  flesh_real d[3][3];    /* x_a - x_0 */
  flesh_real F[9], C[9]; /* C = cof F */
  flesh_real I_C, J;
  flesh_psi_real psi;
} batch;

/* Computes psi lane by lane, for a user's own function or values out of bounds. */
static __attribute__((noinline, cold)) int psi_one_by_one(const flesh_material *material,
                                                          const flesh_real *I_C,
                                                          const flesh_real *J, flesh_psi_real *psi)
{
  for (int l = 0; l < FLESH_LANES; l++) {
    flesh_psi one;
    double length = flesh_lane(*I_C, l);
    int status = material->psi(length, flesh_lane(*J, l), material, &one);
    /* An overflow would spread silently, or be taken for J <= 0. */
    if (status == FLESH_UNDEFINED && !(length < INFINITY)) return FLESH_NONFINITE;
    if (status) return status;
    if (0 * one.value + 0 * one.I + 0 * one.J + 0 * one.II + 0 * one.IJ + 0 * one.JJ + 0 * length !=
        0)
      return FLESH_NONFINITE;
    flesh_set_lane(&psi->value, l, one.value);
    flesh_set_lane(&psi->I, l, one.I);
    flesh_set_lane(&psi->J, l, one.J);
    flesh_set_lane(&psi->II, l, one.II);
    flesh_set_lane(&psi->IJ, l, one.IJ);
    flesh_set_lane(&psi->JJ, l, one.JJ);
  }
  return FLESH_OK;
}

/* Computes the stiffening forms side by side. */
static __attribute__((noinline)) void psi_stiffening(const flesh_material *material, int with_value,
                                                     const flesh_real *I_C, const flesh_real *J, flesh_psi_real *psi)
{
  flesh_psi_stiffening_form(material->energy, material, with_value, *I_C, *J, psi);
}

/* Computes psi in the cases that find_psi() does not handle. */
static __attribute__((noinline)) int psi_otherwise(const flesh_material *material, int with_value,
                                                   const flesh_real *I_C, const flesh_real *J, flesh_psi_real *psi)
{
  if (flesh_form_of_stretches(material->energy))
    return flesh_any((*I_C < INFINITY) == 0) ? FLESH_NONFINITE : BY_STRETCHES;
  const double largest = fmin(LARGEST, flesh_psi_largest(material));
  if (!flesh_form_stiffens(material->energy) || material->psi != flesh_psi_builtin(material->energy) ||
      flesh_any(((*I_C < largest) & (flesh_abs(*J) < LARGEST)) == 0))
    return psi_one_by_one(material, I_C, J, psi);
  psi_stiffening(material, with_value, I_C, J, psi);
  return FLESH_OK;
}

/* Computes J, I_C and the cofactor of F: the arguments of psi and their derivatives. */
INLINE void find_invariants(batch *b)
{
  flesh_mat3_cofactor(b->F, b->C);
  b->J = flesh_vec3_dot(b->F, b->C);
  b->I_C = flesh_mat3_norm2(b->F);
}

INLINE int find_psi(const flesh_batches *batches, int with_value, batch *b)
{
  b->material = &batches->materials[b->t.material];
  flesh_energy energy = b->material->energy;
  flesh_real smallest = flesh_all(flesh_psi_needs_volume(energy) ? SMALLEST : -LARGEST);
  flesh_mask ordinary = (b->I_C < LARGEST) & (b->J < LARGEST) & (b->J > smallest);
  if (flesh_any(ordinary == 0) || b->material->psi != flesh_psi_batched(energy)) {
    flesh_real I_C = b->I_C, J = b->J;
    flesh_psi_real psi;
    int status = psi_otherwise(b->material, with_value, &I_C, &J, &psi);
    b->psi = psi;
    return status;
  }
  flesh_psi_form(energy, b->material, with_value, b->I_C, b->J, &b->psi);
  return FLESH_OK;
}

/* Computes the blocks of the exact Hessian times `factor`. With p_a = F g_a and q_a = cof(F) g_a
 *
 *   K_ab = volume * (4 psi_II p_a p_b^T + 2 psi_IJ (p_a q_b^T + q_a p_b^T) + psi_JJ q_a q_b^T
 *                    + 2 psi_I (g_a . g_b) I + psi_J D_ab),
 *
 * where column j of D_ab is (d cof(F) in direction e_j g_b^T) g_a = e_j x F(g_a x g_b). The g_a are the dual basis of
 * the edges at rest: with det = g_1 . (g_2 x g_3), F(g_1 x g_2) = det d_3 and cof(F) g_1 = det d_2 x d_3, also with the
 * indices permuted cyclically. Blocks K_aa follow from the others (tile_close). */
INLINE void true_blocks(const batch *b, double factor, take_block *take, void *to)
{
  /* F(g_a x g_b) for a < b is, up to det, the edge between the other two nodes, from `one` to `other`. */
  static const unsigned char one[4][4] = {{0, 2, 3, 1}, {0, 0, 0, 2}};
  static const unsigned char other[4][4] = {{0, 3, 1, 2}, {0, 0, 3, 0}, {0, 0, 0, 1}};
  flesh_real g[4][3], p[4][3], q[4][3], x[4][3]; /* x: positions from x_0, times det and psi_J */
  for (int a = 1; a < 4; a++) {
    shape_gradient(&b->t, a, g[a]);
    flesh_mat3_times(b->F, g[a], p[a]);
    flesh_vec3_cross(b->d[a % 3], b->d[(a + 1) % 3], q[a]);
  }
  /* det comes from the volume, as three nearly parallel gradients would make it inaccurate. */
  flesh_real det = 1 / (6 * b->t.shape[9]), scale = factor * b->t.volume, turn = scale * b->psi.J * det;
  flesh_real same = 2 * scale * b->psi.I, II = 4 * scale * b->psi.II, IJ = 2 * scale * b->psi.IJ, JJ = scale * b->psi.JJ;
  for (int i = 0; i < 3; i++) {
    for (int a = 1; a < 4; a++) {
      q[a][i] *= det;
      x[a][i] = turn * b->d[a - 1][i];
    }
    g[0][i] = -(g[1][i] + g[2][i] + g[3][i]);
    p[0][i] = -(p[1][i] + p[2][i] + p[3][i]);
    q[0][i] = -(q[1][i] + q[2][i] + q[3][i]);
    x[0][i] = flesh_all(0);
  }
  const int mixed = flesh_any(IJ != 0); /* 0 in most forms */
  FLESH_UNROLL(3)
  for (int a = 0, n = 0; a < 3; a++) {
    flesh_real u[3], w[3];
    for (int i = 0; i < 3; i++) {
      u[i] = II * p[a][i];
      w[i] = JJ * q[a][i];
    }
    for (int i = 0; i < 3 && mixed; i++) {
      u[i] += IJ * q[a][i];
      w[i] += IJ * p[a][i];
    }
    FLESH_UNROLL(3)
    for (int c = a + 1; c < 4; c++, n++) {
      flesh_real K[9], diagonal = same * flesh_vec3_dot(g[a], g[c]);
      for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) K[3 * i + j] = u[i] * p[c][j] + w[i] * q[c][j];
        K[4 * i] += diagonal;
      }
      for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        flesh_real turned = x[other[a][c]][k] - x[one[a][c]][k];
        K[3 * i + j] += turned;
        K[3 * j + i] -= turned;
      }
      take(&b->t, K, n, to);
    }
  }
}

/* Decomposes lane by lane, for singular values of any size. */
static __attribute__((noinline, cold)) void
decompose_one_by_one(const flesh_real F[9], flesh_real U[9], flesh_real sigma[3], flesh_real V[9])
{
  for (int l = 0; l < FLESH_LANES; l++) {
    double f[9], u[9], s[3], v[9];
    for (int k = 0; k < 9; k++) f[k] = flesh_lane(F[k], l);
    flesh_svd3(f, u, s, v);
    for (int k = 0; k < 9; k++) flesh_set_lane(&U[k], l, u[k]), flesh_set_lane(&V[k], l, v[k]);
    for (int k = 0; k < 3; k++) flesh_set_lane(&sigma[k], l, s[k]);
  }
}

INLINE void find_stretches(const batch *b, flesh_real U[9], flesh_real sigma[3], flesh_real V[9])
{
  if (flesh_any((b->I_C < SMALLEST) | (b->I_C > LARGEST))) decompose_one_by_one(b->F, U, sigma, V);
  else flesh_svd3_core(b->F, U, sigma, V);
}

/* Computes F's singular vectors and the Hessian in their frame. */
INLINE int decompose(const batch *b, flesh_real U[9], flesh_real V[9], flesh_spectrum *spectrum)
{
  flesh_real sigma[3];
  find_stretches(b, U, sigma, V);
  if (flesh_form_of_stretches(b->material->energy)) {
    flesh_stretch_real psi;
    const flesh_mask finite = flesh_stretch_form(b->material->energy, b->material, sigma, &psi);
    *spectrum = psi.spectrum;
    /* b->psi has only the terms of the mean of J: its share, its pressure, and the part taken off */
    flesh_spectrum of_mean;
    flesh_spectrum_make(&b->psi, sigma, &of_mean);
    for (int k = 0; k < 9; k++) spectrum->A[k] += of_mean.A[k];
    for (int k = 0; k < 3; k++) spectrum->twist[k] += of_mean.twist[k], spectrum->flip[k] += of_mean.flip[k];
    return flesh_any(finite == 0) ? FLESH_NONFINITE : FLESH_OK;
  }
  return flesh_any(flesh_spectrum_make(&b->psi, sigma, spectrum) == 0) ? FLESH_NONFINITE : FLESH_OK;
}

/* Computes the blocks of the Hessian with this spectrum in the frame of these singular vectors, times `factor`. */
INLINE void spectral_blocks(const batch *b, const flesh_real U[9], const flesh_real V[9], flesh_spectrum *spectrum,
                            double factor, take_block *take, void *to)
{
  flesh_real g[4][3];
  for (int a = 1; a < 4; a++) {
    flesh_real gradient[3];
    shape_gradient(&b->t, a, gradient);
    flesh_mat3_transposed_times(V, gradient, g[a]);
  }
  for (int i = 0; i < 3; i++) g[0][i] = -(g[1][i] + g[2][i] + g[3][i]);
  flesh_spectrum_scale(spectrum, factor * b->t.volume);
  FLESH_UNROLL(3)
  for (int a = 0, n = 0; a < 3; a++)
    FLESH_UNROLL(3)
    for (int c = a + 1; c < 4; c++, n++) {
      flesh_real B[9], UB[9], K[9];
      flesh_spectrum_block(spectrum, g[a], g[c], B);
      flesh_mat3_multiply(U, B, UB);
      flesh_mat3_multiply_transposed(UB, U, K);
      take(&b->t, K, n, to);
    }
}

/* Computes P' = d2 psi : F', with negative eigenvalues clamped. */
INLINE int stress_rate(const batch *b, const flesh_real rate[9], flesh_real P[9])
{
  flesh_real U[9], V[9], A[9], B[9];
  flesh_spectrum spectrum;
  int status = decompose(b, U, V, &spectrum);
  if (status) return status;
  flesh_spectrum_filter(&spectrum, FLESH_FILTER_CLAMP);
  flesh_mat3_transposed_multiply(U, rate, A);
  flesh_mat3_multiply(A, V, B);
  flesh_spectrum_multiply(&spectrum, B, A);
  flesh_mat3_multiply(U, A, B);
  flesh_mat3_multiply_transposed(B, V, P);
  return FLESH_OK;
}

#endif
