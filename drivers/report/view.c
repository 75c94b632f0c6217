/* view.c: the bodies in motion in a report: positions and fields as numbers, and their description as JSON. Positions and
 * values are rounded to whole numbers, and of each frame only the differences from what the two frames before predict are
 * written; report.h has the format. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli/json_memory.h"
#include "math/nearest.h"
#include "picture/picture.h"
#include "picture/picture_body.h"
#include "picture/picture_legend.h"
#include "picture/snapshot.h"
#include "report/report.h"
#include "scene/scene.h"

enum { FIELDS = 3 }; /* J, stress and speed */

/* A run's body and obstacles as numbers: their shape once, then one frame after another. */
typedef struct shape {
  int nodes, tets, frames;
  double quantum;                    /* unit of positions, m */
  double low[FIELDS], steps[FIELDS]; /* least value and unit of each field */
  flesh_view view;
  flesh_arena memory;
  size_t total, flag_bytes;
  int *numbers[3];   /* [total] numbers of a frame; frame k is at k % 3 */
  uint8_t *flags[2]; /* [flag_bytes] a bit per tet: whether it is inverted; frame k is at k % 2 */
  double *J;         /* [tets] workspace */
} shape;

/* Returns the nearest multiple of the step, in steps: NaN becomes 0, and others are limited to 2^30 of them. */
static int round_to(double value, double step)
{
  const double MOST = 1 << 30, at = value / step;
  return isnan(at) ? 0 : (int)lrint(fmin(fmax(at, -MOST), MOST));
}

/* Writes positions [3*count], rounded, as all x, all y, all z. Returns the end. */
static int *round_positions(int count, const double *x, double quantum, int *to)
{
  for (int d = 0; d < 3; d++)
    for (int i = 0; i < count; i++) *to++ = round_to(x[3 * (size_t)i + (size_t)d], quantum);
  return to;
}

/* Writes a number in as few bytes as it needs: 0, -1, 1, -2, ... become 0, 1, 2, 3, ..., written seven bits per byte,
 * the lowest first, with the eighth bit set in all bytes but the last. */
static void add_number(FILE *numbers, int64_t value)
{
  uint64_t rest = value < 0 ? 2 * (uint64_t)(-(value + 1)) + 1 : 2 * (uint64_t)value;
  for (; rest > 127; rest >>= 7) putc((int)(rest & 127) | 128, numbers);
  putc((int)rest, numbers);
}

/* Writes numbers as differences, each from the one before it, the first from 0. Returns their place as [at, count]. */
static json_t *add_list(FILE *numbers, size_t count, const int *values)
{
  json_t *place = json_pack("[II]", (json_int_t)ftell(numbers), (json_int_t)count);
  for (size_t k = 0; k < count; k++) add_number(numbers, (int64_t)values[k] - (k ? values[k - 1] : 0));
  return place;
}

/* Writes the triangles of curved faces, and the vertices beyond the nodes that they have: six nodes for each, and their
 * weights in eighths. */
static int add_curved(const flesh_mesh *mesh, FILE *numbers, json_t *made)
{
  flesh_curved_surface curved;
  flesh_arena arena = {0};
  int status = flesh_curved_surface_make(mesh, &arena, &curved);
  const size_t triangles = (size_t)curved.triangles, further = (size_t)(curved.vertices - curved.nodes);
  int *hidden = flesh_arena_take(&arena, triangles * sizeof *hidden);
  if (!status && !hidden) status = flesh_report_no_memory();
  for (size_t t = 0; t < triangles && !status; t++) hidden[t] = curved.hidden[t];
  if (!status) {
    json_object_set_new(made, "corners", add_list(numbers, 3 * triangles, curved.corners));
    json_object_set_new(made, "behind", add_list(numbers, triangles, curved.tets));
    json_object_set_new(made, "hidden", add_list(numbers, triangles, hidden));
    json_object_set_new(made, "six", add_list(numbers, 6 * further, curved.six));
    json_object_set_new(made, "eighths", add_list(numbers, 6 * further, curved.eighths));
  }
  flesh_arena_free(&arena);
  return status;
}

