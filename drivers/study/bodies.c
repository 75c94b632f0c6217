/* bodies.c: draws the bodies of a study's cases as the tables that its SQL has made ask for. */
#include "study/bodies.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "cli/path.h"
#include "picture/picture.h"
#include "picture/picture_body.h"
#include "flesh/state.h"
#include "study/database.h"

/* A panel's body. */
typedef struct shown {
  flesh_mesh *mesh; /* owned; NULL: the previous panel's mesh, or none */
  flesh_body body;
} shown;

typedef struct gallery {
  const flesh_study *study;
  const char *out;
  int count;
  flesh_picture_panel *panels;
  shown *bodies;
  flesh_arena arena; /* owns everything but the meshes */
  flesh_picture_options options;
} gallery;

/* Moves a body into a box about the origin whose side is the body's length: a body that is held about its place at
 * rest, another about its own middle. Returns the factor by which a body far larger than the picture is shown smaller,
 * 1 or less. */
static double centre(const flesh_mesh_info *info, int is_held, double *x)
{
  const double reach = 1.05; /* largest coordinate in a picture, in lengths of the body */
  double middle[3], largest = 0, length = 0; /* the length is 1 for a block of 2 x 1 x 1 and its diagonal */
  for (int c = 0; c < 3; c++) {
    double low = is_held ? info->low[c] : INFINITY, high = is_held ? info->high[c] : -INFINITY;
    for (int i = 0; i < info->nodes && !is_held; i++) low = fmin(low, x[3 * i + c]), high = fmax(high, x[3 * i + c]);
    middle[c] = 0.5 * (low + high);
    length += pow(info->high[c] - info->low[c], 2);
  }
  length = sqrt(length / 1.5);
  for (int d = 0; d < 3 * info->nodes; d++) largest = fmax(largest, fabs(x[d] = (x[d] - middle[d % 3]) / length));
  for (int d = 0; d < 3 * info->nodes && largest > reach; d++) x[d] *= reach / largest;
  return largest > reach ? reach / largest : 1;
}

int flesh_study_is_near(const flesh_mesh_info *info, const double *x)
{
  double reach = 0;
  for (int c = 0; c < 3; c++) reach = fmax(reach, 2 * (info->high[c] - info->low[c]));
  for (int d = 0; d < 3 * info->nodes; d++)
    if (!(x[d] > info->low[d % 3] - reach && x[d] < info->high[d % 3] + reach)) return 0;
  return 1;
}

/* Reads the positions from the first of the row's files that exists; those at rest if the row names none. Returns them
 * in the arena, or NULL. */
static double *read_positions(gallery *g, sqlite3_stmt *row, const flesh_mesh *mesh)
{
  const int nodes = flesh_mesh_node_count(mesh);
  const size_t n = 3 * (size_t)nodes;
  flesh_state state = {.x = flesh_arena_take(&g->arena, 2 * n * sizeof *state.x)};
  if (!state.x) return NULL;
  state.v = state.x + n;
  if (sqlite3_column_type(row, 4) == SQLITE_NULL) return memcpy(state.x, flesh_mesh_positions(mesh), n * sizeof *state.x);
  for (int k = 4; k < 6 && sqlite3_column_type(row, k) != SQLITE_NULL; k++)
    if (!flesh_state_read(flesh_path("%s/%s", g->out, (const char *)sqlite3_column_text(row, k)), nodes, &state)) return state.x;
  return NULL;
}

