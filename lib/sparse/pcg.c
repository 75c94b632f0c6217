/* pcg.c: preconditioned conjugate gradients (Hestenes & Stiefel 1952) on plain arrays. */
#include "sparse/pcg.h"

#include <math.h>
#include <string.h>

#include "sparse/block_matrix.h"

static double dot(int n, const double *x, const double *y)
{
  /* Eight sums: the compiler may not reorder one, and a single chain waits for every addition. */
  double s[8] = {0};
  int i = 0;
  for (; i + 8 <= n; i += 8)
    for (int l = 0; l < 8; l++) s[l] += x[i + l] * y[i + l];
  for (; i < n; i++) s[0] += x[i] * y[i];
  return ((s[0] + s[4]) + (s[1] + s[5])) + ((s[2] + s[6]) + (s[3] + s[7]));
}

static double weighted_norm(int n, const double *weights, const double *r)
{
  if (!weights) return sqrt(dot(n, r, r));
  double s = 0;
  for (int i = 0; i < n; i++) s += weights[i] * r[i] * weights[i] * r[i];
  return sqrt(s);
}

int flesh_pcg(const flesh_block_matrix *A, const flesh_preconditioner_data *preconditioner,
              const double *weights, double tolerance, int max_iterations, const double *b,
              double *x, double *work, flesh_pcg_result *result)
{
  return flesh_pcg_guided(A, preconditioner, &(flesh_pcg_guide){0}, weights, tolerance,
                          max_iterations, b, x, work, result);
}

int flesh_pcg_guided(const flesh_block_matrix *A, const flesh_preconditioner_data *preconditioner,
                     const flesh_pcg_guide *guide, const double *weights, double tolerance,
                     int max_iterations, const double *b, double *x, double *work,
                     flesh_pcg_result *result)
{
  enum { ASK_EVERY = 16 };
  int n = 3 * A->rows;
  double *r = work, *z = work + n, *p = work + 2 * (size_t)n, *Ap = work + 3 * (size_t)n;
  memset(x, 0, (size_t)n * sizeof *x);
  memcpy(r, b, (size_t)n * sizeof *r);
  *result = (flesh_pcg_result){0, weighted_norm(n, weights, r)};
  if (result->residual <= tolerance) return FLESH_OK;
  double rz_before = 0, pMp = 0;
  int last = max_iterations, status = FLESH_NOT_CONVERGED, asked;
  while (result->iterations < last) {
    if (guide->stop && result->iterations % ASK_EVERY == 0 && (asked = guide->stop(guide->stop_data)))
      return asked;
    flesh_preconditioner_apply(preconditioner, r, z);
    double rz = dot(n, r, z);
    /* After a direction without curvature there is no next one. */
    if (!(fabs(rz) < INFINITY)) return status == FLESH_NOT_POSITIVE ? status : FLESH_NONFINITE;
    double beta = result->iterations ? rz / rz_before : 0;
    if (beta == 0)
      memcpy(p, z, (size_t)n * sizeof *p);
    else
      for (int i = 0; i < n; i++) p[i] = z[i] + beta * p[i];
    flesh_block_multiply(A, p, Ap);
    double curvature = dot(n, p, Ap);
    if (!(fabs(curvature) < INFINITY)) return status == FLESH_NOT_POSITIVE ? status : FLESH_NONFINITE;
    pMp = rz + beta * beta * pMp;
    if (!(curvature > 0) && status == FLESH_NOT_CONVERGED) {
      status = FLESH_NOT_POSITIVE;
      if (guide->beyond == 0) break;
      if (guide->beyond < max_iterations - result->iterations) last = result->iterations + guide->beyond;
    }
    double alpha = rz / curvature;
    double downhill = status == FLESH_NOT_POSITIVE ? rz / fmax(fabs(curvature), pMp) : alpha;
    for (int i = 0; i < n; i++) {
      x[i] += downhill * p[i];
      r[i] -= alpha * Ap[i];
    }
    result->iterations++;
    result->residual = weighted_norm(n, weights, r);
    if (result->residual <= tolerance) return status == FLESH_NOT_POSITIVE ? status : FLESH_OK;
    rz_before = rz;
  }
  return status;
}
