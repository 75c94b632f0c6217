/* registry.c: the effects that a scene can name. Add a row and the rest follows: parsing, docs. */
#include "effect/registry.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "effect/motion.h"
#include "effect/rows.h"
#include "effect/selection.h"

static const flesh_key no_keys[] = {{0}};

static int add(flesh_system *system, int status, flesh_effect **effect)
{
  return status ? status : flesh_system_add_effect(system, effect);
}

static int add_inertia(const void *parameters, const flesh_body *body, flesh_system *system)
{
  (void)parameters;
  flesh_effect *effect = NULL;
  return add(system, flesh_effect_inertia(body, &effect), &effect);
}

static const char *const instructions[] = {"auto", "portable", "avx2", "avx512", NULL};
static_assert(sizeof instructions / sizeof *instructions == FLESH_INSTRUCTIONS_COUNT + 1,
              "instructions are in the order of flesh_instructions");

static const flesh_key elasticity_keys[] = {
    {.name = "instructions", .type = FLESH_KEY_CHOICE,
     .offset = offsetof(flesh_elasticity_parameters, instructions), .choices = instructions,
     .default_value = "auto",
     .doc = "vector instructions of the elements, in all of the scene's effects: auto, the best of this "
            "machine, or always the same ones; results are the same bits with the same ones on the same "
            "build, else they agree to rounding"},
    {0}};

static int add_elasticity(const void *parameters, const flesh_body *body, flesh_system *system)
{
  (void)parameters; /* what they say is the body's */
  flesh_effect *effect = NULL;
  return add(system, flesh_effect_elasticity(body, &effect), &effect);
}

typedef struct gravity_parameters {
  double acceleration[3];
} gravity_parameters;

static const flesh_key gravity_keys[] = {
    {.name = "acceleration", .type = FLESH_KEY_VECTOR,
     .offset = offsetof(gravity_parameters, acceleration), .unit = "m/s^2",
     .default_value = "[0, 0, -9.81]", .doc = "of free fall"},
    {0}};

static int add_gravity(const void *parameters, const flesh_body *body, flesh_system *system)
{
  const gravity_parameters *p = parameters;
  flesh_effect *effect = NULL;
  return add(system, flesh_effect_gravity(body, p->acceleration, &effect), &effect);
}

/* clang-format off */
#define AXES_KEY(parameters)                                                                       \
  {.name = "axes", .type = FLESH_KEY_SET, .offset = offsetof(parameters, axes),                    \
   .choices = axis_names, .default_value = "[x, y, z]", .doc = "the components held"}
/* clang-format on */

static const char *const axis_names[] = {"x", "y", "z", NULL}; /* the bits of FLESH_AXIS_* */

typedef struct pin_parameters {
  flesh_selection selection;
  unsigned axes;
  double from, until;
} pin_parameters;

static const flesh_key pin_keys[] = {FLESH_SELECTION_KEYS(pin_parameters, selection),
                                     AXES_KEY(pin_parameters),
                                     FLESH_INTERVAL_KEYS(pin_parameters),
                                     {0}};

static int add_pin(const void *parameters, const flesh_body *body, flesh_system *system)
{
  const pin_parameters *p = parameters;
  int count, *nodes, status = flesh_selection_nodes(&p->selection, body, &count, &nodes);
  if (status) return status;
  status = flesh_system_add_pin(system, count, nodes, p->axes, p->from, p->until);
  free(nodes);
  return status;
}

typedef struct handle_parameters {
  flesh_selection selection;
  unsigned axes;
  double from, until, centre[3];
  int interpolation;
  flesh_objects motion;
} handle_parameters;