/* Prepares a row of `panels`. `shows_scale`: its title says by how much the body is shown smaller. */
static int take_panel(gallery *g, sqlite3_stmt *row, int shows_scale, int *last)
{
  shown *s = &g->bodies[g->count];
  flesh_picture_panel *panel = &g->panels[g->count++];
  panel->body = &s->body;
  panel->title = flesh_arena_print(&g->arena, "%s", (const char *)sqlite3_column_text(row, 1));
  panel->subtitle = flesh_arena_print(&g->arena, "%s", (const char *)sqlite3_column_text(row, 2));
  if (!panel->title || !panel->subtitle) return flesh_no_memory();
  if (sqlite3_column_type(row, 0) == SQLITE_NULL) return FLESH_OK;
  const int number = sqlite3_column_int(row, 0);
  int status = number == *last ? FLESH_OK : g->study->body(g->study->data, number, &s->mesh, &g->options.camera);
  if (status) return status;
  s->body.mesh = number == *last ? s[-1].body.mesh : s->mesh;
  *last = number;
  double *x = read_positions(g, row, s->body.mesh), *J;
  if (!x) return FLESH_OK;
  panel->J = J = flesh_arena_take(&g->arena, 2 * sizeof *J * (size_t)flesh_mesh_tet_count(s->body.mesh));
  if (!J) return flesh_no_memory();
  flesh_picture_jacobians(s->body.mesh, x, J);
  flesh_mesh_info info;
  flesh_mesh_inspect(s->body.mesh, &info);
  if (sqlite3_column_type(row, 3) == SQLITE_NULL) {
    panel->x = flesh_study_is_near(&info, x) ? x : NULL;
    return FLESH_OK;
  }
  panel->x = x;
  const double shrunk = centre(&info, sqlite3_column_int(row, 3), x);
  if (shows_scale && shrunk < 1) panel->title = flesh_arena_print(&g->arena, "%s (1:%.2g)", panel->title, 1 / shrunk);
  return panel->title ? FLESH_OK : flesh_no_memory();
}

static void number_of(sqlite3_stmt *row, int column, double *value)
{
  if (sqlite3_column_type(row, column) != SQLITE_NULL) *value = sqlite3_column_double(row, column);
}

/* Draws a row of `pictures`; `query` finds its panels by the picture's name. */
static int draw_picture(const flesh_study *study, const char *out, sqlite3_stmt *row, sqlite3_stmt *query)
{
  gallery g = {.study = study, .out = out};
  const size_t count = (size_t)sqlite3_column_int(row, 1);
  g.panels = flesh_arena_take(&g.arena, count * sizeof *g.panels);
  g.bodies = flesh_arena_take(&g.arena, count * sizeof *g.bodies);
  int last = -1, status = g.panels && g.bodies ? FLESH_OK : flesh_no_memory();
  flesh_picture_options_default(&g.options);
  g.options.columns = sqlite3_column_int(row, 2);
  g.options.width = sqlite3_column_int(row, 3);
  g.options.height = sqlite3_column_int(row, 4);
  g.options.edges = sqlite3_column_int(row, 5);
  number_of(row, 6, &g.options.low);
  number_of(row, 7, &g.options.high);
  sqlite3_reset(query);
  sqlite3_bind_value(query, 1, sqlite3_column_value(row, 0));
  while (!status && g.count < sqlite3_column_int(row, 1) && sqlite3_step(query) == SQLITE_ROW)
    status = take_panel(&g, query, sqlite3_column_int(row, 9), &last);
  number_of(row, 8, &g.options.camera.height);
  const char *path = flesh_path("%s/%s.png", out, (const char *)sqlite3_column_text(row, 0));
  if (!status) status = flesh_picture(path, g.count, g.panels, &g.options, NULL);
  for (int k = 0; k < g.count; k++) flesh_mesh_destroy(&g.bodies[k].mesh);
  flesh_arena_free(&g.arena);
  return status;
}

void flesh_study_draw_bodies(const flesh_study *study, sqlite3 *database, const char *out, flesh_plot_outcome *outcome)
{
  sqlite3_stmt *pictures = NULL, *panels = NULL;
  int code = SQLITE_DONE;
  if (!sqlite3_prepare_v2(database, "SELECT picture, count(*), columns, width, height, edges, low, high, view, shows_scale "
                                    "FROM pictures JOIN panels USING (picture) GROUP BY picture ORDER BY min(number)",
                          -1, &pictures, NULL) &&
      !sqlite3_prepare_v2(database, "SELECT number, title, subtitle, held, file, fallback FROM panels WHERE picture = ? "
                                    "ORDER BY position", -1, &panels, NULL))
    while ((code = sqlite3_step(pictures)) == SQLITE_ROW)
      flesh_plot_note(outcome, draw_picture(study, out, pictures, panels));
  if (!panels || code != SQLITE_DONE) flesh_plot_note(outcome, flesh_database_fail(database, out, "cannot be asked for panels"));
  sqlite3_finalize(pictures);
  sqlite3_finalize(panels);
}
