/* scene_keys.c: every key of a scene but those of the effects, which stand in the effects' own
 * rows. */
#include "scene/effect_list.h"
#include "scene/scene_keys.h"

#include <assert.h>
#include <stddef.h>

#include "material/form.h"
#include "time/method.h"
#include "linear/preconditioner.h"

/* Choices are read as int into fields of enum type. */
static_assert(sizeof(flesh_linear_solver) == sizeof(int), "enums must have the size of int");

/* In the order of the enums. */
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
static const char *const linear_solvers[] = {"pcg", "klu", "cholmod", NULL};
static_assert(sizeof linear_solvers / sizeof *linear_solvers == FLESH_LINEAR_CHOLMOD + 2, "a name of every solver");
static const char *const projections[] = {"when_indefinite", "always", "never", NULL};
static_assert(sizeof projections / sizeof *projections == FLESH_PROJECT_NEVER + 2, "a name of every projection");
/* In the order of flesh_eigenvalue_filter. */
static const char *const eigenvalue_filters[] = {"none", "clamp", "absolute", "trust-region", "auto", NULL};
static_assert(sizeof eigenvalue_filters / sizeof *eigenvalue_filters == FLESH_FILTER_AUTO + 2, "a name of every filter");
/* In the order of the bits FLESH_TECHNIQUE_NEGATIVE_CURVATURE... */
static const char *const techniques[] = {"negative_curvature", "nonlinear_elimination", "watchdog", "untangle", NULL};
static_assert(1 << (sizeof techniques / sizeof *techniques - 1) == FLESH_TECHNIQUES_ALL + 1, "a name of every technique");
static const char *const line_searches[] = {"potential", "none", "residual", NULL};
static_assert(sizeof line_searches / sizeof *line_searches == FLESH_LINE_SEARCH_RESIDUAL + 2, "a name of every search");

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
     .doc = "how the given constants enter the form: raw as they are; matched so that small "
            "strains obey them "
            "(of" FLESH_FORM_MATCHED_NAMES "); as_e like E's (D only). Default: matched where the form can be, "
            "else raw"},
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
     .doc = "Young's modulus; of two whole pairs the one that --set gave last is used"},
    {.name = "poisson",
     .type = FLESH_KEY_NUMBER,
     .offset = offsetof(flesh_scene_material, given.poisson),
     .range = FLESH_RANGE_POISSON,
     .default_value = "",
     .doc = "Poisson's ratio; 0.5 (of which volumes are kept exactly) with body.element tet10-mean only"},
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
     .offset = offsetof(flesh_scene_region, tags),
     .doc = "region tags of the mesh that this entry is for"},
    {.name = "density",
     .type = FLESH_KEY_NUMBER,
     .offset = offsetof(flesh_scene_region, density),
     .range = FLESH_RANGE_POSITIVE,
     .unit = "kg/m^3",
     .default_value = "",
     .doc = "instead of the body's"},
    {.name = "material",
     .type = FLESH_KEY_OBJECT,
     .offset = offsetof(flesh_scene_region, material),
     .default_value = "",
     .children = flesh_material_table,
     .doc = "instead of the body's"},
    {.name = NULL},
};

