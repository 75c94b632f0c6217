/* parallel_vector.c: splits arrays into parts, and vector operations on the parts. */
#include "base/parallel_vector.h"

#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "base/team.h"

enum { SMALLEST = 4096 }; /* numbers; a smaller part is not worth a task */

typedef struct run {
  int length, size; /* numbers in all, and in a part */
  void (*part)(void *data, int k, int begin, int end);
  void *data;
} run;

static void run_part(void *data, int k)
{
  const run *r = data;
  const int begin = k * r->size, rest = r->length - begin;
  r->part(r->data, k, begin, begin + (rest < r->size ? rest : r->size));
}

int flesh_parallel_parts(flesh_threads *threads, int length, void (*part)(void *data, int k, int begin, int end),
                         void *data)
{
  const int even = length / FLESH_PARALLEL_PARTS_MAX / 8 * 8 + 8, size = even > SMALLEST ? even : SMALLEST;
  const int parts = length / size + (length % size > 0);
  flesh_threads_run(threads, parts, run_part, &(run){length, size, part, data});
  return parts;
}

/* Returns the team over which a vector of n numbers is distributed, or NULL; *own: how many of the numbers this rank
 * owns. */
static const flesh_team *team_of(flesh_threads *threads, int n, int *own)
{
  const flesh_team *team = flesh_threads_team(threads);
  if (team && n != 3 * team->nodes) team = NULL;
  *own = team ? 3 * team->own : n;
  return team;
}

typedef struct pair {
  const double *x, *y;
  double *to, results[FLESH_PARALLEL_PARTS_MAX];
  _Atomic int differ;
} pair;

/* Returns the dot product of a part. It has eight sums, as the compiler may not reorder one, and each addition to one
 * would wait for the one before. */
double flesh_dot_of_part(const double *x, const double *y, int begin, int end)
{
  double s[8] = {0};
  int i = begin;
  for (; i + 8 <= end; i += 8)
    for (int l = 0; l < 8; l++) s[l] += x[i + l] * y[i + l];
  for (; i < end; i++) s[0] += x[i] * y[i];
  return ((s[0] + s[4]) + (s[1] + s[5])) + ((s[2] + s[6]) + (s[3] + s[7]));
}

double flesh_weighted_square_of_part(const double *x, const double *w, int begin, int end)
{
  double s[8] = {0};
  int i = begin;
  for (; i + 8 <= end; i += 8)
    for (int l = 0; l < 8; l++) s[l] += (x[i + l] * w[i + l]) * (x[i + l] * w[i + l]);
  for (; i < end; i++) s[0] += (x[i] * w[i]) * (x[i] * w[i]);
  return ((s[0] + s[4]) + (s[1] + s[5])) + ((s[2] + s[6]) + (s[3] + s[7]));
}

static void dot_part(void *data, int k, int begin, int end)
{
  pair *p = data;
  p->results[k] = flesh_dot_of_part(p->x, p->y, begin, end);
}

double flesh_dot(flesh_threads *threads, int n, const double *x, const double *y)
{
  pair p = {.x = x, .y = y};
  const flesh_team *team = team_of(threads, n, &n);
  const int parts = flesh_parallel_parts(threads, n, dot_part, &p);
  double sum = 0;
  for (int k = 0; k < parts; k++) sum += p.results[k];
  flesh_team_sum(team, 1, &sum);
  return sum;
}

double flesh_norm(flesh_threads *threads, int n, const double *x) { return sqrt(flesh_dot(threads, n, x, x)); }

static void largest_of_part(void *data, int k, int begin, int end)
{
  pair *p = data;
  double m[8] = {0};
  int i = begin;
  for (; i + 8 <= end; i += 8)
    for (int l = 0; l < 8; l++) {
      const double size = fabs(p->x[i + l]);
      m[l] = size > m[l] ? size : m[l];
    }
  for (; i < end; i++) m[0] = fmax(m[0], fabs(p->x[i]));
  for (int l = 1; l < 8; l++) m[0] = fmax(m[0], m[l]);
  p->results[k] = m[0];
}

double flesh_largest(flesh_threads *threads, int n, const double *x)
{
  pair p = {.x = x};
  const flesh_team *team = team_of(threads, n, &n);
  const int parts = flesh_parallel_parts(threads, n, largest_of_part, &p);
  double largest = 0;
  for (int k = 0; k < parts; k++) largest = fmax(largest, p.results[k]);
  flesh_team_largest(team, 1, &largest);
  return largest;
}

static double eighth_power(double d)
{
  const double square = d * d, fourth = square * square;
  return fourth * fourth;
}

static void apart_of_part(void *data, int k, int begin, int end)
{
  pair *p = data;
  double s[8] = {0};
  int i = begin;
  if (p->y)
    for (; i + 8 <= end; i += 8)
      for (int l = 0; l < 8; l++) s[l] += eighth_power(p->x[i + l] - p->y[i + l]);
  else
    for (; i + 8 <= end; i += 8)
      for (int l = 0; l < 8; l++) s[l] += eighth_power(p->x[i + l]);
  for (; i < end; i++) s[0] += eighth_power(p->y ? p->x[i] - p->y[i] : p->x[i]);
  p->results[k] = ((s[0] + s[4]) + (s[1] + s[5])) + ((s[2] + s[6]) + (s[3] + s[7]));
}

double flesh_bound_apart(flesh_threads *threads, int n, const double *x, const double *y)
{
  pair p = {.x = x, .y = y};
  const flesh_team *team = team_of(threads, n, &n);
  const int parts = flesh_parallel_parts(threads, n, apart_of_part, &p);
  double sum = 0;
  for (int k = 0; k < parts; k++) sum += p.results[k];
  flesh_team_sum(team, 1, &sum);
  /* The added 1e-38 covers differences whose eighth power underflows. */
  return isnan(sum) ? INFINITY : sqrt(sqrt(sqrt(sum))) + 1e-38;
}

static void copy_part(void *data, int k, int begin, int end)
{
  (void)k;
  const pair *p = data;
  memcpy(p->to + begin, p->x + begin, (size_t)(end - begin) * sizeof *p->x);
}

void flesh_copy(flesh_threads *threads, int n, const double *from, double *to)
{
  flesh_parallel_parts(threads, n, copy_part, &(pair){.x = from, .to = to});
}

static void compare_part(void *data, int k, int begin, int end)
{
  (void)k;
  pair *p = data;
  if (!atomic_load_explicit(&p->differ, memory_order_relaxed) &&
      memcmp(p->x + begin, p->y + begin, (size_t)(end - begin) * sizeof *p->x))
    atomic_store_explicit(&p->differ, 1, memory_order_relaxed);
}

int flesh_same(flesh_threads *threads, int n, const double *x, const double *y)
{
  pair p = {.x = x, .y = y};
  int own;
  const flesh_team *team = team_of(threads, n, &own);
  /* If they differ, the first numbers mostly show it. */
  p.differ = n > 0 && memcmp(x, y, sizeof *x * (size_t)(n < 64 ? n : 64));
  if (!p.differ) flesh_parallel_parts(threads, n, compare_part, &p);
  double differ = p.differ;
  flesh_team_largest(team, 1, &differ);
  return differ == 0;
}
