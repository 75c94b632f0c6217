/* command.c: `flesh material`: tabulates and draws the energies along stretch, scaling, flattening, shear and rotation,
 * and describes the rest state of each and where it breaks down. data/studies/material.sql makes the table and the
 * pictures from a database in memory. */
#include "commands.h"

#include <assert.h>
#include <gsl/gsl_eigen.h>
#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <sqlite3.h>
#include <stdio.h>
#include <string.h>

#include "base/error.h"
#include "cli/lists.h"
#include "cli/options.h"
#include "cli/output.h"
#include "flesh/material.h"
#include "material/form.h"
#include "math/mat3.h"
#include "picture/plot.h"
#include "study/database.h"
#include "study/embedded.h"
#include "study/results.h"

enum {
  MOST_CURVES = 2 * FLESH_ENERGY_COUNT, /* some energies have two curves, as D raw and as_e */
  STEPS = 300,                          /* of a curve */
  QUANTITIES = 4,                       /* energy, energy above rest [J/m^3], stress, smallest eigenvalue [Pa] */
  DEFORMATIONS = 5,
  FLATTENING = 2 /* place in `deformations` */
};

/* A curve in every picture: an energy with one kind of constants. */
typedef struct curve {
  flesh_material material;
  char label[32]; /* "D raw" */
  double rest_value;
} curve;

/* A deformation F(s) for s from `start` to `end`. */
typedef struct deformation {
  const char *name, *title, *parameter, *stress; /* the last three in gnuplot's markup */
  double start, end;
  void (*at)(double s, double F[9]);
  int row, column; /* of the stress component that is drawn; row -1: |P| */
} deformation;

typedef struct comparison {
  const char *out, *energies;
  flesh_material_given given;
  int constants; /* flesh_constants */
  int chosen[FLESH_ENERGY_COUNT];
  double mu, lambda; /* small-strain constants, Pa; lambda is infinite at Poisson's ratio 1/2 */
  const deformation *deformations; /* [DEFORMATIONS] */
  int count;
  curve curves[MOST_CURVES]; /* to draw */
} comparison;

/* ---- deformations ---- */

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

static const deformation deformations[] = {
    {"stretch", "Uniaxial stretch, sides held: F = diag(s, 1, 1)",
                            "stretch s", "P_{11}", 0, 3, stretch_at, 0, 0},
    {"scale", "Uniform scaling through a point: F = s I", "scale s", "P_{11}",
                          1.25, -0.25, scale_at, 0, 0},
    [FLATTENING] = {"flatten", "Flattening through zero to inversion: F = diag(1, 1, s)",
                            "thickness s", "P_{33}", 2, -1, flatten_at, 2, 2},
    SHEAR,
    ROTATION};
static_assert(sizeof deformations / sizeof *deformations == DEFORMATIONS, "a row of every deformation");

static const deformation isochoric_deformations[] = {
    {"stretch", "Uniaxial stretch, sides free: F = diag(s, s^{-1/2}, s^{-1/2})", "stretch s", "P_{11}", 0.3, 3,
     uniaxial_at, 0, 0},
    {"biaxial", "Equibiaxial stretch, faces free: F = diag(s, s, s^{-2})", "stretch s", "P_{11}", 0.5, 2.5, biaxial_at, 0,
     0},
    {"planar", "Pure shear, faces free: F = diag(s, 1, 1/s)", "stretch s", "P_{11}", 0.3, 3, planar_at, 0, 0},
    SHEAR,
    ROTATION};
static_assert(sizeof isochoric_deformations == sizeof deformations, "as many for incompressible materials");

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

/* Computes the curve's quantities at parameter s; NaN for those that are not defined. The stress of an incompressible
 * material is P - p cof F with the pressure p for which P_33 is 0; its eigenvalue is the smallest over changes of F at
 * constant volume. */
