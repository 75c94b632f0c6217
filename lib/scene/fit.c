/* fit.c: fits the mesh of a body to body.refine and body.element, and interpolates a start state that was given for the
 * mesh as it was read. */
#include <stdio.h>

#include "base/error.h"
#include "mesh/refine.h"
#include "mesh/mesh.h"
#include "mesh/split_part.h"
#include "system/state.h"
#include "scene/scene.h"

enum { MOST_REFINED = 10 };

/* Makes the next mesh on the way from the mesh that was read to the wanted one; *next is NULL if `mesh` is that. */
static int next_mesh(const flesh_scene *scene, flesh_element element, const flesh_mesh *mesh, int refined,
                     flesh_mesh **next)
{
  *next = NULL;
  if (refined < scene->keys.body.refine) return flesh_mesh_refine(mesh, next);
  if (element == FLESH_ELEMENT_AUTO || element == FLESH_ELEMENT_TET4 || flesh_mesh_order(mesh) == 2) return FLESH_OK;
  return flesh_mesh_raise_order(mesh, next);
}

/* Checks that body.refine can be done, before it is begun. */
static int check_refine(const flesh_scene *scene, flesh_element element, const flesh_mesh *mesh)
{
  const int times = scene->keys.body.refine, linear = element == FLESH_ELEMENT_AUTO || element == FLESH_ELEMENT_TET4;
  const int status = times > MOST_REFINED ? flesh_fail(FLESH_ERR_ARGUMENT, "it must be 0 to %d", MOST_REFINED)
                                          : flesh_mesh_check_refine(mesh, linear ? flesh_mesh_order(mesh) : 2, times);
  return status ? flesh_fail_within(status, "body.refine is %d; ", times) : FLESH_OK;
}

int flesh_scene_fit_mesh(flesh_scene *scene, const char *body, flesh_element element, const flesh_objects *curved,
                         flesh_mesh **mesh)
{
  if (element == FLESH_ELEMENT_TET4 && flesh_mesh_order(*mesh) == 2)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "%s.element is tet4, and the mesh's tets have ten nodes; it must be tet10 or tet10-mean, or convert "
                      "the mesh by `flesh mesh convert --order 1`", body);
  int status = check_refine(scene, element, *mesh);
  /* The faces on surfaces are found on the mesh as it was read: a mesh with such faces is refined when it is put on
   * them. */
  for (int refined = curved->count ? scene->keys.body.refine : 0; !status; refined++) {
    flesh_mesh *next;
    status = next_mesh(scene, element, *mesh, refined, &next);
    if (status || !next) break;
    flesh_mesh_destroy(mesh);
    *mesh = next;
  }
  if (status) return status;
  status = flesh_scene_curve_mesh(scene, body, curved, mesh);
  return status ? flesh_fail_within(status, "%s.", body) : FLESH_OK;
}

/* Interpolates the state from the nodes of *mesh, through all meshes on the way, to the scene's mesh; replaces *mesh by
 * each. */
static int interpolate(const flesh_scene *scene, flesh_mesh **mesh, flesh_state *state)
{
  for (int refined = 0;; refined++) {
    flesh_mesh *next;
    int status = next_mesh(scene, (flesh_element)scene->keys.body.element, *mesh, refined, &next);
    if (status || !next) return status;
    status = flesh_mesh_refine_field(*mesh, state->x);
    if (!status) status = flesh_mesh_refine_field(*mesh, state->v);
    flesh_mesh_destroy(mesh);
    *mesh = next;
    if (status) return status;
  }
}

int flesh_scene_read_state(const flesh_scene *scene, flesh_state *state)
{
  const char *path = scene->keys.start.state;
  const int nodes = flesh_mesh_node_count(scene->mesh);
  const flesh_split_part *split = scene->mesh->split;
  if (split) return flesh_state_read_some(path, split->whole_nodes, nodes, split->nodes, state);
  int status = flesh_state_read(path, nodes, state);
  if (status != FLESH_ERR_FILE || scene->part_count > 1 || scene->keys.body.curved.count) return status;
  flesh_mesh *mesh = NULL;
  char words[1024];
  snprintf(words, sizeof words, "%s", flesh_error_text());
  status = flesh_mesh_read(scene->keys.body.mesh, &mesh);
  const int given = status ? 0 : flesh_mesh_node_count(mesh);
  if (given && given < nodes && !flesh_state_read(path, given, state)) status = interpolate(scene, &mesh, state);
  else status = flesh_fail(FLESH_ERR_FILE, "%s", words);
  flesh_mesh_destroy(&mesh);
  return status;
}
