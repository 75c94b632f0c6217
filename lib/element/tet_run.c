/* tet_run.c: shares the batches of a body's tets among threads. */
#include <stdatomic.h>
#include <stdint.h>
#include <string.h>

#include "element/tet_batches.h"

/* Number of partial sums of potentials, the same for any number of threads. */
enum { PARTS = 64 };

/* One evaluation. */
typedef struct job {
  const flesh_tet_group *self;
  const flesh_tet_kernel *kernel;
  const flesh_tet_point *at;
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

/* Runs the kernel on tiles from <= k < until; r and sums as for the kernel. */
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

/* Returns the number of shares of a colour's pieces. Consecutive colours begin at different parts, so that few pieces
 * of many colours are spread over many parts. */
static int shares_of_colour(const flesh_tet_order *order, int colour)
{
  int pieces = order->colour_first[colour + 1] - order->colour_first[colour];
  return pieces < PARTS ? pieces : PARTS;
}

static void tiles_of_share(const flesh_tet_group *self, int colour, int share, int *from, int *until)
{
  int first = self->order.colour_first[colour], shares = shares_of_colour(&self->order, colour);
  int64_t pieces = self->order.colour_first[colour + 1] - first;
  *from = self->piece_tile[first + pieces * share / shares];
  *until = self->piece_tile[first + pieces * (share + 1) / shares];
}

/* Computes the same sums in the same order as both_of_share, colour by colour. */
static void sums_of_part(void *data, int task)
{
  job *j = data;
  const flesh_tet_order *order = &j->self->order;
  for (int c = 0, from, until; c < order->colours; c++) {
    int share = (task - order->colour_first[c] % PARTS + PARTS) % PARTS;
    if (share >= shares_of_colour(order, c)) continue;
    tiles_of_share(j->self, c, share, &from, &until);
    residual_kernel(j, from, until, NULL, j->sums[task]);
  }
}

static void both_of_share(void *data, int task)
{
  job *j = data;
  double *sums = j->sums[(j->self->order.colour_first[j->colour] + task) % PARTS];
  int from, until;
  tiles_of_share(j->self, j->colour, task, &from, &until);
  residual_kernel(j, from, until, j->result, sums);
}

static int run_pieces(job *j, flesh_threads *threads, flesh_task *task)
{
  const flesh_tet_order *order = &j->self->order;
  for (int c = 0; c < order->colours && !j->status; c++) {
    j->first_piece = order->colour_first[c];
    flesh_threads_run(threads, order->colour_first[c + 1] - j->first_piece, task, j);
  }
  return j->status;
}

/* Adds a group's residual to r and its potentials to sums. */
static int residual_of_group(const flesh_tet_group *self, const flesh_tet_kernel *kernel, const flesh_tet_point *at,
                             flesh_threads *threads, double *r, double *sums)
{
  job j = {.self = self, .kernel = kernel, .at = at, .result = r};
  if (!sums) return run_pieces(&j, threads, residual_of_piece);
  if (!r) flesh_threads_run(threads, PARTS, sums_of_part, &j);
  for (; r && j.colour < self->order.colours && !j.status; j.colour++)
    flesh_threads_run(threads, shares_of_colour(&self->order, j.colour), both_of_share, &j);
  for (int p = 0; p < PARTS; p++)
    for (int k = 0; k < 2; k++) sums[k] += j.sums[p][k];
  return j.status;
}

int flesh_tets_residual(const flesh_tets *self, flesh_kernel kernel, const flesh_tet_point *at, flesh_threads *threads,
                        double *r, double *sums)
{
  int status = FLESH_OK;
  if (sums) sums[0] = sums[1] = 0;
  for (int g = 0; g < self->group_count && !status; g++) {
    const flesh_tet_kernel *own = self->groups[g].kernels->of[kernel];
    if (own) status = residual_of_group(&self->groups[g], own, at, threads, r, sums);
  }
  return status;
}

int flesh_tets_dissipate(const flesh_tets *self, flesh_kernel kernel, const flesh_tet_point *at, flesh_threads *threads,
                         const flesh_contribution *to)
{
  double sums[2];
  if (!to->r && to->shift == 0) return FLESH_OK;
  int status = flesh_tets_residual(self, kernel, at, threads, to->r, to->shift != 0 ? sums : NULL);
  if (status || to->shift == 0) return status;
  *to->phi += sums[0] / to->shift;
  *to->magnitude += sums[1] / to->shift;
  return FLESH_OK;
}

/* Groups may share corners: a block that is new to one group may already have terms of the other. */
int flesh_tets_hessian(const flesh_tets *self, flesh_kernel kernel, const flesh_tet_point *at, flesh_threads *threads,
                       const int *slots, double *values)
{
  flesh_tet_point own = *at;
  int status = FLESH_OK;
  if (self->group_count > 1) own.assign = 0;
  for (int k = 0; own.assign != at->assign && k < self->cells.pair_count; k++)
    memset(values + 9 * (size_t)slots[k], 0, 9 * sizeof *values);
  for (int g = 0; g < self->group_count && !status; g++) {
    const flesh_tet_group *group = &self->groups[g];
    job j = {.self = group, .kernel = group->kernels->of[kernel], .at = &own, .slots = slots + group->first_slot,
             .result = values};
    status = run_pieces(&j, threads, hessian_of_piece);
  }
  return status;
}

typedef struct rows_job {
  const flesh_tet_group *self;
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

const flesh_tet_group *flesh_tets_stiff(const flesh_tets *self)
{
  for (int g = 0; g < self->group_count; g++)
    if (self->groups[g].kernels->of[FLESH_KERNEL_ELASTIC]->rows_kernel) return &self->groups[g];
  return NULL;
}

void flesh_tets_rows(const flesh_tets *self, const flesh_tet_point *at, flesh_threads *threads, float *rows)
{
  const flesh_tet_group *group = flesh_tets_stiff(self);
  const flesh_tet_order *order = &group->order;
  rows_job j = {.self = group, .kernel = group->kernels->of[FLESH_KERNEL_ELASTIC], .at = at, .rows = rows};
  for (int c = 0; c < order->colours; c++) {
    j.first_piece = order->colour_first[c];
    flesh_threads_run(threads, order->colour_first[c + 1] - j.first_piece, rows_of_piece, &j);
  }
}
