/* continuous_collision.c: additive advancement by separating planes. */
#include "geometry/continuous_collision.h"

#include <float.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "geometry/contact_closest.h"
#include "math/mat3.h"

/* Functions called for all pairs are compiled separately for each number of corners. */
#define INLINE static inline __attribute__((always_inline))

/* Tolerance of an advancement's end, relative to the distance at the start. */
static const double near_enough = 0.02;

/* Number of steps with planes of fixed direction before turning planes are tried as well; largest number of bisections
 * of a turning plane's time. */
enum { STRAIGHT_STEPS = 3, HALVINGS = 40 };

/* Two hulls relative to their first point: corner k is at y[k] + t e[k]. */
typedef struct motion {
  int first, all;
  double y[4][3], e[4][3];
  double rounding, rounding_speed; /* bound of a gap's rounding error: rounding + t * rounding_speed */
} motion;

/* A unit vector and a lower bound of the hulls' gap along it (also at the positions `others`, unless NULL). The search
 * for a better direction ends once the gap exceeds `enough`. */
typedef struct plane {
  double unit[3], gap, enough;
  const double (*others)[3];
} plane;

INLINE double gap_along(const motion *m, const double y[4][3], const double unit[3])
{
  double least = INFINITY, most = -INFINITY, h;
  for (int k = 0; k < m->first; k++) {
    h = flesh_vec3_dot(unit, y[k]);
    least = h < least ? h : least;
  }
  for (int k = m->first; k < m->all; k++) {
    h = flesh_vec3_dot(unit, y[k]);
    most = h > most ? h : most;
  }
  return least - most;
}

/* Whether the gap along a vector of any length is more than `needed`. */
INLINE int is_wide(const motion *m, const double y[4][3], const double along[3], double needed)
{
  const double gap = gap_along(m, y, along);
  return gap > 0 && gap * gap > needed * needed * flesh_vec3_dot(along, along);
}

/* Replaces the best plane if this direction separates better. */
static void try_direction(const motion *m, const double y[4][3], const double direction[3], plane *best)
{
  const double square = flesh_vec3_dot(direction, direction);
  if (!(square > 0) || square > DBL_MAX) return;
  const double inverse = 1 / sqrt(square);
  const double unit[3] = {inverse * direction[0], inverse * direction[1], inverse * direction[2]};
  double gap = gap_along(m, y, unit);
  if (best->others) {
    const double other = gap_along(m, best->others, unit);
    gap = other < gap ? other : gap;
  }
  if (!(gap > best->gap)) return;
  memcpy(best->unit, unit, sizeof unit);
  best->gap = gap;
}

/* Computes the vector to p from the point of the segment AB nearest to p. */
static void from_segment(const double A[3], const double B[3], const double p[3], double direction[3])
{
  double e[3], d[3];
  for (int c = 0; c < 3; c++) e[c] = B[c] - A[c], d[c] = p[c] - A[c];
  const double along = flesh_vec3_dot(d, e), length = flesh_vec3_dot(e, e);
  if (!(along > 0)) memcpy(direction, d, sizeof d);
  else if (along >= length)
    for (int c = 0; c < 3; c++) direction[c] = p[c] - B[c];
  else
    for (int c = 0; c < 3; c++) direction[c] = d[c] - along / length * e[c];
}

static void try_segment(const motion *m, const double y[4][3], int a, int b, int p, double sign, plane *best)
{
  double direction[3];
  from_segment(y[a], y[b], y[p], direction);
  for (int c = 0; c < 3; c++) direction[c] *= sign;
  try_direction(m, y, direction, best);
}

/* Tries the normal of the edges e and f in the sense of `from`. Returns |e x f|^2 / (|e|^2 |f|^2). */
static double try_normal(const motion *m, const double y[4][3], const double e[3], const double f[3],
                         const double from[3], plane *best)
{
  double n[3];
  flesh_vec3_cross(e, f, n);
  const double side = flesh_vec3_dot(n, from);
  for (int c = 0; c < 3; c++) n[c] = side < 0 ? -n[c] : n[c];
  try_direction(m, y, n, best);
  return flesh_vec3_dot(n, n) / (flesh_vec3_dot(e, e) * flesh_vec3_dot(f, f));
}

