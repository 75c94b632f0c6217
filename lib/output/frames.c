/* frames.c: VTU files of the moving body, whole or in one part per rank, and their index. */
#include "output/part_frames.h"

#include <dirent.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/error.h"
#include "base/file.h"
#include "base/sync.h"
#include "mesh/mesh.h"
#include "output/fields.h"
#include "output/obstacles.h"
#include "parallel/body_figures.h"
#include "output/resume.h"
#include "output/vtu_read.h"

enum { NAME_SIZE = FLESH_PVD_NAME_SIZE };

struct flesh_frames {
  const flesh_mesh *mesh;
  const flesh_team *team; /* team of the body if the mesh is this rank's part; NULL: the mesh is the whole */
  int rank, ranks, every;
  int last;               /* step of the last frame; -1: none */
  char *directory, *path; /* path: room for directory/name */
  double *displacement;   /* [3*nodes] */
  double box[6];          /* around the whole body at rest */
  flesh_pvd index;        /* on the first rank */
  flesh_fields fields;
};

static const char *path_of(flesh_frames *frames, const char *name)
{
  sprintf(frames->path, "%s/%s", frames->directory, name);
  return frames->path;
}

/* Returns the path of this rank's file of a step. */
static const char *own_file(flesh_frames *frames, int step)
{
  char name[2 * NAME_SIZE];
  if (frames->team) snprintf(name, sizeof name, "frame_%06d_%05d.vtu", step, frames->rank);
  else snprintf(name, sizeof name, "frame_%06d.vtu", step);
  return path_of(frames, name);
}

/* Returns whether the name is frame_<digits and _>.vtu or .pvtu, or obstacle_<digits and _>.obj. */
static int is_frame(const char *name)
{
  const char *digits = strncmp(name, "frame_", 6) ? name + 9 : name + 6;
  const char *suffix = digits == name + 6 ? ".vtu" : ".obj";
  if (digits != name + 6 && strncmp(name, "obstacle_", 9)) return 0;
  size_t count = strspn(digits, "0123456789_");
  return count > 0 && (!strcmp(digits + count, suffix) || (digits == name + 6 && !strcmp(digits + count, ".pvtu")));
}

/* Returns the step of a frame, or of a moving obstacle's file; -1 for a still obstacle. */
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

int flesh_part_frames_create(const char *directory, const flesh_mesh *mesh, const flesh_team *team, int rank, int ranks,
                             int every, flesh_frames **result)
{
  flesh_frames *frames = *result = calloc(1, sizeof *frames);
  if (frames) {
    *frames = (flesh_frames){.mesh = mesh, .team = team, .rank = rank, .ranks = ranks, .every = every, .last = -1,
                             .directory = strdup(directory), .path = malloc(strlen(directory) + NAME_SIZE + 1),
                             .displacement = malloc((3 * (size_t)flesh_mesh_node_count(mesh) + 1) * sizeof(double))};
    if (frames->directory && frames->path && frames->displacement) return FLESH_OK;
  }
  flesh_frames_close(result);
  return flesh_no_memory_for(directory);
}

static int create(const char *directory, const flesh_mesh *mesh, int every, flesh_frames **frames)
{
  const int status = flesh_part_frames_create(directory, mesh, NULL, 0, 1, every, frames);
  if (!status) flesh_body_rest_box(mesh, NULL, (*frames)->box);
  return status;
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
  /* The index is emptied first, so that it never lists a file that is gone. */
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

int flesh_part_frames_resume(flesh_frames **frames, int last)
{
  flesh_frames *self = *frames;
  int status = FLESH_OK;
  self->last = last;
  if (!self->rank) status = flesh_pvd_resume(path_of(self, "frames.pvd"), self->every, last, &self->index);
  if (status) flesh_frames_close(frames);
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
  if (frames->team) flesh_body_rest_box(frames->mesh, frames->team, frames->box);
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
  char stem[NAME_SIZE], *name = NULL;
  int status = flesh_mesh_check_counts(flesh_system_mesh(record->system), "frames", "", frames->mesh->nodes,
                                       frames->mesh->tets);
  if (status) return status;
  flesh_frame frame;
  flesh_frame_make(frames->mesh, &frames->fields, frames->team, frames->displacement, record, &frame);
  status = flesh_team_agree(frames->team, flesh_vtu_write(own_file(frames, record->step), &frame.content));
  frames->last = record->step;
  if (status || frames->rank) return status;
  status = flesh_pvd_next(&frames->index, &name);
  if (!status) status = flesh_obstacles_write(frames->directory, record, frames->box);
  if (status) return status;
  snprintf(stem, sizeof stem, "frame_%06d", record->step);
  snprintf(name, NAME_SIZE, "frame_%06d.%s", record->step, frames->team ? "pvtu" : "vtu");
  if (frames->team) status = flesh_pvtu_write(path_of(frames, name), &frame.content, stem, frames->ranks);
  return status ? status : flesh_pvd_add(&frames->index, path_of(frames, "frames.pvd"), record->state->t);
}

int flesh_part_frames_sync(flesh_frames *frames, int settled)
{
  const int every = frames->every, first = settled < 0 ? 0 : (settled / every + 1) * every;
  int status = FLESH_OK;
  for (int step = first; step <= frames->last && !status; step += every) status = flesh_sync(own_file(frames, step));
  /* The last frame of a run can be of any step, so it is synced in any case. */
  return status || frames->last < 0 ? status : flesh_sync(own_file(frames, frames->last));
}
