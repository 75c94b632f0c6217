/* collision_reference.h: the reference of test_continuous_collision.c and test_collision_cases.c.
 *
 * Distances are computed in 80 bits by enumerating features. Bounds over intervals of time are proved by bisecting them
 * until the speed of the corners settles each part. Times of contact are roots of the cubic that vanishes when four
 * corners lie in a plane. */
#ifndef FLESH_TEST_COLLISION_REFERENCE_H
#define FLESH_TEST_COLLISION_REFERENCE_H

#include <math.h>
#include <stdio.h>

#include "geometry/continuous_collision.h"
#include "test.h"

static const double keep = 0.1;

typedef struct trial {
  int first, second;
  double x0[4][3], x1[4][3];
} trial;

static double advance(const trial *p)
{
  const double *const x0[4] = {p->x0[0], p->x0[1], p->x0[2], p->x0[3]};
  const double *const x1[4] = {p->x1[0], p->x1[1], p->x1[2], p->x1[3]};
  return flesh_feasible_fraction(p->first, p->second, x0, x1, keep);
}

typedef long double real;

static real dot(const real a[3], const real b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void cross(const real a[3], const real b[3], real c[3])
{
  for (int k = 0; k < 3; k++) c[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static void minus(const real a[3], const real b[3], real d[3])
{
  for (int c = 0; c < 3; c++) d[c] = a[c] - b[c];
}

static real to_segment(const real p[3], const real a[3], const real b[3])
{
  real e[3], d[3];
  minus(b, a, e);
  minus(p, a, d);
  real s = dot(e, e) > 0 ? dot(d, e) / dot(e, e) : 0;
  s = s < 0 ? 0 : s > 1 ? 1 : s;
  for (int c = 0; c < 3; c++) d[c] -= s * e[c];
  return sqrtl(dot(d, d));
}

/* Returns the distance of the planes through p and q with the normal e x f if the feet are inside; else -1. */
static real between_planes(const real e[3], const real f[3], const real d[3], int triangle)
{
  real n[3], u[3], v[3];
  cross(e, f, n);
  const real square = dot(n, n);
  if (!(square > 1e-30L * dot(e, e) * dot(f, f))) return -1;
  cross(d, f, u);
  cross(e, d, v);
  const real s = dot(u, n) / square, t = dot(v, n) / square; /* solves d = s e + t f + along n */
  const int inside = triangle ? s >= 0 && t >= 0 && s + t <= 1 : -s >= 0 && -s <= 1 && t >= 0 && t <= 1;
  return inside ? fabsl(dot(d, n)) / sqrtl(square) : -1;
}

static void place_at(const trial *p, real t, real y[4][3])
{
  for (int k = 0; k < 4; k++)
    for (int c = 0; c < 3; c++) {
      const real from = (real)p->x0[k][c] - p->x0[0][c], to = (real)p->x1[k][c] - p->x1[0][c];
      y[k][c] = from + t * (to - from);
    }
}

static real distance_at(const trial *p, real t)
{
  real y[4][3], e[3], f[3], d[3], least, plane = -1;
  place_at(p, t, y);
  if (p->first == 2) {
    minus(y[1], y[0], e), minus(y[3], y[2], f), minus(y[0], y[2], d);
    least = fminl(fminl(to_segment(y[0], y[2], y[3]), to_segment(y[1], y[2], y[3])),
                  fminl(to_segment(y[2], y[0], y[1]), to_segment(y[3], y[0], y[1])));
    plane = between_planes(e, f, d, 0);
  } else if (p->second == 3) {
    minus(y[2], y[1], e), minus(y[3], y[1], f), minus(y[0], y[1], d);
    least = fminl(fminl(to_segment(y[0], y[1], y[2]), to_segment(y[0], y[2], y[3])), to_segment(y[0], y[3], y[1]));
    plane = between_planes(e, f, d, 1);
  } else {
    least = p->second == 2 ? to_segment(y[0], y[1], y[2]) : to_segment(y[0], y[1], y[1]);
  }
  return plane >= 0 && plane < least ? plane : least;
}

/* Returns a bound of the relative speed of points of different hulls. */
static real speed_of(const trial *p)
{
  real y0[4][3], y1[4][3], most = 0;
  place_at(p, 0, y0);
  place_at(p, 1, y1);
  for (int i = 0; i < p->first; i++)
    for (int j = p->first; j < p->first + p->second; j++) {
      real v[3];
      for (int c = 0; c < 3; c++) v[c] = y1[i][c] - y0[i][c] - (y1[j][c] - y0[j][c]);
      most = fmaxl(most, sqrtl(dot(v, v)));
    }
  return most;
}

/* Whether the distance is at least `bound` from t = a to b; `pieces` counts down, and reaches 0 if that is not
 * settled. */
static int stays_apart(const trial *p, real speed, real a, real b, real bound, int *pieces)
{
  const real middle = (a + b) / 2, distance = distance_at(p, middle);
  if (distance < bound) return 0;
  if (distance - speed * (b - a) / 2 >= bound || --*pieces <= 0) return 1;
  return stays_apart(p, speed, a, middle, bound, pieces) && stays_apart(p, speed, middle, b, bound, pieces);
}

/* Computes the coefficients of (e x f) . d, whose roots are the times at which the four corners lie in a plane. */
static void plane_cubic(const trial *p, real a[4])
{
  real y0[4][3], y1[4][3], x[3][3], v[3][3], n[3][3], u[3];
  place_at(p, 0, y0);
  place_at(p, 1, y1);
  for (int c = 0; c < 3; c++)
    for (int k = 0; k < 3; k++) {
      x[k][c] = y0[k + 1][c] - y0[0][c];
      v[k][c] = y1[k + 1][c] - y1[0][c] - x[k][c];
    }
  cross(x[0], x[1], n[0]);
  cross(x[0], v[1], n[1]);
  cross(v[0], x[1], u);
  cross(v[0], v[1], n[2]);
  for (int c = 0; c < 3; c++) n[1][c] += u[c];
  a[0] = dot(n[0], x[2]);
  a[1] = dot(n[1], x[2]) + dot(n[0], v[2]);
  a[2] = dot(n[2], x[2]) + dot(n[1], v[2]);
  a[3] = dot(n[2], v[2]);
}

static real value_of(int degree, const real *a, real t)
{
  real value = a[degree];
  for (int k = degree - 1; k >= 0; k--) value = value * t + a[k];
  return value;
}

/* Finds its roots from 0 to 1, between those of its derivative. */
static int roots_of(int degree, const real *a, real roots[3])
{
  real derivative[3], ends[5] = {0};
  int count = 0, inner = 0;
  for (int k = 0; k < degree; k++) derivative[k] = (real)(k + 1) * a[k + 1];
  if (degree > 1) inner = roots_of(degree - 1, derivative, ends + 1);
  ends[inner + 1] = 1;
  for (int k = 0; k <= inner; k++) {
    real low = ends[k], high = ends[k + 1];
    const int sign = value_of(degree, a, low) > 0;
    if (sign == (value_of(degree, a, high) > 0)) continue;
    for (int half = 0; half < 70; half++) {
      const real middle = (low + high) / 2;
      if ((value_of(degree, a, middle) > 0) == sign) low = middle;
      else high = middle;
    }
    roots[count++] = high;
  }
  return count;
}

/* Whether the hulls touch at a time up to t at which the corners lie in a plane. */
static int touches_by(const trial *p, real t, real distance)
{
  real a[4], roots[3];
  if (p->first + p->second < 4) return 0;
  plane_cubic(p, a);
  const int count = roots_of(3, a, roots);
  for (int k = 0; k < count; k++)
    if (roots[k] <= t && distance_at(p, roots[k]) < distance) return 1;
  return 0;
}

typedef struct tally {
  int trials, stopped, unsettled, early, touching;
  double largest_part;
} tally;

/* Checks that the advance is not too long and, in the tally, whether it is too short. */
static inline void check_trial(const trial *p, tally *count, const char *what)
{
  const double t = advance(p);
  CHECK(t >= 0 && t <= 1); /* NaN fails */
  const real start = distance_at(p, 0);
  int pieces = 20000;
  const int apart = stays_apart(p, speed_of(p), 0, t, keep * start * (1 - 1e-7L), &pieces) &&
                    distance_at(p, t) >= keep * start * (1 - 1e-7L) && !touches_by(p, t, keep * start * 0.99L);
  count->trials++;
  count->stopped += t < 1;
  count->touching += touches_by(p, 1, 1e-9L * start);
  count->unsettled += pieces <= 0;
  if (!apart) {
    test_failures++;
    printf("# %s: late: t %.17g start %Lg at t %Lg\n", what, t, start, distance_at(p, t));
  }
  if (t < 1) {
    const double part = (double)(distance_at(p, t) / start);
    count->early += part > keep + 0.021;
    if (part > count->largest_part) count->largest_part = part;
  }
}

static unsigned long long state = 1;
static inline double between(double a, double b) { return a + (b - a) * test_uniform(&state); }
static inline double power(double a, double b) { return pow(10, between(a, b)); }

static const int kinds[4][2] = {{1, 3}, {2, 2}, {1, 2}, {1, 1}};

static inline trial random_trial(int kind, double size, double speed)
{
  trial p = {.first = kinds[kind][0], .second = kinds[kind][1]};
  for (int k = 0; k < 4; k++)
    for (int c = 0; c < 3; c++) {
      p.x0[k][c] = size * between(-1, 1);
      p.x1[k][c] = p.x0[k][c] + speed * between(-1, 1);
    }
  return p;
}

#endif
