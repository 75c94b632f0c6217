/* elasticity_kernel.c: energy, force and (projected) Hessian of linear tets, and the forces of rates against
 * that Hessian, FLESH_LANES tets at a time.
 *
 * The pair (a,b) has the block K_ab = volume * (dP g_a) in direction e_j g_b^T. */
#include "element/tet_lanes.h"
#include "material/psi.h"
#include "material/spectrum.h"
#include "material/stretch_forms.h"
#include "math/svd3.h"
#include "math/svd3_core.h"

/* Within these bounds of I_C and J nothing of a built-in energy overflows, nor does the batched
 * logarithm or decomposition leave its domain; beyond, tets are taken one by one. */
#define LARGEST  1e50
#define SMALLEST 1e-50

/* No status: the batch's form is one of the singular values, and has its psi from decompose(). */
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

/* The stiffening forms side by side. */
static __attribute__((noinline)) void psi_stiffening(const flesh_material *material, int with_value,
                                                     const flesh_real *I_C, const flesh_real *J, flesh_psi_real *psi)
{
  flesh_psi_stiffening_form(material->energy, material, with_value, *I_C, *J, psi);
}

/* psi where load() does not compute it. */
static __attribute__((noinline, cold)) int psi_otherwise(const flesh_material *material, int with_value,
                                                         const flesh_real *I_C, const flesh_real *J,
                                                         flesh_psi_real *psi)
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

