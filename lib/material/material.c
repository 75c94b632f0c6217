/* material.c: makes a material from its constants, with the map and the limits of each form. */
#include "flesh/material.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/error.h"
#include "base/text.h"
#include "material/psi.h"
#include "material/psi_forms.h"

static const char *const constants_names[] = {[FLESH_CONSTANTS_RAW] = "raw",
                                              [FLESH_CONSTANTS_MATCHED] = "matched",
                                              [FLESH_CONSTANTS_AS_E] = "as_e"};
enum { CONSTANTS_COUNT = sizeof constants_names / sizeof *constants_names };
static_assert(CONSTANTS_COUNT == FLESH_CONSTANTS_AS_E + 1, "a name of every kind of constants");

const char *flesh_energy_name(flesh_energy energy)
{
  return (unsigned)energy < FLESH_ENERGY_COUNT ? flesh_forms[energy].name
         : energy == FLESH_ENERGY_USER          ? "user"
                                                : "unknown";
}

const char *flesh_constants_name(flesh_constants constants)
{
  return (unsigned)constants < CONSTANTS_COUNT ? constants_names[constants] : "unknown";
}

int flesh_energy_from_name(const char *name, flesh_energy *energy)
{
  FLESH_NEED({name, "name"}, {energy, "energy"});
  for (int e = 0; name && e < FLESH_ENERGY_COUNT; e++)
    if (!strcmp(name, flesh_forms[e].name) || !strcmp(name, flesh_forms[e].full_name)) {
      *energy = (flesh_energy)e;
      return FLESH_OK;
    }
  return flesh_fail(FLESH_ERR_ARGUMENT, "energy is '%s'; it must be one of %s", name ? name : "", FLESH_FORM_NAMES);
}

int flesh_constants_from_name(const char *name, flesh_constants *constants)
{
  FLESH_NEED({name, "name"}, {constants, "constants"});
  for (int c = 0; name && c < CONSTANTS_COUNT; c++)
    if (!strcmp(name, constants_names[c])) {
      *constants = (flesh_constants)c;
      return FLESH_OK;
    }
  return flesh_fail(FLESH_ERR_ARGUMENT, "constants is '%s'; it must be one of raw, matched, as_e",
                    name ? name : "");
}

/* Returns the kinds of constants that the form takes, such as "raw or matched". */
static const char *kinds_of(flesh_energy energy, char text[64])
{
  *text = 0;
  for (int c = 0; c < CONSTANTS_COUNT; c++)
    if (flesh_form_takes(energy, (flesh_constants)c)) flesh_text_add(text, 64, "%s%s", *text ? " or " : "", constants_names[c]);
  return text;
}

/* Returns the forms that take this kind of constants, such as "D". */
static const char *forms_with(flesh_constants constants, char text[256])
{
  *text = 0;
  for (int e = 0; e < FLESH_ENERGY_COUNT; e++)
    if (flesh_form_takes((flesh_energy)e, constants)) flesh_text_add(text, 256, "%s%s", *text ? ", " : "", flesh_forms[e].name);
  return text;
}

/* Checks that the form takes this kind of constants. */
static int check_kind(flesh_energy energy, flesh_constants constants)
{
  if ((unsigned)energy >= FLESH_ENERGY_COUNT)
    return flesh_fail(FLESH_ERR_ARGUMENT, "energy is number %d, which is no built-in form; it must be one of %s",
                      (int)energy, FLESH_FORM_NAMES);
  if ((unsigned)constants >= CONSTANTS_COUNT)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "constants is number %d; it must be one of raw, matched, as_e",
                      (int)constants);
  if (flesh_form_takes(energy, constants)) return FLESH_OK;
  char kinds[64], forms[256];
  const char *name = flesh_forms[energy].name;
  if (constants == FLESH_CONSTANTS_AS_E)
    return flesh_fail(FLESH_ERR_ARGUMENT, "constants is as_e with energy %s; as_e is for energy %s only, %s takes %s",
                      name, forms_with(constants, forms), name, kinds_of(energy, kinds));
  return flesh_fail(FLESH_ERR_ARGUMENT,
                    "constants is matched with energy %s, which is stressed at rest and matches no "
                    "small-strain constants; it must be %s",
                    name, kinds_of(energy, kinds));
}

/* Columns of a row that are formulas of mu and lambda. */
typedef struct constants_of_form {
  double limit, mu, lambda, alpha;
} constants_of_form;

static constants_of_form formulas(flesh_energy energy, const flesh_material *m)
{
  const double mu = m->mu, lambda = m->lambda;
#define LOCAL(FORM, name, ...)                                                                                         \
  const double name = m->name;                                                                                         \
  (void)name;
  FLESH_FORM_CONSTANT_LIST(LOCAL)
#undef LOCAL
  switch (energy) {
#define FORMULAS(NAME, name, text, full, volume, takes, colour, formula, source, limit, limit_text, equal, matched_mu, \
                 matched_lambda, alpha, volume_term)                                                                   \
  case FLESH_ENERGY_##NAME:                                                                                            \
    return (constants_of_form){limit, matched_mu, matched_lambda, alpha};
    FLESH_FORM_LIST(FORMULAS)
#undef FORMULAS
  case FLESH_ENERGY_USER:
    break;
  }
  return (constants_of_form){-INFINITY, mu, lambda, 1};
}