/* Writes the mesh at rest; *made (new) says where it is in `numbers`. */
static int write_mesh(const shape *b, const flesh_mesh *mesh, FILE *numbers, json_t **made)
{
  int triangles, *rest = b->numbers[0]; /* until the first frame is there */
  const int *corners = flesh_mesh_surface(mesh, &triangles);
  *made = json_pack("{sisi}", "nodes", b->nodes, "tet_count", b->tets);
  if (!*made) return flesh_report_no_memory();
  round_positions(b->nodes, flesh_mesh_positions(mesh), b->quantum, rest);
  json_object_set_new(*made, "rest", add_list(numbers, 3 * (size_t)b->nodes, rest));
  json_object_set_new(*made, "tets", add_list(numbers, 4 * (size_t)b->tets, flesh_mesh_tets(mesh)));
  if (flesh_mesh_order(mesh) == 2) {
    json_object_set_new(*made, "edges", add_list(numbers, 6 * (size_t)b->tets, flesh_mesh_tet_edges(mesh)));
    return add_curved(mesh, numbers, *made);
  }
  json_object_set_new(*made, "corners", add_list(numbers, 3 * (size_t)triangles, corners));
  json_object_set_new(*made, "behind", add_list(numbers, (size_t)triangles, flesh_mesh_surface_tets(mesh)));
  return FLESH_OK;
}

/* Opens the shape of the first panel, and writes its obstacles and, unless *mesh is known, its mesh at rest. `frames`
 * [FIELDS]: the ranges of the fields' colours. The caller frees `memory`. */
static int open_shape(const flesh_picture_panel *panel, const flesh_picture_frame *frames, FILE *numbers, shape *b,
                      json_t **mesh, json_t *obstacles)
{
  const double PARTS = 65536, LEVELS = 1024; /* of the body's diagonal, and of the range of colours */
  flesh_picture_scene scene;
  flesh_mesh_info info;
  flesh_mesh_inspect(panel->body->mesh, &info);
  *b = (shape){.nodes = info.nodes, .tets = info.tets, .view = frames[0].view,
               .quantum = flesh_distance(info.low, info.high) / PARTS, .flag_bytes = ((size_t)info.tets + 7) / 8};
  for (int f = 0; f < FIELDS; f++) {
    b->low[f] = frames[f].low;
    b->steps[f] = frames[f].high > frames[f].low ? (frames[f].high - frames[f].low) / LEVELS : 1;
  }
  int status = flesh_picture_obstacles(panel, &b->view, &scene);
  b->total = (3 + FIELDS) * (size_t)b->nodes;
  for (int k = 1; k < scene.count && !status; k++) b->total += 3 * (size_t)scene.surfaces[k].vertices;
  for (int k = 0; k < 3; k++) b->numbers[k] = flesh_arena_take(&b->memory, b->total * sizeof **b->numbers);
  for (int k = 0; k < 2; k++) b->flags[k] = flesh_arena_take(&b->memory, b->flag_bytes);
  b->J = flesh_arena_take(&b->memory, (size_t)b->tets * sizeof *b->J);
  if (!b->numbers[0] || !b->numbers[1] || !b->numbers[2] || !b->flags[0] || !b->flags[1] || !b->J)
    status = flesh_report_no_memory();
  if (!status && !*mesh) status = write_mesh(b, panel->body->mesh, numbers, mesh);
  for (int k = 1; k < scene.count && !status; k++) {
    const flesh_render_surface *s = &scene.surfaces[k];
    json_array_append_new(obstacles, json_pack("{sisfso}", "vertices", s->vertices, "fade", s->fade, "corners",
                                               add_list(numbers, 3 * (size_t)s->triangles, s->corners)));
  }
  flesh_arena_free(&scene.arena);
  return status;
}

/* Computes the numbers of a frame: positions of the body and of the obstacles, and the values of the fields. */
static int gather(shape *b, const flesh_picture_panel *panel)
{
  flesh_picture_scene obstacles;
  int status = flesh_picture_obstacles(panel, &b->view, &obstacles);
  int *to = round_positions(b->nodes, panel->x, b->quantum, b->numbers[b->frames % 3]);
  for (int k = 1; k < obstacles.count && !status; k++) /* the number of vertices does not change */
    to = round_positions(obstacles.surfaces[k].vertices, obstacles.surfaces[k].x, b->quantum, to);
  flesh_arena_free(&obstacles.arena);
  for (int f = 0; f < FIELDS && !status; f++) {
    double *values;
    status = flesh_picture_values(panel, (flesh_picture_field)(FLESH_PICTURE_J + f), &values, NULL);
    for (int i = 0; i < b->nodes && !status; i++) *to++ = round_to(values[i] - b->low[f], b->steps[f]);
    free(values);
  }
  return status;
}

