/* elasticity10_kernel.c: energy, force and (projected) Hessian of ten-node tets, and the forces of rates against that
 * Hessian, FLESH_LANES tets at a time; each point by itself, or with a share of the volume term that depends on the
 * mean of J.
 *
 * With the mean J' of J over the tet of volume V, the share S of the volume term (flesh_volume_share) and the volumes w
 * of the points, the energy is
 *
 *   sum of w (psi - S(J)) + V S(J'),
 *
 * so that forces are those of psi with psi_J - S_J(J) + S_J(J') in place of psi_J. The Hessian has psi_JJ - S_JJ in
 * place of psi_JJ, which leaves a stiffness of the order of the shear modulus, and in addition V S_JJ(J') b b^T, where
 * b is the gradient of J'. Mean dilatation: Nagtegaal, Parks & Rice 1974; a part of the term stays with the points and
 * keeps their bulk modulus positive.
 *
 * Where the mean is held at 1, V k S(J') is a penalty with a factor k, and V p (J' - 1) with the tet's multiplier p is
 * added: forces have k S_J(J') + p in place of S_J(J'), and the Hessian k S_JJ in place of S_JJ. */
#include "element/tet10_blocks.h"
#include "element/elastic_batch.h"
#include "math/logarithm.h"

/* A batch at all points. */
typedef struct points {
  batch at[POINTS];
  flesh_real volume; /* of the tets */
  flesh_real J;      /* mean of J over each tet */
  flesh_real share[3]; /* the share at the means and its derivatives, if there is one */
  flesh_real multiplier; /* if the mean is held at 1 */
  double penalty, excess;
} points;

static COMPILED_ONCE void load(const flesh_batches *batches, int index, const double *x, points *p)
{
  ten all;
  flesh_real sum = flesh_all(0), volume = flesh_all(0);
  for (int q = 0; q < POINTS; q++) {
    batch *b = &p->at[q];
    if (q) b->t = p->at[0].t;
    load_point(batches, index, q, &b->t);
    if (q == 0) load_ten(&b->t, x, &all);
    gradient_at(&b->t, &all, q, b->d, b->F);
    find_invariants(b);
    volume += b->t.volume;
    sum += b->t.volume * b->J;
  }
  p->volume = volume;
  p->J = sum / flesh_select(volume > 0, volume, flesh_all(1)); /* unused lanes */
  p->J = flesh_select(volume > 0, p->J, p->at[0].J);
}

/* Loads the excess, the multipliers of means that are held, and their penalty. */
static COMPILED_ONCE void load_options(const flesh_batches *batches, int index, const flesh_tet_point *at, points *p)
{
  const int first = batches->first[index], used = batches->first[index + 1] - first;
  p->multiplier = flesh_all(0);
  p->penalty = 1;
  p->excess = at->excess ? at->excess[p->at[0].t.material] : 0;
  if (!batches->tet || !batches->volume_shares[p->at[0].t.material].held) return;
  if (at->penalty > 0) p->penalty = at->penalty;
  for (int l = 0; l < used && at->multipliers; l++)
    flesh_set_lane(&p->multiplier, l, at->multipliers[batches->tet[first + l]]);
}

/* Computes U and its derivatives lane by lane, for a user's own function: 0 where U has no value, and the status
 * then is not FLESH_OK. */
static __attribute__((noinline, cold)) int volume_term_one_by_one(const flesh_material *material, const flesh_real *J,
                                                                  flesh_real of[3])
{
  int worst = FLESH_OK;
  for (int l = 0; l < FLESH_LANES; l++) {
    flesh_volume_part one = {0};
    int status = material->volume(flesh_lane(*J, l), material, &one);
    if (!status && 0 * one.value + 0 * one.J + 0 * one.JJ != 0) status = FLESH_NONFINITE;
    if (status) one = (flesh_volume_part){0}, worst = status;
    flesh_set_lane(&of[0], l, one.value);
    flesh_set_lane(&of[1], l, one.J);
    flesh_set_lane(&of[2], l, one.JJ);
  }
  return worst;
}