INLINE int load(const flesh_batches *batches, int index, const double *x, int with_value, batch *b)
{
  load_tets(batches, index, &b->t);
  b->material = &batches->materials[b->t.material];
  gradient_of(&b->t, x, b->d, b->F);
  flesh_mat3_cofactor(b->F, b->C);
  b->J = flesh_vec3_dot(b->F, b->C);
  b->I_C = flesh_mat3_norm2(b->F);

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

INLINE void find_stretches(const batch *b, flesh_real U[9], flesh_real sigma[3], flesh_real V[9])
{
  if (flesh_any((b->I_C < SMALLEST) | (b->I_C > LARGEST))) decompose_one_by_one(b->F, U, sigma, V);
  else flesh_svd3_core(b->F, U, sigma, V);
}

/* F's singular vectors and the Hessian between them. */
INLINE int decompose(const batch *b, flesh_real U[9], flesh_real V[9], flesh_spectrum *spectrum)
{
  flesh_real sigma[3];
  find_stretches(b, U, sigma, V);
  if (flesh_form_of_stretches(b->material->energy)) {
    flesh_stretch_real psi;
    const flesh_mask finite = flesh_stretch_form(b->material->energy, b->material, sigma, &psi);
    *spectrum = psi.spectrum;
    return flesh_any(finite == 0) ? FLESH_NONFINITE : FLESH_OK;
  }
  return flesh_any(flesh_spectrum_make(&b->psi, sigma, spectrum) == 0) ? FLESH_NONFINITE : FLESH_OK;
}

/* The batch's forces, where its form is one of the singular values, are added to `forces` if not NULL; `sums` are its
 * energy and the size of that, lane by lane. */
static COMPILED_ONCE int add_stretch_forces(const flesh_batches *batches, int index, const double *position,
                                            double *forces, flesh_real sums[2])
{
  batch b;
  flesh_real U[9], sigma[3], V[9], UP[9], P[9], f[4][3];
  flesh_stretch_real psi;
  int status = load(batches, index, position, 0, &b);
  if (status != BY_STRETCHES) return status;
  find_stretches(&b, U, sigma, V);
  if (flesh_any(flesh_stretch_form(b.material->energy, b.material, sigma, &psi) == 0)) return FLESH_NONFINITE;
  sums[0] = b.t.volume * psi.value;
  sums[1] = flesh_all(0);
  for (int k = 0; k < 3; k++) sums[1] += 0.5 * flesh_abs(psi.p[k] * sigma[k]);
  sums[1] = b.t.volume * (flesh_abs(psi.value) + sums[1]);
  if (!forces) return FLESH_OK;
  for (int k = 0; k < 9; k++) UP[k] = U[k] * (b.t.volume * psi.p[k % 3]);
  flesh_mat3_multiply_transposed(UP, V, P);
  for (int i = 0; i < 3; i++) force_row(&b.t, i, P + 3 * i, f);
  scatter_forces(&b.t, f, forces);
  return FLESH_OK;
}

static COMPILED_ONCE int elastic_residual(const flesh_batches *batches, int tile, const flesh_tet_point *at,
                                             double *r, double *sums)
{
  const flesh_tiles *tiles = &batches->tiles;
  flesh_real sum = flesh_all(0), size = flesh_all(0);
  tile_vector x, forces;
  tile_gather(tiles, tile, at->x, x);
  if (r) tile_clear(tiles, tile, forces);
  for (int k = tiles->batch[tile]; k < tiles->batch[tile + 1]; k++) {
    batch b;
    int status = load(batches, k, x, sums != NULL, &b);
    if (status) {
      flesh_real own[2];
      if (status == BY_STRETCHES) status = add_stretch_forces(batches, k, x, r ? forces : NULL, own);
      if (status) return status;
      sum += own[0];
      size += own[1];
      continue;
    }
    if (sums) {
      sum += b.t.volume * b.psi.value;
      /* The value may cancel; the length term, of which psi_I I_C is the size, says how far. */
      size += b.t.volume * (flesh_abs(b.psi.value) + flesh_abs(b.psi.I) * b.I_C);
    }
    if (!r) continue;
    flesh_real pI = 2 * b.t.volume * b.psi.I, pJ = b.t.volume * b.psi.J, f[4][3];
    for (int i = 0; i < 3; i++) {
      flesh_real P[3];
      for (int j = 0; j < 3; j++) P[j] = pI * b.F[3 * i + j] + pJ * b.C[3 * i + j];
      force_row(&b.t, i, P, f);
    }
    scatter_forces(&b.t, f, forces);
  }
  if (r) tile_add(tiles, tile, forces, r);
  add_sums(sum, size, sums);
  return FLESH_OK;
}

/* The exact Hessian of the batch at `index`. With p_a = F g_a and q_a = cof(F) g_a
 *
 *   K_ab = volume * (4 psi_II p_a p_b^T + 2 psi_IJ (p_a q_b^T + q_a p_b^T) + psi_JJ q_a q_b^T
 *                    + 2 psi_I (g_a . g_b) I + psi_J D_ab),
 *
 * where column j of D_ab is (d cof(F) in direction e_j g_b^T) g_a = e_j x F(g_a x g_b). The g_a are the dual basis of
 * the edges at rest: with det = g_1 . (g_2 x g_3), F(g_1 x g_2) = det d_3, cof(F) g_1 = det d_2 x d_3, and so on in
 * turn. Blocks K_aa follow from the others (tile_close). `position` are those of the tile's nodes. */
static COMPILED_ONCE int add_true(const flesh_batches *batches, int index, const flesh_tet_point *at,
                                  const double *position, tile_blocks *to)
{
  /* F(g_a x g_b) for a < b is the edge between the other two nodes, from one to the other. */
  static const unsigned char one[4][4] = {{0, 2, 3, 1}, {0, 0, 0, 2}};
  static const unsigned char other[4][4] = {{0, 3, 1, 2}, {0, 0, 3, 0}, {0, 0, 0, 1}};
  batch b;
  int status = load(batches, index, position, 0, &b);
  if (status) return status;
  flesh_real g[4][3], p[4][3], q[4][3], x[4][3]; /* x: positions from x_0, times det and psi_J */
  for (int a = 1; a < 4; a++) {
    shape_gradient(&b.t, a, g[a]);
    flesh_mat3_times(b.F, g[a], p[a]);
    flesh_vec3_cross(b.d[a % 3], b.d[(a + 1) % 3], q[a]);
  }
  /* By the volume: three nearly parallel gradients hardly know it. */
  flesh_real det = 1 / (6 * b.t.shape[9]), scale = at->scale * b.t.volume, turn = scale * b.psi.J * det;
  flesh_real same = 2 * scale * b.psi.I, II = 4 * scale * b.psi.II, IJ = 2 * scale * b.psi.IJ, JJ = scale * b.psi.JJ;
  for (int i = 0; i < 3; i++) {
    for (int a = 1; a < 4; a++) {
      q[a][i] *= det;
      x[a][i] = turn * b.d[a - 1][i];
    }
    g[0][i] = -(g[1][i] + g[2][i] + g[3][i]);
    p[0][i] = -(p[1][i] + p[2][i] + p[3][i]);
    q[0][i] = -(q[1][i] + q[2][i] + q[3][i]);
    x[0][i] = flesh_all(0);
  }
  const int mixed = flesh_any(IJ != 0); /* not in most forms */
#pragma GCC unroll 3
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
#pragma GCC unroll 3
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
      add_block(&b.t, K, n, to);
    }
  }
  return FLESH_OK;
}

