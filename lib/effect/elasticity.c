/* elasticity.c: V(x) = sum over linear tets of volume * psi(F), its gradient and (projected)
 * Hessian: the tets in batches for a kernel, piece by piece and colour by colour (tet_order.h). */
#include <math.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "effect/effect.h"
#include "effect/elasticity_kernel.h"
#include "effect/element.h"
#include "effect/tet_order.h"

/* Parts whose energies are summed one by one, however many threads there are. */
enum { PARTS = 64 };

typedef struct elasticity {
  flesh_cells cells; /* in the order of the batches */
  flesh_batches batches;
  const flesh_elasticity_kernel *kernel;
  flesh_instructions instructions;
  flesh_tet_order order; /* without .tet */
  int *piece_batch;      /* [pieces+1] first batch of each piece */
} elasticity;

static const flesh_cells *elasticity_cells(const flesh_effect *effect)
{
  const elasticity *self = effect->data;
  return &self->cells;
}

/* One evaluation. */
typedef struct job {
  const elasticity *self;
  const double *x;
  const flesh_shift *shift;
  const int *slots;
  double *result; /* residual, or values of the matrix */
  double sums[PARTS][2];
  int colour, first_piece;
  _Atomic int status; /* the largest */
} job;

static void note_status(job *j, int status)
{
  int before = atomic_load_explicit(&j->status, memory_order_relaxed);
  while (before < status && !atomic_compare_exchange_weak(&j->status, &before, status)) continue;
}

static void residual_of_piece(void *data, int task)
{
  job *j = data;
  const elasticity *self = j->self;
  const int *batch = self->piece_batch + j->first_piece + task;
  note_status(j, self->kernel->residual(&self->batches, batch[0], batch[1], j->x, j->result));
}

static void jacobian_of_piece(void *data, int task)
{
  job *j = data;
  const elasticity *self = j->self;
  const int *batch = self->piece_batch + j->first_piece + task;
  note_status(j, self->kernel->jacobian(&self->batches, batch[0], batch[1], j->x, j->shift->x,
                                        (flesh_projected)j->shift->project, j->slots, j->result));
}

/* A colour's pieces are dealt out in shares to the parts, from a part of its own on, so that few
 * pieces of many colours go to many parts. */
static int shares_of_colour(const flesh_tet_order *order, int colour)
{
  int pieces = order->colour_first[colour + 1] - order->colour_first[colour];
  return pieces < PARTS ? pieces : PARTS;
}

static void batches_of_share(const elasticity *self, int colour, int share, int *from, int *until)
{
  int first = self->order.colour_first[colour], shares = shares_of_colour(&self->order, colour);
  int64_t pieces = self->order.colour_first[colour + 1] - first;
  *from = self->piece_batch[first + pieces * share / shares];
  *until = self->piece_batch[first + pieces * (share + 1) / shares];
}

/* The same sums in the same order as by evaluate_share, colour after colour. */
static void energy_of_part(void *data, int task)
{
  job *j = data;
  const elasticity *self = j->self;
  const flesh_tet_order *order = &self->order;
  for (int c = 0, from, until; c < order->colours; c++) {
    int share = (task - order->colour_first[c] % PARTS + PARTS) % PARTS;
    if (share >= shares_of_colour(order, c)) continue;
    batches_of_share(self, c, share, &from, &until);
    note_status(j, self->kernel->energy(&self->batches, from, until, j->x, j->sums[task]));
  }
}

static void evaluate_share(void *data, int task)
{
  job *j = data;
  const elasticity *self = j->self;
  double *sums = j->sums[(self->order.colour_first[j->colour] + task) % PARTS];
  int from, until;
  batches_of_share(self, j->colour, task, &from, &until);
  note_status(j, self->kernel->evaluate(&self->batches, from, until, j->x, j->result, sums));
}

static int run_by_colour(job *j, flesh_threads *threads, flesh_task *task)
{
  const flesh_tet_order *order = &j->self->order;
  for (int c = 0; c < order->colours && !j->status; c++) {
    j->first_piece = order->colour_first[c];
    flesh_threads_run(threads, order->colour_first[c + 1] - j->first_piece, task, j);
  }
  return j->status;
}

