/* dense.c: interpolates a track between its times, and estimates the error of that.
 *
 * Hermite interpolation of positions and velocities at up to four times (math/hermite.h), never across a break, at which the
 * motion has a kink. If a break is not one of the track's times, nothing is known between the two times around it. The
 * velocity at a break is the one before it, as every method leaves it. */
#include <gsl/gsl_interp.h>
#include <math.h>

#include "accuracy/track.h"
#include "math/hermite.h"

/* Every `stride`-th time of a track. */
typedef struct nodes {
  const flesh_accuracy_track *track;
  int stride, count;
} nodes;

static double time_of(const nodes *n, int k) { return n->track->t[k * n->stride]; }

typedef struct part {
  int first, last, half; /* nodes; half: the velocity at the first node is that before a break */
} part;

/* Finds the nodes around t that are on its side of all breaks. Returns 0 if a break lies between the two nodes next to
 * t. */
static int smooth_part(const nodes *n, const flesh_accuracy_measure *measure, double t, part *smooth)
{
  const size_t all = (size_t)((n->count - 1) * n->stride);
  const int k = (int)gsl_interp_bsearch(n->track->t, t, 0, all) / n->stride; /* t is between nodes k and k + 1 */
  const double rounding = 1e-9 * (time_of(n, k + 1) - time_of(n, k));
  double before = -INFINITY, after = INFINITY;
  for (int b = 0; b < measure->break_count; b++)
    if (measure->breaks[b] < t - rounding) before = fmax(before, measure->breaks[b]);
    else after = fmin(after, measure->breaks[b]);
  int first = k, last = k + 1;
  if (fabs(t - time_of(n, last)) <= rounding) first = last; /* t is the time of a node */
  else if (fabs(t - time_of(n, first)) <= rounding) last = first;
  else if (time_of(n, first) < before - rounding || time_of(n, last) > after + rounding) return 0;
  while (last > first && last - first < FLESH_HERMITE_TIMES - 1) {
    int down = first > 0 && time_of(n, first - 1) >= before - rounding;
    int up = last < n->count - 1 && time_of(n, last + 1) <= after + rounding;
    if (!down && !up) break;
    if (down && (!up || k - first <= last - k - 1)) --first;
    else ++last;
  }
  *smooth = (part){first, last, last > first && time_of(n, first) <= before + rounding};
  return 1;
}

/* Interpolates at t; returns 0 if the state is not known there. */
static int interpolate(const nodes *n, const flesh_accuracy_measure *measure, double t, double *x, double *v)
{
  const flesh_accuracy_track *track = n->track;
  size_t unknowns = (size_t)track->unknowns;
  double times[FLESH_HERMITE_TIMES], w[FLESH_HERMITE_TIMES][4];
  part smooth = {0};
  if (n->count > 1 && !smooth_part(n, measure, t, &smooth)) return 0;
  const int first = smooth.first, count = smooth.last - first + 1;
  for (int j = 0; j < count; j++) times[j] = time_of(n, first + j);
  for (int j = 0; j < count; j++) flesh_hermite_weights(count, times, smooth.half, j, t, w[j]);
  for (size_t d = 0; d < unknowns; d++) {
    x[d] = v[d] = 0;
    for (int j = 0; j < count; j++) {
      size_t at = (size_t)(first + j) * (size_t)n->stride * unknowns + d;
      x[d] += w[j][0] * track->x[at] + w[j][1] * track->v[at];
      v[d] += w[j][2] * track->x[at] + w[j][3] * track->v[at];
    }
  }
  return 1;
}

int flesh_accuracy_track_at(const flesh_accuracy_track *track, const flesh_accuracy_measure *measure, double t, double *x,
                            double *v)
{
  const nodes all = {track, 1, track->times};
  return interpolate(&all, measure, t, x, v);
}

/* Finds the largest differences at the times that a coarser choice of nodes leaves out. */
static int hold_out(const flesh_system *system, const flesh_accuracy_measure *measure,
                    const flesh_accuracy_scale *scale, const flesh_accuracy_track *track, int stride,
                    flesh_accuracy_errors *errors)
{
  const nodes coarse = {track, 2 * stride, (track->times - 1) / (2 * stride) + 1};
  flesh_accuracy_track one;
  *errors = (flesh_accuracy_errors){0};
  int status = flesh_accuracy_track_open(1, track->unknowns, &one);
  for (int k = stride; !status && k < (coarse.count - 1) * 2 * stride; k += 2 * stride) {
    *one.t = track->t[k];
    if (!interpolate(&coarse, measure, track->t[k], one.x, one.v)) continue;
    status = flesh_accuracy_track_evaluate(system, &one);
    if (!status) flesh_accuracy_compare_times(measure, scale, &one, 0, track, k, errors);
  }
  flesh_accuracy_track_close(&one);
  return status;
}

/* Extrapolates the error with all nodes from those with every second and with every fourth node: it decreases again by
 * the same factor, limited to the range from 1 to 2^8, that of smooth motions. */
static double left_with_all(double every_second, double every_fourth)
{
  double fall = fabs(every_fourth) / fabs(every_second);
  return every_second == 0 ? 0 : fabs(every_second) / (fall > 1 ? fmin(fall, 256) : 1);
}

int flesh_accuracy_track_doubt(const flesh_system *system, const flesh_accuracy_measure *measure,
                               const flesh_accuracy_scale *scale, const flesh_accuracy_track *track,
                               flesh_accuracy_errors *doubt)
{
  flesh_accuracy_errors second, fourth;
  int status = hold_out(system, measure, scale, track, 1, &second);
  if (!status) status = hold_out(system, measure, scale, track, 2, &fourth);
  if (status) return status;
  *doubt = (flesh_accuracy_errors){left_with_all(second.position_rms, fourth.position_rms),
                                   left_with_all(second.position_max, fourth.position_max),
                                   left_with_all(second.tip, fourth.tip), left_with_all(second.volume, fourth.volume),
                                   left_with_all(second.energy, fourth.energy)};
  return FLESH_OK;
}
