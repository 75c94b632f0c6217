/* effect_rows.c: what the rows of effects share. */
#include "scene/effect_rows.h"

const flesh_key flesh_curve_keys[] = {
    {.name = "time", .type = FLESH_KEY_NUMBER, .offset = offsetof(flesh_curve_point, t), .unit = "s",
     .doc = "when; points ascend in time"},
    {.name = "value", .type = FLESH_KEY_NUMBER, .offset = offsetof(flesh_curve_point, value),
     .doc = "of the factor"},
    {0}};

flesh_amplitude flesh_amplitude_read(const flesh_amplitude_parameters *p)
{
  return (flesh_amplitude){.count = p->points.count, .points = p->points.values,
                           .smooth = p->interpolation, .from = p->from, .until = p->until};
}

const char *const flesh_axis_names[] = {"x", "y", "z", NULL};

int flesh_effect_row_add(flesh_system *system, int status, flesh_effect **effect)
{
  return status ? status : flesh_system_add_effect(system, effect);
}
