/* elasticity.c: V(x) = sum over linear tets of volume * psi(F), its gradient and (projected)
 * Hessian.
 *
 * With x_a the tet's nodes and g_a the gradients of its shape functions, F = sum x_a g_a^T. Node a
 * gets volume * P g_a; the pair (a,b) the block K_ab = volume * (dP g_a) in direction e_j g_b^T. */
#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "effect/effect.h"
#include "material/spectrum.h"
#include "math/mat3.h"
#include "math/svd3.h"

/* What a tet needs at every evaluation, in one place in memory. */
typedef struct element {
  int node[4];  /* ascending */
  int material;
  double volume;
  double gradient[9]; /* rows g_1, g_2, g_3; g_0 = -(g_1 + g_2 + g_3) */
} element;

typedef struct elasticity {
  flesh_cells cells;
  element *elements;
  const flesh_material *materials; /* borrowed */
} elasticity;

static const flesh_cells *elasticity_cells(const flesh_effect *effect)
{
  const elasticity *self = effect->data;
  return &self->cells;
}

static inline void deformation(const element *e, const double *x, double F[9])
{
  const double *x0 = x + 3 * e->node[0], *x1 = x + 3 * e->node[1], *x2 = x + 3 * e->node[2],
               *x3 = x + 3 * e->node[3];
  for (int i = 0; i < 3; i++) {
    double d1 = x1[i] - x0[i], d2 = x2[i] - x0[i], d3 = x3[i] - x0[i];
    for (int j = 0; j < 3; j++)
      F[3 * i + j] = d1 * e->gradient[j] + d2 * e->gradient[3 + j] + d3 * e->gradient[6 + j];
  }
}

/* psi at F, with J and cof F. */
static inline int energy_at(const flesh_material *material, const double F[9], double C[9],
                            double *I_C, flesh_psi *psi)
{
  flesh_mat3_cofactor(F, C);
  double J = flesh_vec3_dot(F, C);
  *I_C = flesh_mat3_norm2(F);
  int status = material->psi(*I_C, J, material, psi);
  /* A non-finite F or an overflow would spread silently, or be taken for J <= 0. */
  if (status == FLESH_OK && !(fabs(psi->value) < INFINITY)) return FLESH_NONFINITE;
  if (status == FLESH_UNDEFINED && !(*I_C < INFINITY)) return FLESH_NONFINITE;
  return status;
}

static int elasticity_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const elasticity *self = effect->data;
  for (int k = 0; k < self->cells.count; k++) {
    const element *e = &self->elements[k];
    double F[9], C[9], I_C;
    flesh_psi psi;
    deformation(e, point->x, F);
    int status = energy_at(&self->materials[e->material], F, C, &I_C, &psi);
    if (status) return status;
    double pI = 2 * e->volume * psi.I, pJ = e->volume * psi.J, P[9];
    for (int p = 0; p < 9; p++) P[p] = pI * F[p] + pJ * C[p];
    double *r0 = r + 3 * e->node[0], *r1 = r + 3 * e->node[1], *r2 = r + 3 * e->node[2],
           *r3 = r + 3 * e->node[3];
    for (int i = 0; i < 3; i++) {
      double f1 = flesh_vec3_dot(P + 3 * i, e->gradient);
      double f2 = flesh_vec3_dot(P + 3 * i, e->gradient + 3);
      double f3 = flesh_vec3_dot(P + 3 * i, e->gradient + 6);
      r1[i] += f1;
      r2[i] += f2;
      r3[i] += f3;
      r0[i] -= f1 + f2 + f3;
    }
  }
  return FLESH_OK;
}

/* Adds the six blocks between nodes 1, 2, 3 and, by the zero row sum, the four that touch node 0.
 * `pair` holds K_11 K_12 K_13 K_22 K_23 K_33. */
