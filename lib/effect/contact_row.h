/* contact_row.h: contact as a scene names it. */
#ifndef FLESH_EFFECT_CONTACT_ROW_H
#define FLESH_EFFECT_CONTACT_ROW_H

#include "effect/registry.h"

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

/* clang-format off */
#define FLESH_CONTACT_ROW                                                                          \
  {"contact", "Keeps the body's nodes out of an obstacle, still or moving, by a smooth "            \
   "barrier that no node can pass, with friction. One obstacle each: plane, sphere, capsule or "   \
   "mesh. Histories have the columns contact_gap, contact_nodes and contact_force.",               \
   flesh_contact_keys, sizeof(flesh_contact_parameters),                                           \
   "{sphere: {centre: [0.4, 0.5, -1.3], radius: 0.7}, thickness: 2, stiffness: 1e5}",              \
   flesh_contact_add, 0}
/* clang-format on */

#endif
