/* tet_batches.c: cutting a body's tets into batches, and sharing them out to threads. */
#include "element/tet_batches.h"

#include <math.h>
#include <stdatomic.h>
#include <stdint.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "element/element.h"
#include "element/tet_tiles.h"
#include "material/form.h"

/* Parts whose potentials are summed one by one, however many threads there are. */
enum { PARTS = 64 };

/* One evaluation. */
typedef struct job {
  const flesh_tets *self;
  const flesh_tet_kernel *kernel;
  const flesh_tet_point *at;
  const int *slots;
  double *result; /* residual, or values of the matrix */
  double sums[PARTS][2];
  int round, first_piece;
  _Atomic int status; /* the largest */
} job;

static void note_status(job *j, int status)
{
  int before = atomic_load_explicit(&j->status, memory_order_relaxed);
  while (before < status && !atomic_compare_exchange_weak(&j->status, &before, status)) continue;
}

/* From one tile until another; r and sums as the kernel takes them. */
static void residual_kernel(job *j, int from, int until, double *r, double *sums)
{
  for (int k = from; k < until; k++) note_status(j, j->kernel->residual_kernel(&j->self->batches, k, j->at, r, sums));
}

static void residual_of_piece(void *data, int task)
{
  job *j = data;
  const int *tile = j->self->piece_tile + j->first_piece + task;
  residual_kernel(j, tile[0], tile[1], j->result, NULL);
}

static void hessian_of_piece(void *data, int task)
{
  job *j = data;
  const int *tile = j->self->piece_tile + j->first_piece + task;
  for (int k = tile[0]; k < tile[1]; k++)
    note_status(j, j->kernel->hessian_kernel(&j->self->batches, k, j->at, j->slots, j->result));
}

/* A round's pieces are dealt out in shares to the parts, from a part of its own on, so that few
 * pieces of many rounds go to many parts. */
static int shares_of_round(const flesh_tet_order *order, int round)
{
  int pieces = order->round_first[round + 1] - order->round_first[round];
  return pieces < PARTS ? pieces : PARTS;
}

static void tiles_of_share(const flesh_tets *self, int round, int share, int *from, int *until)
{
  int first = self->order.round_first[round], shares = shares_of_round(&self->order, round);
  int64_t pieces = self->order.round_first[round + 1] - first;
  *from = self->piece_tile[first + pieces * share / shares];
  *until = self->piece_tile[first + pieces * (share + 1) / shares];
}

/* The same sums in the same order as by both_of_share, round after round. */
static void sums_of_part(void *data, int task)
{
  job *j = data;
  const flesh_tet_order *order = &j->self->order;
  for (int c = 0, from, until; c < order->rounds; c++) {
    int share = (task - order->round_first[c] % PARTS + PARTS) % PARTS;
    if (share >= shares_of_round(order, c)) continue;
    tiles_of_share(j->self, c, share, &from, &until);
    residual_kernel(j, from, until, NULL, j->sums[task]);
  }
}

static void both_of_share(void *data, int task)
{
  job *j = data;
  double *sums = j->sums[(j->self->order.round_first[j->round] + task) % PARTS];
  int from, until;
  tiles_of_share(j->self, j->round, task, &from, &until);
  residual_kernel(j, from, until, j->result, sums);
}

static int run_pieces(job *j, flesh_threads *threads, flesh_task *task)
{
  const flesh_tet_order *order = &j->self->order;
  for (int c = 0; c < order->rounds && !j->status; c++) {
    j->first_piece = order->round_first[c];
    flesh_threads_run(threads, order->round_first[c + 1] - j->first_piece, task, j);
  }
  return j->status;
}

int flesh_tets_residual(const flesh_tets *self, const flesh_tet_kernel *kernel,
                           const flesh_tet_point *at, flesh_threads *threads, double *r, double *sums)
{
  job j = {.self = self, .kernel = kernel, .at = at, .result = r};
  if (!sums) return run_pieces(&j, threads, residual_of_piece);
  if (!r) flesh_threads_run(threads, PARTS, sums_of_part, &j);
  for (; r && j.round < self->order.rounds && !j.status; j.round++)
    flesh_threads_run(threads, shares_of_round(&self->order, j.round), both_of_share, &j);
  sums[0] = sums[1] = 0;
  for (int p = 0; p < PARTS; p++)
    for (int k = 0; k < 2; k++) sums[k] += j.sums[p][k];
  return j.status;
}

