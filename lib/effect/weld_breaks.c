/* weld_breaks.c: which segments of a weld break, and how much energy that releases. */
#include "effect/weld_breaks.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "math/area.h"
#include "math/mat3.h"

enum { RELEASED, FIRST_T, FIRST_PLACE, OF_ALL = FIRST_PLACE + 3 }; /* variables after those of the parts */

void flesh_weld_breaks_begin(flesh_weld_breaks *self, const int triangle[3])
{
  if (self->failed) return;
  self->failed = !flesh_grow_to(&self->parts, sizeof *self->parts, self->count + 2, &self->room);
  if (self->failed) return;
  flesh_weld_part *part = &self->parts[self->count];
  *part = (flesh_weld_part){.begin = self->entries};
  memcpy(part->triangle, triangle, sizeof part->triangle);
}

static int make_room(flesh_weld_breaks *self, int count)
{
  int room = self->entry_room; /* nodes and weights have the same room */
  self->failed = !flesh_grow_to(&self->nodes, sizeof *self->nodes, self->entries + count, &room) ||
                 !flesh_grow_to(&self->weights, sizeof *self->weights, self->entries + count, &self->entry_room);
  return !self->failed;
}

void flesh_weld_breaks_add(flesh_weld_breaks *self, int count, const int *nodes, const double *weights, double area,
                           const double place[3])
{
  if (self->failed || !make_room(self, count)) return;
  flesh_weld_part *part = &self->parts[self->count];
  part->area += area;
  for (int c = 0; c < 3; c++) part->middle[c] += area * place[c];
  for (int a = 0; a < count; a++) {
    int k = part->begin;
    while (k < self->entries && self->nodes[k] != nodes[a]) k++;
    if (k == self->entries) {
      self->nodes[k] = nodes[a];
      self->weights[k] = 0;
      self->entries++;
    }
    self->weights[k] += area * weights[a];
  }
}

void flesh_weld_breaks_end(flesh_weld_breaks *self)
{
  if (self->failed) return;
  flesh_weld_part *part = &self->parts[self->count];
  for (int k = part->begin; k < self->entries; k++) self->weights[k] /= part->area;
  for (int c = 0; c < 3; c++) part->middle[c] /= part->area;
  self->area += part->area;
  self->parts[++self->count].begin = self->entries;
}

int flesh_weld_breaks_finish(const flesh_weld_breaks *self)
{
  return self->failed ? flesh_fail(FLESH_ERR_MEMORY, "no memory for the %d parts of a weld", self->count) : FLESH_OK;
}

int flesh_weld_breaks_restrict(const flesh_weld_breaks *whole, const flesh_rank_part *part, flesh_weld_breaks *self)
{
  const size_t parts = (size_t)whole->count + 1, entries = (size_t)whole->entries + 1;
  *self = *whole;
  self->room = (int)parts;
  self->entry_room = (int)entries;
  self->parts = malloc(parts * sizeof *self->parts);
  self->nodes = malloc(entries * sizeof *self->nodes);
  self->weights = malloc(entries * sizeof *self->weights);
  self->failed = !self->parts || !self->nodes || !self->weights;
  if (self->failed) return flesh_weld_breaks_finish(self);
  if (whole->count) memcpy(self->parts, whole->parts, parts * sizeof *self->parts);
  for (int k = 0; k < whole->entries; k++) {
    self->nodes[k] = flesh_rank_part_find(part, whole->nodes[k]);
    self->weights[k] = whole->weights[k];
  }
  for (int k = 0; k < 3 * whole->count; k++)
    self->parts[k / 3].triangle[k % 3] = flesh_rank_part_find(part, whole->parts[k / 3].triangle[k % 3]);
  return FLESH_OK;
}

void flesh_weld_breaks_clear(flesh_weld_breaks *self)
{
  flesh_free(self->parts);
  flesh_free(self->nodes);
  flesh_free(self->weights);
  *self = (flesh_weld_breaks){0};
}

