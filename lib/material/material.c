/* material.c: making a material from its constants, with the map and the limits of each form. */
#include "flesh/material.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "material/psi.h"

static const char *const energy_names[] = {
    [FLESH_ENERGY_NEO] = "Neo", [FLESH_ENERGY_A] = "A", [FLESH_ENERGY_B] = "B",
    [FLESH_ENERGY_C] = "C",     [FLESH_ENERGY_M] = "M", [FLESH_ENERGY_D] = "D",
    [FLESH_ENERGY_E] = "E",     [FLESH_ENERGY_S] = "S", [FLESH_ENERGY_USER] = "user"};

static const char *const constants_names[] = {[FLESH_CONSTANTS_RAW] = "raw",
                                              [FLESH_CONSTANTS_MATCHED] = "matched",
                                              [FLESH_CONSTANTS_AS_E] = "as_e"};
enum { CONSTANTS_COUNT = sizeof constants_names / sizeof *constants_names };

const char *flesh_energy_name(flesh_energy energy)
{
  return (unsigned)energy <= FLESH_ENERGY_USER ? energy_names[energy] : "unknown";
}

const char *flesh_constants_name(flesh_constants constants)
{
  return (unsigned)constants < CONSTANTS_COUNT ? constants_names[constants] : "unknown";
}

int flesh_energy_from_name(const char *name, flesh_energy *energy)
{
  for (int e = 0; name && e < FLESH_ENERGY_COUNT; e++)
    if (!strcmp(name, energy_names[e])) {
      *energy = (flesh_energy)e;
      return FLESH_OK;
    }
  return flesh_fail(FLESH_ERR_ARGUMENT,
                    "energy is '%s'; it must be one of Neo, A, B, C, M, D, E, S", name ? name : "");
}

int flesh_constants_from_name(const char *name, flesh_constants *constants)
{
  for (int c = 0; name && c < CONSTANTS_COUNT; c++)
    if (!strcmp(name, constants_names[c])) {
      *constants = (flesh_constants)c;
      return FLESH_OK;
    }
  return flesh_fail(FLESH_ERR_ARGUMENT, "constants is '%s'; it must be one of raw, matched, as_e",
                    name ? name : "");
}

/* Whether the form takes this kind of constants at all. */
static int check_kind(flesh_energy energy, flesh_constants constants)
{
  if ((unsigned)energy >= FLESH_ENERGY_COUNT)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "energy is number %d, which is no built-in form; it must be one of "
                      "Neo, A, B, C, M, D, E, S",
                      (int)energy);
  if ((unsigned)constants >= CONSTANTS_COUNT)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "constants is number %d; it must be one of raw, matched, as_e",
                      (int)constants);
  const char *name = energy_names[energy];
  if (constants == FLESH_CONSTANTS_AS_E && energy != FLESH_ENERGY_D)
    return flesh_fail(
        FLESH_ERR_ARGUMENT,
        "constants is as_e with energy %s; as_e is for energy D only, %s takes %s", name, name,
        energy == FLESH_ENERGY_C || energy == FLESH_ENERGY_M ? "raw" : "raw or matched");
  if (constants == FLESH_CONSTANTS_MATCHED &&
      (energy == FLESH_ENERGY_C || energy == FLESH_ENERGY_M || energy == FLESH_ENERGY_D))
    return flesh_fail(
        FLESH_ERR_ARGUMENT,
        "constants is matched with energy %s, which is stressed at rest and matches no "
        "small-strain constants; it must be %s",
        name, energy == FLESH_ENERGY_D ? "raw or as_e" : "raw");
  return FLESH_OK;
}

/* Raw constants below these have no stable rest state (or no lower bound) to be at rest in. */
static int check_raw(flesh_energy energy, double mu, double lambda)
{
  double limit = 0;
  const char *formula = NULL, *reason = "for a stable rest state";
  int at_limit = 0; /* whether lambda may equal the limit */
  switch (energy) {
  case FLESH_ENERGY_E:
    limit = mu / 3, formula = "mu/3";
    break;
  case FLESH_ENERGY_S:
    limit = mu / 8, formula = "mu/8";
    break;
  case FLESH_ENERGY_B:
    limit = 0, formula = "0";
    break;
  case FLESH_ENERGY_NEO:
  case FLESH_ENERGY_A:
    limit = -2 * mu / 3, formula = "-2/3 mu";
    break;
  case FLESH_ENERGY_C:
  case FLESH_ENERGY_D:
    limit = 0, formula = "0", at_limit = 1;
    reason = "for an energy bounded from below";
    break;
  default:
    return FLESH_OK; /* M has no lambda */
  }
  if (lambda > limit || (at_limit && lambda == limit)) return FLESH_OK;
  if (limit == 0)
    return flesh_fail(FLESH_ERR_ARGUMENT, "raw lambda is %.15g; energy %s needs lambda %s 0 %s",
                      lambda, energy_names[energy], at_limit ? ">=" : ">", reason);
  return flesh_fail(FLESH_ERR_ARGUMENT,
                    "raw lambda is %.15g with mu %.15g; energy %s needs lambda > %s = %.15g %s",
                    lambda, mu, energy_names[energy], formula, limit, reason);
}

