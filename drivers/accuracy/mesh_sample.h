/* mesh_sample.h: a run on another mesh seen at the nodes of the scene's own. */
#ifndef FLESH_ACCURACY_MESH_SAMPLE_H
#define FLESH_ACCURACY_MESH_SAMPLE_H

#include "accuracy/accuracy.h"

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
