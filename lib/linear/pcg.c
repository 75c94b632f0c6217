/* pcg.c: preconditioned conjugate gradients (Hestenes & Stiefel 1952) on vectors of four lanes per node, the fourth of
 * which is padding that no sum includes.
 *
 * Residual, direction and its product with A are in double or in single precision. In single precision they are those of a
 * scaled system, whose right-hand side and largest entry are about 1; operations node by node are still done in double
 * precision, and rounded when they are stored. */
#include "linear/pcg.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "base/parallel_vector.h"
#include "base/team.h"
#include "linear/pcg_space.h"
#include "linear/pcg_team.h"

/* Ratio of the residual to the first one below which it is round-off in single precision. In a team more round-off gathers,
 * because A p is a recurrence, too. */
static const double DEEPEST = 1e-5, DEEPEST_OF_TEAM = 1e-4;

/* Joins the threads' team; a team of one rank counts as none. */
static int join(flesh_pcg_space *self)
{
  const flesh_team *team = flesh_threads_team(self->threads);
  if (!team || team->ranks == 1) return FLESH_OK;
  self->team = team;
  self->place = flesh_malloc(((size_t)self->rows + 1) * sizeof *self->place);
  if (!self->place) return flesh_fail(FLESH_ERR_MEMORY, "no memory for conjugate gradients");
  for (int p = 0; p < self->rows; p++) self->place[self->product.rows[p]] = p;
  return FLESH_OK;
}

/* Returns the number of vectors; a team needs two more. */
static size_t vectors_of(const flesh_pcg_space *self) { return self->team ? 8 : 6; }

int flesh_pcg_space_create(const flesh_block_matrix *A, int single, flesh_threads *threads, flesh_pcg_space **space)
{
  flesh_pcg_space *self = flesh_calloc(1, sizeof *self);
  *space = self;
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for conjugate gradients");
  self->rows = A->rows;
  self->chunks = (A->rows + FLESH_PCG_CHUNK - 1) / FLESH_PCG_CHUNK;
  self->threads = threads;
  self->unit = 1;
  flesh_bisection bisection = {0};
  int status = flesh_bisection_create(A, NULL, &bisection);
  if (!status) status = flesh_product_create(A, &bisection, single, &self->product);
  flesh_bisection_clear(&bisection);
  if (!status) status = join(self);
  /* The product has room of its own behind the padding. */
  void **vectors[] = {(void **)&self->x, (void **)&self->weights, &self->r, &self->p, &self->z, (void **)&self->room,
                      (void **)&self->u, (void **)&self->s};
  const size_t count = vectors_of(self), sums = self->team ? FLESH_PCG_SUMS : 2;
  size_t stride;
  double *memory = flesh_huge_pages_vectors(count, 4 * ((size_t)self->product.nodes + FLESH_PCG_PARTS), &stride);
  int failed = !(self->sums = flesh_malloc(sums * ((size_t)self->chunks + 1) * sizeof *self->sums));
  self->squares = self->sums + self->chunks + 1;
  for (size_t k = 0; memory && k < count; k++) *vectors[k] = memory + k * stride;
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
  flesh_free(self->x); /* the other vectors are in the same allocation */
  flesh_free(self->sums);
  flesh_free(self->place);
  flesh_free(self);
  *space = NULL;
}

static void load(void *data, int chunk)
{
  const flesh_pcg_work *w = data;
  const flesh_pcg_space *self = w->space;
  const int single = self->single;
  int begin, end;
  flesh_pcg_range(self, chunk, &begin, &end);
  for (int i = begin; i < end; i++) {
    const size_t node = (size_t)self->product.rows[i];
    const double scale = self->team && node >= (size_t)self->team->own ? 0 : w->scale, *b = w->request->b + 3 * node;
    self->x[i] = (flesh_double4){0};
    flesh_pcg_put(self->p, single, i, self->x[i]);
    flesh_pcg_put(self->z, single, i, self->x[i]);
    flesh_pcg_put(self->r, single, i, scale * (flesh_double4){b[0], b[1], b[2], 0});
    if (self->team) ((flesh_double4 *)self->u)[i] = ((flesh_double4 *)self->s)[i] = self->x[i];
    for (int c = 0; c < 3 && w->weights; c++) self->weights[i][c] = w->weights[3 * node + (size_t)c];
  }
  for (int i = end; i % FLESH_PCG_PARTS; i++) {
    self->x[i] = (flesh_double4){0};
    flesh_pcg_put(self->r, single, i, self->x[i]);
    flesh_pcg_put(self->p, single, i, self->x[i]);
    flesh_pcg_put(self->z, single, i, self->x[i]);
  }
}