static void flag_inverted(shape *b, const flesh_picture_panel *panel)
{
  uint8_t *flags = b->flags[b->frames % 2];
  flesh_mesh_jacobians(panel->body->mesh, panel->x, b->J, NULL, NULL);
  memset(flags, 0, b->flag_bytes);
  for (int t = 0; t < b->tets; t++)
    if (!(b->J[t] > 0)) flags[t / 8] |= (uint8_t)(1 << t % 8);
}

/* Writes the next frame. */
static int write_frame(shape *b, const flesh_picture_panel *panel, FILE *numbers)
{
  const int f = b->frames, *now = b->numbers[f % 3], *last = b->numbers[(f + 2) % 3], *before = b->numbers[(f + 1) % 3];
  const int status = gather(b, panel);
  if (status) return status;
  flag_inverted(b, panel);
  for (size_t k = 0; k < b->total; k++) {
    const int64_t one = last[k], two = before[k];
    const int64_t predicted = b->frames > 1 ? 2 * one - two : b->frames ? one : k ? now[k - 1] : 0;
    add_number(numbers, now[k] - predicted);
  }
  for (size_t k = 0; k < b->flag_bytes; k++) putc(b->flags[0][k] ^ b->flags[1][k], numbers);
  b->frames++;
  return ferror(numbers) ? flesh_report_no_memory() : FLESH_OK;
}

int flesh_report_bytes_flush(flesh_report_bytes *bytes)
{
  const int lost = fflush(bytes->stream) || ferror(bytes->stream);
  return lost ? flesh_report_no_memory() : FLESH_OK;
}

/* Distances of a run's frames from its first. To be zero-initialised. */
typedef struct motion {
  int count;            /* number of frames */
  double *times, *away; /* [count] s; m^2, sum over nodes */
  double *first;        /* [3*nodes] m, positions of the first frame */
} motion;

/* Adds the next of `frames` frames. FLESH_ERR_MEMORY. */
static int add_motion(motion *m, int frames, const flesh_picture_panel *panel, flesh_arena *arena)
{
  const size_t size = 3 * (size_t)flesh_mesh_node_count(panel->body->mesh);
  if (!m->first) {
    m->times = flesh_arena_take(arena, (2 * (size_t)frames + size) * sizeof *m->times);
    if (!m->times) return flesh_report_no_memory();
    m->away = m->times + frames;
    m->first = m->away + frames;
    memcpy(m->first, panel->x, size * sizeof *m->first);
  }
  double sum = 0;
  for (size_t d = 0; d < size; d++) sum += (panel->x[d] - m->first[d]) * (panel->x[d] - m->first[d]);
  m->times[m->count] = panel->t;
  m->away[m->count++] = isfinite(sum) ? sum : 0;
  return FLESH_OK;
}

/* Returns the run's frame at t, or the last one before; the first frame if there is none. */
static int frame_of_time(const motion *of, double t)
{
  int frame = 0;
  while (frame + 1 < of->count && of->times[frame + 1] <= t) frame++;
  return frame;
}

static double farthest(const motion *of)
{
  double most = 0;
  for (int k = 0; k < of->count; k++) most = fmax(most, of->away[k]);
  return most > 0 ? most : 1;
}

/* Returns the time that is shown first: among those that most runs have, the one at which the runs are farthest from
 * where they began, each relative to its own farthest frame. */
static double find_start(int runs, const motion *motions)
{
  double best = 0, best_away = -1;
  int best_runs = 0;
  for (int r = 0; r < runs; r++)
    for (int k = 0; k < motions[r].count; k++) {
      const double t = motions[r].times[k];
      double away = 0;
      int there = 0;
      for (int s = 0; s < runs; s++) {
        const int frame = frame_of_time(&motions[s], t);
        if (motions[s].times[frame] != t) continue;
        away += motions[s].away[frame] / farthest(&motions[s]);
        there++;
      }
      if (there < best_runs || (there == best_runs && away <= best_away)) continue;
      best = t, best_away = away, best_runs = there;
    }
  return best;
}

/* Leaves at most `most` frames (0: all), evenly taken, the first and the last among them. */
static void thin_out(flesh_run_folder *run, int most)
{
  const int last = run->count - 1;
  if (!most || run->count <= most) return;
  for (int k = 0; k < most; k++) run->frames[k] = run->frames[most < 2 ? last : (int)((int64_t)k * last / (most - 1))];
  run->count = most;
}

