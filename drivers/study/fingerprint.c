/* fingerprint.c: what a scene is, in one short text. */
#include "study/fingerprint.h"

#include <sha256.h>
#include <stdlib.h>

#include "base/error.h"
#include "scene/scene.h"

static void add(SHA2_CTX *hash, const void *data, size_t size) { SHA256Update(hash, data, size); }

int flesh_study_fingerprint(const flesh_scene *scene, const char *path, char text[FLESH_STUDY_FINGERPRINT])
{
  SHA2_CTX hash;
  flesh_text values = {0};
  const flesh_mesh *mesh = flesh_scene_mesh(scene);
  const size_t size = 3 * (size_t)flesh_mesh_node_count(mesh) * sizeof(double), tets = (size_t)flesh_mesh_tet_count(mesh);
  *text = 0;
  flesh_scene_print(scene, &values);
  const int lacks = values.failed;
  if (!lacks) {
    SHA256Init(&hash);
    add(&hash, values.data, values.size);
    add(&hash, scene->start.x, size);
    add(&hash, scene->start.v, size);
    add(&hash, flesh_mesh_positions(mesh), size);
    add(&hash, flesh_mesh_tets(mesh), 4 * sizeof(int) * tets);
    if (flesh_mesh_order(mesh) == 2) add(&hash, flesh_mesh_tet_edges(mesh), 6 * sizeof(int) * tets);
    SHA256End(&hash, text);
  }
  free(values.data);
  return lacks ? flesh_no_memory_for(path) : FLESH_OK;
}