/* Computes the share at J and its derivatives; `local` is that of a point or of the mean. */
INLINE int volume_share(const flesh_volume_share *s, const flesh_material *material, flesh_real J, double local,
                        flesh_real of[3])
{
  const flesh_real x = J - 1, t = x * x * (1 / (FLESH_LOCAL_RANGE * FLESH_LOCAL_RANGE)), q = 1 / (1 + t);
  int status = FLESH_OK;
  of[0] = 0.5 * x * x;
  of[1] = x;
  of[2] = flesh_all(1);
  if (s->term == FLESH_VOLUME_USER) {
    flesh_real at = J;
    status = volume_term_one_by_one(material, &at, of);
  } else if (s->term == FLESH_VOLUME_LOGARITHMIC) {
    flesh_real inverse = 1 / J, log_J = flesh_log(J);
    of[0] = 0.5 * log_J * log_J;
    of[1] = log_J * inverse;
    of[2] = (1 - log_J) * inverse * inverse;
  }
  of[0] = s->share * of[0] - local * 0.5 * x * x * t * q;
  of[1] = s->share * of[1] - local * x * (1 - q * q);
  of[2] = s->share * of[2] - local * (1 - (1 - 3 * t) * q * q * q);
  return status;
}

static COMPILED_ONCE int find_share_of_mean(const flesh_batches *batches, points *p)
{
  const int material = p->at[0].t.material; /* the same at all points */
  const flesh_volume_share *s = &batches->volume_shares[material];
  return volume_share(s, &batches->materials[material], p->J, flesh_local_of_mean(s), p->share);
}

/* Computes psi at every point, without the share of the mean and with the mean's pressure; for a form of the singular
 * values, only these two terms. */
static COMPILED_ONCE int find_psi_of_points(const flesh_batches *batches, int with_value, points *p)
{
  const int mean_status = batches->volume_shares ? find_share_of_mean(batches, p) : FLESH_OK;
  for (int q = 0; q < POINTS; q++) {
    batch *b = &p->at[q];
    int status = find_psi(batches, with_value, b);
    if (status == BY_STRETCHES) b->psi = (flesh_psi_real){0};
    else if (status) return status;
    const flesh_volume_share *s = batches->volume_shares ? &batches->volume_shares[b->t.material] : NULL;
    if (!s || s->term == FLESH_VOLUME_NONE) b->psi.JJ -= p->excess;
    if (!s) continue;
    flesh_real own[3];
    status = volume_share(s, b->material, b->J, s->local, own);
    if (status || mean_status) return status ? status : mean_status;
    b->psi.value -= own[0];
    if (s->held) b->psi.J += p->penalty * p->share[1] + p->multiplier - own[1];
    else b->psi.J += p->share[1] - own[1];
    b->psi.JJ -= own[2];
  }
  return FLESH_OK;
}

/* Computes V S(J') and V S_JJ(J'), with the multiplier's term if the mean is held; called after find_share_of_mean. */
INLINE void mean_term(const flesh_batches *batches, const points *p, flesh_real *energy, flesh_real *stiffness)
{
  const flesh_volume_share *s = &batches->volume_shares[p->at[0].t.material];
  *energy = p->volume * p->share[0];
  *stiffness = p->volume * (p->share[2] - p->excess);
  if (!s->held) return;
  *energy = p->penalty * *energy + p->multiplier * p->volume * (p->J - 1);
  *stiffness *= p->penalty;
}

/* Computes the gradient of J' with respect to the nodes. */
static COMPILED_ONCE void mean_gradient(const points *p, ten_forces *b)
{
  flesh_real inverse = 1 / flesh_select(p->volume > 0, p->volume, flesh_all(1));
  open_forces(b);
  for (int q = 0; q < POINTS; q++) {
    flesh_real f[4][3], share = p->at[q].t.volume * inverse;
    for (int i = 0; i < 3; i++) {
      flesh_real C[3];
      for (int j = 0; j < 3; j++) C[j] = share * p->at[q].C[3 * i + j];
      force_row(&p->at[q].t, i, C, f);
    }
    add_virtual_forces(f, q, b);
  }
  close_forces(b);
}