/* Fits the ranges of colours and the view to all frames, and computes how far these move. */
static int fit_runs(flesh_report *report, flesh_run_folder *runs, motion *motions,
                    flesh_picture_options options[FIELDS], flesh_picture_frame frames[FIELDS])
{
  flesh_picture_fit fits[FIELDS];
  int status = FLESH_OK;
  for (int f = 0; f < FIELDS; f++) {
    options[f] = options[0];
    options[f].field = (flesh_picture_field)(f + FLESH_PICTURE_J);
    flesh_picture_fit_begin(&options[f], &fits[f]);
  }
  for (int r = 0; r < report->shown_count && !status; r++)
    for (int k = 0; k < runs[r].count && !status; k++) {
      flesh_picture_panel panel;
      status = flesh_run_panel(&runs[r], k, &panel);
      if (!status) status = add_motion(&motions[r], runs[r].count, &panel, &report->arena);
      for (int f = 0; f < FIELDS && !status; f++) status = flesh_picture_fit_add(&fits[f], &panel);
    }
  for (int f = 0; f < FIELDS && !status; f++) flesh_picture_fit_end(&fits[f], &frames[f]);
  return status;
}

static json_t *describe_camera(const flesh_view *view)
{
  return json_pack("{sosososososfsfsf}", "right", flesh_json_numbers(3, view->right), "up", flesh_json_numbers(3, view->up),
                   "back", flesh_json_numbers(3, view->back), "zenith", flesh_json_numbers(3, view->zenith), "target",
                   flesh_json_numbers(3, view->target), "height", view->height, "distance", view->distance,
                   "aspect", (double)view->width_px / view->height_px);
}

static json_t *describe_field(flesh_picture_field field, const flesh_picture_frame *frame)
{
  static const char *const names[] = {"", "J", "stress", "speed"};
  char quantity[64];
  double unit;
  json_t *palette = json_array();
  flesh_picture_quantity(field, frame, quantity, &unit);
  for (int k = 0; k <= 4; k++) {
    double rgb[3];
    flesh_picture_colour(field, k / 4., rgb);
    json_array_append_new(palette, flesh_json_numbers(3, rgb));
  }
  return json_pack("{sssssfsfsfsoso}", "name", names[field], "quantity", quantity, "unit", unit,
                   "low", frame->low, "high", frame->high, "most",
                   isfinite(frame->least) && isfinite(frame->most)
                       ? json_pack("[ff]", frame->least, frame->most)
                       : json_null(),
                   "palette", palette);
}

/* Returns the mesh of an earlier run that is the same; NULL if there is none. */
static json_t *find_same(const flesh_run_folder *runs, int r, const json_t *made)
{
  const flesh_mesh *mesh = flesh_scene_mesh(runs[r].scene);
  const size_t nodes = (size_t)flesh_mesh_node_count(mesh),
               tets = (size_t)flesh_mesh_tet_count(mesh);
  for (int k = 0; k < r; k++) {
    const flesh_mesh *other = flesh_scene_mesh(runs[k].scene);
    if (flesh_mesh_node_count(other) == (int)nodes && flesh_mesh_tet_count(other) == (int)tets &&
        flesh_mesh_order(other) == flesh_mesh_order(mesh) &&
        !memcmp(flesh_mesh_positions(mesh), flesh_mesh_positions(other),
                3 * nodes * sizeof(double)) &&
        !memcmp(flesh_mesh_tets(mesh), flesh_mesh_tets(other), 4 * tets * sizeof(int)))
      return json_incref(json_object_get(json_array_get(made, (size_t)k), "mesh"));
  }
  return NULL;
}

static int add_run(flesh_report *report, flesh_run_folder *runs, int r,
                   const flesh_picture_frame frames[FIELDS])
{
  shape body = {0};
  flesh_run_folder *own = &runs[r];
  flesh_picture_panel panel;
  json_t *times = json_array(), *numbers = json_array(), *steps = json_array(),
         *made = json_object_get(report->view, "runs");
  json_t *obstacles = json_array(), *mesh = find_same(runs, r, made);
  int status = flesh_run_panel(own, 0, &panel);
  if (!status) status = open_shape(&panel, frames, report->numbers.stream, &body, &mesh, obstacles);
  for (int f = 0; f < FIELDS; f++) json_array_append_new(steps, json_pack("[ff]", body.low[f], body.steps[f]));
  const long at = ftell(report->numbers.stream);
  for (int k = 0; k < own->count && !status; k++) {
    status = flesh_run_panel(own, k, &panel);
    if (!status) status = write_frame(&body, &panel, report->numbers.stream);
    json_array_append_new(times, json_real(panel.t));
    json_array_append_new(numbers, json_integer(own->frames[k].number));
  }
  json_array_append_new(
      made,
      json_pack("{sosososososIsisfso}", "name",
                flesh_json_text(report->shown[r].name), "mesh",
                mesh ? mesh : json_null(), "obstacles", obstacles,
                "times", times, "numbers", numbers, "at", (json_int_t)at, "frames_there",
                report->shown[r].frames, "quantum", body.quantum, "fields", steps));
  flesh_arena_free(&body.memory);
  return status;
}

