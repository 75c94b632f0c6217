/* meshes.h: what meshes that are refined ask of a scene: which of its tets boxes cut, which selections they carry on, and the
 * share of each tet in the error of a quantity: goal-oriented recovery (Zienkiewicz & Zhu 1992 with the dual problem's
 * weights; Becker & Rannacher 2001). */
#ifndef FLESH_ERROR_MESHES_H
#define FLESH_ERROR_MESHES_H

#include "cli/overrides.h"
#include "flesh/scene.h"
#include "scene/selection.h"

/* Tets that boxes of body.regions cut. A tet has the density and material of the region that its middle is in; finer meshes
 * choose anew, and what lies on the other side of a box becomes less. */
typedef struct flesh_cut {
  int count;        /* of tets that are cut where densities or materials differ */
  double share;     /* of the body's volume that has those of the wrong side */
  int has_density;  /* whether densities differ there */
  double *shares;   /* [tets] of each tet's volume; NULL: no tet is cut. Owned, as is the next */
  int *materials;   /* [tets] that of the other side; of tets that are not cut their own */
} flesh_cut;

/* FLESH_ERR_MEMORY; cleared then. */
int flesh_cut_find(const flesh_scene *scene, flesh_cut *cut);
void flesh_cut_clear(flesh_cut *cut);

/* Writes "boxes of body.regions cut 12 tets, ..." of a cut that has tets. */
void flesh_cut_say(const flesh_cut *cut, size_t size, char *words);

/* Adds "effects[2].muscle.box cuts 12 tets, ..." of each muscle's box that cuts tets. FLESH_ERR_MEMORY. */
int flesh_cut_say_muscles(const flesh_scene *scene, size_t size, char *words);

/* Warns of what the bar of a column by `flesh run --to` leaves out: of positions it counts other materials. FLESH_ERR_MEMORY. */
int flesh_cut_warn(const flesh_scene *scene, const char *column);

/* Calls `see` with each selection of nodes or faces that the scene's effects make, and its path, until one fails. */
typedef int flesh_error_see(void *data, const flesh_selection *selection, const char *path);
int flesh_error_selections(const flesh_scene *scene, flesh_error_see *see, void *data);

/* Copies the scene's mesh, with a named set for each selection by box, sphere or numbers of nodes that its effects and
 * probes make, and adds to `overrides` what makes them select that set instead. So a refined mesh (flesh_mesh_refine_marked)
 * holds and loads the faces that this one does; nodes within others are left out, with a warning unless `quiet`. Returns
 * new *mesh. FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
int flesh_error_carry(const flesh_scene *scene, int quiet, flesh_overrides *overrides, flesh_mesh **mesh);

/* Fills indicators [tets], of either sign, of the equilibrium `state` of the scene, whose tets all have ten nodes. `column`
 * is a column of probes. Of a position at a point, which *is_goal tells, the adjoint solves K lambda = dQ/du, and the
 * indicators are shares of its error in m; for all others the displacement stands for lambda, which is the adjoint of the
 * loads' work. They count tets that boxes of body.regions cut, whose shares' sum is *cut_off. FLESH_ERR_MEMORY, FLESH_ERR_SOLVE. */
int flesh_error_indicate(const flesh_scene *scene, const flesh_state *state, const char *column, double *indicators,
                         int *is_goal, double *cut_off);

#endif
