/* sums.c: checksums by which ranks see whether they have read the same scene. */
#include <stdlib.h>
#include <string.h>

#include "base/archive.h"
#include "base/error.h"
#include "base/scan.h"
#include "mesh/mesh.h"
#include "scene/keys.h"
#include "scene/ranks.h"
#include "scene/scene.h"

typedef struct reading {
  const flesh_scene *scene;
  char *keys; /* the keys in force, as text */
  uint64_t sum;
  int status;
} reading;

/* Adds the content of a file to the sum, and removes the path from the keys, as it may differ between ranks. The body's
 * mesh is skipped: its sum is that of the mesh in memory. */
static void add_file(void *data, const char *path)
{
  reading *r = data;
  char *bytes;
  size_t size, length = strlen(path);
  for (char *at = r->keys; length && (at = strstr(at, path));) memmove(at, at + length, strlen(at + length) + 1);
  if (r->status || !strcmp(path, r->scene->keys.body.mesh)) return;
  r->status = flesh_file_load(path, &bytes, &size);
  if (!r->status) r->sum = flesh_archive_sum(r->sum, bytes, size);
  free(bytes);
}

static uint64_t sum_mesh(const flesh_mesh *mesh)
{
  const size_t nodes = (size_t)flesh_mesh_node_count(mesh), tets = (size_t)flesh_mesh_tet_count(mesh);
  const int *edges = flesh_mesh_tet_edges(mesh);
  if (mesh->split) return 0;
  uint64_t sum = flesh_archive_sum(0, flesh_mesh_positions(mesh), 3 * nodes * sizeof(double));
  sum = flesh_archive_sum(sum, flesh_mesh_tets(mesh), 4 * tets * sizeof(int));
  sum = flesh_archive_sum(sum, flesh_mesh_regions(mesh), tets * sizeof(int));
  return edges ? flesh_archive_sum(sum, edges, 6 * tets * sizeof(int)) : sum;
}

static uint64_t sum_start(const flesh_scene *scene)
{
  const size_t size = 3 * (size_t)flesh_mesh_node_count(scene->mesh) * sizeof(double);
  if (scene->mesh->split) return 0;
  uint64_t sum = flesh_archive_sum(0, &scene->start.t, sizeof scene->start.t);
  sum = flesh_archive_sum(sum, scene->start.x, size);
  return flesh_archive_sum(sum, scene->start.v, size);
}

int flesh_scene_sum(const flesh_scene *scene, flesh_scene_sums *sums)
{
  flesh_text text = {0};
  flesh_scene_print(scene, &text);
  reading r = {.scene = scene, .keys = text.data};
  if (text.failed) {
    free(text.data);
    return flesh_no_memory_for(scene->path);
  }
  flesh_scene_visit_files(scene, add_file, &r);
  *sums = (flesh_scene_sums){.keys = flesh_archive_sum(0, text.data, strlen(text.data)),
                             .mesh = sum_mesh(scene->mesh),
                             .start = sum_start(scene),
                             .files = r.sum};
  free(text.data);
  return r.status;
}