/* Opens the runs to show. Optional ones that cannot be opened are removed from the list, with a note. */
static int open_shown(flesh_report *report, flesh_run_folder *runs)
{
  int kept = 0, few = 0, status = FLESH_OK;
  for (int r = 0; r < report->shown_count && !status; r++) {
    flesh_report_shown shown = report->shown[r];
    status = flesh_run_folder_open(shown.folder, &runs[kept]);
    if (!status) status = flesh_run_folder_take_states(&runs[kept], shown.folder);
    if (status && status != FLESH_ERR_MEMORY && shown.optional) {
      flesh_report_note(report->view, "%s", flesh_error_text());
      flesh_run_folder_close(&runs[kept]);
      status = FLESH_OK;
      continue;
    }
    few += runs[kept].has_states;
    shown.frames = runs[kept].count;
    thin_out(&runs[kept], report->most_frames);
    if (runs[kept].count < shown.frames)
      flesh_report_note(report->view, "Of the %d frames of %.200s %d are shown.", shown.frames, shown.name,
                        runs[kept].count);
    report->shown[kept++] = shown;
  }
  report->shown_count = kept;
  if (few)
    flesh_report_note(report->view, "%d of %d runs left no frames: of these the start, the end and what `flesh drift` keeps "
                                    "between are shown.", few, kept);
  return status;
}

/* Draws the bodies side by side, coloured by J, as the page shows them first. */
static int add_still(flesh_report *report, flesh_run_folder *runs, const motion *motions, double start,
                     const flesh_picture_options *options, const flesh_picture_frame *frame)
{
  const int count = report->shown_count;
  flesh_picture_panel *panels = flesh_arena_take(&report->arena, (size_t)count * sizeof *panels);
  flesh_picture_options own = *options;
  int status = panels ? FLESH_OK : flesh_report_no_memory();
  own.columns = (int)ceil(sqrt(count));
  for (int r = 0; r < count && !status; r++) {
    status = flesh_run_panel(&runs[r], frame_of_time(&motions[r], start), &panels[r]);
    if (status) break;
    panels[r].title = report->shown[r].name;
    panels[r].subtitle = flesh_arena_print(&report->arena, "t = %.4g s", panels[r].t);
    if (!panels[r].subtitle) status = flesh_report_no_memory();
  }
  if (!status) status = flesh_picture_print(report->still.stream, count, panels, &own, frame);
  return status ? status : flesh_report_bytes_flush(&report->still);
}

int flesh_report_make_view(flesh_report *report)
{
  flesh_picture_options options[FIELDS];
  flesh_picture_frame frames[FIELDS];
  flesh_run_folder *runs = flesh_arena_take(&report->arena, (size_t)report->shown_count * sizeof *runs);
  motion *motions = flesh_arena_take(&report->arena, (size_t)report->shown_count * sizeof *motions);
  json_decref(report->view);
  report->view = json_pack("{s[]s[]}", "runs", "notes");
  const int wanted = report->shown_count;
  int status = runs && motions && report->view ? open_shown(report, runs) : flesh_report_no_memory();
  if (!status && report->shown_count) {
    flesh_picture_options_default(&options[0]);
    options[0].camera = flesh_scene_outputs(runs[0].scene)->camera;
    flesh_scene_up(runs[0].scene, options[0].camera.up);
    status = fit_runs(report, runs, motions, options, frames);
    const double start = status ? 0 : find_start(report->shown_count, motions);
    json_object_set_new(report->view, "start", json_real(start));
    if (!status) status = add_still(report, runs, motions, start, &options[0], &frames[0]);
    json_t *fields = json_array();
    for (int f = 0; f < FIELDS && !status; f++)
      json_array_append_new(fields, describe_field(options[f].field, &frames[f]));
    json_object_set_new(report->view, "fields", fields);
    if (!status) json_object_set_new(report->view, "camera", describe_camera(&frames[0].view));
  }
  for (int r = 0; r < report->shown_count && !status; r++)
    status = add_run(report, runs, r, frames);
  if (!status) status = flesh_report_bytes_flush(&report->numbers);
  for (int r = 0; runs && r < wanted; r++) flesh_run_folder_close(&runs[r]);
  return status;
}
