/* effect_registry.h: the effects that a scene can name, one row each. Adding an effect takes a file and a row.
 *
 * A row's keys are read into its parameter struct, and `add` adds the effect that they describe to the system. The
 * row's sample is a mapping in scene syntax; the derivative tests, the tests under every method, the docs and the
 * schema use it.
 *
 * Nothing else knows which effects there are: an effect from outside the library (drivers/examples/user_effect.c, a
 * floor) is created by flesh_effect_create and added to the system like these, and a new row needs no change elsewhere.
 * This includes effects that couple nodes, through their cells: forces in tets (viscosity, muscles;
 * drivers/examples/coupled_reflex.c with its own fibres) have tets as cells, welds and springs between nodes have pairs
 * of nodes, loads on surfaces have edges (pressure.c). Cells are fixed when the system is finished. An effect that
 * couples nodes that come near each other, such as contact of bodies, has a memory (flesh_effect_barrier). */
#ifndef FLESH_SCENE_EFFECT_REGISTRY_H
#define FLESH_SCENE_EFFECT_REGISTRY_H

#include "base/key.h"
#include "flesh/system.h"

/* How a rank makes an effect when it has only a part of a split mesh (mesh/split.h), with two layers of tets around
 * it. */
typedef enum flesh_row_on_parts {
  FLESH_PARTS_REFUSED, /* not at all: it needs the whole mesh, as a weld, whose surfaces may be in two parts */
  FLESH_PARTS_NODES,   /* from the nodes and faces that it acts on here */
  FLESH_PARTS_TETS     /* from the rank's own tets */
} flesh_row_on_parts;

typedef struct flesh_effect_row {
  const char *name;
  const char *doc;
  const flesh_key *keys; /* keys of the mapping under the name; a row without name ends them */
  size_t parameters_size;
  const char *sample; /* for the unit cube [0,1]^3, "{...}" */
  /* Adds the effect to the system. Reads nothing but `parameters`; errors do not name file and line, which the caller
   * knows. */
  int (*add)(const void *parameters, const flesh_body *body, flesh_system *system);
  /* Gives the nodes over which probes sum the effect's forces, if these are not all, new *nodes [*count], freed by the
   * caller. NULL: no such nodes (a contact has all). */
  int (*bearers)(const void *parameters, const flesh_body *body, int *count, int **nodes);
  int once; /* 1: acts on the whole body, so a scene names it at most once */
  flesh_row_on_parts on_parts;
} flesh_effect_row;

/* ROW(name) stands for flesh_effect_row_<name>, defined in effects/; in the order of the docs. */
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

/* Returns all rows; *count is their number. */
const flesh_effect_row *const *flesh_effect_registry(int *count);

/* Parameters of elasticity's row; flesh_body.instructions of the whole scene comes from here. */
typedef struct flesh_elasticity_parameters {
  int instructions;
} flesh_elasticity_parameters;

#endif