static int elasticity_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  job j = {.self = effect->data, .x = point->x, .result = r};
  return run_by_colour(&j, point->threads, residual_of_piece);
}

static int elasticity_jacobian(const flesh_effect *effect, const flesh_point *point,
                               const flesh_shift *shift, flesh_block_matrix *K, const int *slots)
{
  if (shift->x == 0) return FLESH_OK;
  job j = {
      .self = effect->data, .x = point->x, .shift = shift, .slots = slots, .result = K->values};
  return run_by_colour(&j, point->threads, jacobian_of_piece);
}

static void add_parts(const job *j, double *energy, double *magnitude)
{
  *energy = *magnitude = 0;
  for (int p = 0; p < PARTS; p++) {
    *energy += j->sums[p][0];
    *magnitude += j->sums[p][1];
  }
}

static int sum_energy(const elasticity *self, const flesh_point *point, double *energy,
                      double *magnitude)
{
  job j = {.self = self, .x = point->x};
  flesh_threads_run(point->threads, PARTS, energy_of_part, &j);
  add_parts(&j, energy, magnitude);
  return j.status;
}

static int elasticity_potential(const flesh_effect *effect, const flesh_point *point,
                                const flesh_shift *shift, double *phi, double *magnitude)
{
  if (shift->x == 0) return FLESH_OK;
  double energy, size;
  int status = sum_energy(effect->data, point, &energy, &size);
  if (status) return status;
  *phi += energy / shift->x;
  *magnitude += size / shift->x;
  return FLESH_OK;
}

static int elasticity_evaluate(const flesh_effect *effect, const flesh_point *point,
                               const flesh_shift *shift, double *r, double *phi, double *magnitude)
{
  if (shift->x == 0) return elasticity_residual(effect, point, r);
  job j = {.self = effect->data, .x = point->x, .result = r};
  const flesh_tet_order *order = &j.self->order;
  for (j.colour = 0; j.colour < order->colours && !j.status; j.colour++)
    flesh_threads_run(point->threads, shares_of_colour(order, j.colour), evaluate_share, &j);
  if (j.status) return j.status;
  double energy, size;
  add_parts(&j, &energy, &size);
  *phi += energy / shift->x;
  *magnitude += size / shift->x;
  return FLESH_OK;
}

static int elasticity_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  double sum, size;
  int status = sum_energy(effect->data, point, &sum, &size);
  if (!status) *energy = sum;
  return status;
}

static size_t elasticity_memory(const flesh_effect *effect)
{
  const elasticity *self = effect->data;
  const size_t batches = (size_t)self->batches.count;
  return sizeof *self + (size_t)self->cells.count * 4 * sizeof(int) +
         batches * (2 * sizeof(int) + 80 * (size_t)self->kernel->lanes) +
         (2 * (size_t)self->order.pieces + (size_t)self->order.colours) * sizeof(int);
}

static void elasticity_destroy(void *data)
{
  elasticity *self = data;
  if (!self) return;
  flesh_cells_clear(&self->cells);
  flesh_tet_order_clear(&self->order);
  free((void *)self->batches.first);
  free((void *)self->batches.material);
  free((void *)self->batches.shapes);
  free(self->piece_batch);
  free(self);
}

