/* tet_batches.c: splits a body's tets into batches. */
#include "element/tet_batches.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "base/stop.h"
#include "element/element.h"
#include "element/tet_tiles.h"
#include "mesh/mesh.h"

static const flesh_tet_kernels *kernels_for(flesh_instructions instructions, flesh_element element)
{
#ifdef FLESH_HAVE_X86_64
  if (instructions == FLESH_INSTRUCTIONS_AVX512) return &flesh_kernels_avx512[element];
  if (instructions == FLESH_INSTRUCTIONS_AVX2) return &flesh_kernels_avx2[element];
#endif
  (void)instructions;
  return &flesh_kernels_portable[element];
}

/* Splits n tets of one material into batches and arranges them in `tet` such that each lane takes a run of its own:
 * neighbours, which share nodes, come one after the other in a lane and do not wait for each other within a batch. If
 * `first` is NULL, only counts. Returns the number of batches. */
static int cut_run(const int *run, int n, int lanes, int at, int *tet, int *first)
{
  int batches = (n + lanes - 1) / lanes;
  for (int b = 0; first && b < batches; b++) {
    first[b] = at;
    for (int k = b; k < n; k += batches) tet[at++] = run[k];
  }
  return batches;
}

/* Splits every piece, sorted by material, into batches of one material each. Counts them if `tet` is NULL, else fills
 * it with the tets' new order. Until there are tiles, piece_tile counts batches. */
static int cut_batches(flesh_tet_group *self, const int *tet_material, int *materials, int *tet, int *first,
                       int *material)
{
  const flesh_tet_order *order = &self->order;
  int count = 0;
  for (int p = 0; p < order->pieces; p++) {
    self->piece_tile[p] = count;
    for (int k = order->piece_first[p], n; k < order->piece_first[p + 1]; k += n) {
      int own = tet_material ? tet_material[order->tet[k]] : 0;
      if (own >= *materials) *materials = own + 1;
      for (n = 1; k + n < order->piece_first[p + 1]; n++)
        if (tet_material && tet_material[order->tet[k + n]] != own) break;
      int batches =
          cut_run(order->tet + k, n, self->kernels->lanes, k, tet, tet ? first + count : NULL);
      for (int b = 0; tet && b < batches; b++) material[count + b] = own;
      count += batches;
    }
  }
  self->piece_tile[order->pieces] = count;
  if (tet) first[count] = order->piece_first[order->pieces];
  return count;
}

