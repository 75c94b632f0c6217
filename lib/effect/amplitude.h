/* amplitude.h: how much of a load acts at a time, and the scene keys that say so. */
#ifndef FLESH_EFFECT_AMPLITUDE_H
#define FLESH_EFFECT_AMPLITUDE_H

#include "base/key.h"
#include "effect/motion.h"
#include "flesh/effects.h"

typedef struct flesh_amplitude_copy {
  flesh_motion curve; /* the factor is its translation's first component; count 0: 1 */
  double from, until;
} flesh_amplitude_copy;

/* Checks and copies; NULL: 1 at all times. Free with flesh_amplitude_clear. */
int flesh_amplitude_take(const flesh_amplitude *amplitude, flesh_amplitude_copy *copy);
void flesh_amplitude_clear(flesh_amplitude_copy *amplitude);

/* The factor at t; 0 outside of from <= t < until. */
double flesh_amplitude_at(const flesh_amplitude_copy *amplitude, double t);
double flesh_amplitude_next_event(const flesh_amplitude_copy *amplitude, double t);

/* As a scene writes it. */
typedef struct flesh_amplitude_parameters {
  double from, until;
  int interpolation;
  flesh_objects curve;
} flesh_amplitude_parameters;
extern const flesh_key flesh_curve_keys[];
/* What the keys mean; borrows the parameters. */
flesh_amplitude flesh_amplitude_read(const flesh_amplitude_parameters *parameters);

/* clang-format off */
/* The two ends of an effect's action. */
#define FLESH_INTERVAL_KEYS(parameters)                                                            \
  {.name = "from", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, from), .unit = "s",    \
   .default_value = "-.inf", .doc = "start of its action"},                                        \
  {.name = "until", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, until), .unit = "s",  \
   .default_value = ".inf", .doc = "end of its action (release); it acts while from <= t < until"}

/* Of a struct that has a flesh_amplitude_parameters as `member`. */
#define FLESH_AMPLITUDE_KEYS(parameters, member)                                                   \
  {.name = "curve", .type = FLESH_KEY_OBJECTS, .offset = offsetof(parameters, member.curve),       \
   .default_value = "", .children = flesh_curve_keys, .child_size = sizeof(flesh_curve_point),     \
   .doc = "factor of the load in time; constant before the first and after the last point; "       \
          "without it 1"},                                                                         \
  {.name = "interpolation", .type = FLESH_KEY_CHOICE,                                              \
   .offset = offsetof(parameters, member.interpolation), .choices = flesh_interpolation_names,     \
   .default_value = "linear",                                                                      \
   .doc = "between the curve's points: linear, or smooth (cubic, at rest at every point)"},        \
  {.name = "from", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, member.from),          \
   .unit = "s", .default_value = "-.inf", .doc = "start of its action"},                           \
  {.name = "until", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, member.until),        \
   .unit = "s", .default_value = ".inf",                                                           \
   .doc = "end of its action (release); it acts while from <= t < until"}
/* clang-format on */

#endif