/* Whether the foot of the perpendicular from d lies within the triangle with sides e and f (all relative to a corner),
 * so that no edge is nearer. */
static int foot_is_inside(const double e[3], const double f[3], const double d[3])
{
  const double ee = flesh_vec3_dot(e, e), ef = flesh_vec3_dot(e, f), ff = flesh_vec3_dot(f, f);
  const double de = flesh_vec3_dot(d, e), df = flesh_vec3_dot(d, f), determinant = ee * ff - ef * ef;
  const double s = ff * de - ef * df, t = ee * df - ef * de;
  return s >= 0 && t >= 0 && s + t <= determinant;
}

/* Whether the shortest connection of the lines p + s e and q + t f, d = p - q, lies within both segments. */
static int lines_meet_inside(const double e[3], const double f[3], const double d[3])
{
  const double ee = flesh_vec3_dot(e, e), ef = flesh_vec3_dot(e, f), ff = flesh_vec3_dot(f, f);
  const double de = flesh_vec3_dot(d, e), df = flesh_vec3_dot(d, f), determinant = ee * ff - ef * ef;
  const double s = ef * df - ff * de, t = ee * df - ef * de;
  return s >= 0 && t >= 0 && s <= determinant && t <= determinant;
}

/* Squared sine below which the normal of two edges is unreliable, so that directions from their ends are tried as
 * well. */
static const double nearly_parallel = 1e-8;

static void separate_triangle(const motion *m, const double y[4][3], plane *best)
{
  double e[3], f[3], d[3];
  for (int c = 0; c < 3; c++) e[c] = y[2][c] - y[1][c], f[c] = y[3][c] - y[1][c], d[c] = y[0][c] - y[1][c];
  if (try_normal(m, y, e, f, d, best) > nearly_parallel && foot_is_inside(e, f, d)) return;
  for (int k = 1; k < 4 && !(best->gap > best->enough); k++) try_segment(m, y, k, k % 3 + 1, 0, 1, best);
}

static void separate_edges(const motion *m, const double y[4][3], plane *best)
{
  double e[3], f[3], d[3];
  for (int c = 0; c < 3; c++) e[c] = y[1][c] - y[0][c], f[c] = y[3][c] - y[2][c], d[c] = y[0][c] - y[2][c];
  if (try_normal(m, y, e, f, d, best) > nearly_parallel && lines_meet_inside(e, f, d)) return;
  for (int k = 0; k < 4 && !(best->gap > best->enough); k++)
    if (k < 2) try_segment(m, y, 2, 3, k, 1, best);
    else try_segment(m, y, 0, 1, k, -1, best);
}

/* Returns the plane normal to the shortest connection, chosen as the best of the connections that may be the
 * shortest. */
static plane separate(const motion *m, const double y[4][3], const double (*others)[3], double enough)
{
  plane best = {.gap = -INFINITY, .enough = enough, .others = others};
  if (m->first == 2) separate_edges(m, y, &best);
  else if (m->all == 4) separate_triangle(m, y, &best);
  else if (m->all == 3) try_segment(m, y, 1, 2, 0, 1, &best);
  else {
    double d[3];
    for (int c = 0; c < 3; c++) d[c] = y[0][c] - y[1][c];
    try_direction(m, y, d, &best);
  }
  if (best.gap == -INFINITY) best.gap = 0;
  return best;
}

double flesh_hull_distance(int first, int second, const double *const x[4], double unit[3])
{
  motion m = {.first = first, .all = first + second};
  for (int k = 0; k < m.all; k++)
    for (int c = 0; c < 3; c++) m.y[k][c] = x[k][c] - x[0][c];
  const plane p = separate(&m, (const double(*)[3])m.y, NULL, INFINITY);
  memcpy(unit, p.unit, sizeof p.unit);
  return p.gap > 0 ? p.gap : 0;
}

static double within_edge(double part, double length) { return part > 0 ? part < length ? part / length : 1 : 0; }

/* Computes the shortest connection from the second edge to the first (Ericson 2005, Real-Time Collision Detection,
 * section 5.1.9). */