/* Computes the stress at a point times its volume for a form of the singular values; sums: its energy and the size of
 * its terms. */
static COMPILED_ONCE int stress_of_stretches(const batch *b, flesh_real P[9], flesh_real sums[2])
{
  flesh_real U[9], sigma[3], V[9], UP[9], size;
  flesh_stretch_real psi;
  find_stretches(b, U, sigma, V);
  if (flesh_any(flesh_stretch_form(b->material->energy, b->material, sigma, &psi) == 0)) return FLESH_NONFINITE;
  size = flesh_abs(psi.value) + flesh_abs(b->psi.value);
  for (int k = 0; k < 3; k++) size += 0.5 * flesh_abs(psi.p[k] * sigma[k]);
  sums[0] = b->t.volume * (psi.value + b->psi.value);
  sums[1] = b->t.volume * size;
  for (int k = 0; k < 9; k++) UP[k] = U[k] * psi.p[k % 3];
  flesh_mat3_multiply_transposed(UP, V, P);
  for (int k = 0; k < 9; k++) P[k] = b->t.volume * (P[k] + b->psi.J * b->C[k]);
  return FLESH_OK;
}

/* Adds the forces of a batch whose form depends on the singular values. */
static COMPILED_ONCE int add_stretch_forces(const points *p, ten_forces *to, flesh_real sums[2])
{
  for (int q = 0; q < POINTS; q++) {
    flesh_real P[9], own[2], of_point[4][3];
    int status = stress_of_stretches(&p->at[q], P, own);
    if (status) return status;
    for (int k = 0; k < 2; k++) sums[k] += own[k];
    for (int i = 0; i < 3; i++) force_row(&p->at[q].t, i, P + 3 * i, of_point);
    add_virtual_forces(of_point, q, to);
  }
  return FLESH_OK;
}

INLINE int add_residual(const flesh_batches *batches, int index, const flesh_tet_point *at, const nearby *near,
                        double *forces, int with_sums, flesh_real sums[2])
{
  points p;
  ten_forces f;
  load(batches, index, near->x, &p);
  load_options(batches, index, at, &p);
  int status = find_psi_of_points(batches, with_sums, &p);
  if (status) return status;
  open_forces(&f);
  const int by_stretches = flesh_form_of_stretches(p.at[0].material->energy);
  if (by_stretches && (status = add_stretch_forces(&p, &f, sums))) return status;
  for (int q = 0; q < POINTS && !by_stretches; q++) {
    const batch *b = &p.at[q];
    if (with_sums) {
      sums[0] += b->t.volume * b->psi.value;
      sums[1] += b->t.volume * (flesh_abs(b->psi.value) + flesh_abs(b->psi.I) * b->I_C);
    }
    if (!forces) continue;
    flesh_real pI = 2 * b->t.volume * b->psi.I, pJ = b->t.volume * b->psi.J, of_point[4][3];
    for (int i = 0; i < 3; i++) {
      flesh_real P[3];
      for (int j = 0; j < 3; j++) P[j] = pI * b->F[3 * i + j] + pJ * b->C[3 * i + j];
      force_row(&b->t, i, P, of_point);
    }
    add_virtual_forces(of_point, q, &f);
  }
  if (with_sums && batches->volume_shares) {
    flesh_real energy, stiffness;
    mean_term(batches, &p, &energy, &stiffness);
    sums[0] += energy;
    sums[1] += flesh_abs(energy);
  }
  if (!forces) return FLESH_OK;
  close_forces(&f);
  scatter_forces(&p.at[0].t, f.node, forces);
  return FLESH_OK;
}

