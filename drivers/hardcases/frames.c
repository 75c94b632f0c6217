/* frames.c: starts and ends of the battery's runs, drawn. */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/text.h"
#include "flesh/scene.h"
#include "picture/picture.h"
#include "picture/picture_body.h"
#include "run/run_folder.h"
#include "hardcases/hardcases.h"

enum { FRAMES = 4 };
static const double REACH = 1.05; /* of a picture, in body lengths */

/* A body in a panel: x NULL: none. */
typedef struct cell {
  double *x, *J;
  double shrunk; /* by how much it is shown smaller, 1 or less */
  char title[64];
  flesh_mesh *mesh; /* owned; NULL: the panel shows another one's body */
  flesh_body body;
} cell;

/* Panels, and what they show. */
typedef struct gallery {
  int room;
  cell *cells;
  flesh_picture_panel *panels;
} gallery;

static int gallery_open(gallery *g, int room)
{
  *g = (gallery){room, calloc((size_t)room + 1, sizeof *g->cells), calloc((size_t)room + 1, sizeof *g->panels)};
  return g->cells && g->panels ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "out of memory");
}

static void gallery_close(gallery *g)
{
  for (int k = 0; g->cells && k < g->room; k++) {
    free(g->cells[k].x), free(g->cells[k].J);
    flesh_mesh_destroy(&g->cells[k].mesh);
  }
  free(g->cells), free(g->panels);
}

/* Shows the cell's body by the triangles of another's, or its own. */
static void show(gallery *g, int place, const flesh_body *body, const char *subtitle)
{
  cell *c = &g->cells[place];
  if (c->mesh) c->body = (flesh_body){.mesh = c->mesh};
  g->panels[place] = (flesh_picture_panel){.title = c->title, .subtitle = subtitle, .body = body, .x = c->x, .J = c->J};
}

/* Into a box about the origin whose side is the body's length; a free body stays in its middle.
 * What is far larger than the picture is shown smaller: returns by how much, 1 or less. */
static double centre(const flesh_hardcases_case *row, const flesh_mesh *mesh, double *x)
{
  flesh_mesh_info info;
  flesh_mesh_inspect(mesh, &info);
  double middle[3];
  for (int c = 0; c < 3; c++) {
    double low = info.low[c], high = info.high[c];
    if (!(row->flags & FLESH_HARDCASES_PINNED)) {
      low = INFINITY, high = -INFINITY;
      for (int i = 0; i < info.nodes; i++)
        low = fmin(low, x[3 * i + c]), high = fmax(high, x[3 * i + c]);
    }
    middle[c] = 0.5 * (low + high);
  }
  double largest = 0, length = 0; /* a block of 2 x 1 x 1 and its diagonal make 1 */
  for (int c = 0; c < 3; c++) length += pow(info.high[c] - info.low[c], 2);
  length = sqrt(length / 1.5);
  for (int d = 0; d < 3 * info.nodes; d++) {
    x[d] = (x[d] - middle[d % 3]) / length;
    largest = fmax(largest, fabs(x[d]));
  }
  if (!(largest > REACH)) return 1;
  for (int d = 0; d < 3 * info.nodes; d++) x[d] *= REACH / largest;
  return REACH / largest;
}

/* The run at the first of the files that is there; without a run the shape at rest. */
static int read_shape(const flesh_hardcases_plan *plan, const flesh_hardcases_case *row, const flesh_hardcases_run *run,
                      const flesh_mesh *mesh, const char *const files[2], cell *s)
{
  char folder[256], path[1700];
  const int nodes = flesh_mesh_node_count(mesh);
  const size_t size = sizeof(double) * 3 * (size_t)nodes;
  if (run) flesh_hardcases_run_folder(run, folder);
  else if (!(s->x = malloc(size))) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  else memcpy(s->x, flesh_mesh_positions(mesh), size);
  for (int k = 0; k < 2 && !s->x && files[k]; k++) {
    snprintf(path, sizeof path, "%s/%s/%s", plan->out, folder, files[k]);
    s->x = flesh_run_positions(path, nodes);
  }
  if (!s->x) return FLESH_OK;
  s->J = malloc(2 * sizeof(double) * (size_t)flesh_mesh_tet_count(mesh));
  if (!s->J) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  flesh_picture_jacobians(mesh, s->x, s->J);
  s->shrunk = centre(row, mesh, s->x);
  return FLESH_OK;
}