#define AT(member) .offset = offsetof(flesh_scene_keys, member) - offsetof(flesh_scene_keys, body)
static const flesh_key body_table[] = {
    {.name = "mesh",
     .type = FLESH_KEY_PATH,
     AT(body.mesh),
     .doc = "file of the tetrahedral mesh (TetGen .node or .ele, Gmsh .msh, Medit .mesh), relative "
            "to the scene"},
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
     .doc = "lumped: a quarter of each tet's mass to each of its nodes, of ten nodes 1/36 to each corner and "
            "4/27 to each node on an edge; consistent: the mass matrix of the element; where nothing moves, "
            "gravity pulls at ten-node tets by the consistent one, which gives the exact load"},
    {.name = "element",
     .type = FLESH_KEY_CHOICE,
     AT(body.element),
     .choices = elements,
     .default_value = "auto",
     .doc = "of all bodies. tet4: displacements linear in a tet, far too stiff in bending where the material is nearly "
            "incompressible; tet10: quadratic, energies at four points; tet10-mean: the same with the volume term by "
            "the mean of J over a tet, as true at poisson_ratio 0.4999 as at 0.3; auto: tet4 where the mesh has four "
            "nodes a tet, tet10-mean where it has ten. With tet10 and tet10-mean, a mesh of four-node tets gets a node "
            "in the middle of each edge, after its own nodes"},
    {.name = "refine",
     .type = FLESH_KEY_INTEGER,
     AT(body.refine),
     .range = FLESH_RANGE_NOT_NEGATIVE,
     .default_value = "0",
     .doc = "times that each tet of the mesh is cut into eight, of all bodies, to see what part of a result is the "
            "mesh's; regions, boxes and spheres mean the same, node numbers the same single points; a start state of "
            "the mesh as it was is interpolated"},
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
    {.name = "name",
     .type = FLESH_KEY_TEXT,
     AT(body.name),
     .default_value = "body",
     .doc = "for selections, where there are several bodies"},
    {.name = NULL},
};
#undef AT

#define AT(member) .offset = offsetof(flesh_scene_other, member)
static const flesh_key other_table[] = {
    {.name = "name", .type = FLESH_KEY_TEXT, AT(name), .doc = "for selections; every body has another"},
    {.name = "mesh", .type = FLESH_KEY_PATH, AT(mesh), .doc = "file, as of body.mesh"},
    {.name = "translation", .type = FLESH_KEY_VECTOR, AT(translation), .unit = "m",
     .default_value = "[0, 0, 0]", .doc = "of the mesh, after the rotation"},
    {.name = "rotation", .type = FLESH_KEY_VECTOR, AT(rotation), .unit = "rad",
     .default_value = "[0, 0, 0]", .doc = "rotation vector of the mesh about the origin"},
    {.name = "density", .type = FLESH_KEY_NUMBER, AT(density), .range = FLESH_RANGE_POSITIVE,
     .unit = "kg/m^3", .default_value = "", .doc = "instead of body.density"},
    {.name = "material", .type = FLESH_KEY_OBJECT, AT(material), .default_value = "",
     .children = flesh_material_table, .doc = "instead of body.material"},
    {.name = "velocity", .type = FLESH_KEY_VECTOR, AT(velocity), .unit = "m/s", .default_value = "",
     .doc = "at the start, instead of start.velocity"},
    {.name = NULL},
};
#undef AT

#define AT(member) .offset = offsetof(flesh_scene_keys, member) - offsetof(flesh_scene_keys, time)
#define METHOD_DOC(NAME, name, text, order, doc) text ": " doc "; "
static const flesh_key time_table[] = {
    {.name = "method",
     .type = FLESH_KEY_CHOICE,
     AT(time.method),
     .choices = flesh_method_names,
     .default_value = "backward-euler",
     .doc = FLESH_METHOD_LIST(METHOD_DOC) "a scene without inertia is always static"},
    {.name = "step",
     .type = FLESH_KEY_NUMBER,
     AT(time.step),
     .range = FLESH_RANGE_POSITIVE,
     .unit = "s",
     .default_value = "1/60",
     .doc = "length of a time step; of the adaptive methods, between outputs"},
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
     .doc = "the run ends with exit code 8 where energy that nothing has put in exceeds this share of the energy that "
            "the motion has had; from 0.05 on there is a warning; 1e300: never ended"},
