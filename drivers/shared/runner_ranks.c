/* runner_ranks.c: a run on several ranks: each steps its part, and the first observes the whole. */
#include <stdlib.h>

#include "base/error.h"
#include "shared/running.h"
#include "system/internal.h"

int flesh_running_share(flesh_running *r)
{
  const flesh_ranks *ranks = r->options->ranks;
  const size_t unknowns = (size_t)flesh_system_unknowns(flesh_ranks_system(ranks, r->scene));
  const size_t tets = (size_t)flesh_mesh_tet_count(flesh_scene_mesh(r->scene));
  r->own.x = malloc(sizeof(double) * unknowns + 1);
  r->own.v = malloc(sizeof(double) * unknowns + 1);
  r->own.internal_count = flesh_system_internal_count(flesh_scene_system(r->scene)); /* all ranks have all */
  r->own.internal = calloc((size_t)r->own.internal_count + 1, sizeof(double));
  r->J = flesh_ranks_first(ranks) ? malloc(sizeof(double) * tets + 1) : NULL;
  if (!r->own.x || !r->own.v || !r->own.internal || (flesh_ranks_first(ranks) && !r->J))
    return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  flesh_scene_share_start(ranks->share, &r->own);
  return flesh_ranks_first(ranks) ? flesh_proximity_create(flesh_scene_system(r->scene), NULL, &r->proximity) : FLESH_OK;
}

/* Nodes of no tet are of no rank; they are held at rest, as on one rank. */
static void hold_unused(const flesh_mesh *mesh, flesh_state *state)
{
  const uint8_t *used = flesh_mesh_node_used(mesh);
  for (int d = 0; d < 3 * flesh_mesh_node_count(mesh); d++)
    if (!used[d / 3]) state->x[d] = flesh_mesh_positions(mesh)[d], state->v[d] = 0;
}

int flesh_running_observe_ranks(void *data, const flesh_step_record *record)
{
  flesh_running *r = data;
  const flesh_ranks *ranks = r->options->ranks;
  r->state.t = record->state->t;
  flesh_gather_vector(ranks->gather, record->state->x, r->state.x);
  flesh_gather_vector(ranks->gather, record->state->v, r->state.v);
  if (!flesh_ranks_first(ranks)) return FLESH_OK;
  const flesh_mesh *mesh = flesh_scene_mesh(r->scene);
  flesh_step_record whole = *record;
  for (int k = 0; k < r->own.internal_count; k++) r->state.internal[k] = r->own.internal[k];
  int tet, inverted, changed;
  if (record->step) hold_unused(mesh, &r->state);
  flesh_mesh_jacobians(mesh, r->state.x, r->J, &tet, &inverted);
  whole.system = flesh_scene_system(r->scene);
  whole.state = &r->state;
  whole.J = r->J;
  whole.proximity = &r->proximity;
  int status = flesh_proximity_follow(&r->proximity, record->step > 0, r->state.t, r->state.x, &changed);
  if (status > 0) status = FLESH_OK; /* what is written says where a place is not finite */
  for (int o = 0; o < r->observer_count && status >= 0; o++)
    status = r->observers[o].observe(r->observers[o].data, &whole);
  return status;
}