static const char *const ends[2] = {"release/state.txt", "out/state.txt"};

/* Four panels of a case, from `place` on. */
static int add_strip(const flesh_hardcases_plan *plan, const flesh_hardcases_run *run, gallery *g, int place)
{
  static const char *const words[FRAMES] = {"start", "first step", "a tenth", "end"};
  static const char *const files[FRAMES][2] = {{"start.txt"}, {"frame_first.txt"}, {"frame_early.txt"}};
  cell *first = &g->cells[place];
  int status = flesh_hardcases_run_mesh(plan, run, &first->mesh);
  for (int k = 0; k < FRAMES && !status; k++) {
    cell *c = &first[k];
    snprintf(c->title, sizeof c->title, "%s%s%s", k ? "" : run->row->name, k ? "" : ": ", words[k]);
    status = read_shape(plan, run->row, run, first->mesh, k < FRAMES - 1 ? files[k] : ends, c);
    if (c->shrunk > 0 && c->shrunk < 1) flesh_text_add(c->title, sizeof c->title, " (1:%.2g)", 1 / c->shrunk);
    show(g, place + k, &first->body, k < FRAMES - 1 ? "" : flesh_hardcases_outcome_name(run->outcome));
  }
  return status;
}

/* The setting that the frames show: the first energy and solver at the largest Poisson's ratio up
 * to 0.49. */
static const flesh_hardcases_setting *shown(const flesh_hardcases_plan *plan)
{
  const flesh_hardcases_setting *best = &plan->settings[0];
  for (int s = 1; s < plan->setting_count; s++) {
    const flesh_hardcases_setting *other = &plan->settings[s];
    int same = other->energy == best->energy && other->constants == best->constants &&
               other->solver == best->solver && other->step == best->step && other->element == best->element;
    if (same && other->poisson <= 0.49 && other->poisson > best->poisson) best = other;
  }
  return best;
}

/* Options for panels of the given size in pixels, in so many columns. */
static flesh_picture_options options_of(int columns, int width, int height)
{
  flesh_picture_options options;
  flesh_picture_options_default(&options);
  options.columns = columns;
  options.width = width;
  options.height = height;
  options.low = 0.5, options.high = 1.5;
  options.edges = 1;
  for (int d = 0; d < 3; d++) options.camera.target[d] = 0;
  options.camera.height = 1.5;
  return options;
}

int flesh_hardcases_draw_frames(const flesh_hardcases_plan *plan, const char *group)
{
  const flesh_hardcases_setting *setting = shown(plan);
  gallery g;
  int count = 0, status = gallery_open(&g, FRAMES * plan->case_count);
  for (int k = 0; k < plan->run_count && !status && count < plan->case_count; k++) {
    const flesh_hardcases_run *r = &plan->runs[k];
    int first = r->setting->first_poisson && !isnan(r->row->poisson) &&
                r->setting->energy == setting->energy && r->setting->solver == setting->solver &&
                r->setting->element == setting->element;
    if (strcmp(r->row->group, group) || r->seed > 1 || !(r->setting == setting || first)) continue;
    status = add_strip(plan, r, &g, FRAMES * count++);
  }
  if (!status && count) {
    char path[1700];
    const flesh_picture_options options = options_of(count > 1 ? 2 * FRAMES : FRAMES, 190, 130);
    snprintf(path, sizeof path, "%s/frames_%s.png", plan->out, group);
    status = flesh_picture(path, FRAMES * count, g.panels, &options, NULL);
  }
  gallery_close(&g);
  return status;
}

