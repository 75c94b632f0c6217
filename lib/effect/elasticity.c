/* elasticity.c: V(x) = sum over linear tets of volume * psi(F), its gradient and (projected)
 * Hessian: the tets in batches for a kernel, piece by piece and colour by colour (tet_order.h). */
#include <math.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>

#include "base/error.h"
#include "effect/effect.h"
#include "effect/elasticity_kernel.h"
#include "effect/tet_order.h"
#include "math/mat3.h"

/* Parts whose energies are summed one by one, however many threads there are. */
enum { PARTS = 64 };

typedef struct elasticity {
  flesh_cells cells; /* in the order of the batches */
  flesh_batches batches;
  const flesh_elasticity_kernel *kernel;
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
  int first_piece;
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

static void energy_of_part(void *data, int task)
{
  job *j = data;
  const elasticity *self = j->self;
  int from = (int)((int64_t)self->batches.count * task / PARTS);
  int until = (int)((int64_t)self->batches.count * (task + 1) / PARTS);
  note_status(j, self->kernel->energy(&self->batches, from, until, j->x, j->sums[task]));
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

static int sum_energy(const elasticity *self, const flesh_point *point, double *energy,
                      double *magnitude)
{
  job j = {.self = self, .x = point->x};
  flesh_threads_run(point->threads, PARTS, energy_of_part, &j);
  *energy = *magnitude = 0;
  for (int p = 0; p < PARTS; p++) {
    *energy += j.sums[p][0];
    *magnitude += j.sums[p][1];
  }
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

static int elasticity_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  double sum, size;
  int status = sum_energy(effect->data, point, &sum, &size);
  if (!status) *energy = sum;
  return status;
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

static const flesh_effect_operations elasticity_operations = {
    .name = "elasticity",
    .cells = elasticity_cells,
    .residual = elasticity_residual,
    .jacobian = elasticity_jacobian,
    .potential = elasticity_potential,
    .energy = elasticity_energy,
    .destroy = elasticity_destroy,
};

static const flesh_elasticity_kernel *kernel_for(flesh_instructions instructions)
{
#ifdef FLESH_HAVE_X86_64
  if (instructions == FLESH_INSTRUCTIONS_AVX512) return &flesh_elasticity_avx512;
  if (instructions == FLESH_INSTRUCTIONS_AVX2) return &flesh_elasticity_avx2;
#endif
  (void)instructions;
  return &flesh_elasticity_portable;
}

/* Cuts the ordered tets into batches: within a piece, of one material. Only counts them where
 * `first` is NULL. */
static int cut_batches(const flesh_tet_order *order, const int *tet_material, int lanes,
                       int *piece_batch, int *first, int *material)
{
  int count = 0;
  for (int p = 0; p < order->pieces; p++) {
    piece_batch[p] = count;
    for (int k = order->piece_first[p], used = 0; k < order->piece_first[p + 1]; k++) {
      int own = tet_material ? tet_material[order->tet[k]] : 0;
      if (used == 0 || used == lanes || (tet_material && own != tet_material[order->tet[k - 1]])) {
        if (first) first[count] = k, material[count] = own;
        count++;
        used = 0;
      }
      used++;
    }
  }
  piece_batch[order->pieces] = count;
  if (first) first[count] = order->piece_first[order->pieces];
  return count;
}

/* Gradients and volume of one tet; its nodes ascend. */
static void find_shape(const double *X, const int node[4], double shape[10])
{
  double D[9];
  for (int i = 0; i < 3; i++)
    for (int a = 0; a < 3; a++)
      D[3 * i + a] = X[3 * (size_t)node[a + 1] + i] - X[3 * (size_t)node[0] + i];
  /* D's columns are the edges; the rows of its inverse are the gradients, whichever way round
   * the ascending nodes wind. */
  shape[9] = fabs(flesh_mat3_inverse(D, shape)) / 6;
}

static int make_batches(elasticity *self, const flesh_body *body)
{
  int lanes = self->kernel->lanes, tets = self->cells.count;
  self->piece_batch = malloc(((size_t)self->order.pieces + 1) * sizeof(int));
  if (!self->piece_batch) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d elements", tets);
  int count = cut_batches(&self->order, body->tet_material, lanes, self->piece_batch, NULL, NULL);
  int *first = malloc(((size_t)count + 1) * sizeof *first);
  int *material = malloc(((size_t)count + 1) * sizeof *material);
  double *shapes = aligned_alloc(64, ((size_t)count * 10 * (size_t)lanes * 8 + 127) / 64 * 64);
  self->batches = (flesh_batches){.count = count,
                                  .first = first,
                                  .material = material,
                                  .shapes = shapes,
                                  .nodes = self->cells.nodes,
                                  .materials = body->materials};
  if (!first || !material || !shapes)
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d elements", tets);
  cut_batches(&self->order, body->tet_material, lanes, self->piece_batch, first, material);
  const double *X = flesh_mesh_positions(body->mesh);
  for (int b = 0; b < count; b++)
    for (int l = 0; l < lanes; l++) {
      int used = first[b + 1] - first[b];
      double shape[10];
      find_shape(X, self->cells.nodes + 4 * (size_t)(first[b] + (l < used ? l : used - 1)), shape);
      if (l >= used) shape[9] = 0;
      for (int k = 0; k < 10; k++) shapes[((size_t)b * 10 + k) * lanes + l] = shape[k];
    }
  return FLESH_OK;
}

/* The cells in the order of the pieces. */
static int order_cells(elasticity *self, const flesh_body *body)
{
  flesh_cells given;
  int status = flesh_tet_order_create(body->mesh, body->tet_material, &self->order);
  if (!status) status = flesh_cells_of_tets(body->mesh, &given);
  if (status) return status;
  int *nodes = malloc((size_t)given.count * 4 * sizeof *nodes);
  for (int k = 0; nodes && k < given.count; k++)
    for (int a = 0; a < 4; a++)
      nodes[4 * (size_t)k + a] = given.nodes[4 * (size_t)self->order.tet[k] + a];
  self->cells = (flesh_cells){given.count, 4, nodes};
  flesh_cells_clear(&given);
  return nodes ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory to order the elements");
}

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
  self->kernel = kernel_for(instructions);
  status = order_cells(self, body);
  if (!status) status = make_batches(self, body);
  free(self->order.tet);
  self->order.tet = NULL;
  if (status) {
    elasticity_destroy(self);
    return status;
  }
  return flesh_effect_create(&elasticity_operations, self, effect);
}
