/* contact.c: contact: its keys in a scene. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/error.h"
#include "geometry/motion.h"
#include "mesh/mesh.h"
#include "flesh/contact.h"
#include "flesh/surface.h"
#include "scene/effect_rows.h"
#include "scene/node.h"

typedef struct parameters {
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
  const flesh_node *between;
  double stiffness, thickness, friction, slip_speed, centre[3];
  int interpolation, intersecting, adaptive;
  flesh_objects motion;
} parameters;

static const char *const intersecting_names[] = {"refuse", "separate", NULL};

#define AT(member)                                                                                 \
  .offset = offsetof(parameters, member) - offsetof(parameters, plane)
static const flesh_key plane_keys[] = {
    {.name = "point", .type = FLESH_KEY_VECTOR, AT(plane.point), .unit = "m", .doc = "a point on the plane"},
    {.name = "normal", .type = FLESH_KEY_VECTOR, AT(plane.normal), .default_value = "[0, 0, 1]",
     .doc = "normal of the plane, of any length, pointing to the side where the body is"},
    {0}};
#undef AT

#define AT(member)                                                                                 \
  .offset = offsetof(parameters, member) - offsetof(parameters, sphere)
static const flesh_key sphere_keys[] = {
    {.name = "centre", .type = FLESH_KEY_VECTOR, AT(sphere.centre), .unit = "m", .doc = "centre of the ball"},
    {.name = "radius", .type = FLESH_KEY_NUMBER, AT(sphere.radius), .range = FLESH_RANGE_POSITIVE,
     .unit = "m", .doc = "radius of the ball"},
    {0}};
#undef AT

#define AT(member)                                                                                 \
  .offset = offsetof(parameters, member) - offsetof(parameters, capsule)
static const flesh_key capsule_keys[] = {
    {.name = "from", .type = FLESH_KEY_VECTOR, AT(capsule.from), .unit = "m",
     .doc = "one end of its axis"},
    {.name = "to", .type = FLESH_KEY_VECTOR, AT(capsule.to), .unit = "m",
     .doc = "other end of its axis"},
    {.name = "radius", .type = FLESH_KEY_NUMBER, AT(capsule.radius), .range = FLESH_RANGE_POSITIVE,
     .unit = "m", .doc = "radius around the axis"},
    {0}};
#undef AT

#define AT(member) .offset = offsetof(parameters, member)
static const flesh_key keys[] = {
    {.name = "plane", .type = FLESH_KEY_OBJECT, AT(plane), .default_value = "",
     .children = plane_keys, .doc = "the half-space below a plane"},
    {.name = "sphere", .type = FLESH_KEY_OBJECT, AT(sphere), .default_value = "",
     .children = sphere_keys, .doc = "a ball"},
    {.name = "capsule", .type = FLESH_KEY_OBJECT, AT(capsule), .default_value = "",
     .children = capsule_keys, .doc = "a rod with round ends"},
    {.name = "mesh", .type = FLESH_KEY_PATH, AT(mesh), .default_value = "",
     .doc = "file of a surface (.obj, .ply or .stl), or of a tetrahedral mesh whose surface is the obstacle; closed "
            "or open; contact acts from both sides"},
    {.name = "between", .type = FLESH_KEY_TREE, AT(between), .default_value = "",
     .doc = "bodies that touch each other, in place of an obstacle: all (each other and themselves), self (each "
            "itself), or a list of pairs of names [[a, b], [a, a]]"},
    {.name = "intersecting", .type = FLESH_KEY_CHOICE, AT(intersecting), .choices = intersecting_names,
     .default_value = "refuse",
     .doc = "surfaces in contact that intersect at the start: refuse the scene, or separate: "
            "ignore contact between them until they are apart"},
    {.name = "motion", .type = FLESH_KEY_OBJECTS, AT(motion), .default_value = "",
     .children = flesh_keyframe_keys, .child_size = sizeof(flesh_keyframe),
     .doc = "keyframes of the obstacle; before the first and after the last it rests"},
    {.name = "centre", .type = FLESH_KEY_VECTOR, AT(centre), .unit = "m",
     .default_value = "[0, 0, 0]", .doc = "centre of the motion's rotations"},
    FLESH_INTERPOLATION_KEY(offsetof(parameters, interpolation), "keyframes", "keyframe"),
    {.name = "stiffness", .type = FLESH_KEY_NUMBER, AT(stiffness), .range = FLESH_RANGE_POSITIVE,
     .unit = "Pa", .default_value = "",
     .doc = "stiffness of the barrier. Default: three times the body's largest shear modulus mu"},
    {.name = "adaptive", .type = FLESH_KEY_BOOLEAN, AT(adaptive), .default_value = "false",
     .doc = "between bodies: the stiffness follows the pressures from step to step, so that most gaps are near half of "
            "the thickness"},
    {.name = "thickness", .type = FLESH_KEY_NUMBER, AT(thickness), .range = FLESH_RANGE_POSITIVE,
     .unit = "m", .default_value = "",
     .doc = "distance at which the barrier begins. Default: 1/20 of the mean edge of the body's "
            "surface"},
    {.name = "friction", .type = FLESH_KEY_NUMBER, AT(friction), .range = FLESH_RANGE_NOT_NEGATIVE,
     .default_value = "0", .doc = "Coulomb's friction coefficient; in statics, friction acts only against moving "
                                  "obstacles"},
    {.name = "slip_speed", .type = FLESH_KEY_NUMBER, AT(slip_speed), .range = FLESH_RANGE_POSITIVE,
     .unit = "m/s", .default_value = "1e-3",
     .doc = "speed below which friction is viscous: sticking contact slides more slowly than this"},
    {0}};
#undef AT

static int is_surface(const char *path)
{
  const char *suffix = strrchr(path, '.');
  return suffix && (!strcasecmp(suffix, ".obj") || !strcasecmp(suffix, ".ply") || !strcasecmp(suffix, ".stl"));
}

static int make_mesh(const char *path, flesh_obstacle **obstacle)
{
  flesh_surface *surface = NULL;
  flesh_mesh *mesh = NULL;
  int triangles, status = is_surface(path) ? flesh_surface_read(path, &surface)
                                           : flesh_mesh_read(path, &mesh);
  if (status) return status;
  const int *corners = surface ? flesh_surface_triangles(surface, &triangles)
                               : flesh_mesh_surface(mesh, &triangles);
  status = flesh_obstacle_mesh(
      surface ? flesh_surface_vertex_count(surface) : flesh_mesh_node_count(mesh),
      surface ? flesh_surface_positions(surface) : flesh_mesh_positions(mesh), triangles, corners,
      obstacle);
  flesh_surface_destroy(&surface);
  flesh_mesh_destroy(&mesh);
  return status;
}

/* Reads a pair of the list. FLESH_ERR_ARGUMENT with what is wrong with it. */
static int read_pair(const flesh_body *body, const flesh_node *node, int pair[2])
{
  char shown[FLESH_SHOW_SIZE];
  if (node->kind != FLESH_NODE_LIST || node->count != 2)
    return flesh_fail(FLESH_ERR_ARGUMENT, "between has %s; it must be a list of pairs of bodies, [[a, b], [a, a]]",
                           flesh_node_show(node, shown));
  for (int end = 0; end < 2; end++) {
    const flesh_node *name = flesh_node_item(node, end);
    const flesh_body_part *part;
    if (name->kind != FLESH_NODE_SCALAR)
      return flesh_fail(FLESH_ERR_ARGUMENT, "between has %s; it must be the name of a body", flesh_node_show(name, shown));
    if (flesh_selection_body(name->text, body, &part)) return flesh_fail_within(FLESH_ERR_ARGUMENT, "between: ");
    pair[end] = (int)(part - body->parts);
  }
  return FLESH_OK;
}