static void sample(const curve *curve, const deformation *deformation, double s, double q[QUANTITIES])
{
  const flesh_material *material = &curve->material;
  double F[9], P[9], values[9], vectors[81];
  deformation->at(s, F);
  for (int k = 0; k < QUANTITIES; k++) q[k] = NAN;
  if (flesh_material_energy(material, F, &q[0])) return;
  q[1] = q[0] - curve->rest_value;
  if (!material->incompressible && !flesh_material_eigen(material, F, values, vectors)) q[3] = gsl_stats_min(values, 1, 9);
  if (flesh_material_stress(material, F, P)) return;
  if (material->incompressible) q[3] = press(material, F, P);
  q[2] = deformation->row < 0 ? sqrt(flesh_mat3_norm2(P)) : P[3 * deformation->row + deformation->column];
}

static const char tables[] =
    "CREATE TABLE given (mu, lambda, young, poisson);"
    "CREATE TABLE paths (path INTEGER PRIMARY KEY, name, title, parameter, stress, low, high);"
    "CREATE TABLE materials (line INTEGER PRIMARY KEY, energy, constants, label, colour, mu, lambda, twice);"
    "CREATE TABLE samples (path, line, point, s, psi, psi_minus_rest, stress, smallest_eigenvalue);";

static void insert_samples(sqlite3_stmt *row, int path, int line, const comparison *r)
{
  const deformation *p = &r->deformations[path];
  for (int k = 0; k <= STEPS; k++) {
    const double s = p->start + (p->end - p->start) * k / STEPS;
    double q[QUANTITIES];
    sample(&r->curves[line], p, s, q);
    for (int v = 0; v < QUANTITIES; v++)
      if (!isfinite(q[v])) q[v] = NAN;
    flesh_database_put(row, "iiiddddd", path, line, k, s, q[0], q[1], q[2], q[3]);
  }
}

static void fill(sqlite3_stmt *const rows[4], const comparison *r)
{
  flesh_database_put(rows[0], "dddd", r->mu, r->lambda, r->given.young, r->given.poisson);
  for (int c = 0; c < r->count; c++) {
    const flesh_material *m = &r->curves[c].material;
    flesh_database_put(rows[2], "ittttddi", c, flesh_energy_name(m->energy), flesh_constants_name(m->constants),
                       r->curves[c].label, flesh_forms[m->energy].colour, m->mu, m->incompressible ? NAN : m->lambda,
                       flesh_form_takes(m->energy, FLESH_CONSTANTS_AS_E));
  }
  for (int p = 0; p < DEFORMATIONS; p++) {
    const deformation *of = &r->deformations[p];
    flesh_database_put(rows[1], "ittttdd", p, of->name, of->title, of->parameter, of->stress, fmin(of->start, of->end),
                       fmax(of->start, of->end));
    for (int c = 0; c < r->count; c++) insert_samples(rows[3], p, c, r);
  }
}

/* Writes material.csv and, for every deformation, NAME.gp into the folder, and draws NAME.png. *outcome: outcome of the
 * drawing. */
static int write_curves(const comparison *r, flesh_plot_outcome *outcome)
{
  static const char *const inserts[] = {
      "INSERT INTO given VALUES (?, ?, ?, ?)", "INSERT INTO paths VALUES (?, ?, ?, ?, ?, ?, ?)",
      "INSERT INTO materials VALUES (?, ?, ?, ?, ?, ?, ?, ?)", "INSERT INTO samples VALUES (?, ?, ?, ?, ?, ?, ?, ?)"};
  const char *const sql[] = {flesh_own_text("plot_same"), flesh_own_text("material"), NULL};
  const flesh_results to = {.out = r->out, .draw = flesh_plot_draw_noted, .data = outcome};
  sqlite3_stmt *rows[4] = {NULL};
  sqlite3 *database = NULL;
  int bad = sqlite3_open(":memory:", &database) || sqlite3_exec(database, tables, NULL, NULL, NULL);
  for (int k = 0; k < 4 && !bad; k++) bad = sqlite3_prepare_v2(database, inserts[k], -1, &rows[k], NULL);
  if (!bad) fill(rows, r);
  for (int k = 0; k < 4; k++) sqlite3_finalize(rows[k]);
  const int status = bad || sqlite3_errcode(database) == SQLITE_NOMEM ? flesh_no_memory()
                                                                      : flesh_results_make(database, "the curves", sql, &to);
  sqlite3_close(database);
  return status;
}