static void connect_edges(const double y[4][3], double connection[3])
{
  double e[3], f[3], r[3];
  for (int c = 0; c < 3; c++) e[c] = y[1][c] - y[0][c], f[c] = y[3][c] - y[2][c], r[c] = y[0][c] - y[2][c];
  const double ee = flesh_vec3_dot(e, e), ef = flesh_vec3_dot(e, f), ff = flesh_vec3_dot(f, f);
  const double er = flesh_vec3_dot(e, r), fr = flesh_vec3_dot(f, r);
  double s = within_edge(ef * fr - er * ff, ee * ff - ef * ef);
  const double t = within_edge(ef * s + fr, ff);
  if (t == 0 || t == 1) s = within_edge(t * ef - er, ee);
  for (int c = 0; c < 3; c++) connection[c] = r[c] + s * e[c] - t * f[c];
}

/* Computes the shortest connection from the triangle to the point. */
static void connect_triangle(const double y[4][3], double connection[3])
{
  double weights[3];
  flesh_contact_nearest_of_triangle(y[0], (const int[]){1, 2, 3}, y[0], weights);
  for (int c = 0; c < 3; c++)
    connection[c] = y[0][c] - weights[0] * y[1][c] - weights[1] * y[2][c] - weights[2] * y[3][c];
}

INLINE int keep_apart(int first, int second, const int nodes[4], const double *x0, const double *x1, double distance)
{
  motion m = {.first = first, .all = first + second};
  double size = 0;
  for (int k = 0; k < m.all; k++)
    for (int c = 0; c < 3; c++) {
      const size_t at = 3 * (size_t)nodes[k] + (size_t)c, from = 3 * (size_t)nodes[0] + (size_t)c;
      m.y[k][c] = x0[at] - x0[from];
      m.e[k][c] = x1 ? x1[at] - x1[from] : 0;
      size += fabs(m.y[k][c]) + fabs(m.e[k][c]);
    }
  const double needed = distance + 16 * DBL_EPSILON * size;
  const double(*y)[3] = (const double(*)[3])m.y, (*end)[3] = (const double(*)[3])m.e; /* m.e holds end positions here,
                                                                                       * not velocities */
  if (!(needed <= DBL_MAX)) return 0;
  if (!x1 && m.all == 4) {
    double connection[3];
    if (first == 2) connect_edges(y, connection);
    else connect_triangle(y, connection);
    return is_wide(&m, y, connection, needed);
  }
  return separate(&m, y, x1 ? end : NULL, needed).gap > needed || (x1 && separate(&m, end, y, needed).gap > needed);
}

int flesh_hulls_stay_apart(int first, int second, const int nodes[4], const double *x0, const double *x1,
                           double distance)
{
  if (x1 || first + second < 4) return keep_apart(first, second, nodes, x0, x1, distance);
  return first == 2 ? keep_apart(2, 2, nodes, x0, NULL, distance) : keep_apart(1, 3, nodes, x0, NULL, distance);
}

/* Sets up the motion. Returns 0 if a position is not finite. */
INLINE int begin(motion *m, const double *const x0[4], const double *const x1[4])
{
  double size = 0, speed = 0, place = 0;
  for (int k = 0; k < m->all; k++)
    for (int c = 0; c < 3; c++) {
      const double from = x0[k][c], to = x1[k][c];
      m->y[k][c] = from - x0[0][c];
      m->e[k][c] = (to - x1[0][c]) - m->y[k][c];
      size += fabs(m->y[k][c]);
      speed += fabs(m->e[k][c]);
      place = fabs(from) > place ? fabs(from) : place;
      place = fabs(to) > place ? fabs(to) : place;
    }
  if (!(size + speed <= 1e70)) return 0;
  /* Bounds for the rounding of differences, of sums of three products, and of stored positions. */
  m->rounding = 8 * DBL_EPSILON * size + 10 * DBL_EPSILON * place;
  m->rounding_speed = 8 * DBL_EPSILON * speed;
  return 1;
}

/* Returns the time for which the gap along p stays at least `floor` as the corners move on from y. */
static double time_to(const motion *m, double y[4][3], const plane *p, double rounding, double floor)
{
  double h[4], v[4], least = INFINITY;
  for (int k = 0; k < m->all; k++) h[k] = flesh_vec3_dot(p->unit, y[k]), v[k] = flesh_vec3_dot(p->unit, m->e[k]);
  for (int i = 0; i < m->first; i++)
    for (int j = m->first; j < m->all; j++) {
      const double gap = h[i] - h[j] - rounding - floor, speed = v[j] - v[i] + m->rounding_speed;
      if (speed > 0 && gap < least * speed) least = gap / speed;
    }
  return least;
}

