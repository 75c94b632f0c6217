/* pressure_pairs.c: computes the pairs of nodes of a pressure from the faces that it acts on. */
#include "effect/pressure_pairs.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/sort.h"
#include "effect/face_shares.h"

/* Sums of terms of order 1 with a smaller magnitude are rounding errors of 0. */
static const double rounding = 1e-12;

typedef flesh_pressure_wing wing;
typedef flesh_pressure_rim rim_term;
typedef flesh_pressure_pairs pairs;

/* Merges terms of the same nodes, and drops those that cancel. */
static void merge_rim(pairs *self)
{
  int kept = 0;
  flesh_sort(self->rim, (size_t)self->rim_count, sizeof *self->rim, flesh_compare_three_ints);
  for (int i = 0, end; i < self->rim_count; i = end) {
    rim_term sum = self->rim[i];
    for (end = i + 1; end < self->rim_count && !flesh_compare_three_ints(&self->rim[end], &sum); end++)
      sum.e += self->rim[end].e;
    if (fabs(sum.e) > rounding) self->rim[kept++] = sum;
  }
  self->rim_count = kept;
}

static void merge_wings(pairs *self)
{
  int kept = 0;
  flesh_sort(self->wings, (size_t)self->wing_count, sizeof *self->wings, flesh_compare_three_ints);
  for (int i = 0, end; i < self->wing_count; i = end) {
    wing sum = self->wings[i];
    for (end = i + 1; end < self->wing_count && !flesh_compare_three_ints(&self->wings[end], &sum); end++) {
      sum.now += self->wings[end].now;
      sum.lagged += self->wings[end].lagged;
    }
    if (fabs(sum.now) + fabs(sum.lagged) > rounding) self->wings[kept++] = sum;
  }
  self->wing_count = kept;
}

/* Adds a wing for a part of G_kl or h_kl, which change sign if k and l are exchanged. */
static wing *add_wing(pairs *self, int k, int l, int node)
{
  wing *w = &self->wings[self->wing_count++];
  *w = (wing){{k < l ? k : l, k < l ? l : k}, node, 0, 0};
  return w;
}

/* Coefficients of flesh_face_forms for every kind of face, and their numbers of non-zero values. */
typedef struct forms {
  double volume[FLESH_FACE_KINDS][FLESH_FACE_TRIPLES], rim[FLESH_FACE_KINDS][6][FLESH_FACE_PAIRS];
  int triples[FLESH_FACE_KINDS], rims[FLESH_FACE_KINDS];
} forms;

static void make_forms(forms *f)
{
  *f = (forms){0};
  for (int q = 0; q < FLESH_FACE_KINDS; q++) {
    flesh_face_forms(q, f->volume[q], f->rim[q]);
    for (int t = 0; t < FLESH_FACE_TRIPLES; t++) f->triples[q] += fabs(f->volume[q][t]) > rounding;
    for (int e = 0; e < 6 * FLESH_FACE_PAIRS; e++)
      f->rims[q] += fabs(f->rim[q][e / FLESH_FACE_PAIRS][e % FLESH_FACE_PAIRS]) > rounding;
  }
}

static void take_rim(pairs *self, const flesh_face_quarter *faces, const forms *f)
{
  for (const flesh_face_quarter *face = faces; face < faces + self->triangle_count; face++)
    for (int k = 0; k < 6; k++)
      for (int p = 0; p < FLESH_FACE_PAIRS; p++) {
        const int a = face->node[flesh_face_pair[p][0]], b = face->node[flesh_face_pair[p][1]];
        const double e = f->rim[face->quarter][k][p];
        if (fabs(e) > rounding)
          self->rim[self->rim_count++] = (rim_term){face->node[k], a < b ? a : b, a < b ? b : a, a < b ? e : -e};
      }
  merge_rim(self);
}

static void take_volume(pairs *self, const flesh_face_quarter *faces, const forms *f)
{
  for (const flesh_face_quarter *face = faces; face < faces + self->triangle_count; face++)
    for (int t = 0; t < FLESH_FACE_TRIPLES; t++) {
      const double w = f->volume[face->quarter][t];
      for (int i = 0; i < 3 && fabs(w) > rounding; i++) {
        const int k = face->node[flesh_face_triple[t][i]], l = face->node[flesh_face_triple[t][(i + 1) % 3]];
        add_wing(self, k, l, face->node[flesh_face_triple[t][(i + 2) % 3]])->now = k < l ? w : -w;
      }
    }
}

static void take_lagged(pairs *self)
{
  for (const rim_term *t = self->rim; t < self->rim + self->rim_count; t++) {
    if (t->k != t->a) add_wing(self, t->k, t->a, t->b)->lagged = (t->k < t->a ? t->e : -t->e) / 2;
    if (t->k != t->b) add_wing(self, t->k, t->b, t->a)->lagged = (t->k < t->b ? -t->e : t->e) / 2;
  }
}