/* ---- options ---- */

static int read_energies(const char *list, int chosen[FLESH_ENERGY_COUNT])
{
  flesh_energy energies[FLESH_ENERGY_COUNT];
  int count = 0, status = list ? flesh_list_energies(list, FLESH_ENERGY_COUNT, energies, NULL, &count) : FLESH_OK;
  for (int e = 0; e < FLESH_ENERGY_COUNT; e++) chosen[e] = !list;
  for (int k = 0; k < count; k++) chosen[energies[k]] = 1;
  return status;
}

static int make_material(const comparison *r, flesh_energy energy, flesh_constants constants,
                         flesh_material *material)
{
  flesh_material_given given = r->given;
#define OF_OTHERS(FORM, name, ...) if (energy != FLESH_ENERGY_##FORM) given.name = NAN;
  FLESH_FORM_CONSTANT_LIST(OF_OTHERS)
#undef OF_OTHERS
  return flesh_material_from_given(energy, constants, &given, material);
}

static int complete(comparison *r)
{
  if (!r->out || !*r->out)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "--out is missing; it must name a folder for the table and the pictures");
  int status = read_energies(r->energies, r->chosen);
  if (status) return status;
  int lame = !isnan(r->given.mu) + !isnan(r->given.lambda), young = !isnan(r->given.young) + !isnan(r->given.poisson);
  if (lame && young)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "--mu, --lambda and --young, --poisson were both given; choose one pair");
  if (lame == 1)
    return flesh_fail(FLESH_ERR_ARGUMENT, "--%s is missing; --mu and --lambda go together",
                      isnan(r->given.mu) ? "mu" : "lambda");
  if (isnan(r->given.young)) r->given.young = 1e5;
  if (isnan(r->given.poisson)) r->given.poisson = 0.45;
  if (lame) r->given.young = r->given.poisson = NAN;
  /* Reports errors that all forms have in common once; E and M have no limits of their own. */
  flesh_material any;
  int matched = r->constants == FLESH_CONSTANTS_MATCHED;
  return make_material(r, matched ? FLESH_ENERGY_E : FLESH_ENERGY_M, r->constants, &any);
}

static void add_curve(comparison *r, flesh_energy energy, flesh_constants constants)
{
  static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  curve *curve = &r->curves[r->count];
  snprintf(curve->label, sizeof curve->label, "%s %s", flesh_energy_name(energy),
           flesh_constants_name(constants));
  int status = make_material(r, energy, constants, &curve->material);
  if (!status) {
    status = flesh_material_energy(&curve->material, identity, &curve->rest_value);
    if (status) flesh_fail(status, "its energy at rest is too large for a number");
  }
  if (status)
    fprintf(stderr, "flesh material: %s is left out: %s\n", curve->label, flesh_error_text());
  else r->count++;
}

static int make_curves(comparison *r)
{
  const flesh_material_given *given = &r->given;
  const int young = isnan(given->mu);
  r->deformations = given->poisson == 0.5 ? isochoric_deformations : deformations;
  r->mu = young ? given->young / (2 * (1 + given->poisson)) : given->mu;
  r->lambda = young ? given->young * given->poisson / ((1 + given->poisson) * (1 - 2 * given->poisson)) : given->lambda;
  for (int e = 0; e < FLESH_ENERGY_COUNT; e++) {
    if (!r->chosen[e]) continue;
    flesh_energy energy = (flesh_energy)e;
    add_curve(r, energy, flesh_form_takes(energy, r->constants) ? r->constants : FLESH_CONSTANTS_RAW);
    if (flesh_form_takes(energy, FLESH_CONSTANTS_AS_E) && r->constants == FLESH_CONSTANTS_MATCHED)
      add_curve(r, energy, FLESH_CONSTANTS_AS_E);
  }
  return r->count ? FLESH_OK
                  : flesh_fail(FLESH_ERR_ARGUMENT, "no energy takes these constants; choose other constants or --energies");
}

