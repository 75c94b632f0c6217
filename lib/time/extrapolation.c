/* extrapolation.c: a first iterate from the last steps' displacements. */
#include "time/extrapolation.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/parallel_vector.h"
#include "base/team.h"

enum { POINTS = FLESH_EXTRAPOLATION_POINTS };

int flesh_extrapolation_create(int n, int own, flesh_threads *threads, flesh_extrapolation *self)
{
  *self = (flesh_extrapolation){.n = n, .own = own, .threads = threads};
  size_t stride;
  self->memory = flesh_huge_pages_vectors(POINTS, (size_t)n, &stride);
  if (!self->memory) return flesh_fail(FLESH_ERR_MEMORY, "no memory for displacements of %d unknowns", n);
  for (size_t k = 0; k < POINTS; k++) self->u[k] = self->memory + k * stride;
  return FLESH_OK;
}

void flesh_extrapolation_clear(flesh_extrapolation *self)
{
  free(self->memory);
  *self = (flesh_extrapolation){0};
}

void flesh_extrapolation_forget(flesh_extrapolation *self) { self->known = 0; }

static int continues(const flesh_extrapolation *self, long serial, double t, double h)
{
  return self->known > 0 && serial == self->serial && fabs(h - self->h) <= 1e-9 * h && fabs(t - self->t) <= 1e-9 * h;
}

/* A recurrence: the displacement is the sum over j of weight[j] times the displacement j + 1 steps before. */
typedef struct rule {
  int order;
  double weight[POINTS];
} rule;

/* Returns the rule that is exact for polynomials of degree order - 1. */
static rule of_polynomial(int order)
{
  rule r = {.order = order};
  double binomial = -1;
  for (int j = 0; j < order; j++) r.weight[j] = binomial *= -(double)(order - j) / (j + 1);
  return r;
}

/* Returns the square of the error with which a rule predicts the last displacement. */
static double square_error(const flesh_extrapolation *self, const rule *r)
{
  const double(*g)[POINTS] = self->products;
  double square = g[0][0];
  for (int j = 0; j < r->order; j++) {
    square -= 2 * r->weight[j] * g[0][1 + j];
    for (int k = 0; k < r->order; k++) square += r->weight[j] * r->weight[k] * g[1 + j][1 + k];
  }
  return fmax(square, 0);
}

/* Solves the symmetric positive definite A x = b by Cholesky's method; overwrites A, and b with x. */
static void solve(int n, double A[POINTS][POINTS], double *b)
{
  for (int j = 0; j < n; j++) {
    for (int k = 0; k < j; k++) {
      for (int i = j; i < n; i++) A[i][j] -= A[i][k] * A[j][k];
      b[j] -= A[j][k] * b[k];
    }
    const double root = sqrt(A[j][j]);
    for (int i = j; i < n; i++) A[i][j] /= root;
    b[j] /= root;
  }
  for (int j = n - 1; j >= 0; j--) {
    for (int i = j + 1; i < n; i++) b[j] -= A[i][j] * b[i];
    b[j] /= A[j][j];
  }
}

/* Finds the rule of an order that predicts displacement `now` best: least squares in the differences of the
 * displacements before, which are less alike than these are. */
static rule of_best_fit(const flesh_extrapolation *self, int order, int now)
{
  const double(*g)[POINTS] = self->products, negligible = 1e-13 * g[now + 1][now + 1];
  double difference[POINTS][POINTS] = {{0}}, A[POINTS][POINTS] = {{0}}, b[POINTS] = {0};
  for (int m = 0; m < order; m++) {
    difference[m][0] = 1;
    for (int j = 1; j <= m; j++) difference[m][j] = difference[m - 1][j] - difference[m - 1][j - 1];
  }
  for (int m = 0; m < order; m++)
    for (int j = 0; j < order; j++) {
      b[m] += difference[m][j] * g[now][now + 1 + j];
      for (int l = 0; l < order; l++)
        for (int k = 0; k < order; k++)
          A[m][l] += difference[m][j] * difference[l][k] * g[now + 1 + j][now + 1 + k];
    }
  for (int m = 0; m < order; m++) A[m][m] = fmax(A[m][m], 0) + negligible + DBL_MIN;
  solve(order, A, b);
  rule r = {.order = order};
  for (int m = 0; m < order; m++)
    for (int j = 0; j < order; j++) r.weight[j] += b[m] * difference[m][j];
  return r;
}

