/* mesh.h: the error that the mesh makes, beside that of the step: the scene on other meshes and with other elements, at
 * the same times, against a reference of refined meshes.
 *
 * All are compared at the nodes of the scene's own mesh, where the others' displacements are interpolated. */
#ifndef FLESH_ACCURACY_MESH_H
#define FLESH_ACCURACY_MESH_H

#include "accuracy/accuracy.h"
#include "flesh/body.h"

/* Chooses method and step, runs the meshes as far as the seconds go, finds reference and errors, and tells of them. The
 * runs have been told of, or the scene is for equilibrium. FLESH_ERR_INTERRUPTED, FLESH_ERR_FILE; FLESH_ERR_SOLVE where no
 * method of fixed steps reached the end. */
int flesh_accuracy_run_meshes(flesh_accuracy_session *session);
/* SQL knows this of a row of meshes beside its case. New object. */
json_t *flesh_accuracy_mesh_facts(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row);

/* The cases, each in this process: a run on a mesh, which keeps its states or is timed alone; and what the kept ones
 * converge to, as rows of a table: of each mesh {mesh, error, below, elsewhere}, of each element {element, levels, order,
 * change, coarse, fine}, and {first, second, apart, uncertainty, motion}, lengths in m. */
int flesh_accuracy_run_mesh(const flesh_accuracy_plan *plan, int number);
int flesh_accuracy_find_limits(const flesh_accuracy_plan *plan, json_t *rows);

typedef struct flesh_accuracy_sampler {
  const flesh_mesh *mesh;      /* of the run */
  const double *points;        /* [3*count] at rest */
  int count;
  int *nodes;                  /* [10*count] of the tet that holds the point */
  double *weights;             /* [10*count] */
  flesh_accuracy_grid grid;    /* the times that are kept */
  int next;
  flesh_accuracy_track track;  /* where the points are at these times */
} flesh_accuracy_sampler;

/* For the nodes of plan->measure and times of the plan's grid; the scene must stay. */
int flesh_accuracy_sampler_open(const flesh_accuracy_plan *plan, const flesh_scene *scene,
                                flesh_accuracy_sampler *sampler);
void flesh_accuracy_sampler_close(flesh_accuracy_sampler *sampler);

/* Integrates the scene, or finds its equilibrium where it has no inertia; `sampler` may be NULL. Short runs are
 * repeated: the least CPU time [s]. */
int flesh_accuracy_sample(const flesh_accuracy_plan *plan, const flesh_scene *scene, flesh_accuracy_sampler *sampler,
                          double *cpu_s);

#endif
