/* keep.c: accuracy.json: what --resume goes on with, and whether it may. */
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

/* Numbers of a struct as they stand in a file. */
typedef struct field {
  const char *name;
  enum { WHOLE, LONG, NUMBER } kind;
  size_t offset;
} field;

#define AT(type, member) offsetof(flesh_accuracy_##type, member)
static const field figures_fields[] = {
    {"status_code", WHOLE, AT(figures, status)},
    {"crashed_by", WHOLE, AT(figures, crashed_by)},
    {"steps", LONG, AT(figures, steps)},
    {"rejected", LONG, AT(figures, rejected)},
    {"residual_evaluations", LONG, AT(figures, residuals)},
    {"hessian_assemblies", LONG, AT(figures, assemblies)},
    {"newton", LONG, AT(figures, newton)},
    {"linear_iterations", LONG, AT(figures, linear)},
    {"cpu_s", NUMBER, AT(figures, cpu_s)},
    {"wall_s_median", NUMBER, AT(figures, wall_s_median)},
    {"wall_s_min", NUMBER, AT(figures, wall_s_min)},
    {"error_position_rms", NUMBER, AT(figures, errors.position_rms)},
    {"error_position_max", NUMBER, AT(figures, errors.position_max)},
    {"error_tip", NUMBER, AT(figures, errors.tip)},
    {"error_volume", NUMBER, AT(figures, errors.volume)},
    {"energy_drift", NUMBER, AT(figures, errors.energy)},
    {"below_reference", WHOLE, AT(figures, below)},
    {"difference", NUMBER, AT(figures, difference)},
    {0}};
static const field reference_fields[] = {
    {"seconds", NUMBER, AT(reference, seconds)},
    {"apart", NUMBER, AT(reference, apart)},
    {"change", NUMBER, AT(reference, change)},
    {"between", NUMBER, AT(reference, between)},
    {"uncertainty_position_rms", NUMBER, AT(reference, uncertainty.position_rms)},
    {"uncertainty_position_max", NUMBER, AT(reference, uncertainty.position_max)},
    {"uncertainty_tip", NUMBER, AT(reference, uncertainty.tip)},
    {"uncertainty_volume", NUMBER, AT(reference, uncertainty.volume)},
    {"uncertainty_energy", NUMBER, AT(reference, uncertainty.energy)},
    {"length", NUMBER, AT(reference, scale.length)},
    {"motion", NUMBER, AT(reference, scale.motion)},
    {"tip_node", WHOLE, AT(reference, scale.tip)},
    {"tip_axis", WHOLE, AT(reference, scale.tip_axis)},
    {"tip_motion", NUMBER, AT(reference, scale.tip_motion)},
    {"kinetic_energy", NUMBER, AT(reference, scale.energy)},
    {"period", NUMBER, AT(reference, scale.period)},
    {0}};

static json_t *fields_json(const field *fields, const void *from)
{
  json_t *object = json_object();
  for (; fields->name; fields++) {
    const char *at = (const char *)from + fields->offset;
    json_t *value = fields->kind == NUMBER ? flesh_json_number(*(const double *)at)
                    : fields->kind == LONG ? json_integer(*(const long *)at)
                                           : json_integer(*(const int *)at);
    json_object_set_new(object, fields->name, value);
  }
  return object;
}

static int read_fields(const field *fields, const json_t *object, void *to)
{
  for (; fields->name; fields++) {
    char *at = (char *)to + fields->offset;
    const json_t *value = json_object_get(object, fields->name);
    if (!value) return -1;
    if (fields->kind == NUMBER)
      *(double *)at = json_is_number(value) ? json_number_value(value) : NAN;
    else if (fields->kind == LONG) *(long *)at = (long)json_integer_value(value);
    else *(int *)at = (int)json_integer_value(value);
  }
  return 0;
}

/* Every value in force, the mesh and the state it starts from. */
static int hash_scene(SHA2_CTX *hash, const flesh_accuracy_plan *plan, const char *path)
{
  flesh_scene *scene = NULL;
  flesh_text text = {0};
  int status = flesh_scene_read(path, plan->overrides->count, plan->overrides->values, &scene);
  if (status) return status;
  flesh_scene_print(scene, &text);
  if (text.failed) status = flesh_fail(FLESH_ERR_MEMORY, "%s: out of memory", path);
  else SHA256Update(hash, (const uint8_t *)text.data, text.size);
  free(text.data);
  const flesh_mesh *mesh = flesh_scene_mesh(scene);
  size_t nodes = (size_t)flesh_mesh_node_count(mesh), size = 3 * nodes * sizeof(double);
  flesh_state state = {.t = 0, .x = malloc(size), .v = malloc(size)};
  if (!state.x || !state.v) {
    status = flesh_fail(FLESH_ERR_MEMORY, "%s: out of memory", path);
  } else {
    flesh_scene_start(scene, &state);
    SHA256Update(hash, (const uint8_t *)state.x, size);
    SHA256Update(hash, (const uint8_t *)state.v, size);
    SHA256Update(hash, (const uint8_t *)flesh_mesh_positions(mesh), size);
    SHA256Update(hash, (const uint8_t *)flesh_mesh_tets(mesh),
                 4 * sizeof(int) * (size_t)flesh_mesh_tet_count(mesh));
    if (flesh_mesh_order(mesh) == 2)
      SHA256Update(hash, (const uint8_t *)flesh_mesh_tet_edges(mesh),
                   6 * sizeof(int) * (size_t)flesh_mesh_tet_count(mesh));
  }
  free(state.x);
  free(state.v);
  flesh_scene_destroy(&scene);
  return status;
}

