/* run_folder.c: opens what a run left, and reads its frames. */
#include "run/run_folder.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/confine.h"
#include "base/error.h"
#include "base/text.h"
#include "output/vtu_read.h"

static int no_memory(void) { return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a run"); }

/* Reads the number from "frame_000012.vtu", or from the name of a frame in parts. */
static int number_of(const char *name, int *number)
{
  int end = 0;
  return sscanf(name, "frame_%9d%n", number, &end) == 1 && end && *number >= 0 &&
         (!strcmp(name + end, ".vtu") || !strcmp(name + end, ".pvtu"));
}

static int open_frames(flesh_run_folder *run, const char *path)
{
  flesh_pvd index = {0};
  char *folder = flesh_text_new("%s/frames", path), *file = folder ? flesh_text_new("%s/frames.pvd", folder) : NULL;
  int status = file ? flesh_path_check(file) : no_memory();
  if (!status && flesh_path_is_file(file)) status = flesh_pvd_read(file, &index);
  free(file);
  run->folder = folder;
  run->times = index.times;
  run->files = calloc((size_t)index.count + 1, sizeof *run->files);
  if (run->files) run->count = index.count;
  else if (!status) status = no_memory();
  run->numbers = calloc((size_t)index.count + 1, sizeof *run->numbers);
  if (!run->numbers && !status) status = no_memory();
  for (int k = 0; k < index.count && !status; k++) {
    if (!(run->files[k] = strdup(index.names[k]))) status = no_memory();
    /* A foreign name has no number: then its place in the index. */
    if (!number_of(index.names[k], &run->numbers[k])) run->numbers[k] = k ? run->numbers[k - 1] + 1 : 0;
  }
  index.times = NULL; /* taken */
  flesh_pvd_clear(&index);
  return status;
}

/* Loads a state of the folder; of no name: the scene's start. */
static int load_state(flesh_run_folder *run, const char *folder, const char *name)
{
  flesh_scene_start(run->scene, &run->state);
  if (!name) return FLESH_OK;
  char *path = flesh_text_new("%s/%s", folder, name);
  const int nodes = flesh_mesh_node_count(flesh_scene_mesh(run->scene));
  const int status = path ? flesh_state_read(path, nodes, &run->state) : no_memory();
  free(path);
  return status;
}

/* A single frame: the last state of a run without frames, or a scene's start. */
static int open_single(flesh_run_folder *run, const char *folder)
{
  run->count = 1;
  free(run->times);
  run->times = malloc(sizeof *run->times);
  free(run->numbers);
  run->numbers = calloc(1, sizeof *run->numbers);
  if (!run->times || !run->numbers) return no_memory();
  const int status = load_state(run, folder, folder ? "state.txt" : NULL);
  run->times[0] = run->state.t;
  return status;
}

/* Adds a state by its time; of one time the later named stays. */
static int add_state(flesh_run_folder *run, const char *name)
{
  const double t = run->state.t;
  char *own = name ? strdup(name) : NULL;
  int at = 0;
  if (name && !own) return no_memory();
  while (at < run->count && run->times[at] < t) at++;
  if (at < run->count && !(run->times[at] > t)) {
    free(run->files[at]);
  } else {
    for (int i = run->count++; i > at; i--) run->times[i] = run->times[i - 1], run->files[i] = run->files[i - 1];
  }
  run->times[at] = t;
  run->files[at] = own;
  return FLESH_OK;
}

int flesh_run_folder_take_states(flesh_run_folder *run, const char *path)
{
  static const char *const names[] = {NULL, "worst_state.txt", "event_state.txt", "state.txt"};
  enum { MOST = sizeof names / sizeof *names };
  if (run->files && run->files[0]) return FLESH_OK;
  free(run->folder), free(run->times), free(run->numbers), free(run->files);
  run->few = 1;
  run->count = 0;
  run->folder = strdup(path);
  run->times = calloc(MOST, sizeof *run->times);
  run->numbers = calloc(MOST, sizeof *run->numbers);
  run->files = calloc(MOST, sizeof *run->files);
  if (!run->folder || !run->times || !run->numbers || !run->files) return no_memory();
  for (int k = 0; k < MOST; k++) {
    char *file = names[k] ? flesh_text_new("%s/%s", path, names[k]) : NULL;
    if (names[k] && !file) return no_memory();
    const int there = !file || flesh_path_is_there(file);
    free(file);
    int status = there ? load_state(run, path, names[k]) : FLESH_OK;
    if (!status && there) status = add_state(run, names[k]);
    if (status) return status;
    run->numbers[k] = k;
  }
  return FLESH_OK;
}

int flesh_run_folder_open(const char *path, flesh_run_folder *run)
{
  struct stat info;
  *run = (flesh_run_folder){0};
  if (flesh_path_stat(path, &info))
    return flesh_fail(FLESH_ERR_FILE, "%s: there is no such folder of a run, nor a scene",
                      *path ? path : "''");
  int is_folder = S_ISDIR(info.st_mode);
  char *scene = is_folder ? flesh_text_new("%s/scene.yaml", path) : strdup(path);
  int status = scene ? FLESH_OK : no_memory();
  if (!status && is_folder) status = flesh_confine(path);
  if (!status && is_folder) status = flesh_path_check(scene);
  if (!status && is_folder && !flesh_path_is_file(scene))
    status = flesh_fail(FLESH_ERR_FILE, "%s: this is no folder of a run: it has no scene.yaml", path);
  if (!status) status = flesh_scene_read(scene, 0, NULL, &run->scene);
  if (!status) {
    size_t size = 3 * sizeof(double) * (size_t)flesh_mesh_node_count(flesh_scene_mesh(run->scene));
    run->state.x = malloc(size);
    run->state.v = malloc(size);
    if (!run->state.x || !run->state.v) status = no_memory();
  }
  if (!status && is_folder) status = open_frames(run, path);
  if (!status && !run->count) status = open_single(run, is_folder ? path : NULL);
  free(scene);
  return status;
}

void flesh_run_folder_close(flesh_run_folder *run)
{
  for (int k = 0; run->files && k < run->count; k++) free(run->files[k]);
  free(run->files);
  free(run->times);
  free(run->numbers);
  free(run->folder);
  free(run->state.x);
  free(run->state.v);
  flesh_scene_destroy(&run->scene);
  *run = (flesh_run_folder){0};
}

int flesh_run_folder_load(flesh_run_folder *run, int k)
{
  if (run->few) return load_state(run, run->folder, run->files[k]);
  run->state.t = run->times[k];
  if (!run->files || !run->files[0]) return FLESH_OK; /* the only frame is loaded */
  char *path = flesh_text_new("%s/%s", run->folder, run->files[k]);
  if (!path) return no_memory();
  static const char *const names[] = {"Points", "velocity"};
  double *const targets[] = {run->state.x, run->state.v};
  int status = flesh_vtu_read(path, flesh_mesh_node_count(flesh_scene_mesh(run->scene)), 2, names,
                              targets);
  free(path);
  return status;
}

int flesh_run_folder_at(const flesh_run_folder *run, double time)
{
  int best = 0;
  for (int k = 1; k < run->count; k++)
    if (fabs(run->times[k] - time) < fabs(run->times[best] - time)) best = k;
  return best;
}

int flesh_run_folder_find(const flesh_run_folder *run, int number)
{
  for (int k = 0; k < run->count; k++)
    if (run->numbers[k] == number) return k;
  return -1;
}

void flesh_run_folder_numbers(const flesh_run_folder *run, char text[64])
{
  const int *n = run->numbers, last = n[run->count - 1];
  if (run->count == 1) snprintf(text, 64, "only %d", n[0]);
  else if (run->count == 2) snprintf(text, 64, "%d and %d", n[0], n[1]);
  else if (run->count == 3) snprintf(text, 64, "%d, %d and %d", n[0], n[1], n[2]);
  else snprintf(text, 64, "%d, %d, %d to %d", n[0], n[1], n[2], last);
}

double *flesh_run_positions(const char *path, int nodes)
{
  const size_t size = sizeof(double) * 3 * (size_t)nodes;
  flesh_state state = {.x = malloc(size), .v = malloc(size)};
  if (!state.x || !state.v || flesh_state_read(path, nodes, &state)) {
    free(state.x);
    state.x = NULL;
  }
  free(state.v);
  return state.x;
}
