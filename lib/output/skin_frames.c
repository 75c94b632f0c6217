/* skin_frames.c: files of the moving skin. */
#include <dirent.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/error.h"
#include "flesh/observer.h"
#include "base/file.h"
#include "mesh/mesh.h"
#include "output/pc2.h"
#include "output/resume.h"
#include "output/skin_frames.h"
#include "output/vtu_read.h"
#include "skin/skin.h"

enum { NAME_SIZE = FLESH_PVD_NAME_SIZE };

struct flesh_skin_frames {
  const flesh_skin *skin;
  const flesh_surface *surface;
  unsigned formats;
  int every;
  char *directory, *path; /* path: room for directory/name */
  double *x, *v, *displacement; /* [3*vertices], one block */
  flesh_pc2 cache;
  flesh_pvd index; /* index of the VTU files */
};

static const char *path_of(flesh_skin_frames *frames, const char *name)
{
  sprintf(frames->path, "%s/%s", frames->directory, name);
  return frames->path;
}

static int is_frame(const char *name)
{
  size_t length = strlen(name);
  const char *suffix = length > 9 && length < NAME_SIZE ? name + length - 4 : "";
  return !strncmp(name, "skin_", 5) && (!strcmp(suffix, ".obj") || !strcmp(suffix, ".vtu")) &&
         strspn(name + 5, "0123456789") == length - 9;
}

void flesh_skin_frames_remove(const char *directory)
{
  flesh_folder_clear(directory);
  char *path = malloc(strlen(directory) + NAME_SIZE + 1);
  DIR *folder = path ? flesh_path_list(directory) : NULL;
  if (folder) {
    for (struct dirent *entry; (entry = readdir(folder));)
      if (is_frame(entry->d_name) || !strcmp(entry->d_name, "skin.pvd") ||
          !strcmp(entry->d_name, "skin.pc2")) {
        sprintf(path, "%s/%s", directory, entry->d_name);
        flesh_path_unlink(path);
      }
    closedir(folder);
  }
  free(path);
}

int flesh_skin_frames_open(const char *directory, const flesh_skin *skin, const flesh_surface *surface,
                           unsigned formats, int every, flesh_skin_frames **result)
{
  *result = NULL;
  flesh_skin_frames *frames = calloc(1, sizeof *frames);
  if (!frames) return flesh_no_memory_for(directory);
  size_t size = 3 * (size_t)skin->identity.vertices;
  frames->skin = skin;
  frames->surface = surface;
  frames->formats = formats;
  frames->every = every;
  frames->directory = strdup(directory);
  frames->path = malloc(strlen(directory) + NAME_SIZE + 1);
  frames->x = malloc(3 * size * sizeof *frames->x);
  if (!frames->directory || !frames->path || !frames->x) {
    flesh_skin_frames_abandon(&frames);
    return flesh_no_memory_for(directory);
  }
  frames->v = frames->x + size;
  frames->displacement = frames->v + size;
  *result = frames;
  return FLESH_OK;
}

int flesh_skin_frames_create(const char *directory, const flesh_skin *skin,
                             const flesh_surface *surface, unsigned formats, int every,
                             flesh_skin_frames **result)
{
  FLESH_NEED({result, "frames"});
  *result = NULL;
  FLESH_NEED({directory, "directory"}, {skin, "skin"}, {surface, "surface"});
  if (every < 1)
    return flesh_fail(FLESH_ERR_ARGUMENT, "skin: every is %d; it must be at least 1", every);
  if (!formats || formats > (FLESH_SKIN_OBJ | FLESH_SKIN_PC2 | FLESH_SKIN_VTU))
    return flesh_fail(FLESH_ERR_ARGUMENT, "skin: the formats are %u; some of obj, pc2 and vtu must "
                                          "be chosen",
                      formats);
  if (skin->identity.vertices != flesh_surface_vertex_count(surface))
    return flesh_fail(FLESH_ERR_ARGUMENT, "skin: it is bound to a surface of %d vertices; this one has %d",
                      skin->identity.vertices, flesh_surface_vertex_count(surface));
  flesh_skin_frames *frames = NULL;
  int status = flesh_folder_make(directory);
  if (!status) status = flesh_skin_frames_open(directory, skin, surface, formats, every, &frames);
  if (status) return status;
  flesh_skin_frames_remove(directory);
  if (formats & FLESH_SKIN_PC2)
    status =
        flesh_pc2_open(path_of(frames, "skin.pc2"), skin->identity.vertices, &frames->cache);
  if (!status && formats & FLESH_SKIN_VTU)
    status = flesh_pvd_write(path_of(frames, "skin.pvd"), 0, NULL, NULL);
  if (status) flesh_skin_frames_abandon(&frames);
  *result = frames;
  return status;
}

int flesh_skin_frames_close(flesh_skin_frames **frames)
{
  if (!frames || !*frames) return FLESH_OK;
  int status = (*frames)->cache.file.stream ? flesh_pc2_commit(&(*frames)->cache) : FLESH_OK;
  flesh_skin_frames_abandon(frames);
  return status;
}