static void store(void *data, int chunk)
{
  const flesh_pcg_work *w = data;
  const flesh_pcg_space *self = w->space;
  int begin, end;
  flesh_pcg_range(self, chunk, &begin, &end);
  for (int i = begin; i < end; i++) {
    const flesh_double4 x = self->x[i] + w->downhill * flesh_pcg_get(self->p, self->single, i);
    for (int c = 0; c < 3; c++) w->x[3 * (size_t)self->product.rows[i] + (size_t)c] = w->unscale * x[c];
  }
}

/* Adds downhill p to x, one iteration late, while p is at hand, then sets p = z + beta p; z is the preconditioner's
 * result. */
static inline __attribute__((always_inline)) void turn_nodes(const flesh_pcg_work *w, int begin, int end, int single)
{
  flesh_float4 result[FLESH_PCG_CHUNK];
  flesh_double4 *x = w->space->x;
  void *p = w->space->p;
  for (int from = begin, until; from < end; from = until) {
    until = from + FLESH_PCG_CHUNK < end ? from + FLESH_PCG_CHUNK : end;
    flesh_preconditioner_result(w->request->preconditioner, from, until, (float *)result);
    for (int i = from; i < until; i++) {
      const flesh_double4 now = flesh_pcg_get(p, single, i);
      x[i] += w->downhill * now;
      flesh_pcg_put(p, single, i, w->back * FLESH_LANES_WIDE(result[i - from]) + w->beta * now);
    }
  }
}

static void turn(void *data, int begin, int end)
{
  const flesh_pcg_work *w = data;
  if (w->space->single) turn_nodes(w, begin, end, 1);
  else turn_nodes(w, begin, end, 0);
}

/* Computes r -= alpha A p, the square of r and the weighted one. */
static inline __attribute__((always_inline)) void descend_nodes(const flesh_pcg_work *w, int begin, int end, int single,
                                                                const flesh_double4 *weights, double *square,
                                                                double *weighted_square)
{
  const flesh_pcg_space *self = w->space;
  const double alpha = w->alpha, to_round = w->to_round;
  flesh_double4 weighted[FLESH_PCG_PARTS] = {{0}}, plain[FLESH_PCG_PARTS] = {{0}};
  for (int i = begin; i < end; i += FLESH_PCG_PARTS)
    for (int l = 0; l < FLESH_PCG_PARTS; l++) {
      const flesh_double4 now = flesh_pcg_get(self->r, single, i + l) - alpha * flesh_pcg_get(self->z, single, i + l);
      flesh_pcg_put(self->r, single, i + l, now);
      if (!single) self->rounded[i + l] = FLESH_LANES_NARROW(to_round * now);
      plain[l] += now * now;
      if (weights) weighted[l] += now * weights[i + l] * (now * weights[i + l]);
    }
  *square = flesh_pcg_sum_of(plain);
  *weighted_square = weights ? flesh_pcg_sum_of(weighted) : w->common * w->common * *square;
}

static void descend(void *data, int chunk)
{
  const flesh_pcg_work *w = data;
  const flesh_pcg_space *self = w->space;
  double *square = &self->squares[chunk], *weighted = &self->sums[chunk];
  int begin, end;
  flesh_pcg_range(self, chunk, &begin, &end);
  if (self->single) descend_nodes(w, begin, end, 1, NULL, square, weighted);
  else descend_nodes(w, begin, end, 0, w->weights ? self->weights : NULL, square, weighted);
}

/* Updates the residual after a step; returns its weighted norm, and its plain one as `norm`. */
static double run_descent(const flesh_pcg_space *self, flesh_pcg_work *w, double *norm)
{
  double sum = 0, square = 0;
  flesh_threads_run(self->threads, self->chunks, descend, w);
  for (int k = 0; k < self->chunks; k++) sum += self->sums[k], square += self->squares[k];
  *norm = sqrt(square);
  return sqrt(sum);
}

