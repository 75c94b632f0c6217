/* pictures.c: the bodies of the comparison side by side, as the table `panels` of data/studies/drift_pictures.sql says. */
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
#include "study/database.h"

/* A panel's body as it was at a state file of the case; x NULL: there is none. */
typedef struct body_panel {
  double *x;
  char title[64], subtitle[96];
} body_panel;

/* The window that shows the bodies that are whole: twice the rest shape about it at most. */
static int draw_panels(const flesh_drift_plan *plan, const char *name, const flesh_scene *scene, int count,
                       body_panel *bodies, int columns)
{
  const flesh_mesh *mesh = flesh_scene_mesh(scene);
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
  options.camera = flesh_scene_outputs(scene)->camera;
  flesh_scene_up(scene, options.camera.up);
  options.columns = columns;
  options.width = 300;
  snprintf(path, sizeof path, "%s/%s.png", plan->out, name);
  int status = flesh_picture(path, count, panels, &options, NULL);
  free(panels);
  return status;
}

/* The picture of `count` panels that the query's rows have. */
static int draw_picture(const flesh_drift_plan *plan, const char *name, const flesh_scene *scene, int count, int columns,
                        sqlite3_stmt *query)
{
  body_panel *bodies = calloc((size_t)count, sizeof *bodies);
  if (!bodies) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  sqlite3_reset(query);
  sqlite3_bind_text(query, 1, name, -1, SQLITE_TRANSIENT);
  for (int k = 0; k < count && sqlite3_step(query) == SQLITE_ROW; k++) {
    char path[1700];
    snprintf(bodies[k].title, sizeof bodies[k].title, "%s", (const char *)sqlite3_column_text(query, 0));
    snprintf(bodies[k].subtitle, sizeof bodies[k].subtitle, "%s", (const char *)sqlite3_column_text(query, 1));
    snprintf(path, sizeof path, "%s/%s", plan->out, (const char *)sqlite3_column_text(query, 2));
    bodies[k].x = flesh_run_positions(path, flesh_mesh_node_count(flesh_scene_mesh(scene)));
  }
  const int status = draw_panels(plan, name, scene, count, bodies, columns);
  for (int k = 0; k < count; k++) free(bodies[k].x);
  free(bodies);
  return status;
}

int flesh_drift_draw(const void *data, sqlite3 *database)
{
  const flesh_drift_plan *plan = data;
  flesh_plot_outcome outcome = {0};
  sqlite3_stmt *pictures = NULL, *panels = NULL;
  if (sqlite3_prepare_v2(database, "SELECT picture, count(*), count(*) / count(DISTINCT at) FROM panels WHERE scene = ? "
                                   "GROUP BY picture", -1, &pictures, NULL) ||
      sqlite3_prepare_v2(database, "SELECT title, subtitle, file FROM panels WHERE picture = ? ORDER BY at, number", -1, &panels,
                         NULL))
    flesh_plot_note(&outcome, flesh_database_fail(database, "drift.db", "cannot be asked for panels"));
  for (int s = 0; s < plan->scene_count && pictures && panels; s++) {
    flesh_scene *scene = NULL;
    const int status = flesh_drift_read(plan, s, &scene);
    flesh_plot_note(&outcome, status);
    sqlite3_reset(pictures);
    sqlite3_bind_text(pictures, 1, plan->scenes[s].name, -1, SQLITE_STATIC);
    while (!status && sqlite3_step(pictures) == SQLITE_ROW)
      flesh_plot_note(&outcome, draw_picture(plan, (const char *)sqlite3_column_text(pictures, 0), scene,
                                             sqlite3_column_int(pictures, 1), sqlite3_column_int(pictures, 2), panels));
    flesh_scene_destroy(&scene);
  }
  sqlite3_finalize(pictures);
  sqlite3_finalize(panels);
  return flesh_plot_ended(&outcome);
}
