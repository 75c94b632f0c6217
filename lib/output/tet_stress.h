/* tet_stress.h: strain, stress and energy at points of a body's tets, as its elements have them. */
#ifndef FLESH_OUTPUT_TET_STRESS_H
#define FLESH_OUTPUT_TET_STRESS_H

#include "element/tet_kernel.h"
#include "flesh/body.h"
#include "flesh/state.h"
#include "flesh/system.h"

typedef struct flesh_tet_stress {
  const flesh_body *body;
  const flesh_system *system;
  flesh_volume_share *shares; /* of the materials; 0 where no mean of J is taken */
  double *rest_energies;      /* psi(I) of the materials, J/m^3 */
} flesh_tet_stress;

/* Numbers of a point: J, three stretches, tau in the order of flesh_tau_place, the energy. */
enum { FLESH_POINT_J, FLESH_POINT_STRETCH, FLESH_POINT_TAU = 4, FLESH_POINT_ENERGY = 10, FLESH_POINT_NUMBERS };
static const int flesh_tau_place[6] = {0, 4, 8, 1, 5, 2}; /* xx, yy, zz, xy, yz, xz */

typedef struct flesh_strain_point {
  double volume; /* m^3 at rest, the point's share of the tet; of a lone point the tet's */
  double L[4], F[9], J;
  flesh_volume_part own, mean; /* of J, and of the tet's mean of J in its place, with its multiplier; 0: no mean is taken */
  double tau[9];  /* Kirchhoff stress P F^T = J sigma, Pa; NaN where it does not exist, 0 without a material */
  double energy;  /* J/m^3 from rest; likewise */
} flesh_strain_point;

/* Borrows the body, and the system whose effects add their stress to the elastic one; NULL: none do.
 * FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY; cleared then. */
int flesh_tet_stress_open(const flesh_body *body, const flesh_system *system, flesh_tet_stress *stress);
void flesh_tet_stress_clear(flesh_tet_stress *stress);

/* At the tet's points of quadrature; returns how many there are. */
int flesh_tet_stress_points(const flesh_tet_stress *stress, const flesh_state *state, int tet,
                            flesh_strain_point points[4]);

/* At barycentric coordinates L of the tet. */
void flesh_tet_stress_at(const flesh_tet_stress *stress, const flesh_state *state, int tet, const double L[4],
                         flesh_strain_point *point);

/* The derivatives of a number of the point by F, by_F [9], and by the tet's mean of J, *by_mean; NaN where there is none. What
 * effects say of their stress is differenced. */
void flesh_tet_stress_slope(const flesh_tet_stress *stress, const flesh_state *state, int tet,
                            const flesh_strain_point *point, int number, double by_F[9], double *by_mean);

#endif
