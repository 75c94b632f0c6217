/* elasticity_kernel.c: energy, force and (projected) Hessian of linear tets, FLESH_LANES at a time.
 *
 * With x_a the tet's nodes and g_a the gradients of its shape functions, F = sum x_a g_a^T. Node a
 * gets volume * P g_a; the pair (a,b) the block K_ab = volume * (dP g_a) in direction e_j g_b^T. */
#include "effect/elasticity_kernel.h"

#include <stddef.h>

#include "material/psi.h"
#include "material/spectrum.h"
#include "math/svd3.h"
#include "math/svd3_core.h"

/* The compiler must see through these to keep a batch in registers. */
#define INLINE static inline __attribute__((always_inline))

/* The compiler must not make variants of this. */
#ifdef __clang__
#define COMPILED_ONCE __attribute__((noinline))
#else
#define COMPILED_ONCE __attribute__((noinline, noclone))
#endif

/* Within these bounds of I_C and J nothing of a built-in energy overflows, nor does the batched
 * logarithm or decomposition leave its domain; beyond, tets are taken one by one. */
#define LARGEST  1e50
#define SMALLEST 1e-50

/* Shapes are asked for this many batches before they are needed. */
#define AHEAD 4

/* A batch at a point. */
typedef struct batch {
  const flesh_material *material;
  const int *node; /* of its first tet */
  int first, used; /* its tets */
  flesh_real g[3][3], volume;
  flesh_real F[9], C[9]; /* C = cof F */
  flesh_real I_C, J;
  flesh_psi_real psi;
} batch;

INLINE void deformation(const double *x, batch *b)
{
  int repeated[4 * FLESH_LANES];
  const int *node = b->node;
  if (b->used < FLESH_LANES) { /* the lanes not used see the last tet */
    for (int l = 0; l < 4 * FLESH_LANES; l++)
      repeated[l] = node[l < 4 * b->used ? l : 4 * b->used - 4 + l % 4];
    node = repeated;
  }
#pragma GCC unroll 3
  for (int i = 0; i < 3; i++) {
#define POSITION(a, l) x[3 * (size_t)node[4 * (l) + (a)] + i]
#define FIRST(l)       POSITION(0, l)
#define SECOND(l)      POSITION(1, l)
#define THIRD(l)       POSITION(2, l)
#define FOURTH(l)      POSITION(3, l)
    flesh_real x0 = FLESH_EACH_LANE(FIRST), d1 = FLESH_EACH_LANE(SECOND) - x0;
    flesh_real d2 = FLESH_EACH_LANE(THIRD) - x0, d3 = FLESH_EACH_LANE(FOURTH) - x0;
#undef FOURTH
#undef THIRD
#undef SECOND
#undef FIRST
#undef POSITION
    for (int j = 0; j < 3; j++)
      b->F[3 * i + j] = d1 * b->g[0][j] + d2 * b->g[1][j] + d3 * b->g[2][j];
  }
}

/* psi where it is a function of the user's own, or where something is out of bounds. */
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

INLINE int load(const flesh_batches *batches, int index, const double *x, int with_value, batch *b)
{
  const flesh_real_at *shape =
      (const flesh_real_at *)(batches->shapes + (size_t)index * 10 * FLESH_LANES);
  if (index + AHEAD < batches->count)
    for (int k = 0; k < 10 * FLESH_LANES; k += 8) /* a line of 64 bytes each */
      __builtin_prefetch(batches->shapes + (size_t)(index + AHEAD) * 10 * FLESH_LANES + k);
  b->material = &batches->materials[batches->material[index]];
  b->first = batches->first[index];
  b->used = batches->first[index + 1] - b->first;
  b->node = batches->nodes + 4 * (size_t)b->first;
  for (int a = 0; a < 3; a++)
    for (int j = 0; j < 3; j++) b->g[a][j] = shape[3 * a + j];
  b->volume = shape[9];
  deformation(x, b);
  flesh_mat3_cofactor(b->F, b->C);
  b->J = flesh_vec3_dot(b->F, b->C);
  b->I_C = flesh_mat3_norm2(b->F);

  flesh_energy energy = b->material->energy;
  flesh_real smallest = flesh_all(flesh_psi_needs_volume(energy) ? SMALLEST : -LARGEST);
  flesh_mask ordinary = (b->I_C < LARGEST) & (b->J < LARGEST) & (b->J > smallest);
  if (flesh_any(ordinary == 0) || b->material->psi != flesh_psi_builtin(energy)) {
    flesh_real I_C = b->I_C, J = b->J;
    flesh_psi_real psi;
    int status = psi_one_by_one(b->material, &I_C, &J, &psi);
    b->psi = psi;
    return status;
  }
  flesh_psi_form(energy, b->material, with_value, b->I_C, b->J, &b->psi);
  return FLESH_OK;
}