/* Computes the vectors e, f, d of separate_*, whose triple product vanishes when all four corners are coplanar. */
static void triple(const motion *m, double y[4][3], double efd[3][3])
{
  const int edges = m->first == 2, from = edges ? 0 : 1, other = edges ? 2 : 1;
  for (int c = 0; c < 3; c++) {
    efd[0][c] = y[from + 1][c] - y[from][c];
    efd[1][c] = y[3][c] - y[other][c];
    efd[2][c] = y[0][c] - y[other][c];
  }
}

static double norm(const double a[3]) { return sqrt(flesh_vec3_dot(a, a)); }

/* Polynomials in time, from the corners at y on: e x f (quadratic) and e x f . d (cubic). */
typedef struct turning {
  double n[3][3], h[4]; /* coefficients */
  double still[3], moving[3]; /* lengths of e, f, d, and of their velocities */
} turning;

static turning turn(const motion *m, double y[4][3])
{
  turning t;
  double at[3][3], by[3][3], u[3], v[3], velocities[4][3];
  memcpy(velocities, m->e, sizeof velocities);
  triple(m, y, at);
  triple(m, velocities, by);
  flesh_vec3_cross(at[0], at[1], t.n[0]);
  flesh_vec3_cross(at[0], by[1], u);
  flesh_vec3_cross(by[0], at[1], v);
  flesh_vec3_cross(by[0], by[1], t.n[2]);
  for (int c = 0; c < 3; c++) t.n[1][c] = u[c] + v[c];
  const double sign = flesh_vec3_dot(t.n[0], at[2]) < 0 ? -1 : 1;
  for (int k = 0; k < 4; k++)
    t.h[k] = sign * ((k < 3 ? flesh_vec3_dot(t.n[k], at[2]) : 0) + (k > 0 ? flesh_vec3_dot(t.n[k - 1], by[2]) : 0));
  for (int k = 0; k < 3; k++) t.still[k] = norm(at[k]), t.moving[k] = norm(by[k]);
  return t;
}

/* Whether the plane that turns with the triangle, or with both edges, keeps the hulls apart by `gap` during a time s: a
 * bound on the Bernstein coefficients of a polynomial bounds the polynomial. */
static int turning_plane_separates(const turning *t, double s, double gap)
{
  const double a[4] = {t->h[0], t->h[1] * s, t->h[2] * s * s, t->h[3] * s * s * s};
  const double b[4] = {a[0], a[0] + a[1] / 3, a[0] + (2 * a[1] + a[2]) / 3, a[0] + a[1] + a[2] + a[3]};
  double half[3], whole[3], size = 1;
  for (int c = 0; c < 3; c++) {
    half[c] = t->n[0][c] + t->n[1][c] * s / 2;
    whole[c] = t->n[0][c] + (t->n[1][c] + t->n[2][c] * s) * s;
    size *= t->still[c] + t->moving[c] * s;
  }
  const double length = fmax(norm(t->n[0]), fmax(norm(half), norm(whole)));
  const double needed = gap * length * (1 + 1e-12) + 64 * DBL_EPSILON * size;
  return b[0] > needed && b[1] > needed && b[2] > needed && b[3] > needed;
}

/* Like time_to, with a plane that turns: returns at least half of the longest time, or 0 if the plane does not
 * separate. */
static double time_to_turned(const motion *m, double y[4][3], double t, double floor, double least)
{
  if (m->all < 4 || !(floor > 0)) return 0;
  const turning turned = turn(m, y);
  const double gap = floor + m->rounding + m->rounding_speed;
  double s = 1 - t;
  for (int halved = 0; halved < HALVINGS && s > least; halved++, s /= 2)
    if (turning_plane_separates(&turned, s, gap)) return s;
  return 0;
}

/* Returns the largest squared difference between the displacements of corners of different hulls. */
INLINE double largest_approach(int first, int all, const double y[4][3], const double end[4][3])
{
  double largest = 0;
  for (int i = 0; i < first; i++)
    for (int j = first; j < all; j++) {
      double square = 0;
      for (int c = 0; c < 3; c++) {
        const double e = end[i][c] - end[j][c] - (y[i][c] - y[j][c]);
        square += e * e;
      }
      largest = square > largest ? square : largest;
    }
  return largest;
}

