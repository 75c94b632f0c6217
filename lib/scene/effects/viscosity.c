/* viscosity.c: viscosity: its keys in a scene. */
#include "scene/effect_rows.h"

typedef struct parameters {
  double shear, bulk;
} parameters;

static const flesh_key keys[] = {
    {.name = "shear", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, shear),
     .range = FLESH_RANGE_NOT_NEGATIVE, .unit = "Pa s", .default_value = "0",
     .doc = "viscosity against changes of shape; shear modulus times a relaxation time"},
    {.name = "bulk", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, bulk),
     .range = FLESH_RANGE_NOT_NEGATIVE, .unit = "Pa s", .default_value = "0",
     .doc = "viscosity against changes of volume"},
    {0}};

static int add(const void *values, const flesh_body *body, flesh_system *system)
{
  const parameters *p = values;
  flesh_effect *effect = NULL;
  int status = flesh_effect_viscosity(body, p->shear, p->bulk, &effect);
  return status ? status : flesh_system_add_effect(system, &effect);
}

const flesh_effect_row flesh_effect_row_viscosity = {
    .name = "viscosity",
    .doc = "Kelvin-Voigt damping: stresses in proportion to the rate of the Green strain. Its forces have no torque, "
           "never add energy, and are 0 in rigid motion. Backward Euler and the midpoint rule take the rate as the "
           "difference of the Green strain over the step, other methods at their own point. So the midpoint rule "
           "keeps the angular momentum exactly, Newmark's and HHT within an error of order 2 in the step that does "
           "not add up, and the other methods lose as much of it as without viscosity. Methods of order 2 repeat "
           "their solves for it, which costs about half a step.",
    .keys = keys,
    .parameters_size = sizeof(parameters),
    .sample = "{shear: 300, bulk: 500}",
    .add = add,
    .on_parts = FLESH_PARTS_TETS,
};