/* Adds every lane's forces f [4 nodes][3] to its nodes, x and y together. */
static inline void scatter_forces(const batch *b, flesh_real f[4][3], double *r)
{
  double xy[4][2][FLESH_LANES], z[4][FLESH_LANES];
  for (int a = 0; a < 4; a++) {
    flesh_exchange(1, &f[a][0], &f[a][1]);
    *(flesh_real_at *)xy[a][0] = f[a][0]; /* x and y of the even lanes */
    *(flesh_real_at *)xy[a][1] = f[a][1];
    *(flesh_real_at *)z[a] = f[a][2];
  }
  for (int l = 0; l < b->used; l++)
    for (int a = 0; a < 4; a++) {
      double *place = r + 3 * (size_t)b->node[4 * l + a];
      *(flesh_two_at *)place += *(const flesh_two_at *)(xy[a][l & 1] + (l & ~1));
      place[2] += z[a][l];
    }
}

/* Adds the gradient to r unless that is NULL, and the energy and the size of its terms to sums
 * unless that is NULL. Compiled once for all three, so that products and sums fuse alike and the bits
 * do not depend on what was asked. */
static COMPILED_ONCE int first_order(const flesh_batches *batches, int from, int until,
                                     const double *x, double *r, double *sums)
{
  flesh_real sum = flesh_all(0), size = flesh_all(0);
  for (int k = from; k < until; k++) {
    batch b;
    int status = load(batches, k, x, sums != NULL, &b);
    if (status) return status;
    if (sums) {
      sum += b.volume * b.psi.value;
      /* The value may cancel; the length term, of which psi_I I_C is the size, says how far. */
      size += b.volume * (flesh_abs(b.psi.value) + flesh_abs(b.psi.I) * b.I_C);
    }
    if (!r) continue;
    flesh_real pI = 2 * b.volume * b.psi.I, pJ = b.volume * b.psi.J, f[4][3];
    for (int i = 0; i < 3; i++) {
      flesh_real P[3];
      for (int j = 0; j < 3; j++) P[j] = pI * b.F[3 * i + j] + pJ * b.C[3 * i + j];
      for (int a = 0; a < 3; a++) f[a + 1][i] = flesh_vec3_dot(P, b.g[a]);
      f[0][i] = -(f[1][i] + f[2][i] + f[3][i]);
    }
    scatter_forces(&b, f, r);
  }
  for (int l = 0; sums && l < FLESH_LANES; l++) {
    sums[0] += flesh_lane(sum, l);
    sums[1] += flesh_lane(size, l);
  }
  return FLESH_OK;
}

static int residual(const flesh_batches *batches, int from, int until, const double *x, double *r)
{
  return first_order(batches, from, until, x, r, NULL);
}

static int energy(const flesh_batches *batches, int from, int until, const double *x,
                  double sums[2])
{
  return first_order(batches, from, until, x, NULL, sums);
}

static int evaluate(const flesh_batches *batches, int from, int until, const double *x, double *r,
                    double sums[2])
{
  return first_order(batches, from, until, x, r, sums);
}

/* The exact Hessian: blocks K_11 K_12 K_13 K_22 K_23 K_33. d cof(F) in direction e_j g_b^T,
 * times g_a, is e_j x F(g_a x g_b). */
static inline void true_blocks(const batch *b, flesh_real scale, flesh_real pair[6][9])
{
  flesh_real p[3][3], q[3][3];
  for (int a = 0; a < 3; a++) {
    flesh_mat3_times(b->F, b->g[a], p[a]);
    flesh_mat3_times(b->C, b->g[a], q[a]);
  }
  flesh_real same = 2 * scale * b->psi.I, II = 4 * scale * b->psi.II, IJ = 2 * scale * b->psi.IJ,
             JJ = scale * b->psi.JJ, turn = scale * b->psi.J;
  for (int a = 0, n = 0; a < 3; a++)
    for (int c = a; c < 3; c++, n++) {
      flesh_real *K = pair[n];
      for (int i = 0; i < 3; i++) {
        flesh_real u = II * p[a][i] + IJ * q[a][i], w = IJ * p[a][i] + JJ * q[a][i];
        for (int j = 0; j < 3; j++) K[3 * i + j] = u * p[c][j] + w * q[c][j];
      }
      flesh_real diagonal = same * flesh_vec3_dot(b->g[a], b->g[c]);
      K[0] += diagonal;
      K[4] += diagonal;
      K[8] += diagonal;
      if (a == c) continue;
      flesh_real cross[3], h[3];
      flesh_vec3_cross(b->g[a], b->g[c], cross);
      flesh_mat3_times(b->F, cross, h);
      K[1] += turn * h[2];
      K[2] -= turn * h[1];
      K[3] -= turn * h[2];
      K[5] += turn * h[0];
      K[6] += turn * h[1];
      K[7] -= turn * h[0];
    }
}