/* Sheets: a row per case, a column per mesh, and above them the meshes at rest. */
enum { SHEET_WIDTH = 112, SHEET_HEIGHT = 70 };

/* The settings that differ from settings[first] in their body only; returns how many. */
static int find_columns(const flesh_hardcases_plan *plan, int first, int *columns)
{
  const flesh_hardcases_setting *s = &plan->settings[first];
  int count = 0;
  for (int k = 0; k < plan->setting_count; k++) {
    const flesh_hardcases_setting *o = &plan->settings[k];
    if (o->energy == s->energy && o->constants == s->constants && o->poisson == s->poisson && o->step == s->step &&
        o->solver == s->solver && o->element == s->element)
      columns[count++] = k;
  }
  return count;
}

static const flesh_hardcases_run *find_run(const flesh_hardcases_plan *plan, int c, int setting)
{
  for (int k = 0; k < plan->run_count; k++)
    if (plan->runs[k].row == plan->cases[c] && plan->runs[k].setting == &plan->settings[setting]) return &plan->runs[k];
  return NULL;
}

/* A column's panels, from the row of the shapes at rest on, whose triangles all of them have. */
static int add_column(const flesh_hardcases_plan *plan, int setting, int column, int columns, gallery *g)
{
  const flesh_hardcases_body *own = plan->settings[setting].body;
  const flesh_body *body = &g->cells[column].body;
  int status = FLESH_OK;
  for (int c = -1; c < plan->case_count && !status; c++) {
    const flesh_hardcases_run *run = c < 0 ? NULL : find_run(plan, c, setting);
    const flesh_hardcases_case *row = plan->cases[c < 0 ? 0 : c];
    const flesh_hardcases_run any = {.row = row, .setting = &plan->settings[setting]};
    const int place = (c + 1) * columns + column, is_run = run && run->outcome != FLESH_HARDCASES_NOT_RUN;
    /* A run that is back at rest keeps no state: it is the shape at rest. */
    const flesh_hardcases_run *kept = is_run && run->outcome != FLESH_HARDCASES_RECOVERED ? run : NULL;
    cell *to = &g->cells[place];
    flesh_mesh *mesh = NULL; /* of the case's size */
    snprintf(to->title, sizeof to->title, "%.60s", c >= 0 ? row->name : own ? own->name : "at rest");
    if (c < 0 || is_run) status = flesh_hardcases_run_mesh(plan, &any, &mesh);
    if (!status && mesh) status = read_shape(plan, row, kept, mesh, ends, to);
    if (c < 0) to->mesh = mesh;
    else flesh_mesh_destroy(&mesh);
    show(g, place, body, kept ? flesh_hardcases_outcome_name(run->outcome) : "");
  }
  return status;
}

int flesh_hardcases_draw_sheet(const flesh_hardcases_plan *plan, int first)
{
  int *settings = calloc((size_t)plan->setting_count, sizeof *settings);
  if (!settings) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  const int columns = find_columns(plan, first, settings), count = columns * (plan->case_count + 1);
  if (columns < 2 || settings[0] != first) {
    free(settings);
    return FLESH_OK;
  }
  gallery g;
  int status = gallery_open(&g, count);
  for (int k = 0; k < columns && !status; k++) status = add_column(plan, settings[k], k, columns, &g);
  if (!status) {
    char path[1700], title[112];
    flesh_picture_options options = options_of(columns, SHEET_WIDTH, SHEET_HEIGHT);
    options.edges = 0;
    options.camera.height = 1.2;
    flesh_hardcases_setting any = plan->settings[first];
    any.body = NULL;
    flesh_hardcases_setting_title(&any, title);
    for (char *p = title; *p; p++) *p = *p == ' ' ? '_' : *p;
    snprintf(path, sizeof path, "%s/sheet_%s.png", plan->out, title);
    status = flesh_picture(path, count, g.panels, &options, NULL);
  }
  gallery_close(&g);
  free(settings);
  return status;
}