#define METHOD_OPTION(name_, value, least, most, range, doc_)                                                          \
  {.name = #name_, .type = FLESH_KEY_NUMBER, AT(time.options.name_), .default_value = #value, .doc = doc_},
    FLESH_METHOD_OPTION_LIST(METHOD_OPTION)
#undef METHOD_OPTION
    {.name = "tolerance",
     .type = FLESH_KEY_NUMBER,
     AT(time.adaptive.tolerance),
     .range = FLESH_RANGE_FRACTION,
     .default_value = "1e-4",
     .doc = "adaptive: the error of positions to aim at, as a share of the body's longest side"},
    {.name = "max_order",
     .type = FLESH_KEY_INTEGER,
     AT(time.adaptive.max_order),
     .range = FLESH_RANGE_POSITIVE,
     .default_value = "2",
     .doc = "adaptive: largest order of the formulas, 1 to 5; above 2 energy may grow and steps become "
            "short at loose tolerances"},
    {.name = "max_step",
     .type = FLESH_KEY_NUMBER,
     AT(time.adaptive.max_step),
     .range = FLESH_RANGE_POSITIVE,
     .unit = "s",
     .default_value = ".inf",
     .doc = "adaptive: longest internal step"},
    {.name = "max_steps",
     .type = FLESH_KEY_INTEGER,
     AT(time.adaptive.max_steps),
     .range = FLESH_RANGE_POSITIVE,
     .default_value = "100000",
     .doc = "adaptive: internal steps between two outputs before the run gives up"},
    {.name = "switch_threshold",
     .type = FLESH_KEY_NUMBER,
     AT(time.adaptive.switch_threshold),
     .range = FLESH_RANGE_POSITIVE,
     .default_value = "0.01",
     .doc = "euler-then-adaptive: backward Euler steps until the local error of such a step, h^2/2 of the "
            "motion's second derivative, is at most this share of the body's longest side and of its scale of "
            "velocity"},
    {.name = NULL},
};
#undef METHOD_DOC
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
     .doc = "of all nodes at the start, from the rest shape"},
    {.name = NULL},
};
#undef AT

