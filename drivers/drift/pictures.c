/* pictures.c: the comparison in plots of the volume against time, one for each scene and Poisson's ratio, and in pictures. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/text.h"
#include "drift/drift.h"
#include "flesh/scene.h"
#include "material/form.h"
#include "picture/picture.h"
#include "picture/plot.h"
#include "run/run_folder.h"
#include "scene/scene.h"
#include "study/csv.h"
#include "study/table.h"

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
    const char *colour = variant->constants == FLESH_CONSTANTS_AS_E ? "#d08ac8" : flesh_forms[variant->energy].colour;
    series[lines] = (flesh_plot_series){v->title, v->file, "t", "volume_ratio", colour,
                                        .dashed = v->c->solver == FLESH_DRIFT_PLAIN};
    if (v->c->figures.status) mark_stop(v, range, &series[lines]);
    lines++;
  }
  return lines;
}

static int draw_volumes(const flesh_drift_plan *plan, int scene, int poisson)
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

/* A panel's body as it was at a state file of the case; x NULL: there is none. */
typedef struct body_panel {
  double *x;
  char title[64], subtitle[96];
} body_panel;

static void free_panels(int count, body_panel *bodies)
{
  for (int k = 0; k < count; k++) free(bodies[k].x);
  free(bodies);
}

/* The window that shows the bodies that are whole: twice the rest shape about it at most. */
static int draw_panels(const flesh_drift_plan *plan, const char *name, const flesh_scene *scene,
                       int count, body_panel *bodies, int columns)
{
  const flesh_mesh *mesh = flesh_scene_mesh(scene);
  const flesh_camera *camera = &flesh_scene_outputs(scene)->camera;
  const flesh_body body = {.mesh = mesh};
  flesh_picture_panel *panels = calloc((size_t)count, sizeof *panels);
  if (!panels) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  flesh_mesh_info info;
  flesh_mesh_inspect(mesh, &info);
  double reach = 0;
  for (int c = 0; c < 3; c++) reach = fmax(reach, 2 * (info.high[c] - info.low[c]));
  for (int k = 0; k < count; k++) {
    double *x = bodies[k].x;
    int whole = x != NULL;
    for (int d = 0; whole && d < 3 * info.nodes; d++)
      whole = x[d] > info.low[d % 3] - reach && x[d] < info.high[d % 3] + reach;
    panels[k] = (flesh_picture_panel){.title = bodies[k].title,
                                      .subtitle = bodies[k].subtitle,
                                      .body = &body,
                                      .x = whole ? x : NULL};
  }
  char path[1700];
  flesh_picture_options options;
  flesh_picture_options_default(&options);
  options.camera = *camera;
  flesh_scene_up(scene, options.camera.up);
  options.columns = columns;
  options.width = 300;
  snprintf(path, sizeof path, "%s/%s.png", plan->out, name);
  int status = flesh_picture(path, count, panels, &options, NULL);
  free(panels);
  return status;
}

/* Which frame of a case a panel shows. */
typedef enum frame_kind { FRAME_WORST, FRAME_EVENT, FRAME_END } frame_kind;

static void describe(const flesh_drift_plan *plan, const flesh_drift_case *c, frame_kind kind,
                     body_panel *panel)
{
  const struct flesh_drift_figures *f = &c->figures;
  char title[16], drift[FLESH_TABLE_TEXT];
  flesh_drift_variant_title(plan->variants[c->variant], title);
  snprintf(panel->title, sizeof panel->title, "%s, ν = %g, %s", title, plan->poissons[c->poisson],
           flesh_drift_solver_name(c->solver));
  if (kind == FRAME_END && f->status)
    snprintf(panel->subtitle, sizeof panel->subtitle, "%s at t = %.3g s", flesh_drift_status_word(c),
             f->failed_at);
  else if (kind == FRAME_END)
    snprintf(panel->subtitle, sizeof panel->subtitle, "at the end: volume %s %%",
             flesh_table_text(drift, "%+.3f", 100 * f->final_volume_drift));
  else
    snprintf(panel->subtitle, sizeof panel->subtitle, "t = %.3g s: volume %s %%%s%s",
             kind == FRAME_WORST ? f->worst_t : f->event_t,
             flesh_table_text(drift, "%+.2f", 100 * (kind == FRAME_WORST ? f->worst_drift : f->event_drift)),
             f->status ? "; later " : "", f->status ? flesh_drift_status_word(c) : "");
}