static inline void scatter(const double pair[6][9], const int slot[10], double *values)
{
  double *k[10];
  for (int p = 0; p < 10; p++) k[p] = values + 9 * (size_t)slot[p];
  for (int p = 0; p < 6; p++)
    for (int c = 0; c < 9; c++) k[4 + p][c] += pair[p][c];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      int c = 3 * i + j, t = 3 * j + i;
      /* K_0b = -(K_1b + K_2b + K_3b). */
      double k01 = -(pair[0][c] + pair[1][t] + pair[2][t]);
      double k02 = -(pair[1][c] + pair[3][c] + pair[4][t]);
      double k03 = -(pair[2][c] + pair[4][c] + pair[5][c]);
      k[1][c] += k01;
      k[2][c] += k02;
      k[3][c] += k03;
      /* K_00 = -(K_01 + K_02 + K_03), symmetric: its (i,j) gets half of each order's sum. */
      k[0][c] -= 0.5 * (k01 + k02 + k03);
      k[0][t] -= 0.5 * (k01 + k02 + k03);
    }
}

/* The exact Hessian. d cof(F) in direction e_j g_b^T, times g_a, is e_j x F(g_a x g_b). */
static inline void true_blocks(const element *e, const double F[9], const double C[9],
                               const flesh_psi *psi, double scale, double pair[6][9])
{
  const double *g[3] = {e->gradient, e->gradient + 3, e->gradient + 6};
  double p[3][3], q[3][3];
  for (int a = 0; a < 3; a++) {
    flesh_mat3_times(F, g[a], p[a]);
    flesh_mat3_times(C, g[a], q[a]);
  }
  double same = 2 * scale * psi->I, II = 4 * scale * psi->II, IJ = 2 * scale * psi->IJ,
         JJ = scale * psi->JJ, turn = scale * psi->J;
  for (int a = 0, n = 0; a < 3; a++)
    for (int b = a; b < 3; b++, n++) {
      double *K = pair[n];
      for (int i = 0; i < 3; i++) {
        double u = II * p[a][i] + IJ * q[a][i], w = IJ * p[a][i] + JJ * q[a][i];
        for (int j = 0; j < 3; j++) K[3 * i + j] = u * p[b][j] + w * q[b][j];
      }
      double diagonal = same * flesh_vec3_dot(g[a], g[b]);
      K[0] += diagonal;
      K[4] += diagonal;
      K[8] += diagonal;
      if (a == b) continue;
      double cross[3], h[3];
      flesh_vec3_cross(g[a], g[b], cross);
      flesh_mat3_times(F, cross, h);
      K[1] += turn * h[2];
      K[2] -= turn * h[1];
      K[3] -= turn * h[2];
      K[5] += turn * h[0];
      K[6] += turn * h[1];
      K[7] -= turn * h[0];
    }
}

/* The Hessian with its negative eigenvalues filtered, from the closed-form spectrum. */
static int projected_blocks(const element *e, const double F[9], const flesh_psi *psi, double scale,
                            flesh_filter filter, double pair[6][9])
{
  double U[9], sigma[3], V[9], g[3][3];
  flesh_spectrum spectrum;
  flesh_svd3(F, U, sigma, V);
  int status = flesh_spectrum_make(psi, sigma, &spectrum);
  if (status) return status;
  if (!flesh_spectrum_filter(&spectrum, filter)) {
    double C[9];
    flesh_mat3_cofactor(F, C);
    true_blocks(e, F, C, psi, scale, pair);
    return FLESH_OK;
  }
  for (int a = 0; a < 3; a++) flesh_mat3_transposed_times(V, e->gradient + 3 * a, g[a]);
  for (int a = 0, n = 0; a < 3; a++)
    for (int b = a; b < 3; b++, n++) {
      double B[9], UB[9];
      flesh_spectrum_block(&spectrum, g[a], g[b], B);
      flesh_mat3_multiply(U, B, UB);
      flesh_mat3_multiply_transposed(UB, U, pair[n]);
      for (int c = 0; c < 9; c++) pair[n][c] *= scale;
    }
  return FLESH_OK;
}