size_t flesh_weld_breaks_memory(const flesh_weld_breaks *self)
{
  return (size_t)self->room * sizeof *self->parts +
         (size_t)self->entry_room * (sizeof *self->nodes + sizeof *self->weights);
}

int flesh_weld_breaks_variables(const flesh_weld_breaks *self) { return self->count + OF_ALL; }

/* Returns the effective traction of a part at x, Pa, without compression. */
static double traction_of(const flesh_weld_breaks *self, int k, const double *x)
{
  const flesh_weld_part *part = &self->parts[k];
  const double *origin = x + 3 * (size_t)part->triangle[0];
  double n[3], t[3] = {0};
  for (int i = part->begin; i < self->parts[k + 1].begin; i++)
    for (int c = 0; c < 3; c++)
      t[c] -= self->stiffness * self->weights[i] * (x[3 * (size_t)self->nodes[i] + (size_t)c] - origin[c]);
  flesh_area_vector_at(x, part->triangle, n);
  const double length = sqrt(flesh_vec3_dot(n, n)), normal = length > 0 ? flesh_vec3_dot(t, n) / length : 0;
  for (int c = 0; c < 3 && normal < 0; c++) t[c] -= normal * n[c] / length;
  return sqrt(flesh_vec3_dot(t, t));
}

static int is_broken(const flesh_weld_breaks *self, const double *internal)
{
  for (int k = 0; k < self->count; k++)
    if (internal[k] != 0) return 1;
  return 0;
}

int flesh_weld_breaks_update(const flesh_weld_breaks *self, const flesh_ties *ties, double t, const double *x,
                             double *internal)
{
  double *of_all = internal + self->count, largest = 0;
  const int first = !is_broken(self, internal);
  int broken = 0;
  for (int k = 0; k < self->count; k++) {
    const double traction = internal[k] != 0 ? 0 : traction_of(self, k, x);
    if (!(traction > self->limit)) continue;
    internal[k] = 1;
    of_all[RELEASED] += flesh_ties_group_energy(ties, k, x);
    broken++;
    if (!first || !(traction > largest)) continue;
    largest = traction;
    of_all[FIRST_T] = t;
    memcpy(of_all + FIRST_PLACE, self->parts[k].middle, sizeof self->parts[k].middle);
  }
  return broken;
}

void flesh_weld_breaks_report(const flesh_weld_breaks *self, const double *x, const double *internal, double values[3])
{
  double area = 0, largest = 0;
  for (int k = 0; k < self->count; k++) {
    if (internal && internal[k] != 0) area += self->parts[k].area;
    else largest = fmax(largest, traction_of(self, k, x));
  }
  values[0] = area / self->area;
  values[1] = internal ? internal[self->count + RELEASED] : 0;
  values[2] = largest;
}

void flesh_weld_breaks_tell(const flesh_weld_breaks *self, const double *internal, size_t size, char *text)
{
  const double *of_all = internal + self->count, *place = of_all + FIRST_PLACE;
  double area = 0;
  *text = 0;
  if (!is_broken(self, internal)) return;
  for (int k = 0; k < self->count; k++) area += internal[k] != 0 ? self->parts[k].area : 0;
  const double toughness = area * self->limit * self->limit / (2 * self->stiffness), ratio = of_all[RELEASED] / toughness;
  char late[100] = "";
  if (ratio > 2)
    snprintf(late, sizeof late, ", %.3g times the toughness of that area: shorter steps or a finer mesh release less", ratio);
  snprintf(text, size, "%.3g %% of %.4g m^2 broke, first at t = %.6g s at (%.4g, %.4g, %.4g) of the rest shape; %.4g J "
           "were released%s", 100 * area / self->area, self->area, of_all[FIRST_T], place[0], place[1], place[2],
           of_all[RELEASED], late);
}