/* The finer scene does not enter: its row is its own. */
static int fingerprint(const flesh_accuracy_plan *plan, const char *path,
                       char text[SHA256_DIGEST_STRING_LENGTH])
{
  SHA2_CTX hash;
  *text = 0;
  if (!path) return FLESH_OK;
  SHA256Init(&hash);
  int status = hash_scene(&hash, plan, path);
  SHA256End(&hash, text);
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

static json_t *row_json(const flesh_accuracy_row *row)
{
  json_t *object = fields_json(figures_fields, &row->figures);
  json_object_set_new(object, "method", json_string(flesh_accuracy_methods[row->method].name));
  json_object_set_new(object, "setting", json_string(row->setting));
  json_object_set_new(object, "group", json_string(flesh_accuracy_group_names[row->group]));
  json_object_set_new(object, "status", json_string(flesh_accuracy_status_word(row)));
  json_object_set_new(object, "message", flesh_json_text(row->figures.message));
  return object;
}

static void keep_path(const flesh_accuracy_plan *plan, char path[1400])
{
  snprintf(path, 1400, "%s/accuracy.json", plan->out);
}

int flesh_accuracy_keep(const flesh_accuracy_plan *plan)
{
  char path[1400];
  json_t *rows = json_array(), *root = json_object();
  json_object_set_new(root, "scene_path", flesh_json_text(plan->scene));
  json_object_set_new(root, "scene", json_string(plan->fingerprint));
  json_object_set_new(root, "finer", json_string(plan->finer_fingerprint));
  json_object_set_new(root, "build", build_json());
  json_object_set_new(root, "grid", grid_json(&plan->grid));
  json_object_set_new(root, "program", flesh_provenance_program(plan->argc, plan->argv));
  json_t *reference = fields_json(reference_fields, &plan->reference);
  json_object_set_new(reference, "first", json_string(plan->reference.first));
  json_object_set_new(reference, "second", json_string(plan->reference.second));
  json_object_set_new(root, "reference", reference);
  for (int k = 0; k < plan->row_count; k++)
    if (plan->rows[k].done) json_array_append_new(rows, row_json(&plan->rows[k]));
  json_object_set_new(root, "rows", rows);
  keep_path(plan, path);
  int status = flesh_json_write(path, root);
  return status ? status : flesh_accuracy_write_csv(plan);
}

static const char *text_of(const json_t *object, const char *key)
{
  const char *text = json_string_value(json_object_get(object, key));
  return text ? text : "";
}

static void take_row(flesh_accuracy_plan *plan, const json_t *object, int same_finer)
{
  for (int k = 0; k < plan->row_count; k++) {
    flesh_accuracy_row *row = &plan->rows[k];
    if (strcmp(text_of(object, "method"), flesh_accuracy_methods[row->method].name) ||
        strcmp(text_of(object, "setting"), row->setting) ||
        strcmp(text_of(object, "group"), flesh_accuracy_group_names[row->group]))
      continue;
    if (row->group == FLESH_ACCURACY_MESH && !same_finer) continue;
    flesh_accuracy_figures figures = row->figures;
    if (read_fields(figures_fields, object, &figures)) continue;
    /* These may go better now. */
    if (figures.status == FLESH_ERR_BUDGET || figures.crashed_by) continue;
    snprintf(figures.message, sizeof figures.message, "%s", text_of(object, "message"));
    row->figures = figures;
    row->done = 1;
  }
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
        "--resume: %s has other times of comparison; the longest of --steps must be "
        "%.15g s as it was",
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
  if (status || !plan->resume || flesh_path_access(path, F_OK)) return status;
  status = flesh_file_load(path, &text, &size);
  if (status) return status;
  json_t *root = json_loadb(text, size, 0, &error);
  free(text);
  if (!root)
    return flesh_fail(FLESH_ERR_FILE, "%s:%d:%d: %s", path, error.line, error.column, error.text);
  status = refuse(plan, root, path);
  const json_t *reference = json_object_get(root, "reference");
  size_t index;
  json_t *row;
  if (!status && read_fields(reference_fields, reference, &plan->reference))
    status = flesh_fail(FLESH_ERR_FILE, "%s: its reference is not whole", path);
  if (!status) {
    snprintf(plan->reference.first, sizeof plan->reference.first, "%s",
             text_of(reference, "first"));
    snprintf(plan->reference.second, sizeof plan->reference.second, "%s",
             text_of(reference, "second"));
    int same_finer = !strcmp(text_of(root, "finer"), plan->finer_fingerprint);
    json_array_foreach(json_object_get(root, "rows"), index, row) take_row(plan, row, same_finer);
  }
  json_decref(root);
  return status;
}