/* Takes the constants beyond mu and lambda: those given, or the usual ones for the small-strain mu. */
static int take_constants(flesh_energy energy, const flesh_material_given *given, double mu, flesh_material *m)
{
  (void)mu;
#define TAKE(FORM, name_, unit, least, usual, doc)                                                                     \
  if (energy == FLESH_ENERGY_##FORM) {                                                                                 \
    m->name_ = isnan(given->name_) ? (usual) : given->name_;                                                           \
    if (!(m->name_ >= (least)) || isinf(m->name_))                                                                     \
      return flesh_fail(FLESH_ERR_ARGUMENT, #name_ " is %.15g; it must be finite and >= %.15g", m->name_,              \
                        (double)(least));                                                                              \
  } else if (!isnan(given->name_))                                                                                     \
    return flesh_fail(FLESH_ERR_ARGUMENT, #name_ " is given with energy %s; it is a constant of %s",                   \
                      flesh_forms[energy].name, flesh_forms[FLESH_ENERGY_##FORM].name);
  FLESH_FORM_CONSTANT_LIST(TAKE)
#undef TAKE
  return FLESH_OK;
}

/* Checks lambda against the form's limit; below it there is no stable rest state, or no lower bound of the energy. */
static int check_limit(flesh_energy energy, const flesh_material *m)
{
  const flesh_form *form = &flesh_forms[energy];
  const char *kind = constants_names[m->constants];
  double mu = m->mu, lambda = m->lambda, limit = formulas(energy, m).limit;
  if (!form->limit || lambda > limit || (form->at_limit && lambda == limit)) return FLESH_OK;
  const char *reason = form->at_limit ? "for an energy bounded from below" : "for a stable rest state";
  const char *sign = form->at_limit ? ">=" : ">";
  if (limit == 0)
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s lambda is %.15g; energy %s needs lambda %s 0 %s", kind,
                      lambda, form->name, sign, reason);
  return flesh_fail(FLESH_ERR_ARGUMENT,
                    "%s lambda is %.15g with mu %.15g; energy %s needs lambda %s %s = %.15g %s", kind,
                    lambda, mu, form->name, sign, form->limit, limit, reason);
}

/* Checks that small-strain constants have a positive bulk modulus. */
static int check_bulk(flesh_constants constants, double mu, double lambda)
{
  if (lambda > -2 * mu / 3) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT,
                    "lambda is %.15g with mu %.15g; %s constants need lambda > -2/3 mu = %.15g, that is Poisson's ratio "
                    "in (-1, 0.5)",
                    lambda, mu, constants_names[constants], -2 * mu / 3);
}

/* Largest lambda over mu: there the rounding of J changes stresses by about 1e-7 mu. At 1e13 the rounding for a body at
 * rest exceeds its weight, and solves end before anything has moved. */
static const double stiffest = 1e9;

/* Maps checked small-strain constants to those of the form. */
static int make(flesh_energy energy, flesh_constants constants, flesh_material *m)
{
  double mu = m->mu, lambda = m->lambda;
  if (constants == FLESH_CONSTANTS_AS_E) m->lambda = lambda + mu;
  if (constants == FLESH_CONSTANTS_MATCHED) {
    constants_of_form matched = formulas(energy, m);
    m->mu = matched.mu, m->lambda = matched.lambda;
  }
  if (!isfinite(m->mu) || !isfinite(m->lambda))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "mu is %.15g and lambda %.15g after mapping; both must be finite", m->mu,
                      m->lambda);
  m->alpha = formulas(energy, m).alpha;
  return check_limit(energy, m);
}

/* Makes a material from mu and lambda of `given`; kind and pair have been checked. */
static int from_lame(flesh_energy energy, flesh_constants constants, double mu, double lambda,
                     const flesh_material_given *given, flesh_material *material)
{
  if (!(mu > 0) || !isfinite(mu))
    return flesh_fail(FLESH_ERR_ARGUMENT, "mu is %.15g; it must be finite and > 0", mu);
  if (!isfinite(lambda))
    return flesh_fail(FLESH_ERR_ARGUMENT, "lambda is %.15g; it must be finite", lambda);
  if (lambda > stiffest * mu)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "lambda is %.15g with mu %.15g; it must be at most %g mu, as rounding errors of the volume term hide "
                      "other stresses beyond; poisson 0.5 is without them",
                      lambda, mu, stiffest);
  flesh_material m = {.psi = flesh_psi_builtin(energy),
                      .mu = mu,
                      .lambda = lambda,
                      .alpha = 1,
                      .energy = energy,
                      .constants = constants,
                      .young = NAN,
                      .poisson = NAN};
  int status = take_constants(energy, given, mu, &m);
  if (status) return status;
  if (constants != FLESH_CONSTANTS_RAW) status = check_bulk(constants, mu, lambda);
  if (!status) status = make(energy, constants, &m);
  if (!status) *material = m;
  return status;
}

