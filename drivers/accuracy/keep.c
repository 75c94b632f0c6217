/* keep.c: accuracy.json: the reference that --resume goes on with, and whether it may. */
#include <jansson.h>
#include <math.h>
#include <sha256.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "accuracy/accuracy.h"
#include "base/confine.h"
#include "base/error.h"
#include "base/scan.h"
#include "run/provenance.h"
#include "run/result.h"
#include "scene/scene.h"
#include "cli/json_memory.h"
#include "study/fields.h"

#define AT(member) offsetof(flesh_accuracy_reference, member)
static const flesh_study_field reference_fields[] = {
    {"seconds", FLESH_FIELD_DOUBLE, AT(seconds)},
    {"apart", FLESH_FIELD_DOUBLE, AT(apart)},
    {"change", FLESH_FIELD_DOUBLE, AT(change)},
    {"between", FLESH_FIELD_DOUBLE, AT(between)},
    {"uncertainty_position_rms", FLESH_FIELD_DOUBLE, AT(uncertainty.position_rms)},
    {"uncertainty_position_max", FLESH_FIELD_DOUBLE, AT(uncertainty.position_max)},
    {"uncertainty_tip", FLESH_FIELD_DOUBLE, AT(uncertainty.tip)},
    {"uncertainty_volume", FLESH_FIELD_DOUBLE, AT(uncertainty.volume)},
    {"uncertainty_energy", FLESH_FIELD_DOUBLE, AT(uncertainty.energy)},
    {"length", FLESH_FIELD_DOUBLE, AT(scale.length)},
    {"motion", FLESH_FIELD_DOUBLE, AT(scale.motion)},
    {"tip_node", FLESH_FIELD_INT, AT(scale.tip)},
    {"tip_axis", FLESH_FIELD_INT, AT(scale.tip_axis)},
    {"tip_motion", FLESH_FIELD_DOUBLE, AT(scale.tip_motion)},
    {"kinetic_energy", FLESH_FIELD_DOUBLE, AT(scale.energy)},
    {"period", FLESH_FIELD_DOUBLE, AT(scale.period)},
    {0}};

static int fingerprint(const flesh_accuracy_plan *plan, const char *path, char text[FLESH_STUDY_FINGERPRINT])
{
  flesh_scene *scene = NULL;
  *text = 0;
  if (!path) return FLESH_OK;
  int status = flesh_accuracy_read_as_it_stands(plan, path, &scene);
  if (!status) status = flesh_study_fingerprint(scene, path, text);
  flesh_scene_destroy(&scene);
  return status;
}

/* One text that names the build. */
static json_t *build_json(void)
{
  static const char *const parts[] = {"flesh",          "commit",          "compiler",
                                      "compiler_flags", "instruction_set", "libraries"};
  char *words[1] = {NULL};
  json_t *program = flesh_provenance_program(0, words), *build = json_object();
  for (size_t p = 0; p < sizeof parts / sizeof parts[0]; p++)
    json_object_set(build, parts[p], json_object_get(program, parts[p]));
  json_decref(program);
  return build;
}

static json_t *grid_json(const flesh_accuracy_grid *grid)
{
  return json_pack("{sfsfsfsfsi}", "start", grid->start, "end", grid->end, "longest", grid->longest, "interval",
                   grid->interval, "count", grid->count);
}

static void keep_path(const flesh_accuracy_plan *plan, char path[1400])
{
  snprintf(path, 1400, "%s/accuracy.json", plan->out);
}

json_t *flesh_accuracy_reference_json(const flesh_accuracy_plan *plan)
{
  json_t *reference = flesh_fields_json(reference_fields, &plan->reference);
  json_object_set_new(reference, "first", json_string(plan->reference.first));
  json_object_set_new(reference, "second", json_string(plan->reference.second));
  json_object_set_new(reference, "times", json_integer(plan->grid.count));
  json_object_set_new(reference, "start", json_real(plan->grid.start));
  json_object_set_new(reference, "end", json_real(plan->grid.end));
  return reference;
}

