/* output_keys.c: the keys of a scene's output. */
#include "scene/scene_keys.h"

#include <stddef.h>

static const char *const skin_formats[] = {"obj", "pc2", "vtu", NULL}; /* bits FLESH_SKIN_OBJ... */

#define AT(member) .offset = offsetof(flesh_output_keys, given.member) - offsetof(flesh_output_keys, given.skin)
static const flesh_key skin_table[] = {
    {.name = "surface",
     .type = FLESH_KEY_PATH,
     AT(skin.surface),
     .doc = "file of the surface (.obj, .ply or .stl), placed like the body at rest; relative to the scene"},
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

/* In the order of flesh_probe_quantity's bits. */
static const char *const quantities[] = {"position", "velocity", "reaction", "J",
                                         "stretch",  "stress",   "energy",   "contact_force", NULL};

#define AT(member) .offset = offsetof(flesh_scene_probe, member)
static const flesh_key probe_table[] = {
    {.name = "name", .type = FLESH_KEY_TEXT, AT(name),
     .doc = "name that its columns begin with: a letter, then letters, digits, _ and -"},
    {.name = "point", .type = FLESH_KEY_VECTOR, AT(point), .unit = "m", .default_value = "",
     .doc = "a point of the body at rest, instead of nodes; interpolated in the tet that holds it"},
    FLESH_SELECTION_KEYS(flesh_scene_probe, selection),
    {.name = "effect", .type = FLESH_KEY_TEXT, AT(effect), .default_value = "",
     .doc = "a pin, prescribed_motion, contact, weld or joint of the scene, as pin or pin[1] (the second), instead of "
            "nodes: its nodes (all for a contact, those of the first side for a weld or joint) and its forces alone"},
    {.name = "about", .type = FLESH_KEY_VECTOR, AT(about), .unit = "m", .default_value = "",
     .doc = "reference point of moments; the mean of the nodes' rest positions by default"},
    {.name = "quantities", .type = FLESH_KEY_SET, AT(quantities), .choices = quantities,
     .default_value = "[position]",
     .doc = "position, velocity: of the point, or the nodes' mean; reaction: force and moment of the pins and "
            "prescribed motions on the nodes; J (det F), stretch (principal ones, descending), stress (Cauchy, of "
            "elasticity and of the fibres of muscles), energy (of strain, from rest): at the point, or of the tets "
            "whose nodes are all chosen, the energy as a sum and the others as means (J as J_mean); contact_force: "
            "force and moment of contact on the nodes, or of the weld or joint that effect names"},
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
     .doc = "angle of the camera about up; with up = z it looks along y at 0 and along -x at 90, with up = y along "
            "-z and -x"},
    {.name = "elevation",
     .type = FLESH_KEY_NUMBER,
     .offset = offsetof(flesh_camera, elevation),
     .unit = "degree",
     .default_value = "20",
     .doc = "angle of the camera above the horizon, at most 90"},
    {.name = "target",
     .type = FLESH_KEY_VECTOR,
     .offset = offsetof(flesh_camera, target),
     .unit = "m",
     .default_value = "",
     .doc = "point in the middle of the picture; fitted by default"},
    {.name = "height",
     .type = FLESH_KEY_NUMBER,
     .offset = offsetof(flesh_camera, height),
     .range = FLESH_RANGE_POSITIVE,
     .unit = "m",
     .default_value = "",
     .doc = "height that the picture shows at the target; fitted by default"},
    {.name = "field_of_view",
     .type = FLESH_KEY_NUMBER,
     .offset = offsetof(flesh_camera, field_of_view),
     .range = FLESH_RANGE_NOT_NEGATIVE,
     .unit = "degree",
     .default_value = "20",
     .doc = "angle from the picture's lower to its upper edge, below 120; 0: a parallel projection"},
    {.name = NULL},
};

/* In the order of flesh_field's and flesh_field_place's bits. */
static const char *const fields[] = {"displacement", "velocity", "J",        "stretch",       "stress", "von_mises",
                                     "pressure",     "energy_density", "reaction", "contact_force", NULL};
static const char *const places[] = {"nodes", "tets", "points", NULL};

const flesh_key flesh_output_table[] = {
    {.name = "frame_interval",
     .type = FLESH_KEY_INTEGER,
     .offset = offsetof(flesh_output_keys, given.frame_interval),
     .range = FLESH_RANGE_NOT_NEGATIVE,
     .default_value = "1",
     .doc = "steps between written frames; 0: no frames"},
    {.name = "fields",
     .type = FLESH_KEY_SET,
     .offset = offsetof(flesh_output_keys, given.fields),
     .choices = fields,
     .default_value = "[displacement, velocity]",
     .doc = "fields of frames: displacement and velocity in any case; J (det F; at nodes its mean, J_mean), stretch "
            "(principal ones, descending), stress (Cauchy, of elasticity and of the fibres of muscles), von_mises "
            "and pressure of it, and energy_density (of strain, from rest) at fields_at; reaction (of pins and "
            "prescribed motions) and contact_force at nodes. J_mean, J_min (least at a quadrature point) and region "
            "of every tet are always there"},
    {.name = "fields_at",
     .type = FLESH_KEY_SET,
     .offset = offsetof(flesh_output_keys, given.fields_at),
     .choices = places,
     .default_value = "[nodes, tets]",
     .doc = "nodes: means over the tets around each; tets: means over each; points: at the quadrature points of each "
            "tet, as cell data"},
    {.name = "seed",
     .type = FLESH_KEY_INTEGER,
     .offset = offsetof(flesh_output_keys, given.seed),
     .range = FLESH_RANGE_NOT_NEGATIVE,
     .default_value = "0",
     .doc = "seed of all random numbers of a run"},
    {.name = "skin",
     .type = FLESH_KEY_OBJECT,
     .offset = offsetof(flesh_output_keys, given.skin),
     .default_value = "",
     .children = skin_table,
     .doc = "a fine surface that follows the body, written into skin/ with every frame"},
    {.name = "camera",
     .type = FLESH_KEY_OBJECT,
     .offset = offsetof(flesh_output_keys, given.camera),
     .default_value = "{}",
     .children = camera_table,
     .doc = "camera of `flesh snap` and `flesh film`"},
    {.name = "probes",
     .type = FLESH_KEY_OBJECTS,
     .offset = offsetof(flesh_output_keys, probes),
     .default_value = "",
     .children = probe_table,
     .child_size = sizeof(flesh_scene_probe),
     .doc = "places for which probes.csv has a row per step, with a column for each component of a quantity"},
    {.name = "reactions",
     .type = FLESH_KEY_BOOLEAN,
     .offset = offsetof(flesh_output_keys, reactions),
     .default_value = "false",
     .doc = "adds a probe of every pin, prescribed_motion, contact, weld and joint, named pin, pin_2 ..., with its "
            "force and the moment of that about the origin"},
    {.name = "error_bars",
     .type = FLESH_KEY_BOOLEAN,
     .offset = offsetof(flesh_output_keys, error_bars),
     .default_value = "false",
     .doc = "estimates the errors of probes and energies due to the mesh and the steps, by further runs with other "
            "ones, which `flesh run` makes after this one"},
    {.name = NULL},
};
