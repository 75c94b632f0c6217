/* elasticity_kernel.c: energy, force and (projected) Hessian of linear tets, and the forces of rates against
 * that Hessian, FLESH_LANES tets at a time. */
#include "element/elastic_batch.h"

INLINE int load(const flesh_batches *batches, int index, const double *x, int with_value, batch *b)
{
  load_tets(batches, index, &b->t);
  gradient_of(&b->t, x, b->d, b->F);
  find_invariants(b);
  return find_psi(batches, with_value, b);
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

INLINE void add_to_tile(const tets *t, const flesh_real block[9], int pair, void *to) { add_block(t, block, pair, to); }

/* The exact Hessian of the batch at `index`; `position` are those of the tile's nodes. */
static COMPILED_ONCE int add_true(const flesh_batches *batches, int index, const flesh_tet_point *at,
                                  const double *position, tile_blocks *to)
{
  batch b;
  int status = load(batches, index, position, 0, &b);
  if (status) return status;
  true_blocks(&b, at->scale, add_to_tile, to);
  return FLESH_OK;
}

/* The Hessian with its negative eigenvalues filtered, if they are to be, from the closed-form spectrum. */
static COMPILED_ONCE int add_projected(const flesh_batches *batches, int index, const flesh_tet_point *at,
                                       const double *position, tile_blocks *to)
{
  const flesh_eigenvalue_filter filter =
      at->filter == FLESH_FILTER_ABSOLUTE ? FLESH_FILTER_ABSOLUTE : FLESH_FILTER_CLAMP;
  batch b;
  flesh_real U[9], V[9];
  flesh_spectrum spectrum;
  int status = load(batches, index, position, 0, &b);
  const int by_stretches = status == BY_STRETCHES;
  if (!status || by_stretches) status = decompose(&b, U, V, &spectrum);
  if (status) return status;
  if (at->filter && !flesh_any(flesh_spectrum_filter(&spectrum, filter)) && !by_stretches)
    return add_true(batches, index, at, position, to);
  spectral_blocks(&b, U, V, &spectrum, at->scale, add_to_tile, to);
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
  tile_close(tiles, tile, &own, at->assign, slots, values);
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

const flesh_tet_kernel FLESH_OF_ISA(flesh_elastic) = {elastic_residual, elastic_hessian, NULL};
const flesh_tet_kernel FLESH_OF_ISA(flesh_stiffness) = {stiffness_residual, elastic_hessian, NULL};