static const flesh_key handle_keys[] = {
    FLESH_SELECTION_KEYS(handle_parameters, selection),
    AXES_KEY(handle_parameters),
    {.name = "motion", .type = FLESH_KEY_OBJECTS, .offset = offsetof(handle_parameters, motion),
     .children = flesh_keyframe_keys, .child_size = sizeof(flesh_keyframe),
     .doc = "keyframes; before the first and after the last the handle holds still"},
    {.name = "centre", .type = FLESH_KEY_VECTOR, .offset = offsetof(handle_parameters, centre),
     .unit = "m", .default_value = "[0, 0, 0]", .doc = "of the rotations"},
    {.name = "interpolation", .type = FLESH_KEY_CHOICE,
     .offset = offsetof(handle_parameters, interpolation), .choices = flesh_interpolation_names,
     .default_value = "linear",
     .doc = "between keyframes: linear, or smooth (cubic, at rest at every keyframe)"},
    FLESH_INTERVAL_KEYS(handle_parameters),
    {0}};

static int add_handle(const void *parameters, const flesh_body *body, flesh_system *system)
{
  const handle_parameters *p = parameters;
  flesh_motion motion = {p->motion.count, p->motion.values,
                         {p->centre[0], p->centre[1], p->centre[2]},
                         p->interpolation};
  int count, *nodes, status = flesh_selection_nodes(&p->selection, body, &count, &nodes);
  if (status) return status;
  status = flesh_system_add_handle(system, count, nodes, p->axes, &motion, p->from, p->until);
  free(nodes);
  return status;
}

typedef struct target {
  double t, position[3];
} target;

static const flesh_key target_keys[] = {
    {.name = "time", .type = FLESH_KEY_NUMBER, .offset = offsetof(target, t), .unit = "s",
     .doc = "when; keyframes ascend in time"},
    {.name = "position", .type = FLESH_KEY_VECTOR, .offset = offsetof(target, position),
     .unit = "m", .doc = "of the target"},
    {0}};

typedef struct drag_parameters {
  double point[3], stiffness, from, until;
  int interpolation;
  flesh_objects target;
} drag_parameters;

static const flesh_key drag_keys[] = {
    {.name = "point", .type = FLESH_KEY_VECTOR, .offset = offsetof(drag_parameters, point),
     .unit = "m", .doc = "of the body where the spring is fixed, in rest coordinates; outside the body its "
            "nearest surface point"},
    {.name = "stiffness", .type = FLESH_KEY_NUMBER, .offset = offsetof(drag_parameters, stiffness),
     .range = FLESH_RANGE_POSITIVE, .unit = "N/m", .doc = "of the spring"},
    {.name = "target", .type = FLESH_KEY_OBJECTS, .offset = offsetof(drag_parameters, target),
     .children = target_keys, .child_size = sizeof(target),
     .doc = "keyframes of the spring's other end"},
    {.name = "interpolation", .type = FLESH_KEY_CHOICE,
     .offset = offsetof(drag_parameters, interpolation), .choices = flesh_interpolation_names,
     .default_value = "linear",
     .doc = "between keyframes: linear, or smooth (cubic, at rest at every keyframe)"},
    FLESH_INTERVAL_KEYS(drag_parameters),
    {0}};

static int add_drag(const void *parameters, const flesh_body *body, flesh_system *system)
{
  const drag_parameters *p = parameters;
  const target *targets = p->target.values;
  flesh_keyframe *keyframes = calloc((size_t)p->target.count + 1, sizeof *keyframes);
  if (!keyframes)
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d keyframes", p->target.count);
  for (int k = 0; k < p->target.count; k++) {
    keyframes[k].t = targets[k].t;
    for (int c = 0; c < 3; c++) keyframes[k].translation[c] = targets[k].position[c];
  }
  flesh_motion motion = {p->target.count, keyframes, {0}, p->interpolation};
  flesh_effect *effect = NULL;
  int status = flesh_effect_drag(body, p->point, p->stiffness, &motion, p->from, p->until, &effect);
  free(keyframes);
  return add(system, status, &effect);
}

