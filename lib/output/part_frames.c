/* part_frames.c: frames in parts, one of each rank. */
#include "output/part_frames.h"

#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "output/vtu.h"

struct flesh_part_frames {
  const flesh_mesh *mesh;
  const flesh_team *team;
  int rank, ranks, every;
  char *directory, *path; /* path: room for directory/name */
  double *displacement;   /* [3*nodes] */
  flesh_pvd index;        /* on the first rank */
};

static const char *path_of(flesh_part_frames *frames, const char *name)
{
  sprintf(frames->path, "%s/%s", frames->directory, name);
  return frames->path;
}

int flesh_part_frames_create(const char *directory, const flesh_mesh *mesh, const flesh_team *team, int rank, int ranks,
                             int every, flesh_part_frames **result)
{
  flesh_part_frames *frames = *result = calloc(1, sizeof *frames);
  if (frames) {
    *frames = (flesh_part_frames){.mesh = mesh, .team = team, .rank = rank, .ranks = ranks, .every = every,
                                  .directory = strdup(directory),
                                  .path = malloc(strlen(directory) + FLESH_PVD_NAME_SIZE + 1),
                                  .displacement = malloc((3 * (size_t)team->nodes + 1) * sizeof(double))};
    if (frames->directory && frames->path && frames->displacement) return FLESH_OK;
  }
  flesh_part_frames_close(result);
  return flesh_fail(FLESH_ERR_MEMORY, "%s: out of memory", directory);
}

void flesh_part_frames_close(flesh_part_frames **frames)
{
  if (!frames || !*frames) return;
  free((*frames)->directory);
  free((*frames)->path);
  free((*frames)->displacement);
  flesh_pvd_clear(&(*frames)->index);
  free(*frames);
  *frames = NULL;
}

/* The part's file, and once all have theirs, that of all. */
static int write_frame(flesh_part_frames *frames, const flesh_step_record *record)
{
  const flesh_mesh *mesh = frames->mesh;
  const double *rest = flesh_mesh_positions(mesh);
  char stem[FLESH_PVD_NAME_SIZE], file[2 * FLESH_PVD_NAME_SIZE], *name = NULL;
  for (size_t d = 0; d < 3 * (size_t)frames->team->nodes; d++) frames->displacement[d] = record->state->x[d] - rest[d];
  const flesh_vtu_array nodes[] = {
      {.name = "displacement", .components = 3, .doubles = frames->displacement, .unit = "m"},
      {.name = "velocity", .components = 3, .doubles = record->state->v, .unit = "m/s"},
      {.name = "node", .components = 1, .integers = frames->team->numbers}};
  const flesh_vtu_array tets[] = {{.name = "J", .components = 1, .doubles = record->J, .unit = "1"},
                                  {.name = "region", .components = 1, .integers = flesh_mesh_regions(mesh)},
                                  {.name = "tet", .components = 1, .integers = frames->team->tets}};
  const flesh_vtu content = {.points = frames->team->nodes, .tets = flesh_mesh_tet_count(mesh),
                             .positions = record->state->x, .tet_nodes = flesh_mesh_tets(mesh),
                             .edge_nodes = flesh_mesh_tet_edges(mesh),
                             .point_array_count = 3, .cell_array_count = 3, .point_arrays = nodes, .cell_arrays = tets};
  snprintf(stem, sizeof stem, "frame_%06d", record->step);
  snprintf(file, sizeof file, "%s_%05d.vtu", stem, frames->rank);
  int status = flesh_team_agree(frames->team, flesh_vtu_write(path_of(frames, file), &content));
  if (status || frames->rank) return status;
  status = flesh_pvd_next(&frames->index, &name);
  if (status) return status;
  snprintf(name, FLESH_PVD_NAME_SIZE, "frame_%06d.pvtu", record->step);
  status = flesh_pvtu_write(path_of(frames, name), &content, stem, frames->ranks);
  return status ? status : flesh_pvd_add(&frames->index, path_of(frames, "frames.pvd"), record->state->t);
}

int flesh_part_frames_observe(void *data, const flesh_step_record *record)
{
  flesh_part_frames *frames = data;
  if (record->step % frames->every && !record->last) return FLESH_OK;
  return flesh_team_agree(frames->team, write_frame(frames, record));
}
