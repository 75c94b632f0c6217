/* share.c: a rank's part of a scene's body: the materials of its tets, the constraints of its nodes, and effects made
 * on its mesh. */
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/team.h"
#include "effect/effect.h"
#include "mesh/mesh.h"
#include "mesh/split_part.h"
#include "parallel/communicator.h"
#include "parallel/rank_part.h"
#include "scene/effect_list.h"
#include "scene/ranks.h"
#include "scene/scene.h"
#include "scene/share.h"
#include "system/parts.h"
#include "system/rank_numbers.h"
#include "system/ranks.h"

struct flesh_scene_share {
  const flesh_scene *scene;
  flesh_rank_part *part;
  double *density;   /* [tets of the part] */
  int *tet_material; /* [tets of the part]; NULL: all have the same material */
  flesh_body_part *bodies;
  flesh_body body;
  flesh_system *system;
  int *effects; /* [the scene's effects] number of each in this system, from 1; 0 for constraints */
  flesh_share_probes probes;
};

/* Copies the scene's densities and materials of this rank's tets. */
static int take_tets(flesh_scene_share *self)
{
  const flesh_body *whole = &self->scene->body;
  const size_t tets = (size_t)flesh_mesh_tet_count(flesh_rank_part_mesh(self->part));
  const int *numbers = flesh_rank_part_tets(self->part);
  self->density = malloc((tets + 1) * sizeof *self->density);
  self->tet_material = malloc((tets + 1) * sizeof *self->tet_material);
  self->bodies = calloc((size_t)whole->part_count + 1, sizeof *self->bodies);
  if (!self->density || !self->tet_material || !self->bodies)
    return flesh_no_memory_for(self->scene->path);
  for (size_t t = 0; t < tets; t++) {
    self->density[t] = whole->density[numbers[t]];
    self->tet_material[t] = whole->tet_material ? whole->tet_material[numbers[t]] : 0;
  }
  /* Numbers rise, so the tets of each body are consecutive here, too. */
  size_t next = 0;
  for (int b = 0; b < whole->part_count; b++) {
    const int end = whole->parts[b].first_tet + whole->parts[b].tets;
    self->bodies[b] = (flesh_body_part){.name = whole->parts[b].name, .first_tet = (int)next};
    while (next < tets && numbers[next] < end) next++;
    self->bodies[b].tets = (int)next - self->bodies[b].first_tet;
  }
  self->body = *whole;
  self->body.mesh = flesh_rank_part_mesh(self->part);
  self->body.density = self->density;
  self->body.tet_material = whole->tet_material ? self->tet_material : NULL;
  self->body.parts = whole->parts ? self->bodies : NULL;
  return FLESH_OK;
}

/* Adds a pin or a prescribed motion for those of its nodes that this rank has, which may be none. */
static int take_constraint(flesh_scene_share *self, const flesh_constraint *whole)
{
  int *nodes = malloc(((size_t)whole->count + 1) * sizeof *nodes), count = 0;
  if (!nodes) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d constrained nodes", whole->count);
  for (int k = 0; k < whole->count; k++)
    if ((nodes[count] = flesh_rank_part_find(self->part, whole->nodes[k])) >= 0) count++;
  const int status =
      whole->motion.count
          ? flesh_system_add_prescribed_motion(self->system, count, nodes, whole->axes, &whole->motion, whole->from,
                                               whole->until)
          : flesh_system_add_pin(self->system, count, nodes, whole->axes, whole->from, whole->until);
  free(nodes);
  return status;
}

/* Fails if a constraint or an effect of a split mesh selects nothing on any rank. Collective. */
static int check_found(const flesh_scene_share *self, flesh_communicator *communicator)
{
  const flesh_effect_entry *entries = self->scene->keys.effects.values;
  int status = FLESH_OK;
  if (!self->scene->mesh->split) return FLESH_OK;
  for (int k = 0; k < self->scene->keys.effects.count; k++) {
    double most = entries[k].found;
    flesh_communicator_largest(communicator, 1, &most);
    if (most == 0 && !status)
      status = flesh_node_fail(entries[k].node, "%s: no node, surface triangle or tet of the mesh is chosen",
                               entries[k].path);
  }
  return status;
}

static int take_effect(flesh_scene_share *self, const flesh_effect_entry *entry)
{
  const flesh_effect *whole = entry->effect ? flesh_system_effect(self->scene->system, entry->effect - 1) : NULL;
  flesh_effect *restricted = NULL;
  if (!whole || !flesh_effect_private_of(whole)->ranks) return entry->row->add(entry->parameters, &self->body, self->system);
  const int status = flesh_effect_private_of(whole)->ranks->restrict_to_part(whole, self->part, &self->body, &restricted);
  return status ? status : flesh_system_add_effect(self->system, &restricted);
}

