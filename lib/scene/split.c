/* split.c: scenes with a split mesh, of which each rank reads only its part: reads the mesh, and refuses what needs the
 * whole. */
#include <stddef.h>

#include "base/error.h"
#include "mesh/split.h"
#include "scene/effect_list.h"
#include "scene/effect_registry.h"
#include "scene/keys.h"
#include "scene/scene.h"

/* Checks that the scene uses the mesh as it is. */
static int check_mesh(const flesh_scene *scene, const flesh_mesh *mesh)
{
  const flesh_element element = (flesh_element)scene->keys.body.element;
  if (scene->keys.body.refine)
    return flesh_fail(FLESH_ERR_ARGUMENT, "body.refine is %d; it must be 0 for a split mesh: refine the mesh, then split it",
                      scene->keys.body.refine);
  if (scene->keys.body.curved.count)
    return flesh_fail(FLESH_ERR_ARGUMENT, "body.curved is given; a split mesh does not take it");
  if (flesh_mesh_order(mesh) == 1 && element != FLESH_ELEMENT_AUTO && element != FLESH_ELEMENT_TET4)
    return flesh_fail(FLESH_ERR_ARGUMENT, "its tets have four nodes, and body.element has ten; split a mesh of ten-node "
                                          "tets (flesh mesh convert --order 2)");
  return FLESH_OK;
}

int flesh_scene_read_body_mesh(const flesh_scene *scene, flesh_mesh **mesh)
{
  const char *path = scene->keys.body.mesh;
  flesh_split split;
  *mesh = NULL;
  if (scene->ranks < 2 || !flesh_split_is_index(path)) return flesh_mesh_read(path, mesh);
  int status = flesh_split_open(path, &split);
  if (!status && split.parts != scene->ranks)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "%s: the mesh is split for %d ranks, and there are %d; start %d, or split it "
                        "for %d", path, split.parts, scene->ranks, split.parts, scene->ranks);
  if (!status) status = flesh_split_read_part(&split, scene->rank, mesh);
  if (!status) status = check_mesh(scene, *mesh);
  flesh_split_close(&split);
  if (status) flesh_mesh_destroy(mesh);
  return status;
}

static int refuse(const flesh_scene *scene, size_t offset, const char *what)
{
  return flesh_node_fail(flesh_scene_place(scene->root, flesh_scene_table, offset),
                         "%s needs the whole body, but each rank of a split mesh has only a part; leave it out, or give a "
                         "mesh that is not split", what);
}

static int check_output(const flesh_scene *scene)
{
  const size_t output = offsetof(flesh_scene_keys, output);
  const flesh_scene_output *given = &scene->keys.output.given;
  if (given->skin.surface) return refuse(scene, output, "output.skin");
  return FLESH_OK;
}

int flesh_scene_check_split(const flesh_scene *scene)
{
  const flesh_effect_entry *entries = scene->keys.effects.values;
  if (!scene->mesh->split) return FLESH_OK;
  if (scene->keys.bodies.count) return refuse(scene, offsetof(flesh_scene_keys, bodies), "bodies");
  for (int k = 0; k < scene->keys.effects.count; k++)
    if (entries[k].row->on_parts == FLESH_PARTS_REFUSED)
      return flesh_node_fail_at_key(entries[k].node,
                                    "%s needs the whole body, but each rank of a split mesh has only a part; leave it out, "
                                    "or give a mesh that is not split", entries[k].path);
  return check_output(scene);
}
