/* effect_rows.c: functions shared by the rows of effects. */
#include <stdlib.h>

#include "scene/effect_rows.h"

const flesh_key flesh_curve_keys[] = {
    {.name = "time", .type = FLESH_KEY_NUMBER, .offset = offsetof(flesh_curve_point, t), .unit = "s",
     .doc = "time of the point; times rise"},
    {.name = "value", .type = FLESH_KEY_NUMBER, .offset = offsetof(flesh_curve_point, value),
     .doc = "factor at this time"},
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

int flesh_effect_row_add_load(const flesh_load_parameters *p, const flesh_body *body, flesh_system *system,
                              int (*select)(const flesh_selection *, const flesh_body *, int *, int **),
                              int (*create)(const flesh_body *, int, const int *, const double[3], const flesh_amplitude *,
                                            flesh_effect **))
{
  const flesh_amplitude amplitude = flesh_amplitude_read(&p->amplitude);
  flesh_effect *effect = NULL;
  int count, *items = NULL, status = select(&p->selection, body, &count, &items);
  if (status) return status;
  status = create(body, count, items, p->vector, &amplitude, &effect);
  free(items);
  return status ? status : flesh_system_add_effect(system, &effect);
}