int flesh_accuracy_keep(const flesh_accuracy_plan *plan)
{
  char path[1400];
  json_t *root = json_object();
  json_object_set_new(root, "scene_path", flesh_json_text(plan->scene));
  json_object_set_new(root, "scene", json_string(plan->fingerprint));
  json_object_set_new(root, "build", build_json());
  json_object_set_new(root, "grid", grid_json(&plan->grid));
  json_object_set_new(root, "program", flesh_provenance_program(plan->options.argc, plan->options.argv));
  json_object_set_new(root, "reference", flesh_accuracy_reference_json(plan));
  keep_path(plan, path);
  return flesh_json_write(path, root);
}

static const char *text_of(const json_t *object, const char *key)
{
  const char *text = json_string_value(json_object_get(object, key));
  return text ? text : "";
}

/* In the order in which a person would want to know. */
static int refuse(const flesh_accuracy_plan *plan, const json_t *root, const char *path)
{
  if (strcmp(text_of(root, "scene"), plan->fingerprint))
    return flesh_fail(
        FLESH_ERR_ARGUMENT,
        "--resume: %s is of another scene or other --set values, or its mesh or start "
        "state has changed; give another --out, or leave --resume out to start over",
        path);
  json_t *grid = grid_json(&plan->grid), *build = build_json();
  int same_grid = json_equal(grid, json_object_get(root, "grid"));
  int same_build = json_equal(build, json_object_get(root, "build"));
  json_decref(grid);
  json_decref(build);
  if (!same_grid)
    return flesh_fail(
        FLESH_ERR_ARGUMENT,
        "--resume: %s compares at other times; the longest of --steps must be %.15g s, as before",
        path, json_number_value(json_object_get(json_object_get(root, "grid"), "longest")));
  if (!same_build)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "--resume: %s was made by another build of flesh, whose times would not "
                      "compare; leave --resume out to start over",
                      path);
  return FLESH_OK;
}

int flesh_accuracy_load(flesh_accuracy_plan *plan)
{
  char path[1400];
  json_error_t error;
  char *text = NULL;
  size_t size = 0;
  int status = fingerprint(plan, plan->scene, plan->fingerprint);
  if (!status) status = fingerprint(plan, plan->finer, plan->finer_fingerprint);
  keep_path(plan, path);
  if (status || !plan->options.resume || flesh_path_access(path, F_OK)) return status;
  status = flesh_file_load(path, &text, &size);
  if (status) return status;
  json_t *root = json_loadb(text, size, 0, &error);
  free(text);
  if (!root)
    return flesh_fail(FLESH_ERR_FILE, "%s:%d:%d: %s", path, error.line, error.column, error.text);
  status = refuse(plan, root, path);
  const json_t *reference = json_object_get(root, "reference");
  if (!status && flesh_fields_read(reference_fields, reference, &plan->reference))
    status = flesh_fail(FLESH_ERR_FILE, "%s: its reference is incomplete", path);
  if (!status) {
    snprintf(plan->reference.first, sizeof plan->reference.first, "%s",
             text_of(reference, "first"));
    snprintf(plan->reference.second, sizeof plan->reference.second, "%s",
             text_of(reference, "second"));
  }
  json_decref(root);
  return status;
}

void flesh_accuracy_make_fingerprint(flesh_accuracy_plan *plan)
{
  json_t *parts[] = {grid_json(&plan->grid), build_json()};
  SHA2_CTX hash;
  SHA256Init(&hash);
  SHA256Update(&hash, (const uint8_t *)plan->fingerprint, strlen(plan->fingerprint));
  for (int k = 0; k < 2; k++) {
    char *text = json_dumps(parts[k], JSON_COMPACT | JSON_SORT_KEYS);
    if (text) SHA256Update(&hash, (const uint8_t *)text, strlen(text));
    free(text);
    json_decref(parts[k]);
  }
  SHA256End(&hash, plan->study_fingerprint);
}
