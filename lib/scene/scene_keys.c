/* scene_keys.c: the keys of a scene, except those of the solver and the output (solver_keys.c, output_keys.c) and of
 * the effects, which are in the effects' rows. */
#include "scene/effect_list.h"
#include "scene/scene_keys.h"

#include <assert.h>
#include <stddef.h>

#include "material/form.h"
#include "time/butcher_table.h"
#include "time/method.h"

/* Names in the order of the enums. */
#define FORM_NAME(NAME, name, text, ...) text,
#define FORM_FULL_NAME(NAME, name, text, full, ...) full,
#define FORM_DOC(NAME, name, text, full, ...) ", " text " or " full
static const char *const energies[] = {FLESH_FORM_LIST(FORM_NAME) NULL};
static_assert(sizeof energies / sizeof *energies == FLESH_ENERGY_COUNT + 1, "a name of every form");
static const char *const full_names[] = {FLESH_FORM_LIST(FORM_FULL_NAME) NULL};
static_assert(sizeof full_names == sizeof energies, "a full name of every form");
static const char *const constants[] = {"raw", "matched", "as_e", NULL};
static_assert(sizeof constants / sizeof *constants == FLESH_CONSTANTS_AS_E + 2, "a name of every kind of constants");
static const char *const masses[] = {"lumped", "consistent", NULL};
static_assert(sizeof masses / sizeof *masses == FLESH_MASS_CONSISTENT + 2, "a name of every mass");
static const char *const elements[] = {"auto", "tet4", "tet10", "tet10-mean", NULL};
const flesh_key flesh_material_table[] = {
    {.name = "energy",
     .type = FLESH_KEY_CHOICE,
     .offset = offsetof(flesh_scene_material, energy),
     .choices = energies,
     .aliases = full_names,
     .doc = "the form of the energy density, short or in full" FLESH_FORM_LIST(FORM_DOC)},
    {.name = "constants",
     .type = FLESH_KEY_CHOICE,
     .offset = offsetof(flesh_scene_material, constants),
     .choices = constants,
     .default_value = "",
     .doc = "how the given constants enter the form: raw, unchanged; matched, so that small strains obey them "
            "(forms" FLESH_FORM_MATCHED_NAMES "); as_e, like those of E (form D only). Default: matched if the form "
            "takes it, else raw"},
    {.name = "mu",
     .type = FLESH_KEY_NUMBER,
     .offset = offsetof(flesh_scene_material, given.mu),
     .range = FLESH_RANGE_POSITIVE,
     .unit = "Pa",
     .default_value = "",
     .doc = "shear modulus; give mu and lambda, or young and poisson"},
    {.name = "lambda",
     .type = FLESH_KEY_NUMBER,
     .offset = offsetof(flesh_scene_material, given.lambda),
     .unit = "Pa",
     .default_value = "",
     .doc = "first Lame constant"},
    {.name = "young",
     .type = FLESH_KEY_NUMBER,
     .offset = offsetof(flesh_scene_material, given.young),
     .range = FLESH_RANGE_POSITIVE,
     .unit = "Pa",
     .default_value = "",
     .doc = "Young's modulus; if both pairs are given, the one that --set gave last is used"},
    {.name = "poisson",
     .type = FLESH_KEY_NUMBER,
     .offset = offsetof(flesh_scene_material, given.poisson),
     .range = FLESH_RANGE_POISSON,
     .default_value = "",
     .doc = "Poisson's ratio; 0.5, which keeps volumes exactly, with body.element tet10-mean only"},
#define FORM_CONSTANT(FORM, name_, unit_, least, usual, doc_)                                                          \
  {.name = #name_,                                                                                                     \
   .type = FLESH_KEY_NUMBER,                                                                                           \
   .offset = offsetof(flesh_scene_material, given.name_),                                                              \
   .unit = unit_,                                                                                                      \
   .default_value = "",                                                                                                \
   .doc = doc_ "; at least " #least ", default " #usual},
    FLESH_FORM_CONSTANT_LIST(FORM_CONSTANT)
#undef FORM_CONSTANT
    {.name = NULL},
};

static const flesh_key region_table[] = {
    {.name = "tags",
     .type = FLESH_KEY_INTEGERS,
     .offset = offsetof(flesh_scene_region, tets.regions),
     .default_value = "",
     .doc = "only tets with these region tags of the mesh"},
    FLESH_TET_SET_AND_BOX_KEYS(flesh_scene_region, tets),
    {.name = "density",
     .type = FLESH_KEY_NUMBER,
     .offset = offsetof(flesh_scene_region, density),
     .range = FLESH_RANGE_POSITIVE,
     .unit = "kg/m^3",
     .default_value = "",
     .doc = "density, instead of the body's"},
    {.name = "material",
     .type = FLESH_KEY_OBJECT,
     .offset = offsetof(flesh_scene_region, material),
     .default_value = "",
     .children = flesh_material_table,
     .doc = "material, instead of the body's"},
    {.name = NULL},
};

#define AT(member) .offset = offsetof(flesh_scene_keys, member) - offsetof(flesh_scene_keys, body)
static const flesh_key body_table[] = {
    {.name = "mesh",
     .type = FLESH_KEY_PATH,
     AT(body.mesh),
     .doc = "file of the tetrahedral mesh (TetGen .node or .ele, Gmsh .msh, Medit .mesh, Abaqus .inp, VTK .vtu, "
            "VegaFEM .veg, index.txt of a split one), relative to the scene"},
    {.name = "density",
     .type = FLESH_KEY_NUMBER,
     AT(body.density),
     .range = FLESH_RANGE_POSITIVE,
     .unit = "kg/m^3",
     .default_value = "1000",
     .doc = "mass per rest volume"},
    {.name = "mass",
     .type = FLESH_KEY_CHOICE,
     AT(body.mass),
     .choices = masses,
     .default_value = "lumped",
     .doc = "lumped: a quarter of each tet's mass to each of its nodes, with ten nodes 1/36 to each corner and 4/27 "
            "to each node on an edge; consistent: the mass matrix of the element; in equilibria, gravity pulls at "
            "ten-node tets by the consistent one, which gives the exact load"},
    {.name = "element", .type = FLESH_KEY_CHOICE, AT(body.element), .choices = elements, .default_value = "auto",
     .doc = "element of bodies that name no other. tet4: displacements linear in a tet, far too stiff in bending if "
            "the material is nearly incompressible; tet10: quadratic, energies at four points; tet10-mean: the same "
            "with the volume term by the mean of J over a tet, equally accurate at poisson 0.4999 and at 0.3; auto: "
            "tet4 for a mesh with four nodes per tet, tet10-mean for ten. With tet10 and tet10-mean, a mesh of "
            "four-node tets gets a node in the middle of each edge, after its own nodes"},
    {.name = "refine", .type = FLESH_KEY_INTEGER, AT(body.refine), .range = FLESH_RANGE_NOT_NEGATIVE,
     .default_value = "0",
     .doc = "number of times that each tet of all bodies is cut into eight, to see the error of the mesh; regions, "
            "sets, lists of nodes, boxes and spheres mean the same; new nodes of curved faces lie on the surfaces; a "
            "start state of the unrefined mesh is interpolated"},
    {.name = "curved", .type = FLESH_KEY_OBJECTS, AT(body.curved), .default_value = "",
     .children = flesh_curved_table, .child_size = sizeof(flesh_scene_curved),
     .doc = "surfaces onto which the body's boundary is moved, nodes on edges too, before it is refined: each face "
            "onto the nearest of those that all its corners are nearer to than a tenth of an edge. For ten-node "
            "tets; refused if a tet would fold over"},
    {.name = "material",
     .type = FLESH_KEY_OBJECT,
     AT(body.material),
     .default_value = "",
     .children = flesh_material_table,
     .doc = "without it the body has no elasticity; with it the effect elasticity is added when "
            "not listed"},
    {.name = "regions",
     .type = FLESH_KEY_OBJECTS,
     AT(body.regions),
     .default_value = "",
     .children = region_table,
     .child_size = sizeof(flesh_scene_region),
     .doc = "other densities and materials for regions of the mesh"},
    {.name = "material_map", .type = FLESH_KEY_PATH, AT(body.material_map), .default_value = "",
     .doc = "file of constants of single tets, as flesh fit writes it: columns tet (from 0, of the mesh as it is in "
            "its file) and constants of a material, as in tet,young [Pa]; they replace those of the tets' material"},
    {.name = "name",
     .type = FLESH_KEY_TEXT,
     AT(body.name),
     .default_value = "body",
     .doc = "name for selections"},
    {.name = NULL},
};
#undef AT

#define AT(member) .offset = offsetof(flesh_scene_other, member)
static const flesh_key other_table[] = {
    {.name = "name", .type = FLESH_KEY_TEXT, AT(name), .doc = "name for selections; names of bodies must differ"},
    {.name = "mesh", .type = FLESH_KEY_PATH, AT(mesh), .doc = "file of the mesh, as for body.mesh"},
    {.name = "translation", .type = FLESH_KEY_VECTOR, AT(translation), .unit = "m",
     .default_value = "[0, 0, 0]", .doc = "translation of the mesh, after the rotation"},
    {.name = "rotation", .type = FLESH_KEY_VECTOR, AT(rotation), .unit = "rad",
     .default_value = "[0, 0, 0]", .doc = "rotation vector of the mesh about the origin"},
    {.name = "density", .type = FLESH_KEY_NUMBER, AT(density), .range = FLESH_RANGE_POSITIVE,
     .unit = "kg/m^3", .default_value = "", .doc = "density, instead of body.density"},
    {.name = "curved", .type = FLESH_KEY_OBJECTS, AT(curved), .default_value = "",
     .children = flesh_curved_table, .child_size = sizeof(flesh_scene_curved),
     .doc = "surfaces as for body.curved, before the rotation"},
    {.name = "element", .type = FLESH_KEY_CHOICE, AT(element), .choices = elements, .default_value = "",
     .doc = "element, instead of body.element"},
    {.name = "material", .type = FLESH_KEY_OBJECT, AT(material), .default_value = "",
     .children = flesh_material_table, .doc = "material, instead of body.material"},
    {.name = "velocity", .type = FLESH_KEY_VECTOR, AT(velocity), .unit = "m/s", .default_value = "",
     .doc = "velocity at the start, instead of start.velocity"},
    {.name = NULL},
};
#undef AT

#define AT(member) .offset = offsetof(flesh_scene_keys, member) - offsetof(flesh_scene_keys, time)
#define METHOD_DOC(NAME, name, text, order, doc) text ": " doc "; "
#define TABLE_DOC(NAME, name, doc) name ": " doc "; "
static const flesh_key time_table[] = {
    {.name = "method",
     .type = FLESH_KEY_CHOICE,
     AT(time.method),
     .choices = flesh_method_names,
     .default_value = "backward-euler",
     .doc = FLESH_METHOD_LIST(METHOD_DOC) "adaptive: runge-kutta with adaptive: true, the least work for a given "
            "error; a scene without inertia is always static"},
    {.name = "step",
     .type = FLESH_KEY_NUMBER,
     AT(time.step),
     .range = FLESH_RANGE_POSITIVE,
     .unit = "s",
     .default_value = "1/60",
     .doc = "length of a time step; if errors choose the steps, the time between outputs"},
    {.name = "end",
     .type = FLESH_KEY_NUMBER,
     AT(time.end),
     .range = FLESH_RANGE_NOT_NEGATIVE,
     .unit = "s",
     .default_value = "",
     .doc = "when the run ends; required when the scene has inertia, 0 by default when static"},
    {.name = "max_energy_gain",
     .type = FLESH_KEY_NUMBER,
     AT(time.max_energy_gain),
     .range = FLESH_RANGE_POSITIVE,
     .default_value = "0.5",
     .doc = "largest spurious energy, beyond the work put in, as a share of the motion's energy (if errors choose "
            "the steps, of at least the energy of errors within the tolerance, which is much in slow stiff bodies): "
            "above it the run ends with exit code 8; from 0.05 on there is a warning; fixed steps of order 2 or 3 "
            "are cut if they would gain more than a fiftieth of it in all; 1e300 switches this off"},
#define METHOD_OPTION(name_, value, least, most, range, doc_)                                                          \
  {.name = #name_, .type = FLESH_KEY_NUMBER, AT(time.options.name_), .default_value = #value, .doc = doc_},
    FLESH_METHOD_OPTION_LIST(METHOD_OPTION)
#undef METHOD_OPTION
    {.name = "table",
     .type = FLESH_KEY_CHOICE,
     AT(time.table),
     .choices = flesh_table_names,
     .default_value = "auto",
     .doc = "table of runge-kutta: " FLESH_TABLE_LIST(TABLE_DOC) "all are L-stable and damp what steps do not resolve"},
    {.name = "tolerance",
     .type = FLESH_KEY_NUMBER,
     AT(time.adaptive.tolerance),
     .range = FLESH_RANGE_FRACTION,
     .default_value = "",
     .doc = "error of positions to aim at if errors choose the steps, as a share of the body's longest side. "
            "Default: 1e-4"},
    {.name = "adaptive",
     .type = FLESH_KEY_BOOLEAN,
     AT(time.controlled),
     .default_value = "",
     .doc = "true: the local error chooses the steps, for all methods except midpoint, static, and ida, which always "
            "chooses its own. Default: true for runge-kutta with a tolerance"},
    {.name = "max_order",
     .type = FLESH_KEY_INTEGER,
     AT(time.adaptive.max_order),
     .range = FLESH_RANGE_POSITIVE,
     .default_value = "2",
     .doc = "ida: largest order of the formulas, 1 to 5; above 2 energy may grow and steps become "
            "short at loose tolerances"},
    {.name = "max_step",
     .type = FLESH_KEY_NUMBER,
     AT(time.adaptive.max_step),
     .range = FLESH_RANGE_POSITIVE,
     .unit = "s",
     .default_value = ".inf",
     .doc = "longest internal step if errors choose the steps"},
    {.name = "max_steps",
     .type = FLESH_KEY_INTEGER,
     AT(time.adaptive.max_steps),
     .range = FLESH_RANGE_POSITIVE,
     .default_value = "100000",
     .doc = "internal steps between two outputs before the run gives up, if errors choose the steps"},
    {.name = NULL},
};
#undef METHOD_DOC
#undef TABLE_DOC
#undef AT

#define AT(member) .offset = offsetof(flesh_scene_keys, member) - offsetof(flesh_scene_keys, start)
static const flesh_key start_table[] = {
    {.name = "state",
     .type = FLESH_KEY_PATH,
     AT(start.state),
     .default_value = "",
     .doc = "file of rows x y z vx vy vz, one per node, to start from; velocity is then not used"},
    {.name = "velocity",
     .type = FLESH_KEY_VECTOR,
     AT(start.velocity),
     .unit = "m/s",
     .default_value = "[0, 0, 0]",
     .doc = "velocity of all nodes at the start, from the rest shape"},
    {.name = NULL},
};
#undef AT

const flesh_key flesh_scene_table[] = {
    {.name = "title",
     .type = FLESH_KEY_TEXT,
     .offset = offsetof(flesh_scene_keys, title),
     .default_value = "",
     .doc = "what the scene shows"},
    {.name = "body",
     .type = FLESH_KEY_OBJECT,
     .offset = offsetof(flesh_scene_keys, body),
     .children = body_table,
     .doc = "the soft body"},
    {.name = "bodies",
     .type = FLESH_KEY_OBJECTS,
     .offset = offsetof(flesh_scene_keys, bodies),
     .default_value = "",
     .children = other_table,
     .child_size = sizeof(flesh_scene_other),
     .doc = "more bodies beside it, each with a mesh, a place and, if given, a density, a material and a velocity of "
            "its own; what acts on the body acts on them as well, unless it has a selection. Without an effect "
            "contact between them bodies pass through each other, and each through itself"},
    {.name = "effects",
     .type = FLESH_KEY_EFFECTS,
     .list = &flesh_effect_key_list,
     .offset = offsetof(flesh_scene_keys, effects),
     .default_value = "[]",
     .doc = "what acts on the body: a list of \"- name: {its keys}\", or \"- name\" if it needs none; the same name "
            "may stand several times, except inertia and elasticity"},
    {.name = "time",
     .type = FLESH_KEY_OBJECT,
     .offset = offsetof(flesh_scene_keys, time),
     .default_value = "{}",
     .children = time_table,
     .doc = "time stepping"},
    {.name = "start",
     .type = FLESH_KEY_OBJECT,
     .offset = offsetof(flesh_scene_keys, start),
     .default_value = "{}",
     .children = start_table,
     .doc = "the state at the start"},
    {.name = "solver",
     .type = FLESH_KEY_OBJECT,
     .offset = offsetof(flesh_scene_keys, solver),
     .default_value = "{}",
     .children = flesh_solver_table,
     .doc = "the nonlinear and linear solves"},
    {.name = "output",
     .type = FLESH_KEY_OBJECT,
     .offset = offsetof(flesh_scene_keys, output),
     .default_value = "{}",
     .children = flesh_output_table,
     .doc = "what a run writes"},
    {.name = NULL},
};
