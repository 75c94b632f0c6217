/* pcg.c: preconditioned conjugate gradients (Hestenes & Stiefel 1952) on vectors of four lanes per node, the fourth of
 * which is padding that no sum takes in. */
#include "sparse/pcg.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/large.h"
#include "sparse/lanes.h"
#include "sparse/product.h"

enum {
  CHUNK = 512,                  /* nodes of a task: what is summed up does not depend on the threads */
  PARTS = FLESH_PRODUCT_PADDING /* of a sum, as additions wait for each other */
};

struct flesh_pcg_space {
  int rows, chunks;
  flesh_threads *threads;
  flesh_product product;
  flesh_double4 *x, *r, *p, *z, *weights; /* [rows] and up to a multiple of PARTS zeros; z is A p */
  double *sums, *squares;                 /* [chunks] */
};

int flesh_pcg_space_create(const flesh_block_matrix *A, flesh_threads *threads, flesh_pcg_space **space)
{
  flesh_pcg_space *self = calloc(1, sizeof *self);
  *space = self;
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for conjugate gradients");
  self->rows = A->rows;
  self->chunks = (A->rows + CHUNK - 1) / CHUNK;
  self->threads = threads;
  flesh_halves halves = {0};
  int status = flesh_halves_create(A, &halves);
  if (!status) status = flesh_product_create(A, &halves, &self->product);
  flesh_halves_clear(&halves);
  /* The product has room of its own behind the padding. */
  flesh_double4 **vectors[] = {&self->x, &self->r, &self->p, &self->z, &self->weights};
  enum { VECTORS = sizeof vectors / sizeof vectors[0] };
  size_t apart;
  double *memory = flesh_large_vectors(VECTORS, 4 * ((size_t)self->product.nodes + PARTS), &apart);
  int failed = !(self->sums = malloc(2 * ((size_t)self->chunks + 1) * sizeof *self->sums));
  self->squares = self->sums + self->chunks + 1;
  for (size_t k = 0; memory && k < VECTORS; k++) *vectors[k] = (flesh_double4 *)(memory + k * apart);
  failed |= !memory;
  if (failed && !status)
    status = flesh_fail(FLESH_ERR_MEMORY, "no memory for conjugate gradients on %d nodes", A->rows);
  if (status) flesh_pcg_space_destroy(space);
  return status;
}

void flesh_pcg_space_destroy(flesh_pcg_space **space)
{
  if (!space || !*space) return;
  flesh_pcg_space *self = *space;
  flesh_product_clear(&self->product);
  free(self->x); /* and the other vectors with it */
  free(self->sums);
  free(self);
  *space = NULL;
}

size_t flesh_pcg_space_memory(const flesh_pcg_space *self)
{
  return sizeof *self + (size_t)self->product.nodes * 5 * sizeof *self->x +
         2 * (size_t)self->chunks * sizeof *self->sums + flesh_product_memory(&self->product);
}

typedef struct work {
  flesh_pcg_space *space;
  const double *b, *weights; /* NULL: all are `common` */
  double *x, common;
  flesh_preconditioner_data *preconditioner;
  double alpha, beta;
  double downhill; /* how far x has yet to go along p: alpha, but after negative curvature */
} work;

static void range(const flesh_pcg_space *self, int chunk, int *begin, int *end)
{
  *begin = chunk * CHUNK;
  *end = *begin + CHUNK < self->rows ? *begin + CHUNK : self->rows;
}

static double sum_of(const flesh_double4 parts[PARTS])
{
  flesh_double4 sum = (parts[0] + parts[1]) + (parts[2] + parts[3]);
  return (sum[0] + sum[1]) + sum[2];
}

static void load(void *data, int chunk)
{
  const work *w = data;
  const flesh_pcg_space *self = w->space;
  int begin, end;
  range(self, chunk, &begin, &end);
  for (int i = begin; i < end; i++) {
    const size_t node = (size_t)self->product.rows[i];
    const double *b = w->b + 3 * node;
    self->x[i] = self->p[i] = self->z[i] = (flesh_double4){0};
    self->r[i] = (flesh_double4){b[0], b[1], b[2], 0};
    for (int c = 0; c < 3 && w->weights; c++) self->weights[i][c] = w->weights[3 * node + (size_t)c];
  }
  for (int i = end; i % PARTS; i++) self->x[i] = self->r[i] = self->p[i] = self->z[i] = (flesh_double4){0};
}

static void store(void *data, int chunk)
{
  const work *w = data;
  int begin, end;
  range(w->space, chunk, &begin, &end);
  for (int i = begin; i < end; i++)
    for (int c = 0; c < 3; c++)
      w->x[3 * (size_t)w->space->product.rows[i] + (size_t)c] = w->space->x[i][c] + w->downhill * w->space->p[i][c];
}

/* x += downhill p, which is late, then p = z + beta p, while p is at hand. */
static void turn(void *data, int begin, int end)
{
  const work *w = data;
  flesh_double4 *x = w->space->x, *p = w->space->p;
  for (int from = begin, until; from < end; from = until) {
    until = from + CHUNK < end ? from + CHUNK : end;
    for (int i = from; i < until; i++) x[i] += w->downhill * p[i];
    flesh_preconditioner_turn(w->preconditioner, from, until, w->beta, (double *)p);
  }
}

