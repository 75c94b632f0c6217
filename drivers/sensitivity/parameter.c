/* parameter.c: keys of a scene as parameters: their values in force, and scenes with other values. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "math/differences.h"
#include "scene/override.h"
#include "scene/scene.h"
#include "scene/scene_keys.h"
#include "sensitivity/sensitivity.h"
#include "system/system.h"
#include "system/velocity_scale.h"

/* Length of differences as a share of the size, and by how many such lengths the middle is moved off the value: at an
 * end of a key's range the differences lie within the range. Longer ones cross kinks of contact and of clamped
 * eigenvalues. */
static const struct way {
  double difference;
  int middle;
} ways[] = {{1e-6, 0}, {1e-8, 0}, {1e-8, -2}, {1e-8, 2}};

static int not_there(const char *key, const char *why)
{
  return flesh_fail(FLESH_ERR_ARGUMENT, "--to is '%s'; %s; it must be a number of the scene as --set names it, such as "
                    "body.material.young or effects.gravity.acceleration[2]", key, why);
}

/* Returns the size of a value. For a component of a vector it is that of the largest component; for a rotation at least
 * a radian, as the size of a small rotation would leave round-off; 1 if all are 0. For a place it is the size of the
 * body, wherever the origin is; for a length its own, limited to the range from a thousandth of the body's size to that
 * size. Near 1/2 lambda depends on the distance of Poisson's ratio from 1/2, which then limits its size. */
static double size_of(const flesh_scene *scene, const char *path, const flesh_key *key, const flesh_node *parent, double value)
{
  const int is_vector = parent->kind == FLESH_NODE_LIST;
  double size = fmax(fabs(value), strstr(path, ".rotation[") ? 1 : 0), other;
  for (const flesh_node *item = is_vector ? parent->first : NULL; item; item = item->next)
    if (item->kind == FLESH_NODE_SCALAR && !flesh_option_number(item->text, &other) && isfinite(other))
      size = fmax(size, fabs(other));
  if (key && key->unit && !strcmp(key->unit, "m")) {
    const double side = flesh_system_length_scale(flesh_scene_system(scene));
    size = is_vector ? side : fmin(fmax(size, 1e-3 * side), side);
  }
  if (strstr(path, ".poisson") && value < 0.5) size = fmin(size, 1e3 * (0.5 - value));
  return size > 0 ? size : 1;
}

/* Finds the value in force of a key, and its size. */
static int find_value(const flesh_scene *scene, const char *path, double *value, double *size)
{
  flesh_text text = {0};
  flesh_arena arena = {0};
  flesh_node *root = NULL, *node, *parent;
  const flesh_key *key;
  if (strncmp(path, "body.", 5) && strncmp(path, "bodies[", 7) && strncmp(path, "effects", 7) &&
      strncmp(path, "start.", 6))
    return not_there(path, "derivatives are by keys of bodies, effects and the start");
  flesh_scene_print(scene, &text);
  int status = text.failed ? flesh_fail(FLESH_ERR_MEMORY, "out of memory for a scene") : FLESH_OK;
  if (!status) status = flesh_yaml_parse(&arena, text.data, text.size, &(flesh_source){"the scene", 0}, &root);
  if (!status) status = flesh_override_find(&arena, flesh_scene_table, path, root, &node, &parent, &key);
  if (status == FLESH_ERR_ARGUMENT) status = not_there(path, "the scene has no such key");
  if (!status && (node->kind != FLESH_NODE_SCALAR || flesh_option_number(node->text, value)))
    status = not_there(path, "this key is no number");
  if (!status) *size = size_of(scene, path, key, parent, *value);
  flesh_arena_free(&arena);
  free(text.data);
  return status;
}

/* Reads the scenes with the key varied by `difference`. If a load or friction begins at its value, these scenes need
 * solves that the scene's own run did not make, and are refused. */
static int make_scenes(const flesh_scene *scene, const char *path, const flesh_overrides *overrides, double difference,
                       int middle, flesh_varied_key *varied, flesh_parameter *parameter)
{
  const flesh_system *own = flesh_scene_system(scene);
  int status = FLESH_OK;
  for (int k = 0; k < FLESH_DIFFERENCES && !status; k++) {
    flesh_overrides set;
    char number[64];
    snprintf(number, sizeof number, "%.17g", varied->value + (flesh_difference_at[k] + middle) * difference);
    flesh_overrides_copy(&set, &overrides->texts);
    flesh_overrides_add(&set, varied->key, number);
    status = flesh_overrides_read(&set, path, &varied->scenes[k]);
    flesh_overrides_close(&set);
    if (status) break;
    const flesh_system *beside = parameter->systems[k] = flesh_scene_system(varied->scenes[k]);
    if (flesh_system_has_follower_loads(beside) != flesh_system_has_follower_loads(own) ||
        flesh_system_multiplier_count(beside) != flesh_system_multiplier_count(own))
      status = flesh_fail(FLESH_ERR_ARGUMENT, "beside its value the scene is of another kind, as where friction begins or tets "
                                              "are no longer incompressible");
  }
  parameter->difference = difference;
  return status;
}

int flesh_varied_key_read(const flesh_scene *scene, const char *path, const flesh_overrides *overrides, const char *key,
                          flesh_varied_key *varied, flesh_parameter *parameter)
{
  *varied = (flesh_varied_key){0};
  snprintf(varied->key, sizeof varied->key, "%s", key);
  double size = 1;
  int status = find_value(scene, key, &varied->value, &size);
  if (status) return status;
  for (size_t k = 0; k < sizeof ways / sizeof *ways; k++) {
    status = make_scenes(scene, path, overrides, ways[k].difference * size, ways[k].middle, varied, parameter);
    if (status != FLESH_ERR_ARGUMENT) return status;
    flesh_varied_key_clear(varied);
  }
  return flesh_fail_within(status, "--to is '%s', differences of which are refused: ", key);
}

void flesh_varied_key_clear(flesh_varied_key *varied)
{
  for (int k = 0; k < FLESH_DIFFERENCES; k++) flesh_scene_destroy(&varied->scenes[k]);
}
