/* contact_patches.c: keeps the patches of surfaces that intersect. */
#include "geometry/contact_patches.h"

#include <limits.h>
#include <stdlib.h>

#include "base/error.h"
#include "base/memory.h"

int flesh_contact_patches_create(const flesh_contact_surface *s, flesh_contact_patches *self)
{
  *self = (flesh_contact_patches){.surface = s};
  const size_t all = (size_t)s->face_count + (size_t)s->edge_count + (size_t)s->node_count;
  self->face_patch = malloc((all + 1) * sizeof *self->face_patch);
  if (!self->face_patch) return flesh_fail(FLESH_ERR_MEMORY, "no memory for patches of %d faces", s->face_count);
  self->edge_patch = self->face_patch + s->face_count;
  self->node_patch = self->edge_patch + s->edge_count;
  for (size_t k = 0; k < all; k++) self->face_patch[k] = -1;
  return FLESH_OK;
}

void flesh_contact_patches_clear(flesh_contact_patches *self)
{
  free(self->face_patch); /* edge_patch and node_patch share this allocation */
  flesh_free(self->pairs);
  *self = (flesh_contact_patches){0};
}

int flesh_contact_patches_reserve(flesh_contact_patches *self, int pairs)
{
  return flesh_grow_to(&self->pairs, sizeof *self->pairs, pairs, &self->pair_room)
             ? FLESH_OK
             : flesh_fail(FLESH_ERR_MEMORY, "no memory for %d pairs of patches", pairs);
}

/* Gives a node or edge the patch that all of its faces share, else -1; called once per face. */
static void take(int *patch, int of_face, int first)
{
  *patch = first ? of_face : *patch == of_face ? of_face : -1;
}

void flesh_contact_patches_label(flesh_contact_patches *self)
{
  const flesh_contact_surface *s = self->surface;
  enum { UNSEEN = INT_MIN };
  for (int k = 0; k < s->edge_count; k++) self->edge_patch[k] = UNSEEN;
  for (int k = 0; k < s->node_count; k++) self->node_patch[k] = UNSEEN;
  for (int k = 0; k < 3 * s->face_count; k++) {
    int *node = self->node_patch + s->node_place[s->faces[k]], *edge = self->edge_patch + s->face_edges[k];
    take(node, self->face_patch[k / 3], *node == UNSEEN);
    take(edge, self->face_patch[k / 3], *edge == UNSEEN);
  }
}

/* Whether loaded patches can belong to this surface. */
static int fits(const flesh_contact_patches *self)
{
  for (int f = 0; f < self->surface->face_count; f++)
    if (self->face_patch[f] < -1 || self->face_patch[f] >= self->count) return 0;
  for (int k = 0; k < self->pair_count; k++)
    for (int end = 0; end < 2; end++)
      if (self->pairs[k].patches[end] < 0 || self->pairs[k].patches[end] >= self->count ||
          self->pairs[k].bodies[end] < 0 || self->pairs[k].bodies[end] >= self->surface->body_count)
        return 0;
  return 1;
}

int flesh_contact_patches_archive(flesh_contact_patches *self, flesh_archive *archive)
{
  int pairs = self->pair_count;
  flesh_archive_int(archive, &pairs, 0, INT_MAX / (int)sizeof *self->pairs);
  flesh_archive_int(archive, &self->count, 0, self->surface->face_count);
  if (archive->wrong) return FLESH_OK;
  const int status = flesh_contact_patches_reserve(self, pairs);
  if (status) return status;
  if (pairs) {
    flesh_archive_bytes(archive, self->face_patch, (size_t)self->surface->face_count * sizeof *self->face_patch);
    flesh_archive_bytes(archive, self->pairs, (size_t)pairs * sizeof *self->pairs);
  }
  self->pair_count = archive->wrong ? 0 : pairs;
  if (archive->mode != FLESH_ARCHIVE_LOAD || archive->wrong) return FLESH_OK;
  if (!fits(self)) {
    archive->wrong = 1;
    self->pair_count = self->count = 0;
  } else flesh_contact_patches_label(self);
  return FLESH_OK;
}
