/* settling_damping.c: settling damping: its keys in a scene. */
#include "scene/effect_rows.h"

typedef struct parameters {
  double rate, speed, from, until;
} parameters;

static const flesh_key keys[] = {
    {.name = "rate", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, rate),
     .range = FLESH_RANGE_POSITIVE, .unit = "1/s", .doc = "rate at which velocities decay while the damping is on"},
    {.name = "speed", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, speed),
     .range = FLESH_RANGE_NOT_NEGATIVE, .unit = "m/s", .default_value = "0",
     .doc = "speed above which the damping is on: the body's root mean square speed at the step's start (with "
            "solver.lag_iterations above 1, at its end); it fades below this and is off below half of it; 0: on at "
            "any speed"},
    FLESH_INTERVAL_KEYS(parameters),
    {0}};

static int add(const void *values, const flesh_body *body, flesh_system *system)
{
  const parameters *p = values;
  flesh_effect *effect = NULL;
  int status = flesh_effect_settling_damping(body, p->rate, p->speed, p->from, p->until, &effect);
  return status ? status : flesh_system_add_effect(system, &effect);
}

const flesh_effect_row flesh_effect_row_settling_damping = {
    .name = "settling_damping",
    .doc = "Artificial damping, to reach equilibrium sooner: in proportion to mass, for a time or until the body is slow.",
    .keys = keys,
    .parameters_size = sizeof(parameters),
    .sample = "{rate: 20, speed: 0.5, until: 2}",
    .add = add,
    .on_parts = FLESH_PARTS_TETS,
};
