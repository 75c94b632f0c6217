/* curves.c: the deformations of `flesh material` and what the energies do along them. */
#include "material/curves.h"

#include <assert.h>
#include <gsl/gsl_eigen.h>
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <string.h>

#include "math/mat3.h"

static void diagonal(double a, double b, double c, double F[9])
{
  memset(F, 0, 9 * sizeof *F);
  F[0] = a, F[4] = b, F[8] = c;
}

static void stretch_at(double s, double F[9]) { diagonal(s, 1, 1, F); }
static void scale_at(double s, double F[9]) { diagonal(s, s, s, F); }
static void flatten_at(double s, double F[9]) { diagonal(1, 1, s, F); }

static void shear_at(double s, double F[9])
{
  diagonal(1, 1, 1, F);
  F[1] = s;
}

static void rotation_at(double degrees, double F[9])
{
  double c = cos(degrees * M_PI / 180), s = sin(degrees * M_PI / 180);
  diagonal(c, c, 1, F);
  F[1] = -s, F[3] = s;
}

static void uniaxial_at(double s, double F[9]) { diagonal(s, 1 / sqrt(s), 1 / sqrt(s), F); }
static void biaxial_at(double s, double F[9]) { diagonal(s, s, 1 / (s * s), F); }
static void planar_at(double s, double F[9]) { diagonal(s, 1, 1 / s, F); }

#define SHEAR                                                                                                          \
  {"shear", "Simple shear: F = I + {/Symbol g} e_1 e_2^T", "shear {/Symbol g}", "P_{12}", 0, 3, shear_at, 0, 1}
#define ROTATION                                                                                                       \
  {"rotation", "Rigid rotation about z (everything must stay constant)", "angle [degrees]", "|P|", 0, 180, rotation_at, \
   -1, -1}

const flesh_path flesh_paths[] = {
    {"stretch", "Uniaxial stretch, sides held: F = diag(s, 1, 1)",
                            "stretch s", "P_{11}", 0, 3, stretch_at, 0, 0},
    {"scale", "Uniform scaling through a point: F = s I", "scale s", "P_{11}",
                          1.25, -0.25, scale_at, 0, 0},
    [FLESH_PATH_FLATTEN] = {"flatten", "Flattening through zero to inversion: F = diag(1, 1, s)",
                            "thickness s", "P_{33}", 2, -1, flatten_at, 2, 2},
    SHEAR,
    ROTATION};
static_assert(sizeof flesh_paths / sizeof *flesh_paths == FLESH_PATHS, "a row of every path");

const flesh_path flesh_isochoric_paths[] = {
    {"stretch", "Uniaxial stretch, sides free: F = diag(s, s^{-1/2}, s^{-1/2})", "stretch s", "P_{11}", 0.3, 3,
     uniaxial_at, 0, 0},
    {"biaxial", "Equibiaxial stretch, faces free: F = diag(s, s, s^{-2})", "stretch s", "P_{11}", 0.5, 2.5, biaxial_at, 0,
     0},
    {"planar", "Pure shear, faces free: F = diag(s, 1, 1/s)", "stretch s", "P_{11}", 0.3, 3, planar_at, 0, 0},
    SHEAR,
    ROTATION};
static_assert(sizeof flesh_isochoric_paths / sizeof *flesh_isochoric_paths == FLESH_PATHS, "a row of every path");

double flesh_path_parameter(const flesh_path *path, int k)
{
  return path->start + (path->end - path->start) * k / FLESH_CURVE_STEPS;
}

/* H - p d2J/dF2, where d2J/dF_ij dF_kl = e_ikm e_jln F_mn. */
static void press_hessian(double H[81], const double F[9], double p)
{
  for (int k = 0; k < 81; k++) {
    const int i = k / 27, j = k / 9 % 3, a = k / 3 % 3, b = k % 3;
    if (i == a || j == b) continue;
    const double sign = ((a - i + 3) % 3 == 1) == ((b - j + 3) % 3 == 1) ? 1 : -1;
    H[k] -= p * sign * F[3 * (3 - i - a) + 3 - j - b];
  }
}

/* The least eigenvalue of H among what is across n. Its other vectors get a value above all of H's. */
static double smallest_across(const double H[81], const double n[9])
{
  double A[81], Hn[9] = {0}, nn = 0, nHn = 0, above = 0, values[9];
  for (int k = 0; k < 81; k++) Hn[k / 9] += H[k] * n[k % 9], above += fabs(H[k]);
  for (int k = 0; k < 9; k++) nn += n[k] * n[k], nHn += n[k] * Hn[k];
  for (int k = 0; k < 81; k++)
    A[k] = H[k] - (n[k / 9] * Hn[k % 9] + Hn[k / 9] * n[k % 9]) / nn + (nHn / nn + above) * n[k / 9] * n[k % 9] / nn;
  gsl_eigen_symm_workspace *room = gsl_eigen_symm_alloc(9);
  if (!room) return NAN;
  gsl_matrix_view matrix = gsl_matrix_view_array(A, 9, 9);
  gsl_vector_view eigenvalues = gsl_vector_view_array(values, 9);
  gsl_eigen_symm(&matrix.matrix, &eigenvalues.vector, room);
  gsl_eigen_symm_free(room);
  return gsl_vector_min(&eigenvalues.vector);
}

/* Takes the pressure that makes P_33 zero off the stress. Returns the smallest eigenvalue, NaN where there is none. */
static double press(const flesh_material *material, const double F[9], double P[9])
{
  double cofactor[9], H[81];
  flesh_mat3_cofactor(F, cofactor);
  const double p = P[8] / cofactor[8];
  for (int k = 0; k < 9; k++) P[k] -= p * cofactor[k];
  if (flesh_material_hessian(material, F, H)) return NAN;
  press_hessian(H, F, p);
  return smallest_across(H, cofactor);
}

void flesh_curve_sample(const flesh_curve *curve, const flesh_path *path, double s, double *energy,
                        double quantities[FLESH_CURVE_QUANTITIES])
{
  const flesh_material *material = &curve->material;
  double F[9], P[9], values[9], vectors[81];
  path->at(s, F);
  *energy = quantities[0] = quantities[1] = quantities[2] = NAN;
  if (flesh_material_energy(material, F, energy)) return;
  quantities[0] = *energy - curve->rest_value;
  if (!material->incompressible && !flesh_material_eigen(material, F, values, vectors))
    quantities[2] = gsl_stats_min(values, 1, 9);
  if (flesh_material_stress(material, F, P)) return;
  if (material->incompressible) quantities[2] = press(material, F, P);
  quantities[1] = path->row < 0 ? sqrt(flesh_mat3_norm2(P)) : P[3 * path->row + path->column];
}
