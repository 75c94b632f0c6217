/* scene.c: reads a scene's file into everything that a run needs, and gives access to it. */
#include "scene/scene.h"

#include <errno.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/confine.h"
#include "base/error.h"
#include "base/file.h"
#include "base/scan.h"
#include "base/stop.h"
#include "newton/equations.h"
#include "scene/effect_list.h"
#include "scene/keys.h"
#include "scene/override.h"
#include "time/method.h"

enum { MAX_FILE = 64 << 20 };

static int load_text(const char *path, char **text, size_t *size)
{
  struct stat info;
  if (flesh_path_stat(path, &info))
    return flesh_fail(FLESH_ERR_FILE, "%s: cannot be opened: %s", path, strerror(errno));
  if (S_ISDIR(info.st_mode))
    return flesh_fail(FLESH_ERR_FILE, "%s: is a directory; a scene is a YAML or JSON file", path);
  if (!S_ISREG(info.st_mode))
    return flesh_fail(FLESH_ERR_FILE, "%s: not a regular file; a scene is a YAML or JSON file",
                      path);
  if (info.st_size > MAX_FILE)
    return flesh_fail(FLESH_ERR_FILE, "%s: has %lld bytes; a scene has at most %d", path,
                      (long long)info.st_size, MAX_FILE);
  return flesh_file_load(path, text, size);
}

/* Reads the tree of the file and applies the overrides. */
static int read_tree(flesh_scene *scene, int count, const char *const *overrides, flesh_node **root)
{
  char *loaded = NULL;
  size_t size = scene->text ? strlen(scene->text) : 0;
  int status = scene->text ? FLESH_OK : load_text(scene->path, &loaded, &size);
  if (status) return status;
  flesh_source source = {scene->path, 0};
  status = flesh_yaml_parse(&scene->arena, scene->text ? scene->text : loaded, size, &source, root);
  free(loaded);
  if (status) return status;
  flesh_key as_key = {.type = FLESH_KEY_OBJECT, .children = flesh_scene_table};
  char expected[FLESH_EXPECTATION_SIZE];
  if (!*root)
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s:1:1: the scene is empty; it must be %s", scene->path,
                      flesh_key_expectation(&as_key, expected));
  if ((*root)->kind != FLESH_NODE_MAPPING) return flesh_key_fail(&as_key, *root, "the scene");
  const flesh_key *effects = flesh_key_at(flesh_scene_table, offsetof(flesh_scene_keys, effects));
  status = flesh_effect_list_normalise(&scene->arena, flesh_node_find(*root, effects->name));
  for (int i = 0; !status && i < count; i++) {
    status = flesh_override_apply(&scene->arena, flesh_scene_table, overrides[i], i + 1, *root);
    if (!status)
      status = flesh_effect_list_normalise(&scene->arena, flesh_node_find(*root, effects->name));
  }
  return status;
}

/* Makes the path absolute, so that it names the same file in any working directory. */
int flesh_scene_make_absolute(flesh_scene *scene, char **path)
{
  char *whole = realpath(*path, NULL);
  if (!whole)
    return flesh_fail(errno == ENOMEM ? FLESH_ERR_MEMORY : FLESH_ERR_FILE, "%s: %s", *path, strerror(errno));
  *path = flesh_arena_text(&scene->arena, whole, strlen(whole));
  free(whole);
  return *path ? FLESH_OK : flesh_no_memory_for(scene->path);
}

static int read_mesh(flesh_scene *scene)
{
  const flesh_node *place = flesh_scene_place(scene->root, flesh_scene_table, offsetof(flesh_scene_keys, body));
  int status = flesh_scene_read_body_mesh(scene, &scene->mesh);
  if (!status) status = flesh_scene_make_absolute(scene, &scene->keys.body.mesh);
  if (status) return flesh_node_fail_within(status, place, "body.mesh: ");
  status = flesh_scene_fit_mesh(scene, "body", (flesh_element)scene->keys.body.element, &scene->keys.body.curved,
                                &scene->mesh);
  return status ? flesh_node_fail_within(status, place, "%s", "") : FLESH_OK;
}