static int no_memory(int tets) { return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d elements", tets); }

/* Copies the cells of the mesh's tets, `given` in the mesh's order, into the order of the batches. */
static int take_nodes(flesh_tets *self, flesh_tet_group *group, const flesh_mesh *mesh, const flesh_cells *given,
                      const int *tet)
{
  const size_t all = (size_t)self->cells.nodes_per_cell, m = (size_t)group->batches.nodes_per_tet;
  int *to = (int *)self->cells.nodes + all * (size_t)group->first, *own = to;
  for (int k = 0; k < group->tets; k++)
    memcpy(to + all * (size_t)k, given->nodes + all * (size_t)tet[k], all * sizeof *to);
  if (all > 4) own = flesh_malloc((size_t)group->tets * m * sizeof *own);
  group->batches.nodes = own;
  for (int k = 0; own && m == 10 && k < group->tets; k++) flesh_tet10_nodes(mesh, tet[k], own + 10 * (size_t)k);
  for (int k = 0; own && m < all && k < group->tets; k++)
    memcpy(own + m * (size_t)k, to + all * (size_t)k, m * sizeof *own);
  return own ? FLESH_OK : no_memory(group->tets);
}

/* Replaces the gradients and the volume by g_1.a, g_2.a, g_3.a and the volume, for a fibre of direction a. */
static void project_shape(const double a[3], double shape[10])
{
  for (int k = 0; k < 3; k++)
    shape[k] = shape[3 * k] * a[0] + shape[3 * k + 1] * a[1] + shape[3 * k + 2] * a[2];
  shape[3] = fabs(shape[9]);
}

/* Computes the shapes of the tets; volumes are negative for the opposite winding. With `directions` [3 * the mesh's
 * tets] of fibres each tet has four numbers, else ten. */
static int take_shapes(flesh_tet_group *self, const flesh_body *body, const int *tet, const double *directions)
{
  const int lanes = self->kernels->lanes, count = self->batches.count, numbers = directions ? 4 : 10;
  const int each = self->batches.nodes_per_tet == 4 ? 1 : flesh_element_shapes(body->mesh);
  double *shapes = flesh_huge_pages_alloc((size_t)count * (size_t)(each * numbers * lanes) * sizeof *shapes);
  if (!shapes) return no_memory(self->tets);
  *(directions ? &self->batches.fibres : &self->batches.shapes) = shapes;
  self->batches.shapes_per_tet = each;
  const double *X = flesh_mesh_positions(body->mesh);
  for (int b = 0; b < count; b++)
    for (int l = 0; l < lanes; l++)
      for (int q = 0; q < each; q++) {
        const int first = self->batches.first[b], used = self->batches.first[b + 1] - first;
        const int e = first + (l < used ? l : used - 1);
        const int *node = self->batches.nodes + (size_t)self->batches.nodes_per_tet * (size_t)e;
        double shape[10], *to = shapes + ((size_t)b * (size_t)each + (size_t)q) * (size_t)(numbers * lanes);
        if (each == 1) shape[9] = flesh_tet4_shape(X, node, shape);
        else if ((shape[9] = flesh_tet10_shape(X, node, q, shape)) * flesh_tet4_shape(X, node, (double[9]){0}) <= 0)
          return flesh_fail(FLESH_ERR_ARGUMENT, "tet %d is so curved that its J is not positive in the mesh", tet[e]);
        if (l >= used) shape[9] = 0;
        if (directions) project_shape(directions + 3 * (size_t)tet[e], shape);
        for (int k = 0; k < numbers; k++) to[k * lanes + l] = shape[k];
      }
  return FLESH_OK;
}

/* Returns marks of the materials of the group's tets, new; NULL without memory. */
static uint8_t *find_materials(const flesh_tets *self, const flesh_tet_group *group)
{
  uint8_t *found = flesh_calloc((size_t)self->materials + 1, 1);
  for (int b = 0; found && b < group->batches.count; b++) found[group->batches.material[b]] = 1;
  return found;
}

/* Finds the volume shares of the group's materials for tet10-mean, and refuses poisson 0.5 for other elements; `found`
 * marks the group's materials. */
static int take_volume_shares(const flesh_tets *self, flesh_tet_group *group, const flesh_body *body, const int *tet,
                              const uint8_t *found)
{
  const int size = group->batches.nodes_per_tet;
  int status = FLESH_OK, held = 0;
  for (int k = 0; k < self->materials && body->materials && !status; k++) {
    const flesh_element own = flesh_body_element_of(body, k, size);
    if (found[k] && body->materials[k].incompressible && own != FLESH_ELEMENT_TET10_MEAN)
      status = flesh_fail(FLESH_ERR_ARGUMENT,
                          "the material's poisson is 0.5, which the element %s cannot hold; set body.element to "
                          "tet10-mean, or poisson below 0.5",
                          flesh_element_name(own));
  }
  if (status || group->element != FLESH_ELEMENT_TET10_MEAN || !body->materials) return status;
  flesh_volume_share *shares = flesh_malloc((size_t)(self->materials + 1) * sizeof *shares);
  if (!shares) return no_memory(group->tets);
  group->batches.volume_shares = shares;
  for (int k = 0; k < self->materials && !status; k++) {
    shares[k] = (flesh_volume_share){.term = FLESH_VOLUME_NONE};
    if (found[k] && flesh_body_element_of(body, k, size) == FLESH_ELEMENT_TET10_MEAN)
      status = flesh_volume_share_of(&body->materials[k], &shares[k]);
    held |= shares[k].held;
  }
  if (status || !held) return status;
  int *numbers = flesh_malloc(((size_t)group->tets + 1) * sizeof *numbers);
  if (!numbers) return no_memory(group->tets);
  memcpy(numbers, tet, (size_t)group->tets * sizeof *numbers);
  group->batches.tet = numbers;
  return FLESH_OK;
}

static int take_masses(flesh_tet_group *self, const flesh_body *body, const int *tet)
{
  const double *volumes = flesh_mesh_tet_volumes(body->mesh);
  const int ten = self->batches.nodes_per_tet == 10;
  const size_t each = self->batches.masses_per_tet = ten && flesh_element_shapes(body->mesh) > 1 ? 55 : 1;
  double *masses = flesh_malloc(((size_t)self->tets * each + 1) * sizeof *masses);
  if (!masses) return no_memory(self->tets);
  self->batches.masses = masses;
  for (int k = 0; k < self->tets && each > 1; k++)
    flesh_tet10_masses(body->mesh, tet[k], body->density[tet[k]], masses + each * (size_t)k);
  if (each > 1) return FLESH_OK;
  for (int k = 0; k < self->tets; k++) masses[k] = body->density[tet[k]] * volumes[tet[k]] / (ten ? 420 : 20);
  return FLESH_OK;
}

/* Finds the group's element. Tets of TET10 join those of TET10_MEAN with a share of 0. */
static int find_element(const flesh_body *body, int count, const int *chosen, int size, flesh_element *element)
{
  *element = flesh_body_element_of(body, -1, size);
  for (int k = 0; k < count && body->material_elements; k++) {
    const int e = chosen ? chosen[k] : k;
    const flesh_element own = body->material_elements[body->tet_material ? body->tet_material[e] : 0];
    if (own != FLESH_ELEMENT_AUTO && (own == FLESH_ELEMENT_TET4) != (size == 4))
      return flesh_fail(FLESH_ERR_ARGUMENT, "the element of tet %d is %s, but it has %d nodes", e,
                        flesh_element_name(own), size);
    if (own == FLESH_ELEMENT_TET10_MEAN) *element = own;
  }
  return FLESH_OK;
}

/* Makes the group of the tets `chosen` [group->tets] (NULL: all); its members `first`, `tets`, `first_slot` and
 * `batches.nodes_per_tet` are set already. */
static int make_group(flesh_tets *self, flesh_tet_group *group, const flesh_body *body, flesh_tets_hold hold,
                      const flesh_cells *given, const int *chosen, const double *directions)
{
  const int tets = group->tets, size = group->batches.nodes_per_tet;
  int status = find_element(body, tets, chosen, size, &group->element);
  if (status) return status;
  group->kernels = kernels_for(self->instructions, group->element);
  status = flesh_tet_order_create(body->mesh, tets, chosen, body->tet_material, &group->order);
  if (status) return status;
  group->piece_tile = flesh_malloc(((size_t)group->order.pieces + 1) * sizeof(int));
  if (!group->piece_tile) return no_memory(tets);
  int count = cut_batches(group, body->tet_material, &self->materials, NULL, NULL, NULL);
  int *first = flesh_malloc(((size_t)count + 1) * sizeof *first);
  int *material = flesh_malloc(((size_t)count + 1) * sizeof *material);
  int *tet = flesh_malloc(((size_t)tets + 1) * sizeof *tet);
  uint8_t *found = NULL;
  group->batches = (flesh_batches){.count = count,
                                   .lanes = group->kernels->lanes,
                                   .nodes_per_tet = size,
                                   .first = first,
                                   .material = material,
                                   .materials = body->materials};
  status = first && material && tet ? FLESH_OK : no_memory(tets);
  if (!status) {
    cut_batches(group, body->tet_material, &self->materials, tet, first, material);
    found = find_materials(self, group);
    status = found ? take_nodes(self, group, body->mesh, given, tet) : no_memory(tets);
  }
  if (!status) status = flesh_stop_ask_before((size_t)tets);
  if (!status)
    status = flesh_tiles_create(&group->batches, body->mesh->nodes, group->order.pieces, group->piece_tile);
  if (!status)
    status = hold == FLESH_TETS_MASSES ? take_masses(group, body, tet) : take_shapes(group, body, tet, directions);
  if (!status && hold != FLESH_TETS_FIBRES) status = take_volume_shares(self, group, body, tet, found);
  flesh_free(found);
  flesh_free(tet);
  flesh_free(group->order.tet);
  group->order.tet = NULL;
  return status;
}

/* Joins the pairs of all groups, numbered as for cells of ten nodes. */
static int join_pairs(flesh_tets *self)
{
  int *pairs = flesh_malloc(((size_t)self->cells.pair_count + 1) * sizeof *pairs);
  if (!pairs) return no_memory(self->cells.count);
  self->cells.pairs = pairs;
  for (int g = 0; g < self->group_count; g++) {
    const flesh_tet_group *group = &self->groups[g];
    const int m = group->batches.nodes_per_tet, each = m * (m + 1) / 2;
    for (int k = 0; k < flesh_tiles_blocks(&group->batches.tiles); k++) {
      const int tet = group->batches.tiles.block[k] / each;
      int a = 0, b = group->batches.tiles.block[k] % each;
      for (; b >= m - a; a++) b -= m - a;
      *pairs++ = 55 * (group->first + tet) + 10 * a - a * (a - 1) / 2 + b;
    }
  }
  return FLESH_OK;
}

/* Returns the tets (of `choice`, NULL: all) of four nodes followed by the others, new; counts [2] of both. */
static int *sort_by_size(const flesh_mesh *mesh, const flesh_tets_choice *choice, int *counts)
{
  const int tets = choice ? choice->count : mesh->tets;
  int *sorted = flesh_malloc(((size_t)tets + 1) * sizeof *sorted), at[2] = {0};
  counts[0] = counts[1] = 0;
  for (int k = 0; k < tets; k++) counts[flesh_mesh_is_quadratic(mesh, choice && choice->tets ? choice->tets[k] : k)]++;
  at[1] = counts[0];
  for (int k = 0; sorted && k < tets; k++) {
    const int e = choice && choice->tets ? choice->tets[k] : k;
    sorted[at[flesh_mesh_is_quadratic(mesh, e)]++] = e;
  }
  return sorted;
}

static int make_groups(flesh_tets *self, const flesh_body *body, flesh_tets_hold hold, const flesh_cells *given,
                       const flesh_tets_choice *choice)
{
  const flesh_mesh *mesh = body->mesh;
  const int mixed = mesh->linear > 0, tets = choice ? choice->count : mesh->tets, sort = mixed || tets < mesh->tets;
  int counts[2] = {mesh->edge_nodes ? 0 : tets, mesh->edge_nodes ? tets : 0}, *nodes;
  int *sorted = sort ? sort_by_size(mesh, choice, counts) : NULL;
  int status = sort && !sorted ? no_memory(tets) : FLESH_OK;
  self->cells = (flesh_cells){.count = tets, .nodes_per_cell = given->nodes_per_cell, .padded = given->padded};
  self->cells.nodes = nodes = flesh_huge_pages_alloc((size_t)tets * (size_t)given->nodes_per_cell * sizeof *nodes);
  if (!nodes) status = no_memory(tets);
  for (int g = 0; g < 2 && !status; g++) {
    if (!counts[g]) continue;
    flesh_tet_group *group = &self->groups[self->group_count++];
    group->first = g ? counts[0] : 0;
    group->tets = counts[g];
    group->first_slot = self->cells.pair_count;
    group->batches.nodes_per_tet = g ? 10 : 4;
    status = make_group(self, group, body, hold, given, sorted ? sorted + group->first : NULL,
                        choice ? choice->directions : NULL);
    if (!status) self->cells.pair_count += flesh_tiles_blocks(&group->batches.tiles);
    if (self->group_count == 1 || group->element == FLESH_ELEMENT_TET10_MEAN) self->element = group->element;
  }
  if (!status && mixed) status = join_pairs(self);
  else if (!status) self->cells.pairs = self->groups[0].batches.tiles.block;
  flesh_free(sorted);
  return status;
}

static int create(const flesh_body *body, flesh_tets_hold hold, const flesh_tets_choice *choice, flesh_tets *self)
{
  *self = (flesh_tets){.given = body->element, .material_elements = body->material_elements};
  flesh_cells given = {0};
  int status = flesh_instructions_find(body->instructions, &self->instructions);
  if (!status) status = flesh_cells_of_tets(body->mesh, &given);
  if (status) return status;
  status = make_groups(self, body, hold, &given, choice);
  flesh_cells_clear(&given);
  return status;
}

int flesh_tets_create(const flesh_body *body, flesh_tets_hold hold, flesh_tets *self)
{
  return create(body, hold, NULL, self);
}

int flesh_tets_create_fibres(const flesh_body *body, const flesh_tets_choice *choice, flesh_tets *self)
{
  return create(body, FLESH_TETS_FIBRES, choice, self);
}

static void clear_group(flesh_tet_group *group, const int *cells)
{
  if (group->batches.nodes != cells) flesh_free((void *)group->batches.nodes);
  flesh_free((void *)group->batches.volume_shares);
  flesh_free((void *)group->batches.tet);
  flesh_tet_order_clear(&group->order);
  flesh_free((void *)group->batches.first);
  flesh_free((void *)group->batches.material);
  flesh_free((void *)group->batches.shapes);
  flesh_free((void *)group->batches.fibres);
  flesh_free((void *)group->batches.masses);
  flesh_tiles_clear(&group->batches.tiles);
  flesh_free(group->piece_tile);
}

void flesh_tets_clear(flesh_tets *self)
{
  if (self->cells.padded) flesh_free((void *)self->cells.pairs); /* joined from those of the groups */
  for (int g = 0; g < self->group_count; g++) clear_group(&self->groups[g], self->cells.nodes);
  flesh_cells_clear(&self->cells);
  *self = (flesh_tets){0};
}

int flesh_tets_hold_means(const flesh_tets *self)
{
  int held = 0;
  for (int g = 0; g < self->group_count; g++) held |= self->groups[g].batches.tet != NULL;
  return held;
}

static size_t memory_of_group(const flesh_tets *self, const flesh_tet_group *group)
{
  const flesh_batches *own = &group->batches;
  const size_t batches = (size_t)own->count, tets = (size_t)group->tets, lanes = (size_t)group->kernels->lanes;
  const size_t m = own->nodes == self->cells.nodes ? 0 : (size_t)own->nodes_per_tet;
  return tets * m * sizeof(int) + batches * 2 * sizeof(int) +
         (own->volume_shares ? (size_t)self->materials * sizeof *own->volume_shares : 0) +
         (own->tet ? tets * sizeof *own->tet : 0) + flesh_tiles_memory(own) +
         (own->shapes ? batches * (size_t)own->shapes_per_tet * 80 * lanes : 0) +
         (own->fibres ? batches * (size_t)own->shapes_per_tet * 32 * lanes : 0) +
         (own->masses ? tets * (size_t)own->masses_per_tet * sizeof *own->masses : 0) +
         (2 * (size_t)group->order.pieces + (size_t)group->order.colours) * sizeof(int);
}

size_t flesh_tets_memory(const flesh_tets *self)
{
  size_t bytes = (size_t)self->cells.count * (size_t)self->cells.nodes_per_cell * sizeof(int);
  if (self->cells.padded) bytes += (size_t)self->cells.pair_count * sizeof(int);
  for (int g = 0; g < self->group_count; g++) bytes += memory_of_group(self, &self->groups[g]);
  return bytes;
}

static int differ(const void *a, const void *b, size_t bytes) { return !a != !b || (a && memcmp(a, b, bytes) != 0); }

/* Compares two groups; of the materials it compares the first `materials`. */
static int groups_are_same(const flesh_tet_group *group, const flesh_tet_group *other, int materials)
{
  const flesh_batches *a = &group->batches, *b = &other->batches;
  if (group->tets != other->tets || group->kernels != other->kernels || a->count != b->count ||
      a->nodes_per_tet != b->nodes_per_tet || a->shapes_per_tet != b->shapes_per_tet)
    return 0;
  const size_t count = (size_t)a->count, tets = (size_t)group->tets, named = (size_t)materials;
  const size_t shapes = count * (size_t)(a->shapes_per_tet * a->lanes) * sizeof(double);
  return !differ(a->first, b->first, (count + 1) * sizeof *a->first) && !differ(a->fibres, b->fibres, 4 * shapes) &&
         !differ(a->material, b->material, count * sizeof *a->material) && !differ(a->shapes, b->shapes, 10 * shapes) &&
         !differ(a->nodes, b->nodes, tets * (size_t)a->nodes_per_tet * sizeof *a->nodes) &&
         !differ(a->masses, b->masses, tets * (size_t)a->masses_per_tet * sizeof *a->masses) &&
         !differ(a->materials, b->materials, named * sizeof *a->materials) &&
         !differ(a->volume_shares, b->volume_shares, named * sizeof *a->volume_shares);
}

int flesh_tets_are_same(const flesh_tets *self, const flesh_tets *others, int with_materials)
{
  int same = self->group_count == others->group_count && self->materials == others->materials;
  for (int g = 0; g < self->group_count && same; g++)
    same = groups_are_same(&self->groups[g], &others->groups[g], with_materials ? self->materials : 0);
  return same;
}