int flesh_tets_dissipate(const flesh_tets *self, const flesh_tet_kernel *kernel, const flesh_tet_point *at,
                         flesh_threads *threads, double shift_v, double *r, double *phi,
                         double *magnitude)
{
  double sums[2];
  if (!r && shift_v == 0) return FLESH_OK;
  int status = flesh_tets_residual(self, kernel, at, threads, r, shift_v != 0 ? sums : NULL);
  if (status || shift_v == 0) return status;
  *phi += sums[0] / shift_v;
  *magnitude += sums[1] / shift_v;
  return FLESH_OK;
}

int flesh_tets_hessian(const flesh_tets *self, const flesh_tet_kernel *kernel,
                            const flesh_tet_point *at, flesh_threads *threads, const int *slots,
                            double *values)
{
  job j = {.self = self, .kernel = kernel, .at = at, .slots = slots, .result = values};
  return run_pieces(&j, threads, hessian_of_piece);
}

typedef struct rows_job {
  const flesh_tets *self;
  const flesh_tet_kernel *kernel;
  const flesh_tet_point *at;
  float *rows;
  int first_piece;
} rows_job;

static void rows_of_piece(void *data, int task)
{
  const rows_job *j = data;
  const int *tile = j->self->piece_tile + j->first_piece + task;
  for (int k = tile[0]; k < tile[1]; k++)
    j->kernel->rows_kernel(&j->self->batches, k, j->at, j->rows);
}

void flesh_tets_rows(const flesh_tets *self, const flesh_tet_kernel *kernel, const flesh_tet_point *at,
                     flesh_threads *threads, float *rows)
{
  const flesh_tet_order *order = &self->order;
  rows_job j = {.self = self, .kernel = kernel, .at = at, .rows = rows};
  for (int c = 0; c < order->rounds; c++) {
    j.first_piece = order->round_first[c];
    flesh_threads_run(threads, order->round_first[c + 1] - j.first_piece, rows_of_piece, &j);
  }
}

static const flesh_tet_kernels *kernels_for(flesh_instructions instructions, flesh_element element)
{
#ifdef FLESH_HAVE_X86_64
  if (instructions == FLESH_INSTRUCTIONS_AVX512) return &flesh_kernels_avx512[element];
  if (instructions == FLESH_INSTRUCTIONS_AVX2) return &flesh_kernels_avx2[element];
#endif
  (void)instructions;
  return &flesh_kernels_portable[element];
}

/* Cuts n tets of one material into batches and arranges them in `tet` so that lane l takes a run
 * of its own: neighbours, which share nodes, follow one another and do not wait for one another
 * within a batch. Only counts where `first` is NULL. Returns how many batches. */
static int cut_run(const int *run, int n, int lanes, int at, int *tet, int *first)
{
  int batches = (n + lanes - 1) / lanes;
  for (int b = 0; first && b < batches; b++) {
    first[b] = at;
    for (int k = b; k < n; k += batches) tet[at++] = run[k];
  }
  return batches;
}

/* Cuts every piece, sorted by material, into batches of one material each; counts them where `tet`
 * is NULL, else fills it with the tets' new order. Until there are tiles, piece_tile is of batches. */