static int from_young(flesh_energy energy, flesh_constants constants, const flesh_material_given *given,
                      flesh_material *material)
{
  double young = given->young, poisson = given->poisson;
  if (!(young > 0) || !isfinite(young))
    return flesh_fail(FLESH_ERR_ARGUMENT, "young is %.15g; it must be finite and > 0", young);
  const int incompressible = poisson == 0.5;
  if (!(poisson > -1 && poisson <= 0.5))
    return flesh_fail(FLESH_ERR_ARGUMENT, "poisson is %.15g; it must be in (-1, 0.5]", poisson);
  if (incompressible && flesh_forms[energy].volume_term == FLESH_VOLUME_NONE)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "poisson is 0.5 with energy %s, which has no volume term that would vanish at J = 1; it must be "
                      "less than 0.5",
                      flesh_forms[energy].name);
  if (!incompressible && poisson > stiffest / (2 * (stiffest + 1)))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "poisson is 0.5 - %.3g; it must be at most %.10g, above which rounding errors of the volume term "
                      "hide other stresses, or 0.5, which has none of these errors",
                      0.5 - poisson, stiffest / (2 * (stiffest + 1)));
  const double ratio = incompressible ? FLESH_REFERENCE_POISSON : poisson;
  double mu = young / (2 * (1 + poisson));
  double lambda = 2 * mu * ratio / (1 - 2 * ratio);
  if (!incompressible) lambda = young * poisson / ((1 + poisson) * (1 - 2 * poisson));
  flesh_material m;
  int status = from_lame(energy, constants, mu, lambda, given, &m);
  if (status)
    return flesh_fail_within(status,
                             "young %.15g and poisson %.15g give mu %.15g, lambda %.15g: ", young,
                             poisson, mu, lambda);
  m.young = young;
  m.poisson = poisson;
  m.incompressible = incompressible;
  if (incompressible) m.alpha = 1; /* the limit as lambda goes to infinity */
  *material = m;
  return FLESH_OK;
}

void flesh_material_given_default(flesh_material_given *given)
{
#define NOT_GIVEN(FORM, name_, ...) .name_ = NAN,
  *given = (flesh_material_given){
      .mu = NAN, .lambda = NAN, .young = NAN, .poisson = NAN, FLESH_FORM_CONSTANT_LIST(NOT_GIVEN)};
#undef NOT_GIVEN
}

int flesh_material_from_given(flesh_energy energy, flesh_constants constants, const flesh_material_given *given,
                              flesh_material *material)
{
  FLESH_NEED({given, "given"}, {material, "material"});
  int status = check_kind(energy, constants);
  if (status) return status;
  int lame = !isnan(given->mu) + !isnan(given->lambda), young = !isnan(given->young) + !isnan(given->poisson);
  if (lame && !young) return from_lame(energy, constants, given->mu, given->lambda, given, material);
  if (young && !lame) return from_young(energy, constants, given, material);
  return flesh_fail(FLESH_ERR_ARGUMENT, "%s of the pairs mu, lambda and young, poisson is given; it must be one",
                    lame ? "more than one" : "none");
}

int flesh_material_from_lame(flesh_energy energy, flesh_constants constants, double mu,
                             double lambda, flesh_material *material)
{
  FLESH_NEED({material, "material"});
  flesh_material_given given;
  flesh_material_given_default(&given);
  int status = check_kind(energy, constants);
  return status ? status : from_lame(energy, constants, mu, lambda, &given, material);
}

int flesh_material_from_young(flesh_energy energy, flesh_constants constants, double young,
                              double poisson, flesh_material *material)
{
  FLESH_NEED({material, "material"});
  flesh_material_given given;
  flesh_material_given_default(&given);
  given.young = young, given.poisson = poisson;
  int status = check_kind(energy, constants);
  return status ? status : from_young(energy, constants, &given, material);
}

int flesh_material_from_psi(flesh_psi_function psi, const void *user, flesh_material *material)
{
  FLESH_NEED({material, "material"});
  if (!psi) return flesh_fail(FLESH_ERR_ARGUMENT, "psi is NULL; it must be a function psi(I_C, J)");
  *material = (flesh_material){.psi = psi,
                               .mu = NAN,
                               .lambda = NAN,
                               .alpha = 1,
                               .energy = FLESH_ENERGY_USER,
                               .constants = FLESH_CONSTANTS_RAW,
                               .young = NAN,
                               .poisson = NAN,
                               .user = user};
  return FLESH_OK;
}