/* Finds anew the rule that, known a step ago, would have predicted the last displacement best. */
static rule choose(const flesh_extrapolation *self)
{
  if (self->known <= 3) return of_polynomial(self->known);
  rule best = of_polynomial(1);
  double least = square_error(self, &best);
  for (int order = 2; order < self->known; order++) {
    const rule polynomial = of_polynomial(order);
    const double square = square_error(self, &polynomial);
    if (square < least) {
      least = square;
      best = polynomial;
    }
  }
  for (int order = 2; order < self->known - 1; order++) {
    const rule before = of_best_fit(self, order, 1), now = of_best_fit(self, order, 0);
    const double square = square_error(self, &before);
    if (square < least && isfinite(square_error(self, &now))) {
      least = square;
      best = now;
    }
  }
  return best;
}

typedef struct sum {
  const flesh_extrapolation *of;
  rule rule;
  double *u;
} sum;

static void sum_part(void *data, int k, int from, int until)
{
  enum { CHUNK = 1024 }; /* block that stays in the first-level cache between loops */
  (void)k;
  const sum *s = data;
  for (int begin = from, end; begin < until; begin = end) {
    end = until - begin < CHUNK ? until : begin + CHUNK;
    memset(s->u + begin, 0, (size_t)(end - begin) * sizeof *s->u);
    for (int j = 0; j < s->rule.order; j++) {
      const double *u = s->of->u[j], weight = s->rule.weight[j];
      for (int d = begin; d < end; d++) s->u[d] += weight * u[d];
    }
  }
}

int flesh_extrapolation_guess(const flesh_extrapolation *self, long serial, double t, double h, double *u)
{
  if (!continues(self, serial, t, h)) return 0;
  flesh_parallel_parts(self->threads, self->n, sum_part, &(sum){self, choose(self), u});
  return 1;
}

typedef struct memory {
  flesh_extrapolation *self;
  const double *u;
  double products[FLESH_PARALLEL_PARTS_MAX][POINTS];
} memory;

/* Takes in the newest displacement, and its products with all others. */
static void remember_part(void *data, int k, int begin, int end)
{
  memory *m = data;
  double **u = m->self->u;
  memcpy(u[0] + begin, m->u + begin, (size_t)(end - begin) * sizeof *m->u);
  const int all = m->self->own, own = begin > all ? begin : end < all ? end : all; /* end of this rank's own numbers */
  for (int i = 0; i < m->self->known; i++) m->products[k][i] = flesh_dot_of_part(u[0], u[i], begin, own);
}

void flesh_extrapolation_remember(flesh_extrapolation *self, const double *u, long serial, double t, double h, int easy)
{
  if (!easy || fabs(h - self->h) > 1e-9 * h || fabs(t - h - self->t) > 1e-6 * h) self->known = 0;
  double *oldest = self->u[POINTS - 1];
  memmove(self->u + 1, self->u, (POINTS - 1) * sizeof *self->u);
  for (int i = POINTS - 1; i > 0; i--)
    memcpy(self->products[i] + 1, self->products[i - 1], (POINTS - 1) * sizeof *self->products[i]);
  self->u[0] = oldest;
  if (self->known < POINTS) self->known++;
  memory m = {.self = self, .u = u};
  const int parts = flesh_parallel_parts(self->threads, self->n, remember_part, &m);
  double sums[POINTS] = {0};
  for (int i = 0; i < self->known; i++)
    for (int k = 0; k < parts; k++) sums[i] += m.products[k][i];
  flesh_team_sum(flesh_threads_team(self->threads), self->known, sums);
  for (int i = 0; i < self->known; i++) self->products[0][i] = self->products[i][0] = sums[i];
  self->serial = serial;
  self->t = t;
  self->h = h;
}

void flesh_extrapolation_archive(flesh_extrapolation *self, flesh_archive *archive)
{
  const size_t nodes = (size_t)self->n / 3;
  flesh_archive_int(archive, &self->known, 0, POINTS);
  FLESH_ARCHIVE(archive, self->serial);
  FLESH_ARCHIVE(archive, self->t);
  FLESH_ARCHIVE(archive, self->h);
  FLESH_ARCHIVE(archive, self->products);
  for (int k = 0; k < self->known; k++) flesh_archive_nodes(archive, self->u[k], nodes);
}
