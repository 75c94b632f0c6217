/* motion.c: keyframed motions of prescribed groups, springs' targets and obstacles. */
#include "geometry/motion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "math/mat3.h"

const char *const flesh_interpolation_names[] = {"linear", "smooth", NULL};

const flesh_key flesh_keyframe_keys[] = {
    {.name = "time", .type = FLESH_KEY_NUMBER, .offset = offsetof(flesh_keyframe, t), .unit = "s",
     .doc = "time of the keyframe; times must ascend"},
    {.name = "translation", .type = FLESH_KEY_VECTOR, .offset = offsetof(flesh_keyframe, translation),
     .unit = "m", .default_value = "[0, 0, 0]", .doc = "displacement from the rest position"},
    {.name = "rotation", .type = FLESH_KEY_VECTOR, .offset = offsetof(flesh_keyframe, rotation),
     .unit = "rad", .default_value = "[0, 0, 0]",
     .doc = "rotation vector (axis times angle) about the motion's centre; between keyframes the body turns about one "
            "axis, by as many turns as their vectors differ"},
    {0}};

int flesh_motion_copy(const flesh_motion *motion, flesh_motion *copy)
{
  if (motion->count < 1 || !motion->keyframes)
    return flesh_fail(FLESH_ERR_ARGUMENT, "a motion needs at least one keyframe");
  for (int k = 0; k < motion->count; k++) {
    const flesh_keyframe *key = &motion->keyframes[k];
    double sum = fabs(key->t);
    for (int c = 0; c < 3; c++)
      sum += fabs(key->translation[c]) + fabs(key->rotation[c]) + fabs(motion->centre[c]);
    if (!(sum < INFINITY))
      return flesh_fail(FLESH_ERR_ARGUMENT,
                        "keyframe %d at t = %g s or the motion's centre holds a number that is not finite", k,
                        key->t);
  }
  for (int k = 1; k < motion->count; k++)
    if (!(motion->keyframes[k].t > motion->keyframes[k - 1].t))
      return flesh_fail(FLESH_ERR_ARGUMENT,
                        "keyframe %d is at t = %g s, not after keyframe %d at %g s; times must ascend", k,
                        motion->keyframes[k].t, k - 1, motion->keyframes[k - 1].t);
  flesh_keyframe *keyframes = malloc((size_t)motion->count * sizeof *keyframes);
  if (!keyframes) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d keyframes", motion->count);
  memcpy(keyframes, motion->keyframes, (size_t)motion->count * sizeof *keyframes);
  *copy = *motion;
  copy->keyframes = keyframes;
  return FLESH_OK;
}

void flesh_motion_clear(flesh_motion *motion)
{
  free((void *)motion->keyframes);
  motion->keyframes = NULL;
  motion->count = 0;
}

/* Finds the keyframes before and after t; both are the same one outside the motion. */
static void around(const flesh_motion *motion, double t, const flesh_keyframe **a,
                   const flesh_keyframe **b)
{
  int next = 0;
  while (next < motion->count && motion->keyframes[next].t <= t) next++;
  *a = &motion->keyframes[next > 0 ? next - 1 : 0];
  *b = &motion->keyframes[next < motion->count ? next : motion->count - 1];
}

/* Returns the fraction of the interval between the keyframes that is completed at t, as interpolated. */
static double share_of(const flesh_motion *motion, double t, const flesh_keyframe *a, const flesh_keyframe *b)
{
  const double s = b->t > a->t ? (t - a->t) / (b->t - a->t) : 0;
  return motion->smooth ? s * s * (3 - 2 * s) : s;
}

void flesh_motion_at(const flesh_motion *motion, double t, double translation[3])
{
  const flesh_keyframe *a, *b;
  around(motion, t, &a, &b);
  const double s = share_of(motion, t, a, b);
  for (int c = 0; c < 3; c++) translation[c] = (1 - s) * a->translation[c] + s * b->translation[c];
}

/* Computes y = origin + R d for the rotation vector w by Rodrigues' formula. */
static void rotate(const double w[3], const double d[3], const double origin[3], double y[3])
{
  const double angle = sqrt(flesh_vec3_dot(w, w));
  if (angle == 0) {
    for (int c = 0; c < 3; c++) y[c] = origin[c] + d[c];
    return;
  }
  const double axis[3] = {w[0] / angle, w[1] / angle, w[2] / angle}, along = flesh_vec3_dot(axis, d);
  const double cosine = cos(angle), sine = sin(angle);
  double across[3];
  flesh_vec3_cross(axis, d, across);
  for (int c = 0; c < 3; c++)
    y[c] = origin[c] + cosine * d[c] + sine * across[c] + (1 - cosine) * along * axis[c];
}