static int read_start(flesh_scene *scene)
{
  int nodes = flesh_mesh_node_count(scene->mesh);
  size_t size = 3 * (size_t)nodes * sizeof(double);
  scene->start.x = flesh_arena_take(&scene->arena, size);
  scene->start.v = flesh_arena_take(&scene->arena, size);
  scene->start.multiplier_count = flesh_system_multiplier_count(scene->system);
  if (scene->start.multiplier_count)
    scene->start.multipliers =
        flesh_arena_take(&scene->arena, (size_t)scene->start.multiplier_count * sizeof(double));
  scene->start.internal_count = flesh_system_internal_count(scene->system);
  if (scene->start.internal_count)
    scene->start.internal = flesh_arena_take(&scene->arena, (size_t)scene->start.internal_count * sizeof(double));
  if (!scene->start.x || !scene->start.v || (scene->start.multiplier_count && !scene->start.multipliers) ||
      (scene->start.internal_count && !scene->start.internal))
    return flesh_no_memory_for(scene->path);
  for (int k = 0; k < scene->start.multiplier_count; k++) scene->start.multipliers[k] = 0;
  for (int k = 0; k < scene->start.internal_count; k++) scene->start.internal[k] = 0;
  if (!scene->keys.start.state) {
    memcpy(scene->start.x, flesh_mesh_positions(scene->mesh), size);
    for (int i = 0; i < 3 * nodes; i++) scene->start.v[i] = scene->keys.start.velocity[i % 3];
    flesh_scene_start_bodies(scene, scene->start.v);
    return FLESH_OK;
  }
  const flesh_node *place = flesh_scene_place(scene->root, flesh_scene_table, offsetof(flesh_scene_keys, start));
  int status = flesh_scene_read_state(scene, &scene->start);
  if (!status) status = flesh_scene_make_absolute(scene, &scene->keys.start.state);
  return status ? flesh_node_fail_within(status, place, "start.state: ") : FLESH_OK;
}

static int check_solver(const flesh_scene *scene)
{
  const flesh_key *solver = flesh_key_at(flesh_scene_table, offsetof(flesh_scene_keys, solver));
  const flesh_node *place = flesh_scene_place(scene->root, flesh_scene_table, solver->offset);
  const int status = flesh_solver_options_check(&scene->keys.solver);
  if (status) return flesh_node_fail_within(status, place, "%s.", solver->name);
#ifndef FLESH_HAVE_CHOLMOD
  if (scene->keys.solver.linear_solver == FLESH_LINEAR_CHOLMOD) {
    const flesh_key *key = flesh_key_at(solver->children, offsetof(flesh_solver_options, linear_solver));
    return flesh_node_fail(place, "%s.%s is %s, which is not built in; it must be %s or %s",
                           solver->name, key->name, key->choices[FLESH_LINEAR_CHOLMOD],
                           key->choices[FLESH_LINEAR_PCG], key->choices[FLESH_LINEAR_KLU]);
  }
#endif
  return FLESH_OK;
}

/* Checks the keys of the output. The skin's file must exist; its content is checked when the skin is bound. */
static int check_output(flesh_scene *scene)
{
  const flesh_node *place = flesh_scene_place(scene->root, flesh_scene_table, offsetof(flesh_scene_keys, output));
  const flesh_camera *camera = &scene->keys.output.given.camera;
  if (fabs(camera->elevation) > 90)
    return flesh_node_fail(place, "output.camera.elevation is %g degrees; it must be -90 to 90", camera->elevation);
  if (camera->field_of_view >= 120)
    return flesh_node_fail(place, "output.camera.field_of_view is %g degrees; it must be 0 to less than 120",
                           camera->field_of_view);
  if (fabs(camera->up[0]) + fabs(camera->up[1]) + fabs(camera->up[2]) == 0)
    return flesh_node_fail(place, "output.camera.up is zero; it must be a direction, such as [0, 1, 0]");
  if (!scene->keys.output.given.skin.surface) return FLESH_OK;
  int status = flesh_scene_make_absolute(scene, &scene->keys.output.given.skin.surface);
  if (!status) status = flesh_regular_check(scene->keys.output.given.skin.surface);
  return status ? flesh_node_fail_within(status, place, "output.skin.surface: ") : FLESH_OK;
}

