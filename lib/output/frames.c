/* frames.c: VTU files of the body as it moves, and their index. */
#include "flesh/observer.h"

#include <dirent.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/error.h"
#include "base/file.h"
#include "mesh/mesh.h"
#include "output/fields.h"
#include "output/obstacles.h"
#include "parallel/body_figures.h"
#include "output/resume.h"
#include "output/vtu_read.h"

enum { NAME_SIZE = FLESH_PVD_NAME_SIZE };

struct flesh_frames {
  const flesh_mesh *mesh;
  char *directory, *path; /* path: room for directory/name */
  double *displacement;   /* [3*nodes] */
  int every;
  flesh_pvd index;
  flesh_fields fields;
};

static const char *path_of(flesh_frames *frames, const char *name)
{
  sprintf(frames->path, "%s/%s", frames->directory, name);
  return frames->path;
}

/* frame_<digits and _>.vtu or .pvtu, or obstacle_<digits and _>.obj */
static int is_frame(const char *name)
{
  const char *digits = strncmp(name, "frame_", 6) ? name + 9 : name + 6;
  const char *suffix = digits == name + 6 ? ".vtu" : ".obj";
  if (digits != name + 6 && strncmp(name, "obstacle_", 9)) return 0;
  size_t count = strspn(digits, "0123456789_");
  return count > 0 && (!strcmp(digits + count, suffix) || (digits == name + 6 && !strcmp(digits + count, ".pvtu")));
}

/* The step of a frame, or of a moving obstacle's file beside it; -1 of a still one's. */
static int step_of(const char *name)
{
  int number, step, end = 0;
  if (sscanf(name, "frame_%9d%n", &step, &end) == 1 && end) return step;
  return sscanf(name, "obstacle_%9d_%9d", &number, &step) == 2 ? step : -1;
}

/* Removes the frames after step `last`; -1: all. */
static void remove_frames(flesh_frames *frames, int last)
{
  DIR *folder = flesh_path_list(frames->directory);
  if (!folder) return;
  for (struct dirent *entry; (entry = readdir(folder));)
    if (is_frame(entry->d_name) && strlen(entry->d_name) < NAME_SIZE && (last < 0 || step_of(entry->d_name) > last))
      flesh_path_unlink(path_of(frames, entry->d_name));
  closedir(folder);
}

static int create(const char *directory, const flesh_mesh *mesh, int every, flesh_frames **result)
{
  flesh_frames *frames = calloc(1, sizeof *frames);
  if (!frames) return flesh_no_memory_for(directory);
  frames->mesh = mesh;
  frames->every = every;
  frames->directory = strdup(directory);
  frames->path = malloc(strlen(directory) + NAME_SIZE + 1);
  frames->displacement = malloc(3 * sizeof(double) * (size_t)flesh_mesh_node_count(mesh));
  if (!frames->directory || !frames->path || !frames->displacement) {
    flesh_frames_close(&frames);
    return flesh_no_memory_for(directory);
  }
  *result = frames;
  return FLESH_OK;
}

int flesh_frames_create(const char *directory, const flesh_mesh *mesh, int every,
                        flesh_frames **result)
{
  FLESH_NEED({result, "frames"});
  *result = NULL;
  FLESH_NEED({directory, "directory"}, {mesh, "mesh"});
  if (every < 1)
    return flesh_fail(FLESH_ERR_ARGUMENT, "frames: every is %d; it must be at least 1", every);
  flesh_frames *frames = NULL;
  int status = flesh_folder_make(directory);
  if (!status) status = create(directory, mesh, every, &frames);
  if (status) return status;
  /* The index first, so that it never lists a file that is gone. */
  status = flesh_pvd_write(path_of(frames, "frames.pvd"), 0, NULL, NULL);
  if (status) flesh_frames_close(&frames);
  else remove_frames(frames, -1);
  flesh_folder_clear(directory);
  *result = frames;
  return status;
}

int flesh_frames_resume(const char *directory, const flesh_mesh *mesh, int every, int last, flesh_frames **frames)
{
  *frames = NULL;
  int status = create(directory, mesh, every, frames);
  if (status) return status;
  flesh_folder_clear(directory);
  status = flesh_pvd_resume(path_of(*frames, "frames.pvd"), every, last, &(*frames)->index);
  if (status) flesh_frames_close(frames);
  else remove_frames(*frames, last);
  return status;
}

int flesh_frames_close(flesh_frames **frames)
{
  if (!frames || !*frames) return FLESH_OK;
  free((*frames)->directory);
  free((*frames)->path);
  free((*frames)->displacement);
  flesh_pvd_clear(&(*frames)->index);
  flesh_fields_clear(&(*frames)->fields);
  free(*frames);
  *frames = NULL;
  return FLESH_OK;
}

int flesh_frames_set_fields(flesh_frames *frames, const flesh_body *body, const flesh_system *system,
                            flesh_method method, unsigned fields, unsigned places)
{
  FLESH_NEED({frames, "frames"}, {body, "body"}, {system, "system"});
  flesh_fields opened;
  int status = flesh_mesh_check_counts(body->mesh, "frames", "", frames->mesh->nodes, frames->mesh->tets);
  if (!status) status = flesh_fields_open(body, system, method, fields, places, &opened);
  if (status) return status;
  flesh_fields_clear(&frames->fields);
  frames->fields = opened;
  return FLESH_OK;
}

int flesh_frames_observe(void *data, const flesh_step_record *record)
{
  FLESH_NEED({data, "frames"}, {record, "record"});
  flesh_frames *frames = data;
  if (record->step % frames->every && !record->last) return FLESH_OK;
  char *name;
  double box[6];
  int status = flesh_mesh_check_counts(flesh_system_mesh(record->system), "frames", "", frames->mesh->nodes,
                                       frames->mesh->tets);
  if (!status) status = flesh_pvd_next(&frames->index, &name);
  flesh_body_rest_box(frames->mesh, NULL, box);
  if (!status) status = flesh_obstacles_write(frames->directory, record, box);
  if (status) return status;
  flesh_frame frame;
  flesh_frame_make(frames->mesh, &frames->fields, NULL, frames->displacement, record, &frame);
  snprintf(name, NAME_SIZE, "frame_%06d.vtu", record->step);
  status = flesh_vtu_write(path_of(frames, name), &frame.content);
  return status ? status : flesh_pvd_add(&frames->index, path_of(frames, "frames.pvd"), record->state->t);
}
