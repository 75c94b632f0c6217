/* curves.c: the deformations of `flesh material` and the energies along them, as tables of a database in memory, from
 * which data/studies/material.sql makes the table and the pictures. */
#include "material/curves.h"

#include <assert.h>
#include <gsl/gsl_eigen.h>
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <sqlite3.h>
#include <string.h>

#include "base/error.h"
#include "material/form.h"
#include "math/mat3.h"
#include "study/database.h"
#include "study/embedded.h"
#include "study/results.h"

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

const flesh_deformation flesh_deformations[] = {
    {"stretch", "Uniaxial stretch, sides held: F = diag(s, 1, 1)",
                            "stretch s", "P_{11}", 0, 3, stretch_at, 0, 0},
    {"scale", "Uniform scaling through a point: F = s I", "scale s", "P_{11}",
                          1.25, -0.25, scale_at, 0, 0},
    [FLESH_FLATTENING] = {"flatten", "Flattening through zero to inversion: F = diag(1, 1, s)",
                            "thickness s", "P_{33}", 2, -1, flatten_at, 2, 2},
    SHEAR,
    ROTATION};
static_assert(sizeof flesh_deformations / sizeof *flesh_deformations == FLESH_DEFORMATIONS, "a row of every deformation");

const flesh_deformation flesh_isochoric_deformations[] = {
    {"stretch", "Uniaxial stretch, sides free: F = diag(s, s^{-1/2}, s^{-1/2})", "stretch s", "P_{11}", 0.3, 3,
     uniaxial_at, 0, 0},
    {"biaxial", "Equibiaxial stretch, faces free: F = diag(s, s, s^{-2})", "stretch s", "P_{11}", 0.5, 2.5, biaxial_at, 0,
     0},
    {"planar", "Pure shear, faces free: F = diag(s, 1, 1/s)", "stretch s", "P_{11}", 0.3, 3, planar_at, 0, 0},
    SHEAR,
    ROTATION};
static_assert(sizeof flesh_isochoric_deformations == sizeof flesh_deformations, "as many for incompressible materials");

/* Returns the parameter of sample k, 0 to FLESH_CURVE_STEPS. */
static double parameter_at(const flesh_deformation *of, int k)
{
  return of->start + (of->end - of->start) * k / FLESH_CURVE_STEPS;
}

/* Sets H to H - p d2J/dF2, where d2J/dF_ij dF_kl = e_ikm e_jln F_mn. */
static void press_hessian(double H[81], const double F[9], double p)
{
  for (int k = 0; k < 81; k++) {
    const int i = k / 27, j = k / 9 % 3, a = k / 3 % 3, b = k % 3;
    if (i == a || j == b) continue;
    const double sign = ((a - i + 3) % 3 == 1) == ((b - j + 3) % 3 == 1) ? 1 : -1;
    H[k] -= p * sign * F[3 * (3 - i - a) + 3 - j - b];
  }
}

/* Returns the smallest eigenvalue of H on the vectors orthogonal to n. n itself gets a value above all eigenvalues of
 * H. NaN if memory runs out. */
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

/* Subtracts from the stress the pressure that makes P_33 zero. Returns the smallest eigenvalue; NaN if there is
 * none. */
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

void flesh_curve_sample(const flesh_curve *curve, const flesh_deformation *deformation, double s, double *energy,
                        double quantities[FLESH_CURVE_QUANTITIES])
{
  const flesh_material *material = &curve->material;
  double F[9], P[9], values[9], vectors[81];
  deformation->at(s, F);
  *energy = quantities[0] = quantities[1] = quantities[2] = NAN;
  if (flesh_material_energy(material, F, energy)) return;
  quantities[0] = *energy - curve->rest_value;
  if (!material->incompressible && !flesh_material_eigen(material, F, values, vectors))
    quantities[2] = gsl_stats_min(values, 1, 9);
  if (flesh_material_stress(material, F, P)) return;
  if (material->incompressible) quantities[2] = press(material, F, P);
  quantities[1] =
      deformation->row < 0 ? sqrt(flesh_mat3_norm2(P)) : P[3 * deformation->row + deformation->column];
}