static const flesh_elasticity_kernel *kernel_for(flesh_instructions instructions)
{
#ifdef FLESH_HAVE_X86_64
  if (instructions == FLESH_INSTRUCTIONS_AVX512) return &flesh_elasticity_avx512;
  if (instructions == FLESH_INSTRUCTIONS_AVX2) return &flesh_elasticity_avx2;
#endif
  (void)instructions;
  return &flesh_elasticity_portable;
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
 * is NULL, else fills it with the tets' new order. */
static int cut_batches(elasticity *self, const int *tet_material, int *tet, int *first,
                       int *material)
{
  const flesh_tet_order *order = &self->order;
  int count = 0;
  for (int p = 0; p < order->pieces; p++) {
    self->piece_batch[p] = count;
    for (int k = order->piece_first[p], n; k < order->piece_first[p + 1]; k += n) {
      int own = tet_material ? tet_material[order->tet[k]] : 0;
      for (n = 1; k + n < order->piece_first[p + 1]; n++)
        if (tet_material && tet_material[order->tet[k + n]] != own) break;
      int batches =
          cut_run(order->tet + k, n, self->kernel->lanes, k, tet, tet ? first + count : NULL);
      for (int b = 0; tet && b < batches; b++) material[count + b] = own;
      count += batches;
    }
  }
  self->piece_batch[order->pieces] = count;
  if (tet) first[count] = order->piece_first[order->pieces];
  return count;
}

/* Cuts the tets of self->order, of which each has its material (NULL: all the first), into batches; gets room for their
 * nodes and shapes. `tet` [tets]: which of them is where. */
static int make_batches(elasticity *self, int tets, const flesh_material *materials, const int *tet_material, int *tet)
{
  self->piece_batch = malloc(((size_t)self->order.pieces + 1) * sizeof(int));
  if (!self->piece_batch) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d elements", tets);
  const int count = cut_batches(self, tet_material, NULL, NULL, NULL), lanes = self->kernel->lanes;
  int *first = malloc(((size_t)count + 1) * sizeof *first);
  int *material = malloc(((size_t)count + 1) * sizeof *material);
  int *nodes = malloc((size_t)tets * 4 * sizeof *nodes);
  double *shapes = aligned_alloc(64, ((size_t)count * 80 * (size_t)lanes + 127) / 64 * 64);
  self->cells = (flesh_cells){tets, 4, nodes};
  self->batches = (flesh_batches){count, first, material, shapes, nodes, materials};
  if (!first || !material || !nodes || !shapes)
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d elements", tets);
  cut_batches(self, tet_material, tet, first, material);
  return FLESH_OK;
}

/* The shape of the tet in lane l of batch b; lanes that are not used have the last one without volume. */
static void set_shape(elasticity *self, int b, int l, const double shape[10])
{
  const int lanes = self->kernel->lanes, used = self->batches.first[b + 1] - self->batches.first[b];
  double *shapes = (double *)self->batches.shapes + (size_t)b * 10 * (size_t)lanes + l;
  for (int k = 0; k < 10; k++) shapes[k * lanes] = k == 9 && l >= used ? 0 : shape[k];
}

/* The tet in lane l of batch b, or the last. */
static int tet_in_lane(const elasticity *self, int b, int l)
{
  const int first = self->batches.first[b], used = self->batches.first[b + 1] - first;
  return first + (l < used ? l : used - 1);
}

/* Nodes and shapes of the batches, whose cells are the tets in this order. */
static int fill_batches(elasticity *self, const flesh_body *body, const int *tet)
{
  flesh_cells given;
  int status = flesh_cells_of_tets(body->mesh, &given);
  if (status) return status;
  int *nodes = (int *)self->batches.nodes;
  for (int k = 0; k < given.count; k++) memcpy(nodes + 4 * (size_t)k, given.nodes + 4 * (size_t)tet[k], 4 * sizeof *nodes);
  flesh_cells_clear(&given);
  const double *X = flesh_mesh_positions(body->mesh);
  for (int b = 0; b < self->batches.count; b++)
    for (int l = 0; l < self->kernel->lanes; l++) {
      double shape[10];
      shape[9] = flesh_element_shape(X, nodes + 4 * (size_t)tet_in_lane(self, b, l), shape);
      set_shape(self, b, l, shape);
    }
  return FLESH_OK;
}

static int order_body(elasticity *self, const flesh_body *body)
{
  const int tets = flesh_mesh_tet_count(body->mesh);
  int status = flesh_tet_order_create(body->mesh, body->tet_material, &self->order);
  if (status) return status;
  int *tet = malloc(((size_t)tets + 1) * sizeof *tet);
  status = tet ? make_batches(self, tets, body->materials, body->tet_material, tet)
               : flesh_fail(FLESH_ERR_MEMORY, "no memory for %d elements", tets);
  if (!status) status = fill_batches(self, body, tet);
  free(tet);
  free(self->order.tet);
  self->order.tet = NULL;
  return status;
}

/* All in one piece, as they come. */
static int order_part(flesh_tet_order *order, int count)
{
  *order = (flesh_tet_order){.tet = malloc((size_t)count * sizeof(int)), .pieces = 1, .colours = 1,
                             .piece_first = calloc(2, sizeof(int)), .colour_first = calloc(2, sizeof(int))};
  if (!order->tet || !order->piece_first || !order->colour_first)
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for a part of %d elements", count);
  for (int k = 0; k < count; k++) order->tet[k] = k;
  order->piece_first[1] = count;
  order->colour_first[1] = 1;
  return FLESH_OK;
}

static const flesh_effect_operations elasticity_operations;

static int elasticity_part(const flesh_effect *effect, int count, const int *chosen, const int *local,
                           flesh_effect **part)
{
  const elasticity *whole = effect->data;
  const flesh_batches *from = &whole->batches;
  const int lanes = whole->kernel->lanes;
  elasticity *self = calloc(1, sizeof *self);
  int *work = calloc(3 * (size_t)count, sizeof *work), *batch = work, *material = work + count, *tet = work + 2 * count;
  int status = self && work ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for a part of %d elements", count);
  if (!status) {
    self->kernel = whole->kernel;
    self->instructions = whole->instructions;
    for (int k = 0, b = 0; k < count; k++) {
      while (from->first[b + 1] <= chosen[k]) b++;
      batch[k] = b;
      material[k] = from->material[b];
    }
    status = order_part(&self->order, count);
  }
  if (!status) status = make_batches(self, count, from->materials, material, tet);
  for (int k = 0; k < 4 * count && !status; k++)
    ((int *)self->batches.nodes)[k] = local[from->nodes[4 * (size_t)chosen[tet[k / 4]] + k % 4]];
  for (int b = 0; !status && b < self->batches.count; b++)
    for (int l = 0; l < lanes; l++) {
      const int k = tet[tet_in_lane(self, b, l)], own = chosen[k] - from->first[batch[k]];
      double shape[10];
      for (int c = 0; c < 10; c++) shape[c] = from->shapes[((size_t)batch[k] * 10 + c) * lanes + own];
      set_shape(self, b, l, shape);
    }
  free(work);
  if (!status) return flesh_effect_create(&elasticity_operations, self, part);
  elasticity_destroy(self);
  return status;
}

static const flesh_effect_operations elasticity_operations = {
    .name = "elasticity",
    .cells = elasticity_cells,
    .residual = elasticity_residual,
    .jacobian = elasticity_jacobian,
    .potential = elasticity_potential,
    .evaluate = elasticity_evaluate,
    .energy = elasticity_energy,
    .part = elasticity_part,
    .destroy = elasticity_destroy,
    .memory = elasticity_memory,
};

int flesh_effect_elasticity(const flesh_body *body, flesh_effect **effect)
{
  return flesh_effect_elasticity_with(body, FLESH_INSTRUCTIONS_AUTO, effect);
}

int flesh_effect_elasticity_with(const flesh_body *body, flesh_instructions instructions,
                                 flesh_effect **effect)
{
  if (!body->materials)
    return flesh_fail(FLESH_ERR_ARGUMENT, "elasticity needs a body with a material");
  int status = flesh_instructions_find(instructions, &instructions);
  if (status) return status;
  elasticity *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the elasticity effect");
  self->instructions = instructions;
  self->kernel = kernel_for(instructions);
  status = order_body(self, body);
  if (status) {
    elasticity_destroy(self);
    return status;
  }
  return flesh_effect_create(&elasticity_operations, self, effect);
}

flesh_instructions flesh_effect_instructions(const flesh_effect *effect)
{
  if (effect->operations != &elasticity_operations) return FLESH_INSTRUCTIONS_AUTO;
  const elasticity *self = effect->data;
  return self->instructions;
}
