/* pictures.c: the comparison in plots and pictures. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "drift/drift.h"
#include "flesh/scene.h"
#include "picture/picture.h"
#include "picture/plot.h"
#include "run/run_folder.h"
#include "scene/scene.h"
#include "study/table.h"

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
      flesh_plot_note(&outcome, flesh_drift_draw_volumes(plan, s, p));
      for (int g = 0; g < plan->solver_count; g++)
        flesh_plot_note(&outcome, draw_shapes(plan, s, p, plan->solvers[g], scene));
    }
    for (int v = 0; v < plan->variant_count; v++) flesh_plot_note(&outcome, draw_worst(plan, s, v, scene));
    flesh_scene_destroy(&scene);
  }
  return flesh_plot_ended(&outcome);
}