/* The rotation between keyframes is R(s) = exp(from + s change) exp(before), with a fixed axis and a uniform rate. */
typedef struct turn {
  int one_axis; /* whether both keyframes' rotation vectors share an axis; then `before` is 0 */
  double before[3], from[3], change[3];
} turn;

/* Computes the rotation vector of exp(to) exp(-from); of those that differ by full turns, the one nearest to `to -
 * from`. Uses quaternions (Shoemake, "Animating rotation with quaternion curves", 1985). */
static void difference(const double from[3], const double to[3], double change[3])
{
  const double *const w[2] = {to, from};
  double real[2], vector[2][3], product[3], along = 0;
  for (int k = 0; k < 2; k++) {
    const double angle = sqrt(flesh_vec3_dot(w[k], w[k])), scale = angle > 0 ? sin(angle / 2) / angle : 0.5;
    real[k] = cos(angle / 2);
    for (int c = 0; c < 3; c++) vector[k][c] = (k ? -scale : scale) * w[k][c];
  }
  flesh_vec3_cross(vector[0], vector[1], product);
  for (int c = 0; c < 3; c++) product[c] += real[0] * vector[1][c] + real[1] * vector[0][c];
  const double cosine = real[0] * real[1] - flesh_vec3_dot(vector[0], vector[1]);
  double sine = sqrt(flesh_vec3_dot(product, product)), axis[3], full = 0;
  const double angle = 2 * atan2(sine, cosine), turns = 2 * acos(-1);
  for (int c = 0; c < 3; c++) full += (to[c] - from[c]) * (to[c] - from[c]);
  for (int c = 0; c < 3; c++) { /* without rotation, or for full turns, any axis will do */
    axis[c] = sine > 1e-12 ? product[c] / sine : (to[c] - from[c]) / sqrt(full);
    along += axis[c] * (to[c] - from[c]);
  }
  const double nearest = angle + turns * round((along - angle) / turns);
  for (int c = 0; c < 3; c++) change[c] = nearest * axis[c];
}

static turn turn_between(const flesh_keyframe *a, const flesh_keyframe *b)
{
  turn result = {0};
  double cross[3];
  flesh_vec3_cross(a->rotation, b->rotation, cross);
  const double sizes = flesh_vec3_dot(a->rotation, a->rotation) * flesh_vec3_dot(b->rotation, b->rotation);
  if (flesh_vec3_dot(cross, cross) <= 1e-28 * sizes) { /* one axis, any number of turns */
    result.one_axis = 1;
    memcpy(result.from, a->rotation, sizeof result.from);
    for (int c = 0; c < 3; c++) result.change[c] = b->rotation[c] - a->rotation[c];
    return result;
  }
  memcpy(result.before, a->rotation, sizeof result.before);
  difference(a->rotation, b->rotation, result.change);
  return result;
}

void flesh_motion_apply(const flesh_motion *motion, double t, const double X[3], double y[3])
{
  static const double zero[3] = {0, 0, 0};
  const flesh_keyframe *a, *b;
  around(motion, t, &a, &b);
  const double s = share_of(motion, t, a, b);
  const turn turn = turn_between(a, b);
  double translation[3], w[3], d[3];
  flesh_motion_at(motion, t, translation);
  for (int c = 0; c < 3; c++) {
    w[c] = turn.one_axis ? (1 - s) * a->rotation[c] + s * b->rotation[c] : s * turn.change[c];
    d[c] = X[c] - motion->centre[c];
  }
  if (turn.one_axis && w[0] == 0 && w[1] == 0 && w[2] == 0) {
    for (int c = 0; c < 3; c++) y[c] = X[c] + translation[c];
    return;
  }
  double turned[3];
  rotate(turn.before, d, zero, turned);
  rotate(w, turn.one_axis ? d : turned, motion->centre, y);
  for (int c = 0; c < 3; c++) y[c] += translation[c];
}

