/* effect_registry.h: the effects that a scene can name: one row each. Adding an effect is a file and a
 * row.
 *
 * A row's keys are read into its parameter struct, and `add` puts what they mean into the system.
 * The row's sample is a mapping in scene syntax that the derivative tests, the tests under every
 * method, the docs and the schema use.
 *
 * Nothing else knows what effects there are: an effect from outside the library
 * (drivers/examples/user_effect.c, a floor) is created by flesh_effect_create and added to the
 * system beside these, and a new row needs no change elsewhere. That goes for what couples nodes
 * too, through the effect's cells: forces in tets (viscosity, muscles; drivers/examples/coupled_reflex.c
 * has fibres of its own) have the tets as cells; welds and springs between nodes have pairs of
 * nodes; loads on surfaces have edges (pressure.c). Cells are fixed when the system is finished.
 * What couples nodes that come near each other, as contact of bodies does, has a memory
 * (flesh_effect_barrier). */
#ifndef FLESH_SCENE_EFFECT_REGISTRY_H
#define FLESH_SCENE_EFFECT_REGISTRY_H

#include "base/key.h"
#include "flesh/system.h"

/* How a rank makes an effect that knows a part of a split mesh alone (mesh/split.h), with two layers of tets around. */
typedef enum flesh_row_on_parts {
  FLESH_PARTS_REFUSED, /* it needs the whole: its count of nodes, say, or whether its surface is closed */
  FLESH_PARTS_NODES,   /* of the nodes and faces that it acts on here */
  FLESH_PARTS_TETS     /* of the rank's own tets */
} flesh_row_on_parts;

typedef struct flesh_effect_row {
  const char *name;
  const char *doc;
  const flesh_key *keys; /* of the mapping below the name; ended by a row without name */
  size_t parameters_size;
  const char *sample; /* for the unit cube [0,1]^3, "{...}" */
  /* Reads nothing but `parameters`; errors say what is wrong without file and line (the caller
   * knows them). */
  int (*add)(const void *parameters, const flesh_body *body, flesh_system *system);
  /* The nodes on which probes sum up what the effect bears, where these are not all; new *nodes [*count], freed by the
   * caller. NULL: none (a contact has all). */
  int (*bearers)(const void *parameters, const flesh_body *body, int *count, int **nodes);
  int once; /* of the whole body: a scene names it once at most */
  flesh_row_on_parts on_parts;
} flesh_effect_row;

/* ROW(name): flesh_effect_row_<name>, defined in effects/; in the order of the docs. */
#define FLESH_EFFECT_LIST(ROW)                                                                     \
  ROW(inertia)                                                                                   \
  ROW(elasticity)                                                                                \
  ROW(gravity)                                                                                   \
  ROW(pin)                                                                                       \
  ROW(prescribed_motion)                                                                         \
  ROW(spring)                                                                                    \
  ROW(force)                                                                                     \
  ROW(traction)                                                                                  \
  ROW(pressure)                                                                                  \
  ROW(drag)                                                                                      \
  ROW(buoyancy)                                                                                  \
  ROW(weld)                                                                                      \
  ROW(joint)                                                                                     \
  ROW(damping)                                                                                   \
  ROW(settling_damping)                                                                          \
  ROW(viscosity)                                                                                 \
  ROW(muscle)                                                                                    \
  ROW(contact)

#define FLESH_EFFECT_ROW_EXTERN(name) extern const flesh_effect_row flesh_effect_row_##name;
FLESH_EFFECT_LIST(FLESH_EFFECT_ROW_EXTERN)
#undef FLESH_EFFECT_ROW_EXTERN

/* All rows; *count of them. */
const flesh_effect_row *const *flesh_effect_registry(int *count);

/* flesh_body.instructions of the whole scene, as elasticity's row reads them. */
typedef struct flesh_elasticity_parameters {
  int instructions;
} flesh_elasticity_parameters;

#endif
