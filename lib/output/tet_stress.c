/* tet_stress.c: strain, stress and energy at points of a body's tets, as its elements define them. */
#include "output/tet_stress.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "element/element.h"
#include "mesh/tet10.h"
#include "flesh/material.h"
#include "math/differences.h"
#include "math/mat3.h"
#include "math/svd3.h"
#include "mesh/mesh.h"
#include "output/tet_shape.h"

static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

/* Returns the number of materials of the body's tets. */
static int count_materials(const flesh_body *body)
{
  int count = 1;
  for (int e = 0; body->tet_material && e < flesh_mesh_tet_count(body->mesh); e++)
    if (body->tet_material[e] >= count) count = body->tet_material[e] + 1;
  return count;
}

int flesh_tet_stress_open(const flesh_body *body, const flesh_system *system, flesh_tet_stress *stress)
{
  *stress = (flesh_tet_stress){.body = body, .system = system};
  if (!body->materials) return FLESH_OK;
  const int count = count_materials(body);
  int status = flesh_body_check_element(body);
  if (status) return status;
  stress->shares = calloc((size_t)count, sizeof *stress->shares);
  stress->rest_energies = calloc((size_t)count, sizeof *stress->rest_energies);
  if (!stress->shares || !stress->rest_energies)
    status = flesh_fail(FLESH_ERR_MEMORY, "no memory for the stress of %d materials", count);
  for (int m = 0; m < count && !status; m++) {
    if (flesh_mesh_order(body->mesh) == 2 && flesh_body_element_of(body, m, 10) == FLESH_ELEMENT_TET10_MEAN)
      status = flesh_volume_share_of(&body->materials[m], &stress->shares[m]);
    if (!status && flesh_material_energy(&body->materials[m], identity, &stress->rest_energies[m]))
      stress->rest_energies[m] = 0;
  }
  if (status) flesh_tet_stress_clear(stress);
  return status;
}

void flesh_tet_stress_clear(flesh_tet_stress *stress)
{
  free(stress->shares);
  free(stress->rest_energies);
  *stress = (flesh_tet_stress){0};
}

static int material_of(const flesh_body *body, int tet) { return body->tet_material ? body->tet_material[tet] : 0; }

/* Adds to tau [9] the stresses of the system's effects at a point of the tet (flesh_effect_figures). */
static void add_of_effects(const flesh_system *system, double t, int tet, const double F[9], double tau[9])
{
  for (int e = 0; e < flesh_system_effect_count(system); e++) {
    const flesh_effect *effect = flesh_system_effect(system, e);
    const flesh_effect_figures *figures = effect->operations->figures;
    if (figures && figures->stress) figures->stress(effect, t, tet, F, tau);
  }
}

/* Computes psi(F) and tau, including the terms of the mean of J (flesh_element). */
static void find_stress(const flesh_tet_stress *stress, const flesh_state *state, int tet, double mean_J,
                        flesh_strain_point *p)
{
  const int m = material_of(stress->body, tet);
  const flesh_material *material = &stress->body->materials[m];
  const flesh_volume_share *share = &stress->shares[m];
  double P[9];
  for (int k = 0; k < 9; k++) p->tau[k] = NAN;
  if (flesh_material_energy(material, p->F, &p->energy)) p->energy = NAN;
  if (!flesh_material_stress(material, p->F, P)) flesh_mat3_multiply_transposed(P, p->F, p->tau);
  if (stress->system) add_of_effects(stress->system, state->t, tet, p->F, p->tau);
  p->energy -= stress->rest_energies[m];
  if (!(share->share > 0)) return;
  if (flesh_volume_share_at(share, material, p->J, share->local, &p->own) ||
      flesh_volume_share_at(share, material, mean_J, flesh_local_of_mean(share), &p->mean))
    p->own.value = p->own.J = NAN;
  if (share->held && state->multipliers) {
    p->mean.value += state->multipliers[tet] * (mean_J - 1);
    p->mean.J += state->multipliers[tet];
  }
  p->energy += p->mean.value - p->own.value;
  for (int k = 0; k < 9; k += 4) p->tau[k] += (p->mean.J - p->own.J) * p->J; /* cof F F^T = J I */
}

