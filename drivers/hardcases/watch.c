/* watch.c: the incremental potential, costs, recovery and frames of a run of the battery. */
#include "hardcases/watch.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/error.h"
#include "base/sort.h"
#include "flesh/scene.h"
#include "mesh/mesh.h"

int flesh_hardcases_watch_open(flesh_hardcases_watch *w, const flesh_mesh *mesh)
{
  w->unknowns = 3 * flesh_mesh_node_count(mesh);
  size_t n = (size_t)w->unknowns;
  w->last.x = calloc(n, sizeof(double));
  w->last.v = calloc(n, sizeof(double));
  w->point = calloc(3 * n, sizeof(double));
  w->zero = calloc(n, sizeof(double));
  w->figures->recovered_at = NAN;
  return w->last.x && w->last.v && w->point && w->zero
             ? FLESH_OK
             : flesh_fail(FLESH_ERR_MEMORY, "out of memory");
}

void flesh_hardcases_watch_close(flesh_hardcases_watch *w)
{
  free(w->last.x), free(w->last.v), free(w->point), free(w->zero), free(w->cost);
}

void flesh_hardcases_watch_release(flesh_hardcases_watch *w)
{
  w->phase++;
  w->timed = w->count;
}

/* The potential of the unknown that leads from the last state to x within h, and the sum of its
 * terms' sizes. Backward Euler: v = u/h, a = (v - v_n)/h; h = 0: statics. */
static int potential(flesh_hardcases_watch *w, const flesh_step_record *record, double h,
                     const double *x, double *phi, double *magnitude)
{
  double *v = w->point + w->unknowns, *a = v + w->unknowns;
  for (int d = 0; d < w->unknowns; d++) {
    v[d] = h > 0 ? (x[d] - w->last.x[d]) / h : 0;
    a[d] = h > 0 ? (v[d] - w->last.v[d]) / h : 0;
  }
  flesh_point point = flesh_point_at(record->state->t, x, v, a);
  point.lagged = (flesh_lagged){w->last.t, w->last.x, w->last.v};
  const flesh_shift shift = {.x = 1, .v = h > 0 ? 1 / h : 0, .a = h > 0 ? 1 / (h * h) : 0};
  *phi = *magnitude = 0;
  return flesh_system_potential(record->system, &point, &shift, phi, magnitude);
}

/* Whether the step's end lies higher than its start with the constrained nodes put in place. Steps
 * that were halved have several potentials, and where a body was untangled the end is not where
 * the solve led: left out. */
static void check_potential(flesh_hardcases_watch *w, const flesh_step_record *record)
{
  double first, last, size, other;
  if (record->stats->solves != 1 || record->stats->untanglings) return;
  double h = flesh_system_has_role(record->system, FLESH_ROLE_INERTIA) ? record->h : 0;
  memcpy(w->point, w->last.x, sizeof(double) * (size_t)w->unknowns);
  flesh_system_prescribe(record->system, record->state->t, w->point);
  if (potential(w, record, h, w->point, &first, &other) ||
      potential(w, record, h, record->state->x, &last, &size))
    return;
  size = fmax(size, other);
  double rise = size > 0 ? (last - first) / size : 0;
  w->figures->rises_checked++;
  w->figures->rises += rise > 1e-12;
  w->figures->worst_rise = fmax(w->figures->worst_rise, rise);
}

static int keep_cost(flesh_hardcases_watch *w, int newton, double seconds)
{
  if (w->count == w->room) {
    int room = w->room ? 2 * w->room : 256;
    void *grown = realloc(w->cost, sizeof *w->cost * (size_t)room);
    if (!grown) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
    w->cost = grown;
    w->room = room;
  }
  w->cost[w->count].newton = newton;
  w->cost[w->count++].seconds = seconds;
  return FLESH_OK;
}

static void keep_frame(const flesh_hardcases_watch *w, const flesh_step_record *record,
                       const char *name)
{
  char path[1500];
  snprintf(path, sizeof path, "%s/%s", w->folder, name);
  flesh_state_write(path, w->unknowns / 3, record->state); /* a picture less is no failure */
}

int flesh_hardcases_watch_observe(void *data, const flesh_step_record *record)
{
  flesh_hardcases_watch *w = data;
  flesh_hardcases_figures *f = w->figures;
  const flesh_solve_stats *stats = record->stats;
  double now = flesh_cpu_seconds();
  if (record->step > 0) {
    int status = keep_cost(w, stats->newton, now - w->clock);
    if (status) return status;
    f->steps++;
    f->simulated_s += record->h;
    f->solves += stats->solves;
    f->untanglings += stats->untanglings;
    f->untangled_nodes += stats->untangled_nodes;
    /* In time n failures have n + 1 successes; an equilibrium is looked for anew after each
     * untangling. */
    f->retried += flesh_system_has_role(record->system, FLESH_ROLE_INERTIA)
                      ? (stats->solves - 1) / 2
                      : stats->solves - 1 - stats->untanglings;
    f->unconverged += stats->unconverged;
    f->at_rounding += stats->at_rounding;
    f->rises += stats->potential_rises; /* of iterates, in halved steps as well */
    f->newton += stats->newton;
    f->linear += stats->linear;
    f->direct += stats->direct;
    f->projections += stats->projections;
    f->backtracks += stats->backtracks;
    check_potential(w, record);
    if (!w->kept_first) keep_frame(w, record, "frame_first.txt"), w->kept_first = 1;
    if (!w->kept_early && record->state->t >= w->early)
      keep_frame(w, record, "frame_early.txt"), w->kept_early = 1;
  }
  for (int d = 0; d < w->unknowns; d++)
    if (!isfinite(record->state->x[d]) || !isfinite(record->state->v[d])) f->finite = 0;
  f->max_inverted = record->inverted > f->max_inverted ? record->inverted : f->max_inverted;
  f->inverted_end = record->inverted;
  if (w->rest) {
    f->distance = flesh_mesh_distance_from_rest(w->rest, record->state->x);
    double volume = flesh_mesh_volume(w->rest, flesh_mesh_positions(w->rest));
    f->volume_error = fabs(flesh_mesh_volume(w->rest, record->state->x) / volume - 1);
    int back = f->distance < FLESH_HARDCASES_TOLERANCE && f->volume_error < FLESH_HARDCASES_TOLERANCE &&
               !record->inverted;
    if (!back) f->recovered_at = NAN;
    else if (isnan(f->recovered_at)) f->recovered_at = record->state->t;
  }
  memcpy(w->last.x, record->state->x, sizeof(double) * (size_t)w->unknowns);
  memcpy(w->last.v, record->state->v, sizeof(double) * (size_t)w->unknowns);
  w->last.t = record->state->t;
  w->clock = flesh_cpu_seconds(); /* what observing costs is no part of a step */
  return FLESH_OK;
}

static double worst_over_median(int count, double *values)
{
  if (count < 3) return NAN;
  qsort(values, (size_t)count, sizeof *values, flesh_compare_double);
  double median = values[count / 2];
  return median > 0 ? values[count - 1] / median : NAN;
}

void flesh_hardcases_watch_finish(flesh_hardcases_watch *w)
{
  int count = w->phase ? w->timed : w->count;
  double *values = malloc(sizeof *values * (size_t)(count + 1));
  if (!values) return;
  for (int k = 0; k < count; k++) values[k] = w->cost[k].newton;
  w->figures->newton_ratio = worst_over_median(count, values);
  for (int k = 0; k < count; k++) values[k] = w->cost[k].seconds;
  w->figures->time_ratio = worst_over_median(count, values);
  free(values);
}
