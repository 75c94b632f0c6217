/* effect_rows.h: shared by the rows of effects (effects/): selections, amplitudes, intervals, axes. */
#ifndef FLESH_SCENE_EFFECT_ROWS_H
#define FLESH_SCENE_EFFECT_ROWS_H

#include "base/key.h"
#include "flesh/system.h"
#include "geometry/motion.h"
#include "scene/effect_registry.h"
#include "scene/selection.h"

/* Adds an effect to the system if `status`, that of its creation, is FLESH_OK; returns the status. */
int flesh_effect_row_add(flesh_system *system, int status, flesh_effect **effect);

/* Parameters of an amplitude, read from a scene. */
typedef struct flesh_amplitude_parameters {
  double from, until;
  int interpolation;
  flesh_objects points;
} flesh_amplitude_parameters;
extern const flesh_key flesh_curve_keys[];
/* Returns the amplitude of the parameters, which it borrows. */
flesh_amplitude flesh_amplitude_read(const flesh_amplitude_parameters *parameters);

/* Parameters of a dead load. */
typedef struct flesh_load_parameters {
  flesh_selection selection;
  double vector[3]; /* N, Pa */
  flesh_amplitude_parameters amplitude;
} flesh_load_parameters;
/* Finds the nodes or triangles of the selection by `select`, makes the load on them by `create` and adds it. */
int flesh_effect_row_add_load(const flesh_load_parameters *p, const flesh_body *body, flesh_system *system,
                              int (*select)(const flesh_selection *, const flesh_body *, int *, int **),
                              int (*create)(const flesh_body *, int, const int *, const double[3],
                                            const flesh_amplitude *, flesh_effect **));

/* clang-format off */
/* Keys of the interval in which an effect acts. */
#define FLESH_INTERVAL_KEYS(parameters)                                                            \
  {.name = "from", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, from), .unit = "s",    \
   .default_value = "-.inf", .doc = "start of the action"},                                        \
  {.name = "until", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, until), .unit = "s",  \
   .default_value = ".inf", .doc = "end of the action (release); it acts while from <= t < until"}

/* Key of the interpolation between points in time. */
#define FLESH_INTERPOLATION_KEY(at, points, each)                                                                     \
  {.name = "interpolation", .type = FLESH_KEY_CHOICE, .offset = (at), .choices = flesh_interpolation_names,           \
   .default_value = "linear", .doc = "between " points ": linear, or smooth (cubic, at rest at every " each ")"}

/* Keys of a struct that has a flesh_amplitude_parameters as `member`. */
#define FLESH_AMPLITUDE_KEYS(parameters, member)                                                   \
  {.name = "amplitude", .type = FLESH_KEY_OBJECTS, .offset = offsetof(parameters, member.points),       \
   .default_value = "", .children = flesh_curve_keys, .child_size = sizeof(flesh_curve_point),     \
   .doc = "factor of the load over time; constant before the first and after the last point. "     \
          "Default: 1"},                                                                           \
  FLESH_INTERPOLATION_KEY(offsetof(parameters, member.interpolation), "the amplitude's points", "point"), \
  {.name = "from", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, member.from),          \
   .unit = "s", .default_value = "-.inf", .doc = "start of the action"},                           \
  {.name = "until", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, member.until),        \
   .unit = "s", .default_value = ".inf",                                                           \
   .doc = "end of the action (release); it acts while from <= t < until"}
/* clang-format on */

/* Names of the bits of FLESH_AXIS_*. */
extern const char *const flesh_axis_names[];
/* clang-format off */
#define FLESH_AXES_KEY(parameters)                                                                       \
  {.name = "axes", .type = FLESH_KEY_SET, .offset = offsetof(parameters, axes),                    \
   .choices = flesh_axis_names, .default_value = "[x, y, z]", .doc = "the constrained components"}
/* clang-format on */

#endif
