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
  return flesh_fail(FLESH_ERR_MEMORY, "%s: out of memory", directory);
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

/* Lists the arrays of flesh_frames, with the numbers of nodes and tets in the whole. */
static void list_arrays(flesh_part_frames *frames, const flesh_step_record *record, flesh_field_list *nodes,
                        flesh_field_list *tets)
{
  const flesh_field_list *more_nodes = &frames->fields.nodes, *more_tets = &frames->fields.tets;
  const flesh_vtu_array of_nodes[] = {
      {.name = "displacement", .components = 3, .doubles = frames->displacement, .unit = "m"},
      {.name = "velocity", .components = 3, .doubles = record->state->v, .unit = "m/s"},
      {.name = "node", .components = 1, .integers = frames->team->numbers}};
  const flesh_vtu_array of_tets[] = {{.name = "J_mean", .components = 1, .doubles = record->tet_J_mean, .unit = "1"},
                                     {.name = "J_min", .components = 1, .doubles = record->tet_J_min, .unit = "1"},
                                     {.name = "region", .components = 1, .integers = flesh_mesh_regions(frames->mesh)},
                                     {.name = "tet", .components = 1, .integers = frames->team->tets}};
  nodes->count = tets->count = 0;
  for (int k = 0; k < 3; k++) nodes->arrays[nodes->count++] = of_nodes[k];
  for (int k = 0; k < 4; k++) tets->arrays[tets->count++] = of_tets[k];
  for (int k = 0; k < more_nodes->count; k++) nodes->arrays[nodes->count++] = more_nodes->arrays[k];
  for (int k = 0; k < more_tets->count; k++) tets->arrays[tets->count++] = more_tets->arrays[k];
}

/* The part's file, and once all have theirs, that of all. */
static int write_frame(flesh_part_frames *frames, const flesh_step_record *record)
{
  const flesh_mesh *mesh = frames->mesh;
  const double *rest = flesh_mesh_positions(mesh);
  char stem[FLESH_PVD_NAME_SIZE], *name = NULL;
  flesh_field_list nodes, tets;
  for (size_t d = 0; d < 3 * (size_t)frames->team->nodes; d++) frames->displacement[d] = record->state->x[d] - rest[d];
  if (frames->fields.body) flesh_fields_find(&frames->fields, record);
  list_arrays(frames, record, &nodes, &tets);
  const flesh_vtu content = {.points = frames->team->nodes, .tets = flesh_mesh_tet_count(mesh),
                             .positions = record->state->x, .tet_nodes = flesh_mesh_tets(mesh),
                             .edge_nodes = flesh_mesh_tet_edges(mesh),
                             .point_array_count = nodes.count, .cell_array_count = tets.count,
                             .point_arrays = nodes.arrays, .cell_arrays = tets.arrays};
  snprintf(stem, sizeof stem, "frame_%06d", record->step);
  int status = flesh_team_agree(frames->team, flesh_vtu_write(part_of(frames, record->step), &content));
  frames->last = record->step;
  if (status || frames->rank) return status;
  status = flesh_pvd_next(&frames->index, &name);
  if (!status) status = flesh_obstacles_write(frames->directory, record, frames->box);
  if (status) return status;
  snprintf(name, FLESH_PVD_NAME_SIZE, "frame_%06d.pvtu", record->step);
  status = flesh_pvtu_write(path_of(frames, name), &content, stem, frames->ranks);
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