/* Restricts the rim of a part's faces to that of the whole body. */
static int keep_rim(pairs *self, const pairs *whole, const flesh_rank_part *part)
{
  int found = 0, kept = 0;
  rim_term *known = flesh_malloc(((size_t)whole->rim_count + 1) * sizeof *known);
  if (!known) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the rim of %d triangles", whole->triangle_count);
  for (const rim_term *t = whole->rim; t < whole->rim + whole->rim_count; t++) {
    const int k = flesh_rank_part_find(part, t->k), a = flesh_rank_part_find(part, t->a),
              b = flesh_rank_part_find(part, t->b);
    if (k >= 0 && a >= 0 && b >= 0) known[found++] = (rim_term){k, a < b ? a : b, a < b ? b : a, 0};
  }
  flesh_sort(known, (size_t)found, sizeof *known, flesh_compare_three_ints);
  for (int i = 0; i < self->rim_count; i++)
    if (bsearch(&self->rim[i], known, (size_t)found, sizeof *known, flesh_compare_three_ints)) self->rim[kept++] = self->rim[i];
  self->rim_count = kept;
  flesh_free(known);
  return FLESH_OK;
}

static int take_pairs(pairs *self)
{
  int *nodes = flesh_malloc(((size_t)self->wing_count * 2 + 1) * sizeof *nodes), count = 0;
  self->cells = (flesh_cells){.nodes_per_cell = 2, .nodes = nodes};
  self->first = flesh_malloc(((size_t)self->wing_count + 1) * sizeof *self->first);
  if (!nodes || !self->first) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d pairs of nodes", self->wing_count);
  for (int w = 0; w < self->wing_count; w++) {
    const int *pair = self->wings[w].pair;
    if (count && nodes[2 * count - 2] == pair[0] && nodes[2 * count - 1] == pair[1]) continue;
    self->first[count++] = w;
    nodes[2 * count - 2] = pair[0], nodes[2 * count - 1] = pair[1];
  }
  self->first[count] = self->wing_count;
  self->cells.count = count;
  return FLESH_OK;
}

/* Computes rim, wings and pairs of the faces; `whole` is NULL for a whole body. */
static int take_faces(pairs *self, const flesh_face_quarter *faces, const pairs *whole,
                      const flesh_rank_part *part)
{
  forms f;
  size_t triples = 0, rims = 0;
  make_forms(&f);
  for (int k = 0; k < self->triangle_count; k++)
    triples += (size_t)f.triples[faces[k].quarter], rims += (size_t)f.rims[faces[k].quarter];
  self->rim = flesh_malloc((rims + 1) * sizeof *self->rim);
  if (self->rim) take_rim(self, faces, &f);
  self->wings = flesh_malloc((3 * triples + 2 * (size_t)self->rim_count + 1) * sizeof *self->wings);
  if (!self->rim || !self->wings)
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for a pressure on %d triangles", self->triangle_count);
  take_volume(self, faces, &f);
  take_lagged(self);
  merge_wings(self);
  const int status = take_pairs(self);
  return status || !whole ? status : keep_rim(self, whole, part);
}

int flesh_pressure_pairs_create(const flesh_mesh *mesh, int count, const int *triangles, const pairs *whole,
                                const flesh_rank_part *part, pairs *self)
{
  const size_t corners = 3 * (size_t)count;
  *self = (pairs){.triangle_count = count, .triangles = flesh_malloc((corners + 1) * sizeof *triangles)};
  flesh_face_quarter *faces = flesh_malloc(((size_t)count + 1) * sizeof *faces);
  int status = faces && self->triangles ? flesh_face_quarters(mesh, count, triangles, faces)
                                        : flesh_fail(FLESH_ERR_MEMORY, "no memory for %d triangles", count);
  if (!status) {
    memcpy(self->triangles, triangles, corners * sizeof *triangles);
    status = take_faces(self, faces, whole, part);
  }
  flesh_free(faces);
  return status;
}

void flesh_pressure_pairs_clear(pairs *self)
{
  flesh_cells_clear(&self->cells);
  flesh_free(self->triangles);
  flesh_free(self->first);
  flesh_free(self->wings);
  flesh_free(self->rim);
}

size_t flesh_pressure_pairs_memory(const pairs *self)
{
  return ((size_t)self->triangle_count + (size_t)self->cells.count) * 3 * sizeof(int) +
         (size_t)self->wing_count * sizeof *self->wings + (size_t)self->rim_count * sizeof *self->rim;
}