static int cut_batches(flesh_tets *self, const int *tet_material, int *tet, int *first,
                       int *material)
{
  const flesh_tet_order *order = &self->order;
  int count = 0;
  for (int p = 0; p < order->pieces; p++) {
    self->piece_tile[p] = count;
    for (int k = order->piece_first[p], n; k < order->piece_first[p + 1]; k += n) {
      int own = tet_material ? tet_material[order->tet[k]] : 0;
      if (own >= self->materials) self->materials = own + 1;
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

/* The cells are the mesh's tets in this order. */
static int take_nodes(flesh_tets *self, const flesh_body *body, const int *tet)
{
  flesh_cells given;
  int status = flesh_cells_of_tets(body->mesh, &given);
  if (status) return status;
  const size_t m = (size_t)given.nodes_per_cell;
  int *nodes = flesh_huge_pages_alloc((size_t)given.count * m * sizeof *nodes), *as_element = nodes;
  for (int k = 0; nodes && k < given.count; k++)
    memcpy(nodes + m * (size_t)k, given.nodes + m * (size_t)tet[k], m * sizeof *nodes);
  self->cells = (flesh_cells){.count = given.count, .nodes_per_cell = given.nodes_per_cell, .nodes = nodes};
  flesh_cells_clear(&given);
  if (m == 10) {
    as_element = flesh_malloc((size_t)self->cells.count * m * sizeof *nodes);
    for (int k = 0; as_element && k < self->cells.count; k++)
      flesh_tet10_nodes(body->mesh, tet[k], as_element + m * (size_t)k);
  }
  self->batches.nodes = as_element;
  self->batches.nodes_per_tet = (int)m;
  return nodes && as_element ? FLESH_OK : no_memory(self->cells.count);
}

/* Volumes are negative where the nodes wind the other way. */
static int take_shapes(flesh_tets *self, const flesh_body *body, const int *tet)
{
  const int lanes = self->kernels->lanes, count = self->batches.count;
  const int each = self->batches.shapes_per_tet = flesh_element_shapes(body->mesh);
  double *shapes = flesh_huge_pages_alloc((size_t)count * (size_t)each * 80 * (size_t)lanes);
  if (!shapes) return no_memory(self->cells.count);
  self->batches.shapes = shapes;
  const double *X = flesh_mesh_positions(body->mesh);
  for (int b = 0; b < count; b++)
    for (int l = 0; l < lanes; l++)
      for (int q = 0; q < each; q++) {
        const int first = self->batches.first[b], used = self->batches.first[b + 1] - first;
        const int e = first + (l < used ? l : used - 1);
        const int *node = self->batches.nodes + (size_t)self->batches.nodes_per_tet * (size_t)e;
        double shape[10], *to = shapes + ((size_t)b * (size_t)each + (size_t)q) * 10 * (size_t)lanes;
        if (each == 1) shape[9] = flesh_tet4_shape(X, node, shape);
        else if ((shape[9] = flesh_tet10_shape(X, node, q, shape)) * flesh_tet4_shape(X, node, (double[9]){0}) <= 0)
          return flesh_fail(FLESH_ERR_ARGUMENT, "tet %d is so curved that its J is not positive in the mesh", tet[e]);
        if (l >= used) shape[9] = 0;
        for (int k = 0; k < 10; k++) to[k * lanes + l] = shape[k];
      }
  return FLESH_OK;
}

/* What the element's kernels need beside the shapes of a body with materials. */
static int take_volume_shares(flesh_tets *self, const flesh_body *body, const int *tet)
{
  int held = 0;
  for (int k = 0; k < self->materials && body->materials && self->element != FLESH_ELEMENT_TET10_MEAN; k++)
    if (body->materials[k].incompressible)
      return flesh_fail(FLESH_ERR_ARGUMENT,
                        "the material's poisson is 0.5, which the element %s cannot hold; set body.element to tet10-mean, "
                        "or poisson below 0.5",
                        flesh_element_name(self->element));
  if (self->element != FLESH_ELEMENT_TET10_MEAN || !body->materials) return FLESH_OK;
  flesh_element element;
  int status = flesh_body_find_element(body, &element);
  flesh_volume_share *shares = flesh_malloc((size_t)(self->materials + 1) * sizeof *shares);
  if (!shares) return no_memory(self->cells.count);
  self->batches.volume_shares = shares;
  for (int k = 0; k < self->materials && !status; k++) {
    shares[k] = (flesh_volume_share){.term = FLESH_VOLUME_NONE};
    if (flesh_body_element_of(body, element, k) == FLESH_ELEMENT_TET10_MEAN)
      status = flesh_volume_share_of(&body->materials[k], &shares[k]);
    else if (body->materials[k].incompressible)
      status = flesh_fail(FLESH_ERR_ARGUMENT,
                          "the poisson of material %d is 0.5, which the element tet10 cannot hold; take tet10-mean", k);
    held |= shares[k].held;
  }
  if (status || !held) return status;
  int *numbers = flesh_malloc(((size_t)self->cells.count + 1) * sizeof *numbers);
  if (!numbers) return no_memory(self->cells.count);
  memcpy(numbers, tet, (size_t)self->cells.count * sizeof *numbers);
  self->batches.tet = numbers;
  return FLESH_OK;
}

static int take_masses(flesh_tets *self, const flesh_body *body, const int *tet)
{
  const double *volumes = flesh_mesh_tet_volumes(body->mesh);
  const double parts = self->batches.nodes_per_tet == 4 ? 20 : 420;
  const size_t each = self->batches.masses_per_tet = flesh_element_shapes(body->mesh) > 1 ? 55 : 1;
  double *masses = flesh_malloc(((size_t)self->cells.count * each + 1) * sizeof *masses);
  if (!masses) return no_memory(self->cells.count);
  self->batches.masses = masses;
  for (int k = 0; k < self->cells.count && each > 1; k++)
    flesh_tet10_masses(body->mesh, tet[k], body->density[tet[k]], masses + each * (size_t)k);
  if (each > 1) return FLESH_OK;
  for (int k = 0; k < self->cells.count; k++) masses[k] = body->density[tet[k]] * volumes[tet[k]] / parts;
  return FLESH_OK;
}

/* Tets of TET10 go with those of TET10_MEAN: the mean bears none of their volume term. */
static int find_elements(const flesh_body *body, int tets, flesh_tets *self)
{
  self->material_elements = body->material_elements;
  for (int e = 0; e < tets && body->material_elements; e++) {
    const flesh_element own = body->material_elements[body->tet_material ? body->tet_material[e] : 0];
    if (own != FLESH_ELEMENT_AUTO && (own == FLESH_ELEMENT_TET4) != (self->element == FLESH_ELEMENT_TET4))
      return flesh_fail(FLESH_ERR_ARGUMENT, "the element of tet %d is %s, but the mesh has order %d", e,
                        flesh_element_name(own), flesh_mesh_order(body->mesh));
    if (own == FLESH_ELEMENT_TET10_MEAN) self->element = own;
  }
  return FLESH_OK;
}

int flesh_tets_create(const flesh_body *body, flesh_tets_hold hold, flesh_tets *self)
{
  *self = (flesh_tets){0};
  int status = flesh_instructions_find(body->instructions, &self->instructions);
  if (status) return status;
  status = flesh_body_find_element(body, &self->element);
  if (status) return status;
  int tets = flesh_mesh_tet_count(body->mesh);
  status = find_elements(body, tets, self);
  if (status) return status;
  self->kernels = kernels_for(self->instructions, self->element);
  status = flesh_tet_order_create(body->mesh, body->tet_material, &self->order);
  if (status) return status;
  self->piece_tile = flesh_malloc(((size_t)self->order.pieces + 1) * sizeof(int));
  if (!self->piece_tile) return no_memory(tets);
  int count = cut_batches(self, body->tet_material, NULL, NULL, NULL);
  int *first = flesh_malloc(((size_t)count + 1) * sizeof *first);
  int *material = flesh_malloc(((size_t)count + 1) * sizeof *material);
  int *tet = flesh_malloc(((size_t)tets + 1) * sizeof *tet);
  self->batches = (flesh_batches){.count = count,
                                  .lanes = self->kernels->lanes,
                                  .first = first,
                                  .material = material,
                                  .materials = body->materials};
  if (first && material && tet) {
    cut_batches(self, body->tet_material, tet, first, material);
    status = take_nodes(self, body, tet);
    if (!status)
      status =
          flesh_tiles_create(&self->batches, flesh_mesh_node_count(body->mesh), self->order.pieces, self->piece_tile);
    self->cells.pair_count = status ? 0 : flesh_tiles_blocks(&self->batches.tiles);
    self->cells.pairs = self->batches.tiles.block;
    if (!status) status = hold == FLESH_TETS_MASSES ? take_masses(self, body, tet) : take_shapes(self, body, tet);
    if (!status) status = take_volume_shares(self, body, tet);
  } else {
    status = no_memory(tets);
  }
  flesh_free(tet);
  flesh_free(self->order.tet);
  self->order.tet = NULL;
  return status;
}

void flesh_tets_clear(flesh_tets *self)
{
  if (self->batches.nodes != self->cells.nodes) flesh_free((void *)self->batches.nodes);
  flesh_free((void *)self->batches.volume_shares);
  flesh_free((void *)self->batches.tet);
  flesh_cells_clear(&self->cells);
  flesh_tet_order_clear(&self->order);
  flesh_free((void *)self->batches.first);
  flesh_free((void *)self->batches.material);
  flesh_free((void *)self->batches.shapes);
  flesh_free((void *)self->batches.masses);
  flesh_tiles_clear(&self->batches.tiles);
  flesh_free(self->piece_tile);
  *self = (flesh_tets){0};
}

size_t flesh_tets_memory(const flesh_tets *self)
{
  if (!self->batches.tiles.node_first) return 0; /* none were made */
  const size_t batches = (size_t)self->batches.count, tets = (size_t)self->cells.count;
  const size_t lanes = (size_t)self->kernels->lanes;
  const size_t lists = self->batches.nodes == self->cells.nodes ? 1 : 2, m = (size_t)self->batches.nodes_per_tet;
  return lists * tets * m * sizeof(int) + batches * 2 * sizeof(int) +
         (self->batches.volume_shares ? (size_t)self->materials * sizeof *self->batches.volume_shares : 0) +
         (self->batches.tet ? tets * sizeof *self->batches.tet : 0) + flesh_tiles_memory(&self->batches) +
         (self->batches.shapes ? batches * (size_t)self->batches.shapes_per_tet * 80 * lanes : 0) +
         (self->batches.masses ? tets * (size_t)self->batches.masses_per_tet * sizeof *self->batches.masses : 0) +
         (2 * (size_t)self->order.pieces + (size_t)self->order.rounds) * sizeof(int);
}
