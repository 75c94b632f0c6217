/* meshes.h: what refining a mesh needs from a scene: the tets that boxes cut, the selections that a refined mesh
 * inherits, and the share of each tet in the error of a quantity, by goal-oriented recovery (Zienkiewicz & Zhu 1992
 * with the weights of the dual problem; Becker & Rannacher 2001). */
#ifndef FLESH_ERROR_MESHES_H
#define FLESH_ERROR_MESHES_H

#include "cli/overrides.h"
#include "flesh/scene.h"
#include "scene/selection.h"

/* Tets that boxes of body.regions cut. A tet has the density and material of the region that contains its middle; finer
 * meshes choose again, so the volume on the wrong side of a box becomes smaller. */
typedef struct flesh_cut {
  int count;        /* number of tets that are cut between different densities or materials */
  double share;     /* of the body's volume that has density or material of the wrong side */
  int has_density;  /* whether densities differ there */
  double *shares;   /* [tets] wrong share of each tet's volume; NULL: no tet is cut */
  int *materials;   /* [tets] material of the other side; for tets that are not cut, their own */
  flesh_arena memory; /* owns both arrays */
} flesh_cut;

/* Finds the tets that boxes cut. FLESH_ERR_MEMORY, with *cut cleared. */
int flesh_cut_find(const flesh_scene *scene, flesh_cut *cut);
void flesh_cut_clear(flesh_cut *cut);

/* Sentences about the tets that boxes cut: "boxes of body.regions cut 12 tets, ..." and, for each muscle's box that cuts
 * tets, "effects[2].muscle.box cuts 12 tets, ..."; "": there are none. */
typedef struct flesh_cut_words {
  int has_density; /* of flesh_cut */
  char regions[320], muscles[320];
} flesh_cut_words;
int flesh_cut_say(const flesh_scene *scene, flesh_cut_words *words); /* FLESH_ERR_MEMORY */

/* Calls `see` with each selection of nodes or faces in the scene's effects, and with its path, until a call fails. */
typedef int flesh_error_see(void *data, const flesh_selection *selection, const char *path);
int flesh_error_selections(const flesh_scene *scene, flesh_error_see *see, void *data);

/* Copies the scene's mesh, with a named set for each selection by box, sphere or numbers of nodes in its effects and
 * probes, and adds overrides to `overrides` that select these sets instead. A refined mesh (flesh_mesh_refine_marked)
 * thus holds and loads the same faces. Nodes within other faces are left out, with a warning unless `quiet`. *mesh is
 * new. FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
int flesh_error_carry(const flesh_scene *scene, int quiet, flesh_overrides *overrides, flesh_mesh **mesh);

/* Computes indicators [tets], of either sign, at the equilibrium `state` of the scene, whose tets all have ten nodes.
 * `column` is a column of probes. For a position at a point, in which case *is_goal is 1, the adjoint solves K lambda =
 * dQ/du, and the indicators are shares of its error in m. For all others the displacement, which is the adjoint of the
 * loads' work, replaces lambda. The indicators include tets that boxes of body.regions cut; the sum of these shares is
 * *cut_off. FLESH_ERR_MEMORY, FLESH_ERR_SOLVE. */
int flesh_error_indicate(const flesh_scene *scene, const flesh_state *state, const char *column, double *indicators,
                         int *is_goal, double *cut_off);

#endif