/* Whether the hulls stay more than `distance` apart along a vector, in its sense: on straight paths the gap along it is
 * nowhere less than the smaller of its values at both ends. */
INLINE int stay_apart(const motion *m, const double end[4][3], const double along[3], double distance)
{
  return is_wide(m, (const double(*)[3])m->y, along, distance) && is_wide(m, end, along, distance);
}

INLINE int move_little(int first, int second, const double *const x0[4], const double *const x1[4], double keep,
                       double rounding)
{
  motion m = {.first = first, .all = first + second};
  double between[3], e[3], f[3], normal[3], end[4][3];
  for (int c = 0; c < 3; c++) {
    between[c] = 0;
    for (int k = 0; k < m.all; k++) {
      m.y[k][c] = x0[k][c] - x0[0][c];
      end[k][c] = x1[k][c] - x1[0][c];
      between[c] += m.y[k][c] / (k < first ? first : -second);
    }
  }
  const double(*y)[3] = (const double(*)[3])m.y, (*at_end)[3] = (const double(*)[3])end;
  /* `between` connects points of both hulls, so their distance is at most its length; hulls further apart than
   * sqrt(most) cannot come too near. */
  const double most = largest_approach(first, m.all, y, at_end) / ((1 - keep) * (1 - keep));
  const double needed = (1 + 1e-12) * keep * sqrt(fmin(flesh_vec3_dot(between, between), most)) + rounding;
  if (m.all == 4) { /* try the common normal, which suffices in most cases, then the direction between the middles */
    for (int c = 0; c < 3; c++) {
      e[c] = first == 2 ? y[1][c] : y[2][c] - y[1][c];
      f[c] = y[3][c] - y[first == 2 ? 2 : 1][c];
    }
    flesh_vec3_cross(e, f, normal);
    const double sense = flesh_vec3_dot(normal, between) < 0 ? -1 : 1;
    for (int c = 0; c < 3; c++) normal[c] *= sense;
    if (stay_apart(&m, at_end, normal, needed)) return 1;
  }
  return stay_apart(&m, at_end, between, needed);
}

int flesh_hulls_move_little(int first, int second, const double *const x0[4], const double *const x1[4], double keep,
                            double place)
{
  /* More than 16 times the effect of rounding on gaps, as bounded in `begin`. */
  const double rounding = 16 * 500 * DBL_EPSILON * place / (1 - keep);
  if (first + second < 4) return move_little(first, second, x0, x1, keep, rounding);
  return first == 2 ? move_little(2, 2, x0, x1, keep, rounding) : move_little(1, 3, x0, x1, keep, rounding);
}

double flesh_feasible_fraction(int first, int second, const double *const x0[4], const double *const x1[4],
                               double keep)
{
  motion m = {.first = first, .all = first + second};
  if (!begin(&m, x0, x1)) return 0;
  double y[4][3], t = 0, start = 0, floor = 0;
  int near = 0;
  memcpy(y, m.y, sizeof y);
  for (int step = 0; step < FLESH_ADVANCE_STEPS; step++) {
    const double rounding = m.rounding + t * m.rounding_speed;
    const plane p = separate(&m, (const double(*)[3])y, NULL, INFINITY);
    const double gap = p.gap - rounding;
    if (step == 0) {
      start = gap;
      floor = gap > 0 ? keep * gap : gap; /* hulls that touch may only separate */
    }
    double further = time_to(&m, y, &p, rounding, floor);
    if (step >= STRAIGHT_STEPS && t + further < 1) further = fmax(further, time_to_turned(&m, y, t, floor, further));
    if (t + further >= 1) return 1;
    const int was_near = near;
    near = gap - floor <= near_enough * start;
    if (!(further > 0) || (near && was_near)) return t; /* two near steps in a row: after only one the hulls may be
                                                         * sliding past */
    t += further;
    for (int k = 0; k < m.all; k++)
      for (int c = 0; c < 3; c++) y[k][c] = m.y[k][c] + t * m.e[k][c];
  }
  return t;
}