/* The defaults are those of flesh_solver_options_default; a test compares them. */
static const flesh_key solver_table[] = {
    {.name = "volume_tolerance", .type = FLESH_KEY_NUMBER, .range = FLESH_RANGE_FRACTION, .default_value = "1e-8",
     .offset = offsetof(flesh_solver_options, volume_tolerance), .doc = "|mean of J - 1| of tets with poisson 0.5"},
    {.name = "newton_tolerance",
     .type = FLESH_KEY_NUMBER,
     .offset = offsetof(flesh_solver_options, newton_tolerance),
     .range = FLESH_RANGE_FRACTION,
     .default_value = "1e-6",
     .doc = "a solve has converged when the residual's 2-norm over the free dofs is at most this times the larger of "
            "the applied load's and the first iterate's; where obstacles, prescribed places or springs may have gone "
            "on at once, and in statics, the first iterate's counts at most as the largest force at the current one: "
            "of loads, contact, inertia, elements and reactions"},
    {.name = "linear_tolerance",
     .type = FLESH_KEY_NUMBER,
     .offset = offsetof(flesh_solver_options, linear_tolerance),
     .range = FLESH_RANGE_FRACTION,
     .default_value = "1e-2",
     .doc = "residual reduction of each iterative linear solve"},
    {.name = "max_newton",
     .type = FLESH_KEY_INTEGER,
     .offset = offsetof(flesh_solver_options, max_newton),
     .range = FLESH_RANGE_POSITIVE,
     .default_value = "1200",
     .doc = "Newton iterations per solve; every 300 must gain a tenth of what has been gained"},
    {.name = "max_linear",
     .type = FLESH_KEY_INTEGER,
     .offset = offsetof(flesh_solver_options, max_linear),
     .range = FLESH_RANGE_POSITIVE,
     .default_value = "2000",
     .doc = "iterations per linear solve; one that they do not end is left to a direct factorisation, "
            "unless that costs more"},
    {.name = "max_cutbacks",
     .type = FLESH_KEY_INTEGER,
     .offset = offsetof(flesh_solver_options, max_cutbacks),
     .range = FLESH_RANGE_NOT_NEGATIVE,
     .default_value = "8",
     .doc = "how often a step or load increment that fails may be halved"},
    {.name = "linear_solver",
     .type = FLESH_KEY_CHOICE,
     .offset = offsetof(flesh_solver_options, linear_solver),
     .choices = linear_solvers,
     .default_value = "pcg",
     .doc = "pcg: preconditioned conjugate gradients; klu: sparse LU; cholmod: sparse Cholesky, "
            "where built in"},
    {.name = "preconditioner",
     .type = FLESH_KEY_CHOICE,
     .offset = offsetof(flesh_solver_options, preconditioner),
     .choices = flesh_preconditioner_names,
     .default_value = "auto",
     .doc = "of pcg: ic: incomplete Cholesky on 3x3 blocks; two-level: and with it displacements that "
            "are trilinear between the vertices of a grid over the body; jacobi: inverse diagonal blocks; none; auto: "
            "two-level, "
            "or ic on meshes of a few hundred nodes"},
    {.name = "project",
     .type = FLESH_KEY_CHOICE,
     .offset = offsetof(flesh_solver_options, project),
     .choices = projections,
     .default_value = "when_indefinite",
     .doc = "when the elements' Hessians are made positive semi-definite: where negative curvature "
            "shows, always, "
            "or never"},
    {.name = "eigenvalue_filter",
     .type = FLESH_KEY_CHOICE,
     .offset = offsetof(flesh_solver_options, eigenvalue_filter),
     .choices = eigenvalue_filters,
     .default_value = "auto",
     .doc = "what projection makes of negative eigenvalues: clamp: zero; absolute: their absolute values; "
            "trust-region: zero after a filtered step whose decrease was predicted to 1 %, else "
            "absolute; auto: the same in dynamics, absolute in statics; none: they stay, as with project: never"},
    {.name = "line_search",
     .type = FLESH_KEY_CHOICE,
     .offset = offsetof(flesh_solver_options, line_search),
     .choices = line_searches,
     .default_value = "potential",
     .doc = "potential: full steps guarded by a search on the incremental potential; none: plain full "
            "Newton steps; "
            "residual: KINSOL's line search on the residual"},
    {.name = "techniques",
     .type = FLESH_KEY_SET,
     .offset = offsetof(flesh_solver_options, techniques),
     .choices = techniques,
     .may_be_empty = 1,
     .default_value = "[negative_curvature, nonlinear_elimination, watchdog, untangle]",
     .doc = "what helps where plain Newton steps are slow or a body is tangled; [] for none of it. negative_curvature: "
            "steps that prove too short are lengthened where few nodes carry the residual (a crease, a tet that turns "
            "inside out), after a cut, or time and again; and where few do, with pcg and project: when_indefinite, the "
            "true Hessian is followed downhill along negative curvature. nonlinear_elimination: where a step went "
            "otherwise than predicted and left few nodes that carry the residual, these and their neighbours are "
            "solved for alone before the next (line_search: potential). watchdog: where steps are cut by what is "
            "stiff, which a straight step cannot turn, a longer one is tried, with Newton steps from there; taken if "
            "the potential ends lower (line_search: potential). untangle: near equilibrium, nodes of tets that stay "
            "inverted, collapsed or wound once more around an edge, and are held so by no load, are repositioned by "
            "their neighbours and the rest shape (counted in the results)"},
    {.name = "accept_unconverged",
     .type = FLESH_KEY_BOOLEAN,
     .offset = offsetof(flesh_solver_options, accept_unconverged),
     .default_value = "false",
     .doc = "true: a solve that ends at max_newton counts all the same, as in programs that take a "
            "fixed number of iterations; false: the step is retried in halves and fails"},
    {.name = "threads",
     .type = FLESH_KEY_INTEGER,
     .offset = offsetof(flesh_solver_options, threads),
     .range = FLESH_RANGE_NOT_NEGATIVE,
     .default_value = "1",
     .doc = "threads of a solve, at most 256; 0: one for each processor the process may use; results "
            "do not depend on it"},
    {.name = NULL},
};

static const char *const skin_formats[] = {"obj", "pc2", "vtu", NULL}; /* bits FLESH_SKIN_OBJ... */

#define AT(member) .offset = offsetof(flesh_scene_output, member) - offsetof(flesh_scene_output, skin)
static const flesh_key skin_table[] = {
    {.name = "surface",
     .type = FLESH_KEY_PATH,
     AT(skin.surface),
     .doc = "file of the surface (Wavefront .obj, Stanford .ply) in the place of the body at rest, "
            "relative to the scene"},
    {.name = "formats",
     .type = FLESH_KEY_SET,
     AT(skin.formats),
     .choices = skin_formats,
     .default_value = "[obj]",
     .doc = "obj: a file per frame; pc2: one point cache, as Blender's Mesh Cache reads it; vtu: a file "
            "per frame and an index for ParaView"},
    {.name = NULL},
};
#undef AT

