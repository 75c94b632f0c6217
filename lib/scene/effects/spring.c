/* spring.c: springs to moving targets: their keys in a scene. */
#include <stdlib.h>

#include "base/error.h"
#include "effect/effect.h"
#include "math/nearest.h"
#include "mesh/mesh.h"
#include "parallel/body_figures.h"
#include "scene/effect_rows.h"

typedef struct target {
  double t, position[3];
} target;

static const flesh_key target_keys[] = {
    {.name = "time", .type = FLESH_KEY_NUMBER, .offset = offsetof(target, t), .unit = "s",
     .doc = "time of the keyframe; times rise"},
    {.name = "position", .type = FLESH_KEY_VECTOR, .offset = offsetof(target, position),
     .unit = "m", .doc = "position of the target"},
    {0}};

typedef struct parameters {
  double point[3], radius, stiffness, from, until;
  int interpolation;
  flesh_objects target;
} parameters;

static const flesh_key keys[] = {
    {.name = "point", .type = FLESH_KEY_VECTOR, .offset = offsetof(parameters, point),
     .unit = "m", .doc = "point of the body where the spring is attached, in rest coordinates; outside the body, the "
                         "nearest point of its surface, which must be no farther away than the mesh is long"},
    {.name = "radius", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, radius),
     .range = FLESH_RANGE_NOT_NEGATIVE, .unit = "m", .default_value = "",
     .doc = "distance within which nodes carry the point, with weights that fall off smoothly, so that refining the "
            "mesh changes little; it must hold at most 1200 nodes. Default: a twentieth of the longest side of the "
            "body's box. 0: the point alone, which digs a deeper dent in a finer mesh"},
    {.name = "stiffness", .type = FLESH_KEY_NUMBER, .offset = offsetof(parameters, stiffness),
     .range = FLESH_RANGE_POSITIVE, .unit = "N/m", .doc = "stiffness of the whole spring"},
    {.name = "target", .type = FLESH_KEY_OBJECTS, .offset = offsetof(parameters, target),
     .children = target_keys, .child_size = sizeof(target),
     .doc = "keyframes of the spring's other end"},
    FLESH_INTERPOLATION_KEY(offsetof(parameters, interpolation), "keyframes", "keyframe"),
    FLESH_INTERVAL_KEYS(parameters),
    {0}};

/* Refuses a point far from the body, which may be in another unit than the mesh. */
static int check_place(const parameters *p, const flesh_body *body, const flesh_effect *effect)
{
  double at[3];
  flesh_effect_spring_radius(effect, at);
  const double away = flesh_distance(p->point, at), longest = flesh_body_longest_side(body->mesh, NULL);
  if (body->mesh->split || away <= longest) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT, "point is [%g, %g, %g], %.3g m away from the body; it must be no farther than the "
                                        "longest side of the mesh, %.3g m",
                    p->point[0], p->point[1], p->point[2], away, longest);
}

static int add(const void *values, const flesh_body *body, flesh_system *system)
{
  const parameters *p = values;
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
  int status = flesh_effect_spring_within(body, p->point, p->radius, p->stiffness, &motion, p->from, p->until, &effect);
  free(keyframes);
  if (!status && (status = check_place(p, body, effect))) flesh_effect_destroy(&effect);
  return flesh_effect_row_add(system, status, &effect);
}

const flesh_effect_row flesh_effect_row_spring = {
    .name = "spring",
    .doc = "A spring from a point of the body, carried by the nodes around it, to a moving target, as for pulling "
           "with a mouse. It does not resist turning.",
    .keys = keys,
    .parameters_size = sizeof(parameters),
    .sample = "{point: [0.9, 0.8, 0.3], stiffness: 1000, target: [{time: 0, position: [2, 1, 1]}]}",
    .add = add,
};