/* Computes the blocks of virtual corners at a point, exact or filtered. */
static COMPILED_ONCE int blocks_at_point(const batch *b, double scale, flesh_eigenvalue_filter filter, void *to)
{
  const int by_stretches = flesh_form_of_stretches(b->material->energy);
  if (filter || by_stretches) {
    flesh_real U[9], V[9];
    flesh_spectrum spectrum;
    int status = decompose(b, U, V, &spectrum), changed = by_stretches;
    if (status) return status;
    if (filter) {
      filter = filter == FLESH_FILTER_ABSOLUTE ? FLESH_FILTER_ABSOLUTE : FLESH_FILTER_CLAMP;
      changed |= flesh_any(flesh_spectrum_filter(&spectrum, filter));
    }
    if (changed) {
      spectral_blocks(b, U, V, &spectrum, scale, keep_block, to);
      return FLESH_OK;
    }
  }
  true_blocks(b, scale, keep_block, to);
  return FLESH_OK;
}

/* Computes the Hessian of the mean's term, as a product of a vector with itself. */
static COMPILED_ONCE void product_of_mean(const flesh_batches *batches, const points *p, const flesh_tet_point *at,
                                          ten_product *product)
{
  ten_forces b;
  flesh_real energy, stiffness;
  mean_term(batches, p, &energy, &stiffness);
  if (at->filter) stiffness = flesh_spectrum_filtered(stiffness, at->filter);
  mean_gradient(p, &b);
  for (int a = 0; a < 10; a++)
    for (int i = 0; i < 3; i++) {
      product->a[a][i] = b.node[a][i];
      product->scaled[a][i] = at->scale * stiffness * b.node[a][i];
    }
}

static COMPILED_ONCE void blocks_with_mean(corner_blocks *restrict of, const ten_product *restrict mean,
                                           flesh_real (*restrict K)[9])
{
  blocks_and_product(of, mean, K);
}

static COMPILED_ONCE int add_hessian(const flesh_batches *batches, int index, const flesh_tet_point *at,
                                     const nearby *near, tile_blocks *to)
{
  points p;
  corner_blocks of_corners;
  ten_blocks of_nodes;
  load(batches, index, near->x, &p);
  load_options(batches, index, at, &p);
  int status = find_psi_of_points(batches, 0, &p);
  for (int q = 0; q < POINTS && !status; q++)
    status = blocks_at_point(&p.at[q], at->scale, at->filter, of_corners.point[q]);
  if (status) return status;
  if (batches->volume_shares) {
    ten_product mean;
    product_of_mean(batches, &p, at, &mean);
    blocks_with_mean(&of_corners, &mean, of_nodes);
  } else {
    blocks_of_nodes(&of_corners, of_nodes);
  }
  add_blocks(&p.at[0].t, of_nodes, to);
  return FLESH_OK;
}

/* Adds the forces of rates: P' at every point, and V S_JJ (b . v) b of the mean with negative S_JJ clamped. */
INLINE int add_stiffness(const flesh_batches *batches, int index, const flesh_tet_point *at, const nearby *near,
                         double *forces, int with_sums, flesh_real sums[2])
{
  points p;
  ten rates;
  ten_forces f, gradient;
  flesh_real rate[POINTS][9], P[POINTS][9];
  load(batches, index, near->x, &p);
  load_options(batches, index, at, &p);
  int status = find_psi_of_points(batches, 0, &p);
  load_ten(&p.at[0].t, near->v, &rates);
  open_forces(&f);
  for (int q = 0; q < POINTS && !status; q++) {
    const batch *b = &p.at[q];
    flesh_real edges[3][3], of_point[4][3];
    gradient_at(&b->t, &rates, q, edges, rate[q]);
    status = stress_rate(b, rate[q], P[q]);
    for (int c = 0; c < 9; c++) P[q][c] *= at->scale * b->t.volume;
    if (with_sums) sums[0] += 0.5 * flesh_mat3_inner(rate[q], P[q]);
    for (int i = 0; i < 3; i++) force_row(&b->t, i, P[q] + 3 * i, of_point);
    add_virtual_forces(of_point, q, &f);
  }
  if (status) return status;
  close_forces(&f);
  if (batches->volume_shares) {
    flesh_real energy, stiffness, J_rate = flesh_all(0);
    mean_term(batches, &p, &energy, &stiffness);
    stiffness = at->scale * flesh_spectrum_filtered(stiffness, FLESH_FILTER_CLAMP);
    mean_gradient(&p, &gradient);
    for (int a = 1; a < 10; a++) J_rate += flesh_vec3_dot(gradient.node[a], rates.node[a]);
    if (with_sums) sums[0] += 0.5 * stiffness * J_rate * J_rate;
    for (int a = 0; a < 10; a++)
      for (int i = 0; i < 3; i++) f.node[a][i] += stiffness * J_rate * gradient.node[a][i];
  }
  if (with_sums) sums[1] = sums[0];
  if (forces) scatter_forces(&p.at[0].t, f.node, forces);
  return FLESH_OK;
}

