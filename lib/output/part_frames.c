/* part_frames.c: frames in parts, one of each rank. */
#include "output/part_frames.h"

#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/sync.h"
#include "output/fields.h"
#include "output/obstacles.h"
#include "parallel/body_figures.h"
#include "output/vtu_read.h"

struct flesh_part_frames {
  const flesh_mesh *mesh;
  const flesh_team *team;
  int rank, ranks, every;
  int last;               /* step of the last frame; -1: none */
  char *directory, *path; /* path: room for directory/name */
  double *displacement;   /* [3*nodes] */
  flesh_pvd index;        /* on the first rank */
  flesh_fields fields;
  double box[6]; /* around the whole body at rest */
};

static const char *path_of(flesh_part_frames *frames, const char *name)
{
  sprintf(frames->path, "%s/%s", frames->directory, name);
  return frames->path;
}

/* This rank's file of a step. */
static const char *part_of(flesh_part_frames *frames, int step)
{
  char file[2 * FLESH_PVD_NAME_SIZE];
  snprintf(file, sizeof file, "frame_%06d_%05d.vtu", step, frames->rank);
  return path_of(frames, file);
}

int flesh_part_frames_create(const char *directory, const flesh_mesh *mesh, const flesh_team *team, int rank, int ranks,
                             int every, flesh_part_frames **result)
{
  flesh_part_frames *frames = *result = calloc(1, sizeof *frames);
  if (frames) {
    *frames = (flesh_part_frames){.mesh = mesh, .team = team, .rank = rank, .ranks = ranks, .every = every, .last = -1,
                                  .directory = strdup(directory),
                                  .path = malloc(strlen(directory) + FLESH_PVD_NAME_SIZE + 1),
                                  .displacement = malloc((3 * (size_t)team->nodes + 1) * sizeof(double))};
    if (frames->directory && frames->path && frames->displacement) return FLESH_OK;
  }
  flesh_part_frames_close(result);
  return flesh_no_memory_for(directory);
}

int flesh_part_frames_resume(flesh_part_frames **frames, int last)
{
  flesh_part_frames *self = *frames;
  int status = FLESH_OK;
  self->last = last;
  if (!self->rank) status = flesh_pvd_resume(path_of(self, "frames.pvd"), self->every, last, &self->index);
  if (status) flesh_part_frames_close(frames);
  return status;
}

void flesh_part_frames_close(flesh_part_frames **frames)
{
  if (!frames || !*frames) return;
  free((*frames)->directory);
  free((*frames)->path);
  free((*frames)->displacement);
  flesh_pvd_clear(&(*frames)->index);
  flesh_fields_clear(&(*frames)->fields);
  free(*frames);
  *frames = NULL;
}

int flesh_part_frames_set_fields(flesh_part_frames *frames, const flesh_body *body, const flesh_system *system,
                                 flesh_method method, unsigned fields, unsigned places)
{
  flesh_body_rest_box(frames->mesh, frames->team, frames->box);
  return flesh_fields_open(body, system, method, fields, places, &frames->fields);
}

/* The part's file, and once all have theirs, that of all. */
static int write_frame(flesh_part_frames *frames, const flesh_step_record *record)
{
  char stem[FLESH_PVD_NAME_SIZE], *name = NULL;
  flesh_frame frame;
  flesh_frame_make(frames->mesh, &frames->fields, frames->team, frames->displacement, record, &frame);
  snprintf(stem, sizeof stem, "frame_%06d", record->step);
  int status = flesh_team_agree(frames->team, flesh_vtu_write(part_of(frames, record->step), &frame.content));
  frames->last = record->step;
  if (status || frames->rank) return status;
  status = flesh_pvd_next(&frames->index, &name);
  if (!status) status = flesh_obstacles_write(frames->directory, record, frames->box);
  if (status) return status;
  snprintf(name, FLESH_PVD_NAME_SIZE, "frame_%06d.pvtu", record->step);
  status = flesh_pvtu_write(path_of(frames, name), &frame.content, stem, frames->ranks);
  return status ? status : flesh_pvd_add(&frames->index, path_of(frames, "frames.pvd"), record->state->t);
}

int flesh_part_frames_observe(void *data, const flesh_step_record *record)
{
  flesh_part_frames *frames = data;
  if (record->step % frames->every && !record->last) return FLESH_OK;
  return write_frame(frames, record);
}

int flesh_part_frames_sync(flesh_part_frames *frames, int settled)
{
  const int every = frames->every, first = settled < 0 ? 0 : (settled / every + 1) * every;
  int status = FLESH_OK;
  for (int step = first; step <= frames->last && !status; step += every) status = flesh_sync(part_of(frames, step));
  /* The last one of a run is of any step. */
  return status || frames->last < 0 ? status : flesh_sync(part_of(frames, frames->last));
}