/* Maps checked small-strain constants to those of the form. */
static int make(flesh_energy energy, flesh_constants constants, double mu, double lambda,
                flesh_material *material)
{
  flesh_material m = {.psi = flesh_psi_builtin(energy),
                      .mu = mu,
                      .lambda = lambda,
                      .alpha = 1,
                      .energy = energy,
                      .constants = constants,
                      .young = NAN,
                      .poisson = NAN};
  if (constants == FLESH_CONSTANTS_AS_E) m.lambda = lambda + mu;
  if (constants == FLESH_CONSTANTS_MATCHED) {
    if (energy == FLESH_ENERGY_B) m.lambda = lambda + 2 * mu / 3;
    if (energy == FLESH_ENERGY_E) m.lambda = lambda + mu;
    if (energy == FLESH_ENERGY_S) m.mu = 4 * mu / 3, m.lambda = lambda + 5 * mu / 6;
  }
  if (!isfinite(m.mu) || !isfinite(m.lambda))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "mu is %.15g and lambda %.15g after mapping; both must be finite", m.mu,
                      m.lambda);
  if (energy == FLESH_ENERGY_E) m.alpha = 1 + m.mu / m.lambda;
  if (energy == FLESH_ENERGY_S) m.alpha = 1 + 0.75 * m.mu / m.lambda;
  *material = m;
  return FLESH_OK;
}

int flesh_material_from_lame(flesh_energy energy, flesh_constants constants, double mu,
                             double lambda, flesh_material *material)
{
  int status = check_kind(energy, constants);
  if (status) return status;
  if (!(mu > 0) || !isfinite(mu))
    return flesh_fail(FLESH_ERR_ARGUMENT, "mu is %.15g; it must be finite and > 0", mu);
  if (!isfinite(lambda))
    return flesh_fail(FLESH_ERR_ARGUMENT, "lambda is %.15g; it must be finite", lambda);
  if (constants == FLESH_CONSTANTS_RAW) status = check_raw(energy, mu, lambda);
  else if (!(lambda >= 0))
    status = flesh_fail(FLESH_ERR_ARGUMENT,
                        "lambda is %.15g; %s constants need lambda >= 0, that is Poisson's ratio "
                        "in [0, 0.5)",
                        lambda, constants_names[constants]);
  return status ? status : make(energy, constants, mu, lambda, material);
}

int flesh_material_from_young(flesh_energy energy, flesh_constants constants, double young,
                              double poisson, flesh_material *material)
{
  int status = check_kind(energy, constants);
  if (status) return status;
  if (!(young > 0) || !isfinite(young))
    return flesh_fail(FLESH_ERR_ARGUMENT, "young is %.15g; it must be finite and > 0", young);
  int raw = constants == FLESH_CONSTANTS_RAW;
  if (!(poisson < 0.5) || !(raw ? poisson > -1 : poisson >= 0))
    return flesh_fail(FLESH_ERR_ARGUMENT, "poisson is %.15g; it must be in %s with %s constants",
                      poisson, raw ? "(-1, 0.5)" : "[0, 0.5)", constants_names[constants]);
  double mu = young / (2 * (1 + poisson));
  double lambda = young * poisson / ((1 + poisson) * (1 - 2 * poisson));
  flesh_material m;
  status = flesh_material_from_lame(energy, constants, mu, lambda, &m);
  if (status)
    return flesh_fail_within(status,
                             "young %.15g and poisson %.15g give mu %.15g, lambda %.15g: ", young,
                             poisson, mu, lambda);
  m.young = young;
  m.poisson = poisson;
  *material = m;
  return FLESH_OK;
}

int flesh_material_from_psi(flesh_psi_function psi, const void *user, flesh_material *material)
{
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