/* Reads the values of all keys, before anything is made of them. */
static int read_keys(flesh_scene *scene, int count, const char *const *overrides)
{
  flesh_node *root = NULL;
  int status = read_tree(scene, count, overrides, &root);
  if (status) return status;
  scene->root = root;
  const char *slash = strrchr(scene->path, '/');
  flesh_key_reader reader = {.arena = &scene->arena};
  /* If the path's last slash is the root's, it stays: "/scene.yaml" lies in "/". */
  reader.directory =
      flesh_arena_text(&scene->arena, scene->path,
                       slash ? (size_t)(slash - scene->path) + (slash == scene->path) : 0);
  if (!reader.directory) return flesh_no_memory_for(scene->path);
  return flesh_keys_read(&reader, flesh_scene_table, root, root, "", &scene->keys);
}

int flesh_scene_warn(flesh_scene *scene, const char *words)
{
  if (words && scene->warning) words = flesh_arena_print(&scene->arena, "%s; %s", scene->warning, words);
  if (words) scene->warning = words;
  return words ? FLESH_OK : flesh_no_memory();
}

static int read_scene(flesh_scene *scene, int count, const char *const *overrides)
{
  int status = read_keys(scene, count, overrides);
  if (!status) status = check_solver(scene);
  if (!status) status = read_mesh(scene);
  if (!status) status = flesh_scene_check_split(scene);
  if (!status) status = flesh_scene_join_bodies(scene);
  if (!status) status = flesh_scene_make_body(scene);
  if (!status) status = flesh_scene_make_system(scene);
  if (!status) status = flesh_stop_ask_before((size_t)flesh_mesh_tet_count(scene->mesh));
  if (!status) status = flesh_scene_settle_time(scene);
  if (!status) status = read_start(scene);
  if (!status) status = flesh_scene_warn_of_unused(scene);
  if (!status) status = check_output(scene);
  if (!status) status = flesh_scene_make_probes(scene);
  if (!status) status = flesh_scene_check_fields(scene);
  return status;
}

int flesh_scene_check_keys(const char *path, int count, const char *const *overrides)
{
  flesh_scene scene = {.path = path};
  int status = read_keys(&scene, count, overrides);
  flesh_arena_free(&scene.arena);
  return status;
}

/* Makes a scene from `text`, or from the file at `path` if that is NULL. */
static int make_scene(const char *text, const char *path, int count, const char *const *overrides, int rank, int ranks,
                      flesh_scene **scene)
{
  for (int k = 0; k < count; k++)
    if (!overrides || !overrides[k])
      return flesh_fail(FLESH_ERR_ARGUMENT, "%s: the count is %d overrides, but %s is NULL", path, count,
                        overrides ? "one of them" : "overrides");
  flesh_scene *made = calloc(1, sizeof *made);
  if (!made) return flesh_no_memory_for(path);
  made->path = flesh_arena_text(&made->arena, path, strlen(path));
  made->text = text;
  made->rank = rank;
  made->ranks = ranks;
  flesh_stop_begin();
  int status = made->path ? read_scene(made, count, overrides) : flesh_no_memory_for(path);
  const int stopped = flesh_stop_end();
  if (status && stopped)
    status = flesh_fail(stopped, "%s: %s while the scene was set up", path, flesh_status_text(stopped));
  made->text = NULL; /* borrowed during the call only */
  if (status) flesh_scene_destroy(&made);
  else *scene = made;
  return status;
}

void flesh_scene_set_stop(int (*stop)(void *data), void *data) { flesh_stop_set(stop, data); }

int flesh_scene_read(const char *path, int count, const char *const *overrides, flesh_scene **scene)
{
  FLESH_NEED({scene, "scene"});
  *scene = NULL;
  FLESH_NEED({path, "path"});
  return make_scene(NULL, path, count, overrides, 0, 0, scene);
}

int flesh_scene_read_on_rank(const char *path, int count, const char *const *overrides, int rank, int ranks,
                             flesh_scene **scene)
{
  *scene = NULL;
  return make_scene(NULL, path, count, overrides, rank, ranks, scene);
}

