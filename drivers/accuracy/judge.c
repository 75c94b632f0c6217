/* judge.c: the errors of a run, step by step while it goes. */
#include "accuracy/judge.h"

#include <math.h>
#include <string.h>

/* The node nearest to where the tip of the coarser mesh is at rest. */
static int find_tip(const flesh_accuracy_plan *plan, const flesh_mesh *mesh)
{
  const double *X = flesh_mesh_positions(mesh), *tip = plan->measure.rest + 3 * plan->reference.scale.tip;
  double least = INFINITY;
  int node = 0;
  for (int i = 0; i < flesh_mesh_node_count(mesh); i++) {
    double d2 = 0;
    for (int c = 0; c < 3; c++) d2 += (X[3 * i + c] - tip[c]) * (X[3 * i + c] - tip[c]);
    if (d2 < least) least = d2, node = i;
  }
  return node;
}

int flesh_accuracy_judge_open(const flesh_accuracy_plan *plan, const flesh_accuracy_track *reference,
                              const flesh_accuracy_track *tight, const flesh_scene *scene, int is_finer,
                              flesh_accuracy_judge *judge)
{
  const flesh_system *system = flesh_scene_system(scene);
  *judge = (flesh_accuracy_judge){
      .plan = plan, .reference = reference, .tight = tight, .system = system, .finer_tip = -1};
  if (is_finer) judge->finer_tip = find_tip(plan, flesh_scene_mesh(scene));
  int status = flesh_accuracy_read_as_it_stands(plan, plan->scene, &judge->scene);
  if (!status) status = flesh_accuracy_track_open(1, flesh_system_unknowns(system), &judge->now);
  return status ? status : flesh_accuracy_track_open(1, reference->unknowns, &judge->then);
}

void flesh_accuracy_judge_close(flesh_accuracy_judge *judge)
{
  flesh_accuracy_track_close(&judge->now);
  flesh_accuracy_track_close(&judge->then);
  flesh_scene_destroy(&judge->scene);
}

static int compare(flesh_accuracy_judge *j, const flesh_accuracy_track *with, flesh_accuracy_errors *errors)
{
  const flesh_accuracy_plan *plan = j->plan;
  *j->then.t = *j->now.t;
  flesh_accuracy_track_at(with, &plan->measure, *j->now.t, j->then.x, j->then.v);
  int status = flesh_accuracy_track_evaluate(flesh_scene_system(j->scene), &j->then);
  const flesh_accuracy_state now = {j->now.x, *j->now.energy, *j->now.volume};
  const flesh_accuracy_state then = {j->then.x, *j->then.energy, *j->then.volume};
  if (!status) flesh_accuracy_compare_states(&plan->measure, &plan->reference.scale, &now, &then, errors);
  return status;
}

/* A finer mesh has other nodes: the one nearest to the tip speaks for its place, and the volumes. */
static void compare_finer(flesh_accuracy_judge *j)
{
  const flesh_accuracy_plan *plan = j->plan;
  const flesh_mesh *mesh = flesh_system_mesh(j->system);
  const double *X = flesh_mesh_positions(mesh) + 3 * j->finer_tip, *fine = j->now.x + 3 * j->finer_tip;
  const double *coarse = j->then.x + 3 * plan->reference.scale.tip;
  const double *tip = plan->measure.rest + 3 * plan->reference.scale.tip;
  double d2 = 0, volume = flesh_mesh_volume(mesh, j->now.x) / flesh_mesh_volume(mesh, flesh_mesh_positions(mesh));
  flesh_accuracy_track_at(j->tight, &plan->measure, *j->now.t, j->then.x, j->then.v);
  for (int c = 0; c < 3; c++) {
    double apart = fine[c] - X[c] - (coarse[c] - tip[c]);
    d2 += apart * apart;
  }
  j->errors.tip = fmax(j->errors.tip, sqrt(d2));
  double other = flesh_mesh_volume(flesh_scene_mesh(j->scene), j->then.x) / plan->measure.rest_volume;
  j->errors.volume = fmax(j->errors.volume, fabs(volume - other));
}

int flesh_accuracy_judge_see(void *data, const flesh_state *state)
{
  flesh_accuracy_judge *j = data;
  size_t size = sizeof(double) * (size_t)j->now.unknowns;
  *j->now.t = state->t;
  memcpy(j->now.x, state->x, size);
  memcpy(j->now.v, state->v, size);
  if (j->finer_tip >= 0) {
    compare_finer(j);
    return FLESH_OK;
  }
  int status = flesh_accuracy_track_evaluate(j->system, &j->now);
  if (!status) status = compare(j, j->reference, &j->errors);
  if (!status && j->tight) status = compare(j, j->tight, &j->difference);
  return status;
}