/* Computes F, J and volumes at the tet's quadrature points; *mean_J is the mean of J. */
static int find_strains(const flesh_body *body, const double *x, int tet, flesh_strain_point points[4], double *mean_J)
{
  const int count = flesh_mesh_is_quadratic(body->mesh, tet) ? FLESH_TET10_POINTS : 1;
  double volume = 0, now = 0;
  for (int q = 0; q < count; q++) {
    flesh_strain_point *p = &points[q];
    *p = (flesh_strain_point){0};
    for (int a = 0; a < 4; a++) p->L[a] = count == 1 ? 0.25 : a == q ? FLESH_TET10_NEAR : FLESH_TET10_FAR;
    p->volume = flesh_tet_gradient(body->mesh, tet, p->L, x, p->F) / count;
    p->J = flesh_mat3_determinant(p->F);
    volume += p->volume;
    now += p->volume * p->J;
  }
  *mean_J = now / volume;
  return count;
}

int flesh_tet_stress_points(const flesh_tet_stress *stress, const flesh_state *state, int tet,
                            flesh_strain_point points[4])
{
  double mean_J;
  const int count = find_strains(stress->body, state->x, tet, points, &mean_J);
  for (int q = 0; q < count && stress->shares; q++) find_stress(stress, state, tet, mean_J, &points[q]);
  return count;
}

void flesh_tet_stress_at(const flesh_tet_stress *stress, const flesh_state *state, int tet, const double L[4],
                         flesh_strain_point *point)
{
  flesh_strain_point points[4];
  double mean_J;
  find_strains(stress->body, state->x, tet, points, &mean_J);
  *point = (flesh_strain_point){.volume = flesh_mesh_tet_volumes(stress->body->mesh)[tet]};
  memcpy(point->L, L, sizeof point->L);
  flesh_tet_gradient(stress->body->mesh, tet, L, state->x, point->F);
  point->J = flesh_mat3_determinant(point->F);
  if (stress->shares) find_stress(stress, state, tet, mean_J, point);
}

/* Adds to by_F the derivative of the effects' stress tau at index `place`, by finite differences. */
static void differentiate_effects(const flesh_system *system, double t, int tet, const double F[9], int place, double by_F[9])
{
  const double step = 3e-5;
  double beside[9];
  memcpy(beside, F, sizeof beside);
  for (int c = 0; c < 9; c++, beside[c - 1] = F[c - 1])
    for (int k = 0; k < FLESH_DIFFERENCES; k++) {
      double tau[9] = {0};
      beside[c] = F[c] + flesh_difference_at[k] * step;
      add_of_effects(system, t, tet, beside, tau);
      by_F[c] += flesh_difference_weight[k] / step * tau[place];
    }
}

/* Differentiates tau = P F^T + (p_mean - p_own) J I. */
static void differentiate_tau(const flesh_tet_stress *stress, const flesh_state *state, int tet, const flesh_strain_point *p,
                              int place, double by_F[9], double *by_mean)
{
  const flesh_material *material = &stress->body->materials[material_of(stress->body, tet)];
  const int i = place / 3, j = place % 3;
  double H[81], P[9], C[9];
  const int fails = flesh_material_hessian(material, p->F, H) || flesh_material_stress(material, p->F, P);
  flesh_mat3_cofactor(p->F, C);
  for (int k = 0; k < 9; k++) {
    by_F[k] = fails ? NAN : k / 3 == j ? P[3 * i + k % 3] : 0;
    for (int m = 0; m < 3; m++) by_F[k] += H[9 * k + 3 * i + m] * p->F[3 * j + m];
    if (i == j) by_F[k] += (p->mean.J - p->own.J - p->own.JJ * p->J) * C[k];
  }
  if (i == j) *by_mean = p->mean.JJ * p->J;
  if (stress->system) differentiate_effects(stress->system, state->t, tet, p->F, place, by_F);
}

void flesh_tet_stress_slope(const flesh_tet_stress *stress, const flesh_state *state, int tet,
                            const flesh_strain_point *p, int number, double by_F[9], double *by_mean)
{
  double U[9], stretch[3], V[9], C[9];
  const int s = number - FLESH_POINT_STRETCH;
  *by_mean = 0;
  flesh_mat3_cofactor(p->F, C);
  if (number == FLESH_POINT_J) memcpy(by_F, C, sizeof C);
  else if (number == FLESH_POINT_ENERGY) {
    if (flesh_material_stress(&stress->body->materials[material_of(stress->body, tet)], p->F, by_F)) by_F[0] = NAN;
    for (int k = 0; k < 9; k++) by_F[k] -= p->own.J * C[k];
    *by_mean = p->mean.J;
  } else if (number >= FLESH_POINT_TAU)
    differentiate_tau(stress, state, tet, p, flesh_tau_place[number - FLESH_POINT_TAU], by_F, by_mean);
  else {
    flesh_svd3(p->F, U, stretch, V);
    for (int k = 0; k < 9; k++) by_F[k] = U[3 * (k / 3) + s] * V[3 * (k % 3) + s];
  }
}