RESIDUAL_KERNEL(elastic_residual, add_residual)
HESSIAN_KERNEL(elastic_hessian, add_hessian)
RESIDUAL_KERNEL(stiffness_residual, add_stiffness)

/* Computes the rows b of the stiff term b b^T: the part of the mean's term that is stiffer than the rest of the
 * form. */
static COMPILED_ONCE void elastic_rows(const flesh_batches *batches, int tile, const flesh_tet_point *at, float *rows)
{
  const flesh_tiles *tiles = &batches->tiles;
  tile_vector x;
  tile_gather(tiles, tile, at->x, x);
  for (int k = tiles->batch[tile]; k < tiles->batch[tile + 1]; k++) {
    const int first = batches->first[k], used = batches->first[k + 1] - first;
    points p;
    ten_forces b;
    flesh_real energy, stiffness;
    load(batches, k, x, &p);
    load_options(batches, k, at, &p);
    find_share_of_mean(batches, &p);
    mean_term(batches, &p, &energy, &stiffness);
    mean_gradient(&p, &b);
    stiffness = at->scale * (stiffness - batches->volume_shares[p.at[0].t.material].moderate * p.volume);
    const flesh_real factor = flesh_sqrt(flesh_select(stiffness > 0, stiffness, flesh_all(0)));
    for (int a = 0; a < 10; a++)
      for (int i = 0; i < 3; i++) {
        const flesh_real value = factor * b.node[a][i];
        float *to = rows + 30 * (size_t)first + 3 * a + i;
        for (int l = 0; l < used; l++) to[30 * l] = (float)flesh_lane(value, l);
      }
  }
}

/* Writes the mean of J minus 1 to the places of the mesh's tets. */
static COMPILED_ONCE int gaps_of(const flesh_batches *batches, int tile, const flesh_tet_point *at, double *r,
                                 double *sums)
{
  const flesh_tiles *tiles = &batches->tiles;
  tile_vector x;
  (void)sums;
  tile_gather(tiles, tile, at->x, x);
  for (int k = tiles->batch[tile]; k < tiles->batch[tile + 1]; k++) {
    points p;
    const int first = batches->first[k], used = batches->first[k + 1] - first;
    load(batches, k, x, &p);
    const int held = batches->volume_shares[p.at[0].t.material].held;
    for (int l = 0; l < used; l++) r[batches->tet[first + l]] = held ? flesh_lane(p.J, l) - 1 : 0;
  }
  return FLESH_OK;
}

const flesh_tet_kernel FLESH_OF_ISA(flesh_elastic10) = {elastic_residual, elastic_hessian, NULL};
const flesh_tet_kernel FLESH_OF_ISA(flesh_elastic10_mean) = {elastic_residual, elastic_hessian, elastic_rows};
const flesh_tet_kernel FLESH_OF_ISA(flesh_stiffness10) = {stiffness_residual, elastic_hessian, NULL};
const flesh_tet_kernel FLESH_OF_ISA(flesh_gaps10_mean) = {gaps_of, NULL, NULL};
