/* surface_contact_ranks.c: contact between bodies that are shared by ranks. Every rank has all surface nodes, and
 * searches for and evaluates the pairs whose first node it owns. Patches, and the pairs of an adaptive stiffness,
 * depend on the whole contact and are found by every rank. */
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "effect/effect.h"
#include "effect/surface_contact.h"
#include "flesh/ranks.h"

typedef flesh_surface_contact contact;

/* Copies the surface, in the part's numbers, and which bodies may touch. */
static int take(const contact *whole, const flesh_rank_part *part, contact *self)
{
  const size_t bodies = (size_t)whole->surface.body_count;
  int *local = malloc(((size_t)whole->surface.node_count + 1) * sizeof *local);
  self->may_meet = malloc(bodies * bodies + 1);
  int status = local && self->may_meet
                   ? FLESH_OK
                   : flesh_fail(FLESH_ERR_MEMORY, "no memory for the contact of %d nodes", whole->surface.node_count);
  for (int k = 0; k < whole->surface.node_count && !status; k++)
    local[k] = flesh_rank_part_find(part, whole->surface.nodes[k]);
  if (!status) memcpy(self->may_meet, whole->may_meet, bodies * bodies);
  if (!status)
    status = flesh_contact_surface_renumber(&whole->surface, flesh_mesh_node_count(self->mesh), local, &self->surface);
  free(local);
  return status;
}

static int restrict_to_part(const flesh_effect *whole, const flesh_rank_part *part, const flesh_body *body,
                            flesh_effect **restricted)
{
  const contact *from = whole->data;
  contact *self = malloc(sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a contact effect");
  *self = *from;
  self->mesh = body->mesh;
  self->part_count = body->part_count;
  self->parts = body->parts;
  self->surface = (flesh_contact_surface){0};
  self->places = (flesh_cells){0};
  self->may_meet = NULL;
  self->owns_bonds = 0;
  self->bonded = 1; /* borrows the bonds of the whole: they use indices of surface nodes, which are the same on all ranks */
  self->own = flesh_rank_part_own(part);
  self->numbers = flesh_rank_part_nodes(part);
  const int status = take(from, part, self);
  return flesh_effect_create_after(status, whole->operations, body->mesh, self, restricted);
}

static const flesh_cells *cells_of_ranks(const flesh_effect *whole, int *everywhere)
{
  const contact *self = whole->data;
  *everywhere = 1;
  return &self->places;
}

const flesh_effect_ranks flesh_surface_contact_ranks = {.restrict_to_part = restrict_to_part, .cells = cells_of_ranks};