static int elasticity_jacobian(const flesh_effect *effect, const flesh_point *point,
                               const flesh_shift *shift, flesh_block_matrix *K, const int *slots)
{
  const elasticity *self = effect->data;
  if (shift->x == 0) return FLESH_OK;
  for (int k = 0; k < self->cells.count; k++) {
    const element *e = &self->elements[k];
    double F[9], C[9], pair[6][9], I_C;
    flesh_psi psi;
    deformation(e, point->x, F);
    int status = energy_at(&self->materials[e->material], F, C, &I_C, &psi);
    if (status) return status;
    double scale = shift->x * e->volume;
    if (shift->project) {
      status = projected_blocks(e, F, &psi, scale,
                                shift->project == FLESH_PROJECTED_ABSOLUTE ? FLESH_FILTER_ABSOLUTE
                                                                           : FLESH_FILTER_CLAMP,
                                pair);
      if (status) return status;
    } else {
      true_blocks(e, F, C, &psi, scale, pair);
    }
    scatter(pair, slots + 10 * (size_t)k, K->values);
  }
  return FLESH_OK;
}

static int sum_energy(const elasticity *self, const double *x, double *energy, double *magnitude)
{
  double sum = 0, size = 0;
  for (int k = 0; k < self->cells.count; k++) {
    const element *e = &self->elements[k];
    double F[9], C[9], I_C;
    flesh_psi psi;
    deformation(e, x, F);
    int status = energy_at(&self->materials[e->material], F, C, &I_C, &psi);
    if (status) return status;
    sum += e->volume * psi.value;
    /* The value may cancel; the length term, of which psi_I I_C is the size, says how far. */
    size += e->volume * (fabs(psi.value) + fabs(psi.I) * I_C);
  }
  *energy = sum;
  *magnitude = size;
  return FLESH_OK;
}

static int elasticity_potential(const flesh_effect *effect, const flesh_point *point,
                                const flesh_shift *shift, double *phi, double *magnitude)
{
  if (shift->x == 0) return FLESH_OK;
  double energy, size;
  int status = sum_energy(effect->data, point->x, &energy, &size);
  if (status) return status;
  *phi += energy / shift->x;
  *magnitude += size / shift->x;
  return FLESH_OK;
}

static int elasticity_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  double size;
  return sum_energy(effect->data, point->x, energy, &size);
}

static void elasticity_destroy(void *data)
{
  elasticity *self = data;
  if (!self) return;
  flesh_cells_clear(&self->cells);
  free(self->elements);
  free(self);
}

static const flesh_effect_operations elasticity_operations = {
    .name = "elasticity",
    .cells = elasticity_cells,
    .residual = elasticity_residual,
    .jacobian = elasticity_jacobian,
    .potential = elasticity_potential,
    .energy = elasticity_energy,
    .destroy = elasticity_destroy,
};

int flesh_effect_elasticity(const flesh_body *body, flesh_effect **effect)
{
  if (!body->materials)
    return flesh_fail(FLESH_ERR_ARGUMENT, "elasticity needs a body with a material");
  int tets = flesh_mesh_tet_count(body->mesh);
  const double *X = flesh_mesh_positions(body->mesh);
  elasticity *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the elasticity effect");
  self->materials = body->materials;
  int status = flesh_cells_of_tets(body->mesh, &self->cells);
  if (!status) {
    self->elements = malloc((size_t)tets * sizeof *self->elements);
    if (!self->elements)
      status = flesh_fail(FLESH_ERR_MEMORY, "no memory for %d elements", tets);
  }
  if (status) {
    elasticity_destroy(self);
    return status;
  }
  for (int k = 0; k < tets; k++) {
    element *e = &self->elements[k];
    double D[9];
    for (int a = 0; a < 4; a++) e->node[a] = self->cells.nodes[4 * k + a];
    for (int i = 0; i < 3; i++)
      for (int a = 0; a < 3; a++) D[3 * i + a] = X[3 * e->node[a + 1] + i] - X[3 * e->node[0] + i];
    /* D's columns are the edges; the rows of its inverse are the gradients, whichever way round
     * the ascending nodes wind. */
    e->volume = fabs(flesh_mat3_inverse(D, e->gradient)) / 6;
    e->material = body->tet_material ? body->tet_material[k] : 0;
  }
  return flesh_effect_create(&elasticity_operations, self, effect);
}
