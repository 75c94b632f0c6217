/* rows.h: what the registry needs to know of the effects that keep their keys in their own files: the struct that the
 * keys are read into, the keys, and what puts them into a system. */
#ifndef FLESH_EFFECT_ROWS_H
#define FLESH_EFFECT_ROWS_H

#include "effect/amplitude.h"
#include "effect/registry.h"
#include "effect/selection.h"

/* flesh_body.instructions of the whole scene. */
typedef struct flesh_elasticity_parameters {
  int instructions;
} flesh_elasticity_parameters;

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

typedef struct flesh_load_parameters {
  flesh_selection selection;
  double vector[3]; /* N, Pa */
  flesh_amplitude_parameters amplitude;
} flesh_load_parameters;
extern const flesh_key flesh_force_keys[], flesh_traction_keys[];
int flesh_force_add(const void *parameters, const flesh_body *body, flesh_system *system);
int flesh_traction_add(const void *parameters, const flesh_body *body, flesh_system *system);

typedef struct flesh_pressure_parameters {
  flesh_selection selection;
  double pressure;
  flesh_amplitude_parameters amplitude;
} flesh_pressure_parameters;
extern const flesh_key flesh_pressure_keys[];
int flesh_pressure_add(const void *parameters, const flesh_body *body, flesh_system *system);

typedef struct flesh_contact_parameters {
  struct {
    double point[3], normal[3];
  } plane;
  struct {
    double centre[3], radius;
  } sphere;
  struct {
    double from[3], to[3], radius;
  } capsule;
  char *mesh;
  double stiffness, thickness, friction, slip_speed, centre[3];
  int interpolation;
  flesh_objects motion;
} flesh_contact_parameters;

extern const flesh_key flesh_contact_keys[];
int flesh_contact_add(const void *parameters, const flesh_body *body, flesh_system *system);

typedef struct flesh_calm_parameters {
  double rate, speed, from, until;
} flesh_calm_parameters;
extern const flesh_key flesh_calm_keys[];
int flesh_calm_add(const void *parameters, const flesh_body *body, flesh_system *system);

#endif