/* ---- descriptions ---- */

static double flat_eigenvalue(const curve *curve, double thickness)
{
  double q[QUANTITIES];
  sample(curve, &deformations[FLATTENING], thickness, q);
  return q[3];
}

/* Returns the thickness below 1 at which the smallest eigenvalue first becomes negative under flattening; NaN if it
 * stays positive as long as the energy is defined. */
static double softening(const curve *curve)
{
  double above = 1, limit = -1e-12 * curve->material.mu;
  for (int k = 0; k <= STEPS; k++) {
    double below = 1 - 2. * k / STEPS, value = flat_eigenvalue(curve, below);
    if (isnan(value)) return NAN;
    if (value < limit) {
      for (int n = 0; n < 40; n++) {
        double middle = 0.5 * (above + below);
        if (flat_eigenvalue(curve, middle) < limit) below = middle;
        else above = middle;
      }
      return above;
    }
    above = below;
  }
  return NAN;
}

/* Describes an incompressible curve by its constants only: at a fixed volume there is no other rest state and no inversion. */
static void describe_incompressible(const curve *curve)
{
  double mu;
  flesh_material_small_strain(&curve->material, &mu, NULL, NULL);
  printf("%-12s mu %.6g Pa; small strain mu %.6g Pa; J = 1, the pressure is that with which P_33 is 0\n", curve->label,
         curve->material.mu, mu);
}

static void describe(const curve *curve)
{
  static const double nothing[9] = {0}, mirror[9] = {1, 0, 0, 0, 1, 0, 0, 0, -1},
                      flat[9] = {1, 0, 0, 0, 1, 0, 0, 0, 0};
  const flesh_material *m = &curve->material;
  double mu, lambda, stress, ratio, P[9], values[9], vectors[81];
  flesh_material_small_strain(m, &mu, &lambda, &stress);
  printf("%-12s mu %.6g Pa, lambda %.6g Pa", curve->label, m->mu, m->lambda);
  if (m->alpha != 1) printf(", alpha %.6g", m->alpha);
#define FORM_CONSTANT(FORM, name, ...) if (m->energy == FLESH_ENERGY_##FORM) printf(", " #name " %.6g", m->name);
  FLESH_FORM_CONSTANT_LIST(FORM_CONSTANT)
#undef FORM_CONSTANT
  printf("\n             at rest: ");
  if (fabs(stress) <= 1e-12 * m->mu)
    printf("no stress; small strain mu %.6g, lambda %.6g Pa", mu, lambda);
  else printf("stress %.6g Pa", stress);
  if (flesh_material_rest_ratio(m, &ratio)) printf("; a free body has no rest volume");
  else printf("; a free body rests at %.6g of its volume", ratio);
  printf("\n             beyond: ");
  int inverts = !flesh_material_stress(m, mirror, P);
  double soft = softening(curve);
  printf(inverts ? "never undefined" : "undefined for J <= 0");
  if (!flesh_material_stress(m, flat, P)) printf("; pressed flat by %.6g Pa", 0 - P[8]);
  else printf("; no finite pressure presses it flat");
  if (flat_eigenvalue(curve, 1) < -1e-12 * m->mu)
    printf("; its Hessian is indefinite already at rest");
  else if (isnan(soft)) printf("; flattening keeps its Hessian definite");
  else if (soft > 0.999) printf("; the least flattening makes its Hessian indefinite");
  else printf("; its Hessian is indefinite below thickness %.4g", soft);
  if (!flesh_material_eigen(m, nothing, values, vectors)) {
    const double smallest = gsl_stats_min(values, 1, 9);
    const int rests = !flesh_material_stress(m, nothing, P) && P[0] == 0 && P[4] == 0 && P[8] == 0;
    printf(smallest > 0                 ? "; F = 0 is a local minimum"
           : !rests                     ? "; F = 0 is no equilibrium"
           : smallest < -1e-12 * m->mu ? "; F = 0 is an unstable equilibrium"
                                        : "; F = 0 is an equilibrium of zero stiffness");
  }
  printf("\n");
}

