/* elasticity_kernel.c: energy, force and (projected) Hessian of linear tets, and the forces of rates against that
 * Hessian, FLESH_LANES tets at a time. */
#include "element/elastic_batch.h"

INLINE int load(const flesh_batches *batches, int index, const flesh_tet_point *at, const double *x, int with_value,
                batch *b)
{
  load_tets(batches, index, &b->t);
  gradient_of(&b->t, x, b->d, b->F);
  find_invariants(b);
  const int status = find_psi(batches, with_value, b);
  if (status == BY_STRETCHES) b->psi = (flesh_psi_real){0};
  if (at->excess) b->psi.JJ -= at->excess[b->t.material];
  return status;
}

/* Adds the batch's forces to `forces` unless NULL, for a form of the singular values; `sums` becomes its energy and the
 * size of its terms, lane by lane. */
static COMPILED_ONCE int add_stretch_forces(const flesh_batches *batches, int index, const flesh_tet_point *at,
                                            const double *position, double *forces, flesh_real sums[2])
{
  batch b;
  flesh_real U[9], sigma[3], V[9], UP[9], P[9], f[4][3];
  flesh_stretch_real psi;
  int status = load(batches, index, at, position, 0, &b);
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

INLINE int add_residual(const flesh_batches *batches, int index, const flesh_tet_point *at, const nearby *near,
                        double *forces, int with_sums, flesh_real sums[2])
{
  batch b;
  int status = load(batches, index, at, near->x, with_sums, &b);
  if (status == BY_STRETCHES) {
    flesh_real own[2];
    status = add_stretch_forces(batches, index, at, near->x, forces, own);
    for (int k = 0; k < 2 && with_sums && !status; k++) sums[k] += own[k];
    return status;
  }
  if (status) return status;
  if (with_sums) {
    sums[0] += b.t.volume * b.psi.value;
    /* The terms of the value may cancel; the length term, of size psi_I I_C, tells by how much. */
    sums[1] += b.t.volume * (flesh_abs(b.psi.value) + flesh_abs(b.psi.I) * b.I_C);
  }
  if (!forces) return FLESH_OK;
  flesh_real pI = 2 * b.t.volume * b.psi.I, pJ = b.t.volume * b.psi.J, f[4][3];
  for (int i = 0; i < 3; i++) {
    flesh_real P[3];
    for (int j = 0; j < 3; j++) P[j] = pI * b.F[3 * i + j] + pJ * b.C[3 * i + j];
    force_row(&b.t, i, P, f);
  }
  scatter_forces(&b.t, f, forces);
  return FLESH_OK;
}

/* Adds the exact Hessian of the batch at `index`. */
static COMPILED_ONCE int add_true(const flesh_batches *batches, int index, const flesh_tet_point *at,
                                  const nearby *near, tile_blocks *to)
{
  batch b;
  int status = load(batches, index, at, near->x, 0, &b);
  if (status) return status;
  true_blocks(&b, at->scale, add_block, to);
  return FLESH_OK;
}

/* Adds the Hessian from the closed-form spectrum, with its negative eigenvalues filtered if `at` says so. */
static COMPILED_ONCE int add_projected(const flesh_batches *batches, int index, const flesh_tet_point *at,
                                       const nearby *near, tile_blocks *to)
{
  const flesh_eigenvalue_filter filter =
      at->filter == FLESH_FILTER_ABSOLUTE ? FLESH_FILTER_ABSOLUTE : FLESH_FILTER_CLAMP;
  batch b;
  flesh_real U[9], V[9];
  flesh_spectrum spectrum;
  int status = load(batches, index, at, near->x, 0, &b);
  const int by_stretches = status == BY_STRETCHES;
  if (!status || by_stretches) status = decompose(&b, U, V, &spectrum);
  if (status) return status;
  if (at->filter && !flesh_any(flesh_spectrum_filter(&spectrum, filter)) && !by_stretches)
    return add_true(batches, index, at, near, to);
  spectral_blocks(&b, U, V, &spectrum, at->scale, add_block, to);
  return FLESH_OK;
}

INLINE int add_hessian(const flesh_batches *batches, int index, const flesh_tet_point *at, const nearby *near,
                       tile_blocks *to)
{
  int status = (at->filter ? add_projected : add_true)(batches, index, at, near, to);
  return status == BY_STRETCHES ? add_projected(batches, index, at, near, to) : status;
}

INLINE int add_stiffness(const flesh_batches *batches, int index, const flesh_tet_point *at, const nearby *near,
                         double *forces, int with_sums, flesh_real sums[2])
{
  batch b;
  flesh_real edges[3][3], rate[9], P[9], f[4][3];
  int status = load(batches, index, at, near->x, 0, &b);
  if (status && status != BY_STRETCHES) return status;
  gradient_of(&b.t, near->v, edges, rate);
  status = stress_rate(&b, rate, P);
  if (status) return status;
  for (int c = 0; c < 9; c++) P[c] *= at->scale * b.t.volume;
  if (with_sums) sums[0] += 0.5 * flesh_mat3_inner(rate, P), sums[1] = sums[0];
  if (!forces) return FLESH_OK;
  for (int i = 0; i < 3; i++) force_row(&b.t, i, P + 3 * i, f);
  scatter_forces(&b.t, f, forces);
  return FLESH_OK;
}

RESIDUAL_KERNEL(elastic_residual, add_residual)
HESSIAN_KERNEL(elastic_hessian, add_hessian)
RESIDUAL_KERNEL(stiffness_residual, add_stiffness)

const flesh_tet_kernel FLESH_OF_ISA(flesh_elastic) = {elastic_residual, elastic_hessian, NULL};
const flesh_tet_kernel FLESH_OF_ISA(flesh_stiffness) = {stiffness_residual, elastic_hessian, NULL};
