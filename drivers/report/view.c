/* view.c: the bodies in motion in a report: positions and fields as numbers, and their description as JSON. */
#include <math.h>
#include <string.h>

#include "report/body.h"
#include "cli/json_memory.h"
#include "picture/picture.h"
#include "picture/picture_body.h"
#include "picture/picture_legend.h"
#include "picture/snapshot.h"
#include "scene/scene.h"

enum { FIELDS = FLESH_REPORT_FIELDS };

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

static json_t *describe_steps(const flesh_report_body *body)
{
  json_t *list = json_array();
  for (int f = 0; f < FIELDS; f++)
    json_array_append_new(list, json_pack("[ff]", body->low[f], body->steps[f]));
  return list;
}

static int add_run(flesh_report *report, flesh_run_folder *runs, int r,
                   const flesh_picture_frame frames[FIELDS])
{
  flesh_report_body body = {0};
  flesh_run_folder *own = &runs[r];
  flesh_picture_panel panel;
  json_t *times = json_array(), *numbers = json_array(),
         *made = json_object_get(report->view, "runs");
  json_t *obstacles = NULL, *mesh = find_same(runs, r, made);
  int status = flesh_run_panel(own, 0, &panel);
  if (!status) status = flesh_report_body_open(&panel, frames, &body);
  if (!status && !mesh) status = flesh_report_body_mesh(&body, &panel, report->numbers.stream, &mesh);
  if (!status) status = flesh_report_body_obstacles(&body, &panel, report->numbers.stream, &obstacles);
  const long at = ftell(report->numbers.stream);
  for (int k = 0; k < own->count && !status; k++) {
    status = flesh_run_panel(own, k, &panel);
    if (!status) status = flesh_report_body_frame(&body, &panel, report->numbers.stream);
    json_array_append_new(times, json_real(panel.t));
    json_array_append_new(numbers, json_integer(own->frames[k].number));
  }
  json_array_append_new(
      made,
      json_pack("{sosososososIsisfso}", "name",
                flesh_json_text(report->shown[r].name), "mesh",
                mesh ? mesh : json_null(), "obstacles", obstacles ? obstacles : json_null(),
                "times", times, "numbers", numbers, "at", (json_int_t)at, "frames_there",
                report->shown[r].frames, "quantum", body.quantum, "fields", describe_steps(&body)));
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