void flesh_skin_frames_abandon(flesh_skin_frames **frames)
{
  if (!frames || !*frames) return;
  flesh_pc2_abandon(&(*frames)->cache);
  free((*frames)->directory);
  free((*frames)->path);
  free((*frames)->x);
  flesh_pvd_clear(&(*frames)->index);
  free(*frames);
  *frames = NULL;
}

static int write_vtu(flesh_skin_frames *frames, int number, const flesh_state *state)
{
  char *name;
  int status = flesh_pvd_next(&frames->index, &name), vertices = frames->skin->identity.vertices;
  if (status) return status;
  const double *rest = flesh_surface_positions(frames->surface);
  flesh_skin_apply(frames->skin, 3, 0, state->v, frames->v);
  for (size_t d = 0; d < 3 * (size_t)vertices; d++)
    frames->displacement[d] = frames->x[d] - rest[d];
  const flesh_vtu_array arrays[] = {
      {.name = "displacement", .components = 3, .doubles = frames->displacement, .unit = "m"},
      {.name = "velocity", .components = 3, .doubles = frames->v, .unit = "m/s"}};
  const flesh_vtu content = {.points = vertices,
                             .positions = frames->x,
                             .polygons = flesh_surface_face_count(frames->surface),
                             .starts = flesh_surface_starts(frames->surface),
                             .corners = flesh_surface_corners(frames->surface),
                             .point_array_count = 2,
                             .point_arrays = arrays};
  snprintf(name, NAME_SIZE, "skin_%06d.vtu", number);
  status = flesh_vtu_write(path_of(frames, name), &content);
  return status ? status : flesh_pvd_add(&frames->index, path_of(frames, "skin.pvd"), state->t);
}

int flesh_skin_frames_add(flesh_skin_frames *frames, int number, const flesh_state *state)
{
  FLESH_NEED({frames, "frames"}, {state, "state"});
  int status = FLESH_OK;
  flesh_skin_apply(frames->skin, 3, 0, state->x, frames->x);
  if (frames->formats & FLESH_SKIN_OBJ) {
    char name[NAME_SIZE];
    snprintf(name, sizeof name, "skin_%06d.obj", number);
    status = flesh_surface_write(frames->surface, frames->x, path_of(frames, name));
  }
  if (!status && frames->formats & FLESH_SKIN_PC2)
    status = flesh_pc2_add(&frames->cache, frames->x);
  if (!status && frames->formats & FLESH_SKIN_VTU) status = write_vtu(frames, number, state);
  return status;
}

int flesh_skin_frames_observe(void *data, const flesh_step_record *record)
{
  FLESH_NEED({data, "frames"}, {record, "record"});
  flesh_skin_frames *frames = data;
  if (record->step % frames->every && !record->last) return FLESH_OK;
  const flesh_skin_identity *of = &frames->skin->identity;
  const int status = flesh_mesh_check_counts(flesh_system_mesh(record->system), "the skin", "", of->nodes, of->tets);
  return status ? status : flesh_skin_frames_add(frames, record->step, record->state);
}

/* Removes the files of steps after `last`. */
static void remove_after(flesh_skin_frames *frames, int last)
{
  DIR *folder = flesh_path_list(frames->directory);
  if (!folder) return;
  for (struct dirent *entry; (entry = readdir(folder));)
    if (is_frame(entry->d_name) && atoi(entry->d_name + 5) > last) flesh_path_unlink(path_of(frames, entry->d_name));
  closedir(folder);
}

/* Makes the point cache up to step `last` from the body's frames. */
static int make_cache(flesh_skin_frames *frames, int last, const char *body_frames, const flesh_mesh *mesh)
{
  static const char *const names[] = {"Points"};
  const int nodes = flesh_mesh_node_count(mesh);
  double *x = malloc(3 * sizeof *x * (size_t)nodes);
  char *path = malloc(strlen(body_frames) + NAME_SIZE + 1);
  int status = x && path ? flesh_pc2_open(path_of(frames, "skin.pc2"), frames->skin->identity.vertices, &frames->cache)
                         : flesh_no_memory_for(body_frames);
  for (int step = 0; step <= last && !status; step += frames->every) {
    sprintf(path, "%s/frame_%06d.vtu", body_frames, step);
    status = flesh_vtu_read(path, nodes, 1, names, &x);
    if (status) break;
    flesh_skin_apply(frames->skin, 3, 0, x, frames->x);
    status = flesh_pc2_add(&frames->cache, frames->x);
  }
  free(x);
  free(path);
  return status;
}

int flesh_skin_frames_resume(flesh_skin_frames **frames, int last, const char *body_frames, const flesh_mesh *mesh)
{
  flesh_skin_frames *self = *frames;
  int status = FLESH_OK;
  flesh_folder_clear(self->directory);
  remove_after(self, last);
  if (self->formats & FLESH_SKIN_PC2) status = make_cache(self, last, body_frames, mesh);
  if (!status && self->formats & FLESH_SKIN_VTU)
    status = flesh_pvd_resume(path_of(self, "skin.pvd"), self->every, last, &self->index);
  if (status) flesh_skin_frames_abandon(frames);
  return status;
}
