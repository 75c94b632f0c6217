/* surface_separate.c: contact of bodies that intersect when a run begins: patches that are ignored until they are
 * apart, updated from step to step. */
#include <limits.h>
#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "effect/surface_contact.h"

typedef flesh_surface_near near;

/* Distance, over the mean edge, within which patches include their surroundings: how far they may slide along a surface
 * in one step before they meet features that touch. */
static const double room = 1;

/* Activates new patches, which invalidates the pairs found so far. */
static void take_patches(near *self)
{
  self->finder->patches = self->patches.pair_count ? &self->patches : NULL;
  flesh_surface_near_forget(self);
}

static int update(near *self, const double *x)
{
  const flesh_surface_contact *contact = self->contact;
  const int own = self->finder->own;
  self->finder->patches = NULL;
  self->finder->own = INT_MAX; /* every rank finds all patches */
  int status = flesh_contact_patches_update(&self->patches, self->finder, x, contact->law.thickness,
                                            contact->law.thickness + room * contact->surface.mean_edge, self->threads);
  self->finder->own = own;
  take_patches(self);
  return status;
}

static int begin(near *self, const double *x)
{
  self->patches.pair_count = 0;
  const int status = update(self, x);
  self->begun = self->patches.pair_count;
  self->t_apart = NAN;
  return status;
}

/* Computes the contact's energy at x, on a rank that of its own pairs. */
static int find_energy(near *self, const double *x, double *energy)
{
  *energy = 0;
  int status = flesh_surface_near_update_pairs(self, x);
  if (!status) status = flesh_contact_set_evaluate(&self->set, x, self->threads, energy, NULL, NULL);
  return status;
}

/* Recomputes the patches. The energy of pairs that newly belong to patches is lost. */
static int renew(near *self, double t, const double *x, int *changed)
{
  double before, after;
  if (!self->patches.pair_count) return FLESH_OK;
  int status = find_energy(self, x, &before);
  if (!status) status = update(self, x);
  if (!status) status = find_energy(self, x, &after);
  if (status) return status;
  *changed = before != after;
  if (!self->patches.pair_count) self->t_apart = t;
  return FLESH_OK;
}

int flesh_surface_near_follow(near *self, int accepted, double t, const double *x, int *changed)
{
  *changed = 0;
  if (self->patches_known && flesh_surface_near_is_at(self, x, self->x_patches)) return FLESH_OK;
  int status = self->patches_known && accepted ? renew(self, t, x, changed) : begin(self, x);
  self->patches_known = !status;
  flesh_surface_near_keep(self, x, self->x_patches);
  return status;
}

int flesh_surface_near_archive(near *self, flesh_archive *archive)
{
  const int nodes = self->contact->surface.mesh_nodes;
  FLESH_ARCHIVE(archive, self->t_apart);
  flesh_archive_int(archive, &self->begun, 0, INT_MAX);
  flesh_archive_int(archive, &self->patches_known, 0, 1);
  flesh_archive_bytes(archive, self->x_patches, 3 * (size_t)nodes * sizeof *self->x_patches);
  const int status = flesh_contact_patches_archive(&self->patches, archive);
  if (archive->mode == FLESH_ARCHIVE_LOAD) take_patches(self);
  return status;
}

void flesh_surface_near_separation(const flesh_surface_near *self, flesh_separation *separation)
{
  separation->begun += self->begun;
  separation->ignored += self->patches.pair_count;
  separation->t_apart = fmax(separation->t_apart, self->t_apart);
}

int flesh_surface_contact_ignored(const flesh_effect *effect, const double *x, int *count, flesh_patch_pair **pairs)
{
  near *self = NULL;
  int changed;
  *count = 0;
  *pairs = NULL;
  if (effect->operations != &flesh_separating_contact_operations) return FLESH_OK;
  int status = flesh_surface_near_create(effect->data, NULL, &self);
  if (!status) status = flesh_surface_near_follow(self, 0, 0, x, &changed);
  if (!status) {
    *count = self->patches.pair_count;
    *pairs = self->patches.pairs;
    self->patches.pairs = NULL;
  }
  flesh_surface_near_destroy(self);
  return status;
}