/* Reads `between` into new pairs: NULL for all, each body with itself, or those listed. */
static int read_between(const flesh_body *body, const flesh_node *between, int *count, int **pairs)
{
  const int is_self = between->kind == FLESH_NODE_SCALAR && !strcmp(between->text, "self"),
            parts = body->part_count > 0 ? body->part_count : 1;
  char shown[FLESH_SHOW_SIZE];
  int status = FLESH_OK;
  *pairs = NULL;
  *count = 0;
  if (between->kind == FLESH_NODE_SCALAR && !strcmp(between->text, "all")) return FLESH_OK;
  if (!is_self && (between->kind != FLESH_NODE_LIST || between->count < 1))
    return flesh_fail(FLESH_ERR_ARGUMENT, "between is %s; it must be all, self, or a list of pairs of bodies",
                           flesh_node_show(between, shown));
  *count = is_self ? parts : between->count;
  *pairs = malloc(2 * (size_t)*count * sizeof **pairs);
  if (!*pairs) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d pairs of bodies", *count);
  for (int k = 0; k < *count && !status; k++) {
    int *pair = *pairs + 2 * (size_t)k;
    pair[0] = pair[1] = k;
    if (!is_self) status = read_pair(body, flesh_node_item(between, k), pair);
  }
  if (status) free(*pairs);
  return status;
}