/* The Hessian with its negative eigenvalues filtered, if they are to be, from the closed-form spectrum. */
static COMPILED_ONCE int add_projected(const flesh_batches *batches, int index, const flesh_tet_point *at,
                                       const double *position, tile_blocks *to)
{
  const flesh_eigenvalue_filter filter =
      at->filter == FLESH_FILTER_ABSOLUTE ? FLESH_FILTER_ABSOLUTE : FLESH_FILTER_CLAMP;
  batch b;
  flesh_real U[9], V[9], g[4][3];
  flesh_spectrum spectrum;
  int status = load(batches, index, position, 0, &b);
  const int by_stretches = status == BY_STRETCHES;
  if (!status || by_stretches) status = decompose(&b, U, V, &spectrum);
  if (status) return status;
  if (at->filter && !flesh_any(flesh_spectrum_filter(&spectrum, filter)) && !by_stretches)
    return add_true(batches, index, at, position, to);
  for (int a = 1; a < 4; a++) {
    flesh_real gradient[3];
    shape_gradient(&b.t, a, gradient);
    flesh_mat3_transposed_times(V, gradient, g[a]);
  }
  for (int i = 0; i < 3; i++) g[0][i] = -(g[1][i] + g[2][i] + g[3][i]);
  flesh_spectrum_scale(&spectrum, at->scale * b.t.volume);
#pragma GCC unroll 3
  for (int a = 0, n = 0; a < 3; a++)
#pragma GCC unroll 3
    for (int c = a + 1; c < 4; c++, n++) {
      flesh_real B[9], UB[9], K[9];
      flesh_spectrum_block(&spectrum, g[a], g[c], B);
      flesh_mat3_multiply(U, B, UB);
      flesh_mat3_multiply_transposed(UB, U, K);
      add_block(&b.t, K, n, to);
    }
  return FLESH_OK;
}

static int elastic_hessian(const flesh_batches *batches, int tile, const flesh_tet_point *at, const int *slots,
                                double *values)
{
  const flesh_tiles *tiles = &batches->tiles;
  tile_vector x;
  tile_blocks own;
  tile_gather(tiles, tile, at->x, x);
  tile_open(tiles, tile, &own);
  for (int k = tiles->batch[tile]; k < tiles->batch[tile + 1]; k++) {
    int status = (at->filter ? add_projected : add_true)(batches, k, at, x, &own);
    if (status == BY_STRETCHES) status = add_projected(batches, k, at, x, &own);
    if (status) return status;
    tile_expect(tiles, tile, k, slots, values);
  }
  tile_close(tiles, tile, &own, at->anew, slots, values);
  return FLESH_OK;
}

/* P' = d2 psi : F', with negative eigenvalues clamped. */
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

static COMPILED_ONCE int stiffness_residual(const flesh_batches *batches, int tile, const flesh_tet_point *at,
                                               double *r, double *sums)
{
  const flesh_tiles *tiles = &batches->tiles;
  flesh_real sum = flesh_all(0);
  tile_vector x, v, forces;
  tile_gather(tiles, tile, at->x, x);
  tile_gather(tiles, tile, at->v, v);
  if (r) tile_clear(tiles, tile, forces);
  for (int k = tiles->batch[tile]; k < tiles->batch[tile + 1]; k++) {
    batch b;
    flesh_real edges[3][3], rate[9], P[9], f[4][3];
    int status = load(batches, k, x, 0, &b);
    if (status && status != BY_STRETCHES) return status;
    gradient_of(&b.t, v, edges, rate);
    status = stress_rate(&b, rate, P);
    if (status) return status;
    for (int c = 0; c < 9; c++) P[c] *= at->scale * b.t.volume;
    if (sums) sum += 0.5 * flesh_mat3_inner(rate, P);
    if (!r) continue;
    for (int i = 0; i < 3; i++) force_row(&b.t, i, P + 3 * i, f);
    scatter_forces(&b.t, f, forces);
  }
  if (r) tile_add(tiles, tile, forces, r);
  add_sums(sum, sum, sums);
  return FLESH_OK;
}

const flesh_tet_kernel FLESH_OF_ISA(flesh_elastic) = {elastic_residual, elastic_hessian};
const flesh_tet_kernel FLESH_OF_ISA(flesh_stiffness) = {stiffness_residual, elastic_hessian};