/* A function of time with its first two derivatives. */
typedef struct jet {
  double value, rate, second;
} jet;

static jet jet_product(jet f, jet g)
{
  return (jet){f.value * g.value, f.rate * g.value + f.value * g.rate,
               f.second * g.value + 2 * f.rate * g.rate + f.value * g.second};
}

static jet jet_sum(jet f, jet g, double sign)
{
  return (jet){f.value + sign * g.value, f.rate + sign * g.rate, f.second + sign * g.second};
}

static void jet_cross(const jet u[3], const jet w[3], jet result[3])
{
  for (int c = 0; c < 3; c++) {
    int i = (c + 1) % 3, j = (c + 2) % 3;
    result[c] = jet_sum(jet_product(u[i], w[j]), jet_product(u[j], w[i]), -1);
  }
}

/* Returns the sum over k of (-q)^k / (2k + first)!, with q = angle^2: sin(angle)/angle for first = 1, (1 -
 * cos(angle))/angle^2 for first = 2. */
static jet rotation_series(jet q, int first)
{
  double value, rate, second, angle = sqrt(q.value), s = sin(angle), c = cos(angle);
  if (q.value < 1) { /* the closed forms suffer from cancellation */
    double term = first == 1 ? 1 : 0.5;
    value = rate = second = 0;
    for (int k = 0; k < 11; k++) {
      /* term = (-1)^k / (2k + first)! */
      value += term * pow(q.value, k);
      if (k > 0) rate += term * k * pow(q.value, k - 1);
      if (k > 1) second += term * k * (k - 1) * pow(q.value, k - 2);
      term /= -(2. * k + first + 1) * (2. * k + first + 2);
    }
  } else if (first == 1) {
    value = s / angle;
    rate = (angle * c - s) / (2 * q.value * angle);
    second = (3 * s - 3 * angle * c - q.value * s) / (4 * q.value * q.value * angle);
  } else {
    value = (1 - c) / q.value;
    rate = (angle * s - 2 * (1 - c)) / (2 * q.value * q.value);
    second = (q.value * c - 5 * angle * s + 8 * (1 - c)) / (4 * q.value * q.value * q.value);
  }
  return (jet){value, rate * q.rate, second * q.rate * q.rate + rate * q.second};
}

void flesh_motion_rates(const flesh_motion *motion, double t, const double X[3], double v[3],
                        double a[3])
{
  const flesh_keyframe *from, *to;
  around(motion, t, &from, &to);
  if (!(to->t > from->t)) {
    for (int c = 0; c < 3; c++) v[c] = a[c] = 0;
    return;
  }
  double length = to->t - from->t, part = (t - from->t) / length;
  jet s = {part, 1 / length, 0};
  if (motion->smooth)
    s = (jet){part * part * (3 - 2 * part), 6 * part * (1 - part) / length,
              (6 - 12 * part) / (length * length)};
  /* R d = d + A w x d + B w x (w x d). */
  const turn turn = turn_between(from, to);
  jet w[3], d[3], once[3], twice[3], q = {0, 0, 0};
  static const double zero[3] = {0, 0, 0};
  const double from_centre[3] = {X[0] - motion->centre[0], X[1] - motion->centre[1], X[2] - motion->centre[2]};
  double start[3];
  rotate(turn.before, from_centre, zero, start);
  for (int c = 0; c < 3; c++) {
    const double change = turn.change[c];
    w[c] = (jet){turn.from[c] + s.value * change, s.rate * change, s.second * change};
    d[c] = (jet){start[c], 0, 0};
    q = jet_sum(q, jet_product(w[c], w[c]), 1);
  }
  jet_cross(w, d, once);
  jet_cross(w, once, twice);
  jet A = rotation_series(q, 1), B = rotation_series(q, 2);
  for (int c = 0; c < 3; c++) {
    jet y = jet_sum(jet_product(A, once[c]), jet_product(B, twice[c]), 1);
    double change = to->translation[c] - from->translation[c];
    v[c] = y.rate + s.rate * change;
    a[c] = y.second + s.second * change;
  }
}

double flesh_motion_next_event(const flesh_motion *motion, double t)
{
  /* A single keyframe is a motionless target. */
  for (int k = 0; motion->count > 1 && k < motion->count; k++)
    if (motion->keyframes[k].t > t) return motion->keyframes[k].t;
  return INFINITY;
}