static int add_between(const parameters *p, const flesh_contact_options *options, const flesh_body *body,
                       flesh_system *system)
{
  flesh_effect *effect = NULL;
  int count, *pairs;
  if (p->motion.count) return flesh_fail(FLESH_ERR_ARGUMENT, "motion applies to an obstacle; leave it out beside between");
  if (body->mesh->split)
    return flesh_fail(FLESH_ERR_ARGUMENT, "between needs the whole body, but each rank of a split mesh has only a part; "
                                          "leave it out, or give a mesh that is not split");
  int status = read_between(body, p->between, &count, &pairs);
  if (status) return status;
  status = flesh_effect_surface_contact(body, options, count, pairs, &effect);
  free(pairs);
  return flesh_effect_row_add(system, status, &effect);
}

static int add(const void *values, const flesh_body *body, flesh_system *system)
{
  const parameters *p = values;
  const flesh_contact_options options = {.stiffness = p->stiffness, .thickness = p->thickness,
                                         .friction = p->friction, .slip_speed = p->slip_speed,
                                         .separates = p->intersecting, .adaptive = p->adaptive};
  const int plane = !isnan(p->plane.point[0]), sphere = !isnan(p->sphere.radius),
            capsule = !isnan(p->capsule.radius), mesh = p->mesh != NULL;
  flesh_obstacle *obstacle = NULL;
  flesh_effect *effect = NULL;
  if (plane + sphere + capsule + mesh + (p->between != NULL) != 1)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "%d obstacles are given; one of plane, sphere, capsule or mesh is needed, or between",
                      plane + sphere + capsule + mesh + (p->between != NULL));
  if (p->between) return add_between(p, &options, body, system);
  if (p->intersecting)
    return flesh_fail(FLESH_ERR_ARGUMENT, "intersecting applies to contact between bodies; leave it out for an obstacle");
  if (p->adaptive)
    return flesh_fail(FLESH_ERR_ARGUMENT, "adaptive applies to contact between bodies; leave it out for an obstacle");
  int status = plane     ? flesh_obstacle_plane(p->plane.point, p->plane.normal, &obstacle)
               : sphere  ? flesh_obstacle_sphere(p->sphere.centre, p->sphere.radius, &obstacle)
               : capsule ? flesh_obstacle_capsule(p->capsule.from, p->capsule.to,
                                                  p->capsule.radius, &obstacle)
                         : make_mesh(p->mesh, &obstacle);
  const flesh_motion motion = {p->motion.count, p->motion.values,
                               {p->centre[0], p->centre[1], p->centre[2]}, p->interpolation};
  if (!status && motion.count) status = flesh_obstacle_move(obstacle, &motion);
  if (status) {
    flesh_obstacle_destroy(&obstacle);
    return status;
  }
  status = flesh_effect_obstacle_contact(body, &options, &obstacle, &effect);
  return status ? status : flesh_system_add_effect(system, &effect);
}

const flesh_effect_row flesh_effect_row_contact = {
    .name = "contact",
    .doc = "Keeps the body's nodes out of an obstacle, still or moving, by a smooth barrier that no node can "
     "pass, with friction. One obstacle each: plane, sphere, capsule or mesh. Histories have the columns contact_gap, "
     "contact_nodes and contact_force. With between in place of an obstacle it keeps the surfaces of bodies out of each "
     "other; histories have contact_gap, contact_pairs and contact_force.",
    .keys = keys,
    .parameters_size = sizeof(parameters),
    .sample = "{plane: {point: [0, 0, -1], normal: [0.2, 0.1, 1]}, thickness: 4, stiffness: 1e5}",
    .add = add,
    .on_parts = FLESH_PARTS_NODES,
};