static const char tables[] =
    "CREATE TABLE given (mu, lambda, young, poisson);"
    "CREATE TABLE paths (path INTEGER PRIMARY KEY, name, title, parameter, stress, low, high);"
    "CREATE TABLE materials (line INTEGER PRIMARY KEY, energy, constants, label, colour, mu, lambda, twice);"
    "CREATE TABLE samples (path, line, point, s, psi, psi_minus_rest, stress, smallest_eigenvalue);";

static void insert_samples(sqlite3_stmt *row, int path, int line, const flesh_curves *all)
{
  const flesh_deformation *p = &all->deformations[path];
  for (int k = 0; k <= FLESH_CURVE_STEPS; k++) {
    double values[2 + FLESH_CURVE_QUANTITIES] = {parameter_at(p, k)};
    flesh_curve_sample(&all->curves[line], p, values[0], &values[1], values + 2);
    for (int v = 0; v < 2 + FLESH_CURVE_QUANTITIES; v++)
      if (!isfinite(values[v])) values[v] = NAN;
    flesh_database_put(row, "iiiddddd", path, line, k, values[0], values[1], values[2], values[3], values[4]);
  }
}

static void fill(sqlite3_stmt *const rows[4], const flesh_curves *all)
{
  flesh_database_put(rows[0], "dddd", all->mu, all->lambda, all->young, all->poisson);
  for (int c = 0; c < all->count; c++) {
    const flesh_material *m = &all->curves[c].material;
    flesh_database_put(rows[2], "ittttddi", c, flesh_energy_name(m->energy), flesh_constants_name(m->constants),
                       all->curves[c].label, flesh_forms[m->energy].colour, m->mu, m->incompressible ? NAN : m->lambda,
                       flesh_form_takes(m->energy, FLESH_CONSTANTS_AS_E));
  }
  for (int p = 0; p < FLESH_DEFORMATIONS; p++) {
    const flesh_deformation *of = &all->deformations[p];
    flesh_database_put(rows[1], "ittttdd", p, of->name, of->title, of->parameter, of->stress, fmin(of->start, of->end),
                       fmax(of->start, of->end));
    for (int c = 0; c < all->count; c++) insert_samples(rows[3], p, c, all);
  }
}

int flesh_curves_write(const char *folder, const flesh_curves *all, flesh_plot_outcome *outcome)
{
  static const char *const inserts[] = {
      "INSERT INTO given VALUES (?, ?, ?, ?)", "INSERT INTO paths VALUES (?, ?, ?, ?, ?, ?, ?)",
      "INSERT INTO materials VALUES (?, ?, ?, ?, ?, ?, ?, ?)", "INSERT INTO samples VALUES (?, ?, ?, ?, ?, ?, ?, ?)"};
  const char *const sql[] = {flesh_own_text("plot_same"), flesh_own_text("material"), NULL};
  const flesh_results to = {.out = folder, .draw = flesh_plot_draw_noted, .data = outcome};
  sqlite3_stmt *rows[4] = {NULL};
  sqlite3 *database = NULL;
  int bad = sqlite3_open(":memory:", &database) || sqlite3_exec(database, tables, NULL, NULL, NULL);
  for (int k = 0; k < 4 && !bad; k++) bad = sqlite3_prepare_v2(database, inserts[k], -1, &rows[k], NULL);
  if (!bad) fill(rows, all);
  for (int k = 0; k < 4; k++) sqlite3_finalize(rows[k]);
  const int status = bad || sqlite3_errcode(database) == SQLITE_NOMEM ? flesh_no_memory()
                                                                      : flesh_results_make(database, "the curves", sql, &to);
  sqlite3_close(database);
  return status;
}