/* r -= alpha A p; the square of r and the weighted one. */
static inline void descend_nodes(const work *w, int begin, int end, const flesh_double4 *weights, double *square,
                                 double *weighted_square)
{
  const flesh_pcg_space *self = w->space;
  const double alpha = w->alpha;
  flesh_double4 weighted[PARTS] = {{0}}, plain[PARTS] = {{0}}, *r = self->r;
  const flesh_double4 *z = self->z;
  for (int i = begin; i < end; i += PARTS)
    for (int l = 0; l < PARTS; l++) {
      flesh_double4 now = r[i + l] - alpha * z[i + l];
      r[i + l] = now;
      plain[l] += now * now;
      if (weights) weighted[l] += now * weights[i + l] * (now * weights[i + l]);
    }
  *square = sum_of(plain);
  *weighted_square = weights ? sum_of(weighted) : w->common * w->common * *square;
}

static void descend(void *data, int chunk)
{
  const work *w = data;
  const flesh_pcg_space *self = w->space;
  int begin, end;
  range(self, chunk, &begin, &end);
  descend_nodes(w, begin, end, w->weights ? self->weights : NULL, &self->squares[chunk], &self->sums[chunk]);
}

/* The residual after a step; returns its weighted square. */
static double run_descent(const flesh_pcg_space *self, work *w)
{
  double sum = 0;
  flesh_threads_run(self->threads, self->chunks, descend, w);
  for (int k = 0; k < self->chunks; k++) sum += self->sums[k];
  return sum;
}

static int iterate(flesh_pcg_space *self, const flesh_block_matrix *A, const flesh_pcg_guide *guide, double tolerance,
                   int max_iterations, work *w, flesh_pcg_result *result)
{
  enum { ASK_EVERY = 16 };
  double rz_before = 0, pMp = 0;
  int last = max_iterations, status = FLESH_NOT_CONVERGED, asked;
  result->first = result->residual = sqrt(run_descent(self, w)); /* alpha is 0 */
  if (result->residual <= tolerance) return FLESH_OK;
  while (result->iterations < last) {
    double square = 0, curvature;
    if (guide->stop && result->iterations % ASK_EVERY == 0 && (asked = guide->stop(guide->stop_data))) return asked;
    for (int k = 0; k < self->chunks; k++) square += self->squares[k];
    const double rz = flesh_preconditioner_solve(w->preconditioner, sqrt(square), (const double *)self->r);
    /* After a direction without curvature there is no next one. */
    if (!(fabs(rz) < INFINITY)) return status == FLESH_NOT_POSITIVE ? status : FLESH_NONFINITE;
    w->beta = result->iterations ? rz / rz_before : 0;
    flesh_product_make_and_multiply(&self->product, A, self->threads, turn, w, (double *)self->p, (double *)self->z,
                                    &curvature);
    w->downhill = 0;
    if (!(fabs(curvature) < INFINITY)) return status == FLESH_NOT_POSITIVE ? status : FLESH_NONFINITE;
    pMp = rz + w->beta * w->beta * pMp;
    if (!(curvature > 0) && status == FLESH_NOT_CONVERGED) {
      status = FLESH_NOT_POSITIVE;
      if (guide->beyond == 0) break;
      if (guide->beyond < max_iterations - result->iterations) last = result->iterations + guide->beyond;
    }
    w->alpha = rz / curvature;
    w->downhill = status == FLESH_NOT_POSITIVE ? rz / fmax(fabs(curvature), pMp) : w->alpha;
    result->iterations++;
    result->residual = sqrt(run_descent(self, w));
    if (result->residual <= tolerance) return status == FLESH_NOT_POSITIVE ? status : FLESH_OK;
    rz_before = rz;
  }
  return status;
}

int flesh_pcg(flesh_pcg_space *self, const flesh_block_matrix *A, flesh_preconditioner_data *preconditioner,
              const double *weights, double tolerance, int max_iterations, const double *b, double *x,
              flesh_pcg_result *result)
{
  return flesh_pcg_guided(self, A, preconditioner, &(flesh_pcg_guide){0}, weights, tolerance, max_iterations, b, x,
                          result);
}

typedef struct comparison {
  const flesh_pcg_space *space;
  const double *r;
} comparison;

static void compare(void *data, int chunk)
{
  const comparison *c = data;
  const flesh_pcg_space *self = c->space;
  flesh_double4 square = {0};
  int begin, end;
  range(self, chunk, &begin, &end);
  for (int i = begin; i < end; i++) {
    const double *r = c->r + 3 * (size_t)self->product.rows[i];
    const flesh_double4 departure = self->r[i] + (flesh_double4){r[0], r[1], r[2], 0};
    square += departure * departure;
  }
  self->squares[chunk] = (square[0] + square[1]) + square[2];
}

double flesh_pcg_departure(const flesh_pcg_space *self, const double *r)
{
  double sum = 0;
  flesh_threads_run(self->threads, self->chunks, compare, &(comparison){self, r});
  for (int k = 0; k < self->chunks; k++) sum += self->squares[k];
  return sqrt(sum);
}

/* What n numbers all are; 0: they differ. */
static double common_to(int n, const double *numbers)
{
  int same = 0;
  while (same < n && numbers[same] == numbers[0]) same++;
  return n > 0 && same == n ? numbers[0] : 0;
}

int flesh_pcg_guided(flesh_pcg_space *self, const flesh_block_matrix *A, flesh_preconditioner_data *preconditioner,
                     const flesh_pcg_guide *guide, const double *weights, double tolerance, int max_iterations,
                     const double *b, double *x, flesh_pcg_result *result)
{
  const double common = weights ? common_to(3 * self->rows, weights) : 1;
  work w = {.space = self, .b = b, .weights = common != 0 ? NULL : weights, .common = common, .x = x,
            .preconditioner = preconditioner};
  *result = (flesh_pcg_result){0};
  flesh_threads_run(self->threads, self->chunks, load, &w);
  int status = iterate(self, A, guide, tolerance, max_iterations, &w, result);
  flesh_threads_run(self->threads, self->chunks, store, &w);
  return status;
}