static int iterate(flesh_pcg_space *self, flesh_pcg_work *w, flesh_pcg_result *result)
{
  enum { ASK_EVERY = 16 };
  const flesh_pcg_request *request = w->request;
  const double scale = flesh_preconditioner_scale(request->preconditioner);
  double rz_before = 0, pMp = 0, norm;
  int last = request->max_iterations, status = FLESH_NOT_CONVERGED, asked;
  result->first = result->residual = run_descent(self, w, &norm); /* alpha is 0 */
  if (result->residual <= request->tolerance) return FLESH_OK;
  while (result->iterations < last) {
    if (request->stop && result->iterations % ASK_EVERY == 0 && (asked = request->stop(request->stop_data))) return asked;
    w->back = self->single ? 1 : scale / w->to_round;
    const double rz =
        flesh_preconditioner_solve(request->preconditioner, (const float *)self->rounded) * w->back / w->to_round;
    /* A direction without curvature is the last one. */
    if (!(fabs(rz) < INFINITY)) return status == FLESH_NOT_POSITIVE ? status : FLESH_NONFINITE;
    w->beta = result->iterations ? rz / rz_before : 0;
    const double curvature =
        flesh_pcg_product(self, request->A, scale, &(flesh_product_maker){turn, w}, self->p); /* A times the next p */
    w->downhill = 0;
    if (!(fabs(curvature) < INFINITY)) return status == FLESH_NOT_POSITIVE ? status : FLESH_NONFINITE;
    pMp = rz + w->beta * w->beta * pMp;
    if (!(curvature > FLESH_PCG_FLAT * pMp) && status == FLESH_NOT_CONVERGED) {
      status = FLESH_NOT_POSITIVE;
      if (request->after_indefinite == 0) break;
      if (request->after_indefinite < request->max_iterations - result->iterations)
        last = result->iterations + request->after_indefinite;
    }
    w->alpha = rz / curvature;
    w->downhill = status == FLESH_NOT_POSITIVE ? rz / fmax(fabs(curvature), pMp) : w->alpha;
    result->iterations++;
    if (!self->single) w->to_round = flesh_power_to_one(norm);
    result->residual = run_descent(self, w, &norm);
    if (result->residual <= request->tolerance) return status == FLESH_NOT_POSITIVE ? status : FLESH_OK;
    rz_before = rz;
  }
  return status;
}

typedef struct comparison {
  const flesh_pcg_space *space;
  const double *weights, *r;
} comparison;

static void compare(void *data, int chunk)
{
  const comparison *c = data;
  const flesh_pcg_space *self = c->space;
  flesh_double4 square = {0};
  int begin, end;
  flesh_pcg_range(self, chunk, &begin, &end);
  for (int i = begin; i < end; i++) {
    const double *r = c->r + 3 * (size_t)self->product.rows[i];
    flesh_double4 difference =
        self->unit * flesh_pcg_get(self->r, self->single, i) + (flesh_double4){r[0], r[1], r[2], 0};
    if (c->weights) {
      const double *w = c->weights + 3 * (size_t)self->product.rows[i];
      difference *= (flesh_double4){w[0], w[1], w[2], 0};
    }
    square += difference * difference;
  }
  self->squares[chunk] = (square[0] + square[1]) + square[2];
}

double flesh_pcg_model_error(const flesh_pcg_space *self, const double *weights, const double *r)
{
  double sum = 0;
  flesh_threads_run(self->threads, self->chunks, compare, &(comparison){self, weights, r});
  for (int k = 0; k < self->chunks; k++) sum += self->squares[k];
  flesh_team_sum(self->team, 1, &sum);
  return sqrt(sum);
}

/* Returns the common value of n numbers; 0: they differ. */
static double common_to(int n, const double *numbers)
{
  int same = 0;
  while (same < n && numbers[same] == numbers[0]) same++;
  return n > 0 && same == n ? numbers[0] : 0;
}

/* Whether a solve that may be in single precision is, given the common value of all weights (0: they differ), on all
 * ranks. */
static int is_rounded(const flesh_pcg_space *self, const flesh_pcg_request *request, double common, double norm)
{
  double weights[2] = {common, -common};
  flesh_team_largest(self->team, 2, weights);
  return self->product.rounded && weights[0] > 0 && weights[0] == -weights[1] &&
         (!self->team || flesh_preconditioner_overlap(request->preconditioner)) &&
         request->tolerance > (self->team ? DEEPEST_OF_TEAM : DEEPEST) * common * norm;
}

int flesh_pcg(flesh_pcg_space *self, const flesh_pcg_request *request, double *x, flesh_pcg_result *result)
{
  const double common = request->weights ? common_to(3 * self->rows, request->weights) : 1;
  const double norm = flesh_norm(self->threads, 3 * self->rows, request->b), to_one = flesh_power_to_one(norm);
  self->single = request->single && is_rounded(self, request, common, norm);
  flesh_pcg_work w = {.space = self, .request = request, .weights = common != 0 ? NULL : request->weights,
                      .common = common, .x = x, .scale = 1, .unscale = 1, .to_round = to_one};
  if (!request->same) self->holds = 0;
  self->rounded = self->room;
  self->unit = 1;
  if (self->single) {
    self->rounded = self->r;
    w.scale = to_one;
    w.to_round = 1;
    self->unit = 1 / to_one;
    w.unscale = self->unit * flesh_preconditioner_scale(request->preconditioner);
    w.common = common * self->unit;
  }
  *result = (flesh_pcg_result){.single = self->single};
  flesh_threads_run(self->threads, self->chunks, load, &w);
  const int status = self->team ? flesh_pcg_in_team(&w, result) : iterate(self, &w, result);
  flesh_threads_run(self->threads, self->chunks, store, &w);
  flesh_preconditioner_share_left_out(request->preconditioner, x);
  return status;
}
