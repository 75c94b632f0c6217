/* tet_stress.h: strain, stress and energy at points of a body's tets, as its elements define them. */
#ifndef FLESH_OUTPUT_TET_STRESS_H
#define FLESH_OUTPUT_TET_STRESS_H

#include "element/tet_kernel.h"
#include "flesh/body.h"
#include "flesh/state.h"
#include "flesh/system.h"

typedef struct flesh_tet_stress {
  const flesh_body *body;
  const flesh_system *system;
  flesh_volume_share *shares; /* [materials]; 0 for elements without a mean of J */
  double *rest_energies;      /* [materials] psi(I), J/m^3 */
} flesh_tet_stress;

/* Indices of a point's numbers: J, three stretches, tau in the order of flesh_tau_place, the energy. */
enum { FLESH_POINT_J, FLESH_POINT_STRETCH, FLESH_POINT_TAU = 4, FLESH_POINT_ENERGY = 10, FLESH_POINT_NUMBERS };
static const int flesh_tau_place[6] = {0, 4, 8, 1, 5, 2}; /* xx, yy, zz, xy, yz, xz */

typedef struct flesh_strain_point {
  double volume; /* the point's share of the tet's rest volume, m^3; the whole tet's for a single point */
  double L[4], F[9], J;
  flesh_volume_part own, mean; /* terms of J and of the tet's mean of J, with its multiplier; 0: no mean is used */
  double tau[9];  /* Kirchhoff stress P F^T = J sigma, Pa; NaN where it does not exist, 0 without a material */
  double energy;  /* strain energy since rest, J/m^3; NaN and 0 as for tau */
} flesh_strain_point;

/* Prepares stresses. Borrows the body, and the system whose effects add their stress to the elastic one (NULL: none
 * do). FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY; *stress is then cleared. */
int flesh_tet_stress_open(const flesh_body *body, const flesh_system *system, flesh_tet_stress *stress);
void flesh_tet_stress_clear(flesh_tet_stress *stress);

/* Computes the values at the tet's quadrature points; returns their number. */
int flesh_tet_stress_points(const flesh_tet_stress *stress, const flesh_state *state, int tet,
                            flesh_strain_point points[4]);

/* Computes the values at barycentric coordinates L of the tet. */
void flesh_tet_stress_at(const flesh_tet_stress *stress, const flesh_state *state, int tet, const double L[4],
                         flesh_strain_point *point);

/* Computes the derivatives of a point's number by F, by_F [9], and by the tet's mean of J, *by_mean; NaN where there is
 * none. Stresses of effects are differentiated by finite differences. */
void flesh_tet_stress_slope(const flesh_tet_stress *stress, const flesh_state *state, int tet,
                            const flesh_strain_point *point, int number, double by_F[9], double *by_mean);

#endif