static int take_entry(flesh_scene_share *self, const flesh_effect_entry *entry)
{
  const flesh_system *whole = self->scene->system;
  int status = FLESH_OK;
  if (entry->constraint) return take_constraint(self, &whole->constraints[entry->constraint - 1]);
  if (entry->effect) status = flesh_system_check_shared(flesh_system_effect(whole, entry->effect - 1));
  if (!status) status = take_effect(self, entry);
  return status ? flesh_node_fail_within(status, entry->node ? entry->node : self->scene->root, "%s: ", entry->path)
                : FLESH_OK;
}

static int build(flesh_scene_share *self)
{
  const flesh_effect_entry *entries = self->scene->keys.effects.values;
  int status = take_tets(self);
  self->effects = calloc((size_t)self->scene->keys.effects.count + 1, sizeof *self->effects);
  if (!status && !self->effects) status = flesh_no_memory_for(self->scene->path);
  if (!status) status = flesh_system_create(self->body.mesh, &self->system);
  if (!status) status = flesh_system_set_part(self->system, self->part);
  for (int k = 0; k < self->scene->keys.effects.count && !status; k++) {
    status = take_entry(self, &entries[k]);
    if (!entries[k].constraint) self->effects[k] = flesh_system_effect_count(self->system);
  }
  return status;
}

/* Finalizes the system, with data of effects that depend on the whole body. */
static int finish(flesh_scene_share *self)
{
  const int status = flesh_system_finalize(self->system);
  if (!status && self->scene->mesh->split && flesh_system_multiplier_count(self->system))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "%s: the pressures of incompressible tets (poisson 0.5) cannot be kept in a state of a split mesh; "
                      "take a mesh that is not split, or poisson below 0.5", self->scene->path);
  return status ? status : flesh_share_probes_take(self->scene, self->part, self->effects, &self->probes);
}

int flesh_scene_share_create(const flesh_scene *scene, flesh_communicator *communicator, flesh_scene_share **share)
{
  flesh_scene_share *self = *share = calloc(1, sizeof *self);
  int status = self ? FLESH_OK : flesh_no_memory_for(scene->path);
  status = flesh_communicator_agree(communicator, status);
  if (!status) {
    self->scene = scene;
    status = flesh_rank_part_create_for(communicator, scene->system, NULL, &self->part);
  }
  if (!status) status = check_found(self, communicator);
  if (!status) status = flesh_communicator_agree(communicator, build(self));
  if (!status) {
    flesh_rank_numbers_settle(self->system);
    status = flesh_communicator_agree(communicator, finish(self));
  }
  if (!status) status = flesh_share_probes_prepare(scene, &self->body, self->system, &self->probes);
  if (status) flesh_scene_share_destroy(share);
  return status;
}

void flesh_scene_share_destroy(flesh_scene_share **share)
{
  if (!share || !*share) return;
  flesh_scene_share *self = *share;
  flesh_share_probes_clear(&self->probes);
  flesh_system_destroy(&self->system);
  flesh_rank_part_destroy(&self->part);
  free(self->density);
  free(self->tet_material);
  free(self->bodies);
  free(self->effects);
  free(self);
  *share = NULL;
}

const flesh_rank_part *flesh_scene_share_part(const flesh_scene_share *share) { return share->part; }
const flesh_body *flesh_scene_share_body(const flesh_scene_share *share) { return &share->body; }
const flesh_system *flesh_scene_share_system(const flesh_scene_share *share) { return share->system; }

const flesh_probe *flesh_scene_share_probes(const flesh_scene_share *share, int *count)
{
  *count = share->probes.count;
  return share->probes.probes;
}

void flesh_scene_share_start(const flesh_scene_share *self, flesh_state *state)
{
  const flesh_state *whole = &self->scene->start;
  const int *nodes = flesh_rank_part_nodes(self->part);
  state->t = whole->t;
  for (int k = 0; k < state->internal_count; k++) state->internal[k] = whole->internal[k];
  const int *tets = flesh_rank_part_tets(self->part);
  for (int k = 0; k < state->multiplier_count; k++) state->multipliers[k] = whole->multipliers[tets[k]];
  for (size_t i = 0; i < (size_t)flesh_mesh_node_count(self->body.mesh); i++) {
    memcpy(state->x + 3 * i, whole->x + 3 * (size_t)nodes[i], 3 * sizeof *state->x);
    memcpy(state->v + 3 * i, whole->v + 3 * (size_t)nodes[i], 3 * sizeof *state->v);
  }
}