static int write_and_draw(const comparison *r)
{
  flesh_plot_outcome outcome = {0};
  int status = write_curves(r, &outcome);
  if (status) return status;
  printf("Given: mu %.6g Pa, lambda %.6g Pa", r->mu, r->lambda);
  if (!isnan(r->given.young)) printf(" (E %.6g Pa, nu %.15g)", r->given.young, r->given.poisson);
  printf("\n");
  for (int c = 0; c < r->count; c++)
    (r->curves[c].material.incompressible ? describe_incompressible : describe)(&r->curves[c]);
  printf("Table: %s/material.csv\n", r->out);
  status = flesh_plot_ended(&outcome); /* without gnuplot, the scripts are left to be run later */
  if (status) return status;
  printf("Pictures:");
  for (int p = 0; p < DEFORMATIONS; p++) printf(" %s/%s.png", r->out, r->deformations[p].name);
  printf("\n");
  return FLESH_OK;
}

static int compare(comparison *r)
{
  flesh_folder_claim claim = {.descriptor = -1};
  int status = complete(r);
  if (!status) status = make_curves(r);
  if (!status) status = flesh_output_claim(r->out, "material", &claim);
  if (!status) status = write_and_draw(r);
  flesh_folder_claim_release(&claim);
  return status;
}

/* The names of the forms for --help: ",Neo,A,...S". */
#define FORM_OF(NAME, name, text, ...) "," text

int flesh_command_material(int argc, char **argv)
{
  comparison r = {.constants = FLESH_CONSTANTS_MATCHED};
  flesh_material_given_default(&r.given);
  const flesh_option rows[] = {
      {"out", "DIR", FLESH_OPTION_TEXT, &r.out, "folder of the table and the pictures (required)"},
      {"energies", "LIST", FLESH_OPTION_TEXT, &r.energies, &(FLESH_FORM_LIST(FORM_OF) " (default all)")[1]},
      {"young", "E", FLESH_OPTION_POSITIVE, &r.given.young, "Young's modulus, Pa (default 1e5)"},
      {"poisson", "NU", FLESH_OPTION_NUMBER, &r.given.poisson, "Poisson's ratio (default 0.45)"},
      {"mu", "MU", FLESH_OPTION_POSITIVE, &r.given.mu, "shear modulus instead, Pa; with --lambda"},
      {"lambda", "LAMBDA", FLESH_OPTION_NUMBER, &r.given.lambda, "first Lame constant, Pa; with --mu"},
#define FORM_CONSTANT(FORM, name, unit, least, usual, doc)                                                             \
  {#name, "NUMBER", FLESH_OPTION_NUMBER, &r.given.name, doc " (default " #usual ")"},
      FLESH_FORM_CONSTANT_LIST(FORM_CONSTANT)
#undef FORM_CONSTANT
      {"constants", "raw|matched", FLESH_OPTION_CHOICE, &r.constants, "the constants' meaning (default matched)"},
      {0}};
  const flesh_usage usage = {
      "material", "", "Compares the energies along simple deformations.", flesh_own_text("material_help"), 0, 0, rows, NULL, 0};
  int positionals, code = flesh_options_read(&usage, argc, argv, &positionals);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  const int status = compare(&r);
  return status ? flesh_command_fail("material", status) : 0;
}