int flesh_scene_read_text(const char *text, const char *path, int count, const char *const *overrides,
                          flesh_scene **scene)
{
  FLESH_NEED({scene, "scene"});
  *scene = NULL;
  FLESH_NEED({text, "text"}, {path, "path"});
  if (strlen(text) > MAX_FILE)
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s: the text has %zu bytes; a scene has at most %d", path, strlen(text),
                      MAX_FILE);
  return make_scene(text, path, count, overrides, 0, 0, scene);
}

void flesh_scene_destroy(flesh_scene **scene)
{
  if (!scene || !*scene) return;
  flesh_system_destroy(&(*scene)->system);
  flesh_mesh_destroy(&(*scene)->mesh);
  flesh_arena_free(&(*scene)->arena);
  free(*scene);
  *scene = NULL;
}

const flesh_mesh *flesh_scene_mesh(const flesh_scene *scene) { return scene->mesh; }
const char *flesh_scene_mesh_path(const flesh_scene *scene) { return scene->keys.body.mesh; }
void flesh_scene_visit_files(const flesh_scene *scene,
                             void (*visit)(void *data, const char *path), void *data)
{
  flesh_keys_visit_paths(flesh_scene_table, &scene->keys, visit, data);
}
const flesh_body *flesh_scene_body(const flesh_scene *scene) { return &scene->body; }
const flesh_system *flesh_scene_system(const flesh_scene *scene) { return scene->system; }
const flesh_solver_options *flesh_scene_solver(const flesh_scene *scene)
{
  return &scene->keys.solver;
}
int flesh_scene_material_count(const flesh_scene *scene) { return scene->material_count; }
const flesh_scene_time *flesh_scene_times(const flesh_scene *scene) { return &scene->time; }
const char *flesh_scene_warning(const flesh_scene *scene) { return scene->warning; }

const flesh_scene_output *flesh_scene_outputs(const flesh_scene *scene)
{
  return &scene->keys.output.given;
}

void flesh_scene_start(const flesh_scene *scene, flesh_state *state)
{
  size_t size = 3 * (size_t)flesh_mesh_node_count(scene->mesh) * sizeof(double);
  state->t = scene->start.t;
  memcpy(state->x, scene->start.x, size);
  memcpy(state->v, scene->start.v, size);
  for (int k = 0; k < state->multiplier_count && k < scene->start.multiplier_count; k++)
    state->multipliers[k] = scene->start.multipliers[k];
  for (int k = 0; k < state->internal_count && k < scene->start.internal_count; k++)
    state->internal[k] = scene->start.internal[k];
}

void flesh_scene_print(const flesh_scene *scene, flesh_text *text)
{
  flesh_text_print(text, "# Every key in force; running this file repeats the run.\n");
  flesh_keys_write(flesh_scene_table, &scene->keys, 0, text);
}

int flesh_scene_write(const flesh_scene *scene, const char *path)
{
  FLESH_NEED({scene, "scene"}, {path, "path"});
  flesh_text text = {0};
  flesh_scene_print(scene, &text);
  if (text.failed) {
    free(text.data);
    return flesh_no_memory_for(path);
  }
  flesh_file file;
  int status = flesh_file_open(path, &file);
  if (!status) {
    fwrite(text.data, 1, text.size, file.stream);
    status = flesh_file_commit(&file);
  }
  free(text.data);
  return status;
}

int flesh_scene_has_positive(const flesh_scene *scene, const char *name)
{
  const flesh_effect_entry *entries = scene->keys.effects.values;
  for (int k = 0; k < scene->keys.effects.count; k++) {
    const flesh_key *key = flesh_key_named(entries[k].row->keys, name);
    if (key && *(const double *)((const char *)entries[k].parameters + key->offset) > 0) return 1;
  }
  return 0;
}

const char *flesh_scene_tangents_refused(const flesh_scene *scene)
{
  if (flesh_scene_times(scene)->method != FLESH_METHOD_STATIC) return "it is a motion";
  if (flesh_scene_has_positive(scene, "friction")) return "friction makes its equilibria depend on the way to them";
  return flesh_system_internal_count(flesh_scene_system(scene)) ? "its effects remember the way to its equilibria" : "";
}