/* Singular values of any size. */
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

/* The Hessian with its negative eigenvalues filtered, from the closed-form spectrum. */
static int projected_blocks(const batch *b, flesh_real scale, flesh_filter filter,
                            flesh_real pair[6][9])
{
  flesh_real U[9], sigma[3], V[9], g[3][3];
  flesh_spectrum spectrum;
  if (flesh_any((b->I_C < SMALLEST) | (b->I_C > LARGEST))) decompose_one_by_one(b->F, U, sigma, V);
  else flesh_svd3_core(b->F, U, sigma, V);
  if (flesh_any(flesh_spectrum_make(&b->psi, sigma, &spectrum) == 0)) return FLESH_NONFINITE;
  if (!flesh_any(flesh_spectrum_filter(&spectrum, filter))) {
    true_blocks(b, scale, pair);
    return FLESH_OK;
  }
  for (int a = 0; a < 3; a++) flesh_mat3_transposed_times(V, b->g[a], g[a]);
  for (int a = 0, n = 0; a < 3; a++)
    for (int c = a; c < 3; c++, n++) {
      flesh_real B[9], UB[9];
      flesh_spectrum_block(&spectrum, g[a], g[c], B);
      flesh_mat3_multiply(U, B, UB);
      flesh_mat3_multiply_transposed(UB, U, pair[n]);
      for (int k = 0; k < 9; k++) pair[n][k] *= scale;
    }
  return FLESH_OK;
}

/* Adds every lane's block to its place; slots are 10 apart from tet to tet. */
static inline void add_block(const flesh_real block[9], const int *slot, int used, double *values)
{
  flesh_real by_tet[8 / FLESH_LANES][FLESH_LANES];
  for (int part = 0; part < 8 / FLESH_LANES; part++) {
    for (int c = 0; c < FLESH_LANES; c++) by_tet[part][c] = block[part * FLESH_LANES + c];
    flesh_transpose(by_tet[part]);
  }
  for (int l = 0; l < FLESH_LANES && l < used; l++) {
    double *place = values + 9 * (size_t)slot[10 * l];
    for (int part = 0; part < 8 / FLESH_LANES; part++)
      *(flesh_real_at *)(place + part * FLESH_LANES) += by_tet[part][l];
    place[8] += flesh_lane(block[8], l);
  }
}

/* Adds the six blocks between nodes 1, 2, 3 and, by the zero row sum, the four of node 0. */
static inline void scatter(const flesh_real pair[6][9], const int *slot, int used, double *values)
{
  flesh_real k0[3][9], k00[9];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      int c = 3 * i + j, t = 3 * j + i;
      /* K_0b = -(K_1b + K_2b + K_3b). */
      k0[0][c] = -(pair[0][c] + pair[1][t] + pair[2][t]);
      k0[1][c] = -(pair[1][c] + pair[3][c] + pair[4][t]);
      k0[2][c] = -(pair[2][c] + pair[4][c] + pair[5][c]);
    }
  /* K_00 = -(K_01 + K_02 + K_03), symmetric: the mean of both orders. */
  for (int i = 0; i < 3; i++)
    for (int j = i; j < 3; j++) {
      int c = 3 * i + j, t = 3 * j + i;
      k00[c] = k00[t] =
          -0.5 * ((k0[0][c] + k0[1][c] + k0[2][c]) + (k0[0][t] + k0[1][t] + k0[2][t]));
    }
  add_block(k00, slot, used, values);
  for (int p = 0; p < 3; p++) add_block(k0[p], slot + 1 + p, used, values);
  for (int p = 0; p < 6; p++) add_block(pair[p], slot + 4 + p, used, values);
}

static int jacobian(const flesh_batches *batches, int from, int until, const double *x,
                    double scale, flesh_projected project, const int *slots, double *values)
{
  for (int k = from; k < until; k++) {
    batch b;
    flesh_real pair[6][9];
    int status = load(batches, k, x, 0, &b);
    if (status) return status;
    if (project) {
      status = projected_blocks(
          &b, scale * b.volume,
          project == FLESH_PROJECTED_ABSOLUTE ? FLESH_FILTER_ABSOLUTE : FLESH_FILTER_CLAMP, pair);
      if (status) return status;
    } else {
      true_blocks(&b, scale * b.volume, pair);
    }
    scatter(pair, slots + 10 * (size_t)b.first, b.used, values);
  }
  return FLESH_OK;
}

const flesh_elasticity_kernel FLESH_KERNEL = {
    .name = FLESH_KERNEL_NAME,
    .lanes = FLESH_LANES,
    .residual = residual,
    .jacobian = jacobian,
    .energy = energy,
    .evaluate = evaluate,
};