static const flesh_key camera_table[] = {
    {.name = "up",
     .type = FLESH_KEY_VECTOR,
     .offset = offsetof(flesh_camera, up),
     .default_value = "",
     .doc = "direction that points upwards in the picture; by default against gravity, and z without gravity"},
    {.name = "azimuth",
     .type = FLESH_KEY_NUMBER,
     .offset = offsetof(flesh_camera, azimuth),
     .unit = "degree",
     .default_value = "30",
     .doc = "how far the camera stands turned about up; with up = z it looks along y at 0 and along -x at 90, with "
            "up = y along -z and -x"},
    {.name = "elevation",
     .type = FLESH_KEY_NUMBER,
     .offset = offsetof(flesh_camera, elevation),
     .unit = "degree",
     .default_value = "20",
     .doc = "how far it stands above the horizon, at most 90"},
    {.name = "target",
     .type = FLESH_KEY_VECTOR,
     .offset = offsetof(flesh_camera, target),
     .unit = "m",
     .default_value = "",
     .doc = "the middle of the picture; fitted by default"},
    {.name = "height",
     .type = FLESH_KEY_NUMBER,
     .offset = offsetof(flesh_camera, height),
     .range = FLESH_RANGE_POSITIVE,
     .unit = "m",
     .default_value = "",
     .doc = "of what is seen at the target; fitted by default"},
    {.name = "field_of_view",
     .type = FLESH_KEY_NUMBER,
     .offset = offsetof(flesh_camera, field_of_view),
     .range = FLESH_RANGE_NOT_NEGATIVE,
     .unit = "degree",
     .default_value = "20",
     .doc = "from the picture's lower to its upper edge, below 120; 0: a parallel projection"},
    {.name = NULL},
};

static const flesh_key output_table[] = {
    {.name = "frame_interval",
     .type = FLESH_KEY_INTEGER,
     .offset = offsetof(flesh_scene_output, frame_interval),
     .range = FLESH_RANGE_NOT_NEGATIVE,
     .default_value = "1",
     .doc = "steps between written frames; 0: no frames"},
    {.name = "seed",
     .type = FLESH_KEY_INTEGER,
     .offset = offsetof(flesh_scene_output, seed),
     .range = FLESH_RANGE_NOT_NEGATIVE,
     .default_value = "0",
     .doc = "of everything random in a run"},
    {.name = "skin",
     .type = FLESH_KEY_OBJECT,
     .offset = offsetof(flesh_scene_output, skin),
     .default_value = "",
     .children = skin_table,
     .doc = "a fine surface that follows the body, written into skin/ with every frame"},
    {.name = "camera",
     .type = FLESH_KEY_OBJECT,
     .offset = offsetof(flesh_scene_output, camera),
     .default_value = "{}",
     .children = camera_table,
     .doc = "from where `flesh snap` and `flesh film` see the scene"},
    {.name = NULL},
};

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
     .doc = "more bodies beside it, each with a mesh, a place and, if given, a density, a material "
            "and a velocity of its own; what acts on the body acts on them as well, unless it is "
            "for a selection. Contact is with obstacles only: bodies pass through each other, and each through itself"},
    {.name = "effects",
     .type = FLESH_KEY_EFFECTS,
     .list = &flesh_effect_key_list,
     .offset = offsetof(flesh_scene_keys, effects),
     .default_value = "[]",
     .doc = "what acts on the body: a list of \"- name: {its keys}\", or \"- name\" when it needs "
            "none; the same name may stand several times, but for inertia and elasticity"},
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
     .children = solver_table,
     .doc = "the nonlinear and linear solves"},
    {.name = "output",
     .type = FLESH_KEY_OBJECT,
     .offset = offsetof(flesh_scene_keys, output),
     .default_value = "{}",
     .children = output_table,
     .doc = "what a run writes"},
    {.name = NULL},
};
