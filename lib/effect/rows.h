/* rows.h: what the registry needs to know of the effects that keep their keys in their own files: the struct that the
 * keys are read into, the keys, and what puts them into a system. */
#ifndef FLESH_EFFECT_ROWS_H
#define FLESH_EFFECT_ROWS_H

#include "effect/registry.h"
#include "effect/selection.h"

typedef struct flesh_damping_parameters {
  double mass, stiffness;
  int against;
} flesh_damping_parameters;
extern const flesh_key flesh_damping_keys[];
int flesh_damping_add(const void *parameters, const flesh_body *body, flesh_system *system);

typedef struct flesh_viscosity_parameters {
  double shear, bulk;
} flesh_viscosity_parameters;
extern const flesh_key flesh_viscosity_keys[];
int flesh_viscosity_add(const void *parameters, const flesh_body *body, flesh_system *system);

#endif