static const flesh_effect_row rows[] = {
    {"inertia",
     "The body's mass resists acceleration. Without it the scene is solved for equilibrium.",
     no_keys, 0, "{}", add_inertia, 1},
    {"elasticity", "The body's material resists deformation. Present wherever body.material is.",
     elasticity_keys, sizeof(flesh_elasticity_parameters), "{}", add_elasticity, 1},
    {"gravity", "A uniform acceleration pulls at the body's mass.", gravity_keys,
     sizeof(gravity_parameters), "{acceleration: [1, 2, -9.81]}", add_gravity, 0},
    {"pin", "Nodes, or single components of them, held at their rest positions. Where several pins and "
     "handles hold a component at a time, the last of them counts.", pin_keys,
     sizeof(pin_parameters), "{box: [[-1, -1, -1], [0.1, 2, 2]], axes: [x, z]}", add_pin, 0},
    {"handle", "Nodes that follow a keyframed motion.", handle_keys, sizeof(handle_parameters),
     "{sphere: {centre: [1, 1, 1], radius: 0.1}, motion: [{time: 0}, {time: 1, translation: "
     "[0.1, 0, 0], rotation: [0, 0, 0.5]}]}",
     add_handle, 0},
    {"drag", "A spring from a point of the body to a moving target: the mouse pull.", drag_keys,
     sizeof(drag_parameters),
     "{point: [0.9, 0.8, 0.3], stiffness: 1000, target: [{time: 0, position: [2, 1, 1]}]}",
     add_drag, 0},
    {"force", "A force in a fixed direction, shared by nodes: a dead load.", flesh_force_keys,
     sizeof(flesh_load_parameters), "{box: [[0.9, -1, -1], [2, 2, 2]], force: [100, 0, -50], curve: [{time: 0, value: 0}, "
     "{time: 1, value: 1}]}", flesh_force_add, 0},
    {"traction", "A force per area of the rest shape's surface, in a fixed direction: a dead load.", flesh_traction_keys,
     sizeof(flesh_load_parameters), "{box: [[0.9, -1, -1], [2, 2, 2]], traction: [0, 300, 100]}", flesh_traction_add, 0},
    {"pressure", "A pressure that follows the deformed surface. On a closed surface (also one that encloses a hollow) it "
     "is conservative. On an open one the part of the rim's edges is taken from the last accepted state in every "
     "step of a fixed-step method; statics and adaptive steps have it as it is, and its work is in no energy.",
     flesh_pressure_keys, sizeof(flesh_pressure_parameters),
     "{box: [[0.9, -1, -1], [2, 2, 2]], pressure: 2000, curve: [{time: 0, value: 0.5}, {time: 1, value: 1}], "
     "interpolation: smooth}", flesh_pressure_add, 0},
    {"damping", "Rayleigh damping: forces against velocity in proportion to mass and stiffness. Backward Euler and other "
     "methods that damp by themselves add to it.", flesh_damping_keys, sizeof(flesh_damping_parameters),
     "{mass: 2, stiffness: 0.01, against: current}", flesh_damping_add, 0},
    {"calm", "Winds the motion down: damping in proportion to mass, for a time or until the body is slow. It is not the "
     "scene's physics, and says so by its name.", flesh_calm_keys, sizeof(flesh_calm_parameters),
     "{rate: 20, speed: 0.5, until: 2}", flesh_calm_add, 0},
    {"viscosity", "Kelvin-Voigt damping: stresses in proportion to the rate of the Green strain; rigid motion feels "
     "nothing. The deformation gradient is the last accepted state's, so that a body that turns by an angle in one "
     "step of a fixed-step method feels a part of the order of its square; adaptive steps have none of it.",
     flesh_viscosity_keys, sizeof(flesh_viscosity_parameters), "{shear: 300, bulk: 500}", flesh_viscosity_add, 0},
    {"contact", "Keeps the body's nodes out of an obstacle, still or moving, by a smooth barrier that no node can "
     "pass, with friction. One obstacle each: plane, sphere, capsule or mesh. Histories have the columns contact_gap, "
     "contact_nodes and contact_force.",
     flesh_contact_keys, sizeof(flesh_contact_parameters),
     "{plane: {point: [0, 0, -1], normal: [0.2, 0.1, 1]}, thickness: 4, stiffness: 1e5}", flesh_contact_add, 0},
};

const flesh_effect_row *flesh_effect_registry(int *count)
{
  *count = (int)(sizeof rows / sizeof rows[0]);
  return rows;
}
