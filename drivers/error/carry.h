/* carry.h: a scene whose selections refined meshes carry on. */
#ifndef FLESH_ERROR_CARRY_H
#define FLESH_ERROR_CARRY_H

#include "cli/overrides.h"
#include "flesh/scene.h"
#include "scene/selection.h"

/* Calls `see` with each selection of nodes or faces that the scene's effects make, and its path, until one fails. */
typedef int flesh_error_see(void *data, const flesh_selection *selection, const char *path);
int flesh_error_selections(const flesh_scene *scene, flesh_error_see *see, void *data);

/* Copies the scene's mesh, with a named set for each selection by box, sphere or numbers of nodes that its effects and
 * probes make, and adds to `overrides` what makes them select that set instead. So a refined mesh (flesh_mesh_refine_marked)
 * holds and loads the faces that this one does; nodes within others are left out, with a warning unless `quiet`. Returns
 * new *mesh. FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
int flesh_error_carry(const flesh_scene *scene, int quiet, flesh_overrides *overrides, flesh_mesh **mesh);

#endif
