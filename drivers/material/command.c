/* command.c: `flesh material`: tabulates and draws the energies along stretch, scaling, flattening, shear and rotation,
 * and describes the rest state of each and where it breaks down. */
#include "commands.h"

#include <gsl/gsl_statistics_double.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/error.h"
#include "cli/lists.h"
#include "material/curves.h"
#include "cli/options.h"
#include "cli/output.h"
#include "material/form.h"
#include "study/embedded.h"

typedef struct request {
  const char *out, *energies;
  flesh_material_given given;
  int constants; /* flesh_constants */
  int chosen[FLESH_ENERGY_COUNT];
} request;

/* ---- options ---- */

static int read_energies(const char *list, int chosen[FLESH_ENERGY_COUNT])
{
  flesh_energy energies[FLESH_ENERGY_COUNT];
  int count = 0, status = list ? flesh_list_energies(list, FLESH_ENERGY_COUNT, energies, NULL, &count) : FLESH_OK;
  for (int e = 0; e < FLESH_ENERGY_COUNT; e++) chosen[e] = !list;
  for (int k = 0; k < count; k++) chosen[energies[k]] = 1;
  return status;
}

static int make_material(const request *r, flesh_energy energy, flesh_constants constants,
                         flesh_material *material)
{
  flesh_material_given given = r->given;
#define OF_OTHERS(FORM, name, ...) if (energy != FLESH_ENERGY_##FORM) given.name = NAN;
  FLESH_FORM_CONSTANT_LIST(OF_OTHERS)
#undef OF_OTHERS
  return flesh_material_from_given(energy, constants, &given, material);
}

static int complete(request *r)
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

static void add_curve(const request *r, flesh_energy energy, flesh_constants constants,
                      flesh_curves *all)
{
  static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  flesh_curve *curve = &all->curves[all->count];
  snprintf(curve->label, sizeof curve->label, "%s %s", flesh_energy_name(energy),
           flesh_constants_name(constants));
  int status = make_material(r, energy, constants, &curve->material);
  if (!status) {
    status = flesh_material_energy(&curve->material, identity, &curve->rest_value);
    if (status) flesh_fail(status, "its energy at rest is too large for a number");
  }
  if (status)
    fprintf(stderr, "flesh material: %s is left out: %s\n", curve->label, flesh_error_text());
  else all->count++;
}

static int make_curves(const request *r, flesh_curves *all)
{
  *all = (flesh_curves){.mu = r->given.mu, .lambda = r->given.lambda, .young = r->given.young, .poisson = r->given.poisson,
                         .deformations = r->given.poisson == 0.5 ? flesh_isochoric_deformations : flesh_deformations};
  if (isnan(r->given.mu)) {
    all->mu = r->given.young / (2 * (1 + r->given.poisson));
    all->lambda = r->given.young * r->given.poisson / ((1 + r->given.poisson) * (1 - 2 * r->given.poisson));
  }
  for (int e = 0; e < FLESH_ENERGY_COUNT; e++) {
    if (!r->chosen[e]) continue;
    flesh_energy energy = (flesh_energy)e;
    add_curve(r, energy, flesh_form_takes(energy, r->constants) ? r->constants : FLESH_CONSTANTS_RAW, all);
    if (flesh_form_takes(energy, FLESH_CONSTANTS_AS_E) && r->constants == FLESH_CONSTANTS_MATCHED)
      add_curve(r, energy, FLESH_CONSTANTS_AS_E, all);
  }
  return all->count ? FLESH_OK
                    : flesh_fail(FLESH_ERR_ARGUMENT, "no energy takes these constants; choose other constants or --energies");
}

/* ---- descriptions ---- */

static double flat_eigenvalue(const flesh_curve *curve, double thickness)
{
  double energy, q[FLESH_CURVE_QUANTITIES];
  flesh_curve_sample(curve, &flesh_deformations[FLESH_FLATTENING], thickness, &energy, q);
  return q[2];
}

/* Returns the thickness below 1 at which the smallest eigenvalue first becomes negative under flattening; NaN if it
 * stays positive as long as the energy is defined. */
static double softening(const flesh_curve *curve)
{
  double above = 1, limit = -1e-12 * curve->material.mu;
  for (int k = 0; k <= FLESH_CURVE_STEPS; k++) {
    double below = 1 - 2. * k / FLESH_CURVE_STEPS, value = flat_eigenvalue(curve, below);
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
static void describe_incompressible(const flesh_curve *curve)
{
  double mu;
  flesh_material_small_strain(&curve->material, &mu, NULL, NULL);
  printf("%-12s mu %.6g Pa; small strain mu %.6g Pa; J = 1, the pressure is that with which P_33 is 0\n", curve->label,
         curve->material.mu, mu);
}

static void describe(const flesh_curve *curve)
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

static int write_and_draw(const request *r, const flesh_curves *all)
{
  flesh_plot_outcome outcome = {0};
  int status = flesh_curves_write(r->out, all, &outcome);
  if (status) return status;
  printf("Given: mu %.6g Pa, lambda %.6g Pa", all->mu, all->lambda);
  if (!isnan(all->young)) printf(" (E %.6g Pa, nu %.15g)", all->young, all->poisson);
  printf("\n");
  for (int c = 0; c < all->count; c++)
    (all->curves[c].material.incompressible ? describe_incompressible : describe)(&all->curves[c]);
  printf("Table: %s/material.csv\n", r->out);
  status = flesh_plot_ended(&outcome); /* without gnuplot, the scripts are left to be run later */
  if (status) return status;
  printf("Pictures:");
  for (int p = 0; p < FLESH_DEFORMATIONS; p++) printf(" %s/%s.png", r->out, all->deformations[p].name);
  printf("\n");
  return FLESH_OK;
}

static int compare(const request *r)
{
  flesh_curves all;
  flesh_folder_claim claim = {.descriptor = -1};
  int status = make_curves(r, &all);
  if (!status) status = flesh_output_claim(r->out, "material", &claim);
  if (!status) status = write_and_draw(r, &all);
  flesh_folder_claim_release(&claim);
  return status;
}

/* The names of the forms for --help: ",Neo,A,...S". */
#define FORM_OF(NAME, name, text, ...) "," text

int flesh_command_material(int argc, char **argv)
{
  request r = {.constants = FLESH_CONSTANTS_MATCHED};
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
  int status = complete(&r);
  if (!status) status = compare(&r);
  return status ? flesh_command_fail("material", status) : 0;
}
