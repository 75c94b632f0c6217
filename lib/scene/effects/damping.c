/* damping.c: damping: its keys in a scene. */
#include <assert.h>

#include "scene/effect_rows.h"

typedef struct parameters {
  double mass, stiffness;
  int stiffness_at;
} parameters;

static const char *const stiffnesses[] = {"initial", "current", NULL}; /* in the order of flesh_stiffness */
static_assert(sizeof stiffnesses / sizeof *stiffnesses == FLESH_STIFFNESS_CURRENT + 2, "a name of every stiffness");

static const flesh_key keys[] = {
    {.name = "mass", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, mass),
     .range = FLESH_RANGE_NOT_NEGATIVE, .unit = "1/s", .default_value = "0",
     .doc = "coefficient a of r = a M v: damping ratio a/(2 w) for a mode of angular frequency w; brakes rigid "
            "motion, too"},
    {.name = "stiffness", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, stiffness),
     .range = FLESH_RANGE_NOT_NEGATIVE, .unit = "s", .default_value = "0",
     .doc = "coefficient b of r = b K v: damping ratio b w/2 for a mode of angular frequency w, the largest for fast "
            "modes; above poisson 0.45, K has the bulk part of 0.45, so that strains that keep the volume are damped "
            "as at 0.5"},
    {.name = "stiffness_at", .type = FLESH_KEY_CHOICE, .offset = offsetof(parameters, stiffness_at),
     .choices = stiffnesses, .default_value = "initial",
     .doc = "stiffness K: initial, of the rest shape, is cheap, but brakes a body that has turned; current, of the "
            "previous step (of the same step in the second solve that methods of order 2 make), with negative "
            "curvature removed, always dissipates"},
    {0}};

static int add(const void *values, const flesh_body *body, flesh_system *system)
{
  const parameters *p = values;
  flesh_effect *effect = NULL;
  int status = flesh_effect_damping(body, p->mass, p->stiffness, (flesh_stiffness)p->stiffness_at, &effect);
  return status ? status : flesh_system_add_effect(system, &effect);
}

const flesh_effect_row flesh_effect_row_damping = {
    .name = "damping",
    .doc = "Rayleigh damping: forces against velocity in proportion to mass and stiffness. It adds to the damping of "
           "backward Euler and other methods that damp by themselves. All of it brakes turning, with the current "
           "stiffness by an amount of the order of the step; the effect viscosity does not.",
    .keys = keys,
    .parameters_size = sizeof(parameters),
    .sample = "{mass: 2, stiffness: 0.01, stiffness_at: current}",
    .add = add,
    .on_parts = FLESH_PARTS_TETS,
};
