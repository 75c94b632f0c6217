/* volumes.c: volume against time, a plot per scene and Poisson's ratio. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/error.h"
#include "base/text.h"
#include "drift/drift.h"
#include "picture/palette.h"
#include "picture/plot.h"
#include "study/csv.h"

/* The volume of a case over its run, and the line that draws it. */
typedef struct volumes {
  const flesh_drift_case *c;
  int count, same_as; /* same_as: the line that it lies on, itself where it is the first */
  double *t, *ratio;
  char file[300], title[400];
} volumes;

/* A case without a history has no line. */
static int read_history(const flesh_drift_plan *plan, volumes *v)
{
  char path[1700], folder[256];
  flesh_csv history;
  flesh_drift_case_folder(plan, v->c, folder);
  snprintf(v->file, sizeof v->file, "%s/history.csv", folder);
  snprintf(path, sizeof path, "%s/%s", plan->out, v->file);
  if (flesh_csv_read(path, FLESH_CSV_TORN, &history)) return FLESH_OK;
  const int time = flesh_csv_find(&history, "t"), ratio = flesh_csv_find(&history, "volume_ratio");
  v->t = malloc(sizeof *v->t * (size_t)(history.rows + 1));
  v->ratio = malloc(sizeof *v->ratio * (size_t)(history.rows + 1));
  const int status = v->t && v->ratio ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  for (int row = 0; row < history.rows && !status && time >= 0 && ratio >= 0; row++, v->count++) {
    flesh_csv_number(&history, row, time, &v->t[row]);
    flesh_csv_number(&history, row, ratio, &v->ratio[row]);
  }
  flesh_csv_clear(&history);
  return status;
}

/* The range of the runs that reach the end; a run that blows up leaves the picture instead of flattening the others. */
static void find_range(int count, const volumes *all, double range[2])
{
  double low = 0.98, high = 1.02;
  for (int k = 0; k < count; k++)
    for (int n = 0; n < all[k].count && !all[k].c->figures.status; n++)
      low = fmin(low, all[k].ratio[n]), high = fmax(high, all[k].ratio[n]);
  double margin = 0.06 * (high - low);
  range[0] = low - margin;
  range[1] = high + margin;
}

/* Whether the eye could distinguish them nowhere. */
static int coincide(const volumes *a, const volumes *b, const double range[2])
{
  if (a->count != b->count || !a->c->figures.status != !b->c->figures.status) return 0;
  for (int n = 0; n < a->count; n++)
    if (a->t[n] != b->t[n] || !(fabs(a->ratio[n] - b->ratio[n]) < 1e-3 * (range[1] - range[0]))) return 0;
  return 1;
}

static void add_name(const flesh_drift_plan *plan, const volumes *v, char title[400])
{
  char name[16];
  flesh_drift_variant_title(plan->variants[v->c->variant], name);
  flesh_text_add(title, 400, "%s%s, %s", *title ? "; " : "", name, flesh_drift_solver_name(v->c->solver));
}

/* Marks the last visible point of a run that stops: on its line, or at its crossing of the picture's edge. */
static void mark_stop(const volumes *v, const double range[2], flesh_plot_series *series)
{
  int n = 0;
  while (n < v->count - 1 && v->ratio[n] >= range[0] && v->ratio[n] <= range[1]) n++;
  if (!v->count || !isfinite(v->ratio[n])) return;
  double edge = fmin(fmax(v->ratio[n], range[0]), range[1]), share = 1;
  if (n && edge != v->ratio[n]) share = (edge - v->ratio[n - 1]) / (v->ratio[n] - v->ratio[n - 1]);
  series->stops = 1;
  series->stop_x = n ? v->t[n - 1] + share * (v->t[n] - v->t[n - 1]) : v->t[n];
  series->stop_y = edge;
}

static int make_series(const flesh_drift_plan *plan, int count, volumes *all, const double range[2],
                       flesh_plot_series *series)
{
  int lines = 0;
  for (int k = 0; k < count; k++) {
    volumes *v = &all[k];
    v->same_as = k;
    for (int other = 0; other < k && v->same_as == k; other++)
      if (all[other].same_as == other && coincide(&all[other], v, range)) v->same_as = other;
    add_name(plan, v, all[v->same_as].title);
  }
  for (int k = 0; k < count; k++) {
    volumes *v = &all[k];
    const flesh_drift_variant *variant = &plan->variants[v->c->variant];
    if (v->same_as != k || !v->count) continue;
    if (v->c->figures.status) flesh_text_add(v->title, sizeof v->title, " (stops at %.3g s)", v->c->figures.failed_at);
    /* The two D's share a colour: the deflation sets them apart. */
    const char *colour = variant->constants == FLESH_CONSTANTS_AS_E ? "#d08ac8" : flesh_palette_colour(variant->energy);
    series[lines] = (flesh_plot_series){v->title, v->file, "t", "volume_ratio", colour,
                                        .dashed = v->c->solver == FLESH_DRIFT_PLAIN};
    if (v->c->figures.status) mark_stop(v, range, &series[lines]);
    lines++;
  }
  return lines;
}

int flesh_drift_draw_volumes(const flesh_drift_plan *plan, int scene, int poisson)
{
  int room = plan->variant_count * plan->solver_count, count = 0, status = FLESH_OK;
  flesh_plot_series *series = calloc((size_t)room, sizeof *series);
  volumes *all = calloc((size_t)room, sizeof *all);
  if (!series || !all) status = flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  for (int k = 0; k < plan->case_count && !status; k++) {
    const flesh_drift_case *c = &plan->cases[k];
    if (c->scene != scene || c->poisson != poisson || c->figures.exit_code == 2) continue;
    all[count].c = c;
    status = read_history(plan, &all[count++]);
  }
  char name[128], title[200], extra[96];
  double range[2];
  find_range(count, all, range);
  int lines = status ? 0 : make_series(plan, count, all, range, series);
  snprintf(name, sizeof name, "volume_%s_%g", plan->scenes[scene].name, plan->poissons[poisson]);
  snprintf(title, sizeof title, "%s: volume against time, Poisson's ratio %g", plan->scenes[scene].name,
           plan->poissons[poisson]);
  snprintf(extra, sizeof extra, "set yrange [%.6g:%.6g]\n", range[0], range[1]);
  const flesh_plot_lines plot = {title, "time t [s]", "volume / volume of the mesh", extra, lines, series};
  if (!status && lines) status = flesh_plot_lines_draw(plan->out, name, &plot);
  for (int k = 0; k < count; k++) free(all[k].t), free(all[k].ratio);
  free(all);
  free(series);
  return status;
}
