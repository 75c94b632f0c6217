/* run_folder.c: opens the results of a run, and reads its frames. */
#include "run/run_folder.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/confine.h"
#include "base/error.h"
#include "cli/path.h"
#include "output/vtu_read.h"
#include "run/start.h"

/* Reads the number from "frame_000012.vtu", or from the name of a frame in parts. */
static int number_of(const char *name, int *number)
{
  int end = 0;
  return sscanf(name, "frame_%9d%n", number, &end) == 1 && end && *number >= 0 &&
         (!strcmp(name + end, ".vtu") || !strcmp(name + end, ".pvtu"));
}

/* Allocates frames, and drops those that there are. */
static int make_room(flesh_run_folder *run, int count)
{
  run->count = 0;
  run->frames = flesh_arena_take(&run->memory, (size_t)count * sizeof *run->frames);
  return run->frames ? FLESH_OK : flesh_no_memory();
}

static int open_frames(flesh_run_folder *run, const char *path)
{
  flesh_pvd index = {0};
  const char *file = flesh_path("%s/frames/frames.pvd", path);
  run->folder = flesh_arena_print(&run->memory, "%s/frames", path);
  int status = run->folder ? flesh_path_check(file) : flesh_no_memory();
  if (!status && flesh_path_is_file(file)) status = flesh_pvd_read(file, &index);
  if (!status) status = make_room(run, index.count);
  for (int k = 0; k < index.count && !status; k++) {
    flesh_run_frame *frame = &run->frames[run->count++];
    frame->time = index.times[k];
    if (!(frame->file = flesh_arena_print(&run->memory, "%s", index.names[k]))) status = flesh_no_memory();
    /* A frame whose name has no number gets the one after the previous frame's. */
    if (!number_of(index.names[k], &frame->number)) frame->number = k ? frame[-1].number + 1 : 0;
  }
  flesh_pvd_clear(&index);
  return status;
}

/* Loads a state of the folder; with `name` NULL the scene's start. */
static int load_state(flesh_run_folder *run, const char *folder, const char *name)
{
  flesh_scene_start(run->scene, &run->state);
  if (!name) return FLESH_OK;
  return flesh_state_read(flesh_path("%s/%s", folder, name), flesh_mesh_node_count(flesh_scene_mesh(run->scene)), &run->state);
}

/* Makes a single frame: the last state of a run without frames, or a scene's start. */
static int open_single(flesh_run_folder *run, const char *folder)
{
  int status = make_room(run, 1);
  if (!status) status = load_state(run, folder, folder ? "state.txt" : NULL);
  if (status) return status;
  run->count = 1;
  run->frames[0].time = run->state.t;
  return FLESH_OK;
}

/* Inserts a state by its time; of states with the same time the last one stays. */
static void add_state(flesh_run_folder *run, const char *name)
{
  const flesh_run_frame frame = {.time = run->state.t, .file = name};
  int at = 0;
  while (at < run->count && run->frames[at].time < frame.time) at++;
  if (at == run->count || run->frames[at].time > frame.time)
    for (int i = run->count++; i > at; i--) run->frames[i] = run->frames[i - 1];
  run->frames[at] = frame;
}

int flesh_run_folder_take_states(flesh_run_folder *run, const char *path)
{
  static const char *const names[] = {NULL, "worst_state.txt", "event_state.txt", "state.txt"};
  enum { MOST = sizeof names / sizeof *names };
  if (run->frames[0].file) return FLESH_OK;
  run->has_states = 1;
  run->folder = flesh_arena_print(&run->memory, "%s", path);
  int status = run->folder ? make_room(run, MOST) : flesh_no_memory();
  for (int k = 0; k < MOST && !status; k++) {
    if (names[k] && !flesh_path_is_there(flesh_path("%s/%s", path, names[k]))) continue;
    status = load_state(run, path, names[k]);
    if (!status) add_state(run, names[k]);
  }
  for (int k = 0; k < run->count; k++) run->frames[k].number = k;
  return status;
}

int flesh_run_folder_open(const char *path, flesh_run_folder *run)
{
  struct stat info;
  *run = (flesh_run_folder){0};
  if (flesh_path_stat(path, &info))
    return flesh_fail(FLESH_ERR_FILE, "%s: there is no such folder of a run, nor a scene",
                      *path ? path : "''");
  int is_folder = S_ISDIR(info.st_mode);
  const char *scene = is_folder ? flesh_path("%s/scene.yaml", path) : path;
  int status = is_folder ? flesh_confine(path) : FLESH_OK;
  if (!status && is_folder) status = flesh_path_check(scene);
  if (!status && is_folder && !flesh_path_is_file(scene))
    status = flesh_fail(FLESH_ERR_FILE, "%s: this is no folder of a run: it has no scene.yaml", path);
  if (!status) status = flesh_scene_read(scene, 0, NULL, &run->scene);
  if (!status) status = flesh_state_make(flesh_mesh_node_count(flesh_scene_mesh(run->scene)), 0, 0, &run->state);
  if (!status && is_folder) status = open_frames(run, path);
  return status || run->count ? status : open_single(run, is_folder ? path : NULL);
}

void flesh_run_folder_close(flesh_run_folder *run)
{
  flesh_arena_free(&run->memory);
  free(run->state.x);
  flesh_scene_destroy(&run->scene);
  *run = (flesh_run_folder){0};
}

int flesh_run_folder_load(flesh_run_folder *run, int k)
{
  const flesh_run_frame *frame = &run->frames[k];
  if (run->has_states) return load_state(run, run->folder, frame->file);
  run->state.t = frame->time;
  if (!frame->file) return FLESH_OK; /* the only frame is already loaded */
  static const char *const names[] = {"Points", "velocity"};
  double *const targets[] = {run->state.x, run->state.v};
  return flesh_vtu_read(flesh_path("%s/%s", run->folder, frame->file), flesh_mesh_node_count(flesh_scene_mesh(run->scene)), 2,
                        names, targets);
}

int flesh_run_folder_at(const flesh_run_folder *run, double time)
{
  int best = 0;
  for (int k = 1; k < run->count; k++)
    if (fabs(run->frames[k].time - time) < fabs(run->frames[best].time - time)) best = k;
  return best;
}

size_t flesh_run_folder_name(const char *path, const char **name)
{
  size_t end = strlen(path), begin;
  while (end > 1 && path[end - 1] == '/') end--;
  for (begin = end; begin > 0 && path[begin - 1] != '/';) begin--;
  *name = path + begin;
  return end - begin;
}