static void add_panel(const flesh_drift_plan *plan, const flesh_drift_case *c, frame_kind kind,
                      const flesh_mesh *mesh, body_panel *panel)
{
  static const char *const files[] = {
      [FRAME_WORST] = "worst_state.txt", [FRAME_EVENT] = "event_state.txt", [FRAME_END] = "state.txt"};
  char folder[256], path[1700];
  flesh_drift_case_folder(plan, c, folder);
  snprintf(path, sizeof path, "%s/%s/%s", plan->out, folder, files[kind]);
  panel->x = flesh_run_positions(path, flesh_mesh_node_count(mesh));
  describe(plan, c, kind, panel);
}

/* The worst frame of an energy at every Poisson's ratio and with every solver, coloured by the mean of J. */
static int draw_worst(const flesh_drift_plan *plan, int scene, int variant,
                      const flesh_scene *drawn)
{
  int room = plan->poisson_count * plan->solver_count, count = 0;
  body_panel *bodies = calloc((size_t)room, sizeof *bodies);
  if (!bodies) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  for (int g = 0; g < plan->solver_count; g++)
    for (int k = 0; k < plan->case_count; k++) {
      const flesh_drift_case *c = &plan->cases[k];
      if (c->scene != scene || c->variant != variant || c->solver != plan->solvers[g]) continue;
      add_panel(plan, c, FRAME_WORST, flesh_scene_mesh(drawn), &bodies[count++]);
    }
  char name[160];
  snprintf(name, sizeof name, "worst_%s_%s_%s", plan->scenes[scene].name,
           flesh_energy_name(plan->variants[variant].energy),
           flesh_constants_name(plan->variants[variant].constants));
  int status = draw_panels(plan, name, drawn, count, bodies, plan->poisson_count);
  free_panels(room, bodies);
  return status;
}

/* All energies side by side at one Poisson's ratio: before the last event (the release) above, the end below. */
static int draw_shapes(const flesh_drift_plan *plan, int scene, int poisson, flesh_drift_solver solver,
                       const flesh_scene *drawn)
{
  int room = 2 * plan->variant_count, count = 0;
  body_panel *bodies = calloc((size_t)room, sizeof *bodies);
  if (!bodies) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  for (frame_kind kind = FRAME_EVENT; kind <= FRAME_END; kind++)
    for (int k = 0; k < plan->case_count; k++) {
      const flesh_drift_case *c = &plan->cases[k];
      if (c->scene != scene || c->poisson != poisson || c->solver != solver) continue;
      add_panel(plan, c, kind, flesh_scene_mesh(drawn), &bodies[count++]);
    }
  char name[160];
  snprintf(name, sizeof name, "shapes_%s_%g_%s", plan->scenes[scene].name, plan->poissons[poisson],
           flesh_drift_solver_name(solver));
  int status = draw_panels(plan, name, drawn, count, bodies, plan->variant_count);
  free_panels(room, bodies);
  return status;
}

int flesh_drift_draw(const void *data)
{
  const flesh_drift_plan *plan = data;
  flesh_plot_outcome outcome = {0};
  for (int s = 0; s < plan->scene_count; s++) {
    flesh_scene *scene = NULL;
    int status = flesh_drift_read(plan, s, &scene);
    flesh_plot_note(&outcome, status);
    if (status) continue;
    for (int p = 0; p < plan->poisson_count; p++) {
      flesh_plot_note(&outcome, draw_volumes(plan, s, p));
      for (int g = 0; g < plan->solver_count; g++)
        flesh_plot_note(&outcome, draw_shapes(plan, s, p, plan->solvers[g], scene));
    }
    for (int v = 0; v < plan->variant_count; v++) flesh_plot_note(&outcome, draw_worst(plan, s, v, scene));
    flesh_scene_destroy(&scene);
  }
  return flesh_plot_ended(&outcome);
}
