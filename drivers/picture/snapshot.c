/* snapshot.c: opens runs for drawing, and makes their panels. */
#include "picture/snapshot.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "cli/lists.h"
#include "picture/picture_legend.h"
#include "scene/scene.h"

void flesh_snapshot_default(flesh_snapshot *s)
{
  *s = (flesh_snapshot){.colour = FLESH_PICTURE_J, .height = NAN, .field_of_view = NAN};
  flesh_picture_options_default(&s->options);
}

/* Chooses the camera: that of the first scene, changed by the command line. */
static int choose_camera(flesh_snapshot *s)
{
  flesh_camera *camera = &s->options.camera;
  static const char *const origins[] = {[FLESH_UP_GIVEN] = "as the scene says",
                                        [FLESH_UP_GRAVITY] = "against gravity",
                                        [FLESH_UP_Z] = "as there is no gravity"};
  static_assert(sizeof origins / sizeof *origins == FLESH_UP_Z + 1, "words for every origin");
  double angles[2];
  *camera = flesh_scene_outputs(s->runs[0].folder.scene)->camera;
  s->up_origin = origins[flesh_scene_up(s->runs[0].folder.scene, camera->up)];
  if (s->up) {
    s->up_origin = "as --up says";
    if (flesh_list_parse(s->up, 3, camera->up) != 3 || !flesh_scene_direction(camera->up, camera->up))
      return flesh_fail(FLESH_ERR_ARGUMENT, "--up is '%s'; it must be a direction, such as 0,1,0", s->up);
  }
  if (s->camera) {
    if (flesh_list_parse(s->camera, 2, angles) != 2 || fabs(angles[1]) > 90)
      return flesh_fail(FLESH_ERR_ARGUMENT,
                        "--camera is '%s'; it must be two angles in degrees, the second -90 to 90, such as 30,20",
                        s->camera);
    camera->azimuth = angles[0];
    camera->elevation = angles[1];
  }
  if (s->target && flesh_list_parse(s->target, 3, camera->target) != 3)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "--target is '%s'; it must be a place, three numbers in metres, such as 0,0,1", s->target);
  if (!isnan(s->height)) camera->height = s->height;
  if (!isnan(s->field_of_view)) camera->field_of_view = s->field_of_view;
  if (!(camera->field_of_view >= 0 && camera->field_of_view < 120))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "--field-of-view is %g; it must be 0 to less than 120 degrees",
                      camera->field_of_view);
  return FLESH_OK;
}

static int choose_options(flesh_snapshot *s)
{
  enum { LEAST = 16, MOST = 8192 };
  double ends[2];
  const int width = s->options.width, height = s->options.height;
  if (width < LEAST || width > MOST)
    return flesh_fail(FLESH_ERR_ARGUMENT, "--width is %d; it must be %d to %d pixels", width, LEAST, MOST);
  if (height && (height < LEAST || height > MOST))
    return flesh_fail(FLESH_ERR_ARGUMENT, "--picture-height is %d; it must be %d to %d pixels", height, LEAST, MOST);
  s->options.field = s->error ? FLESH_PICTURE_ERROR : (flesh_picture_field)s->colour;
  if (s->range) {
    if (flesh_list_parse(s->range, 2, ends) != 2 || !(ends[0] < ends[1]))
      return flesh_fail(FLESH_ERR_ARGUMENT,
                        "--range is '%s'; it must be two numbers, the smaller first, such as 0.9,1.1",
                        s->range);
    s->options.low = ends[0];
    s->options.high = ends[1];
  }
  return choose_camera(s);
}

/* Opens a run: its folder, its name and its skin, which is the command line's or else the scene's. */
static int open_run(flesh_snapshot *s, const char *path, flesh_snapshot_run *run)
{
  const char *name;
  const size_t length = flesh_run_folder_name(path, &name);
  int status = flesh_run_folder_open(path, &run->folder);
  if (status) return status;
  if (!(run->title = flesh_arena_text(&run->folder.memory, name, length))) return flesh_no_memory();
  const char *surface = s->surface ? s->surface : flesh_scene_outputs(run->folder.scene)->skin.surface;
  if (!surface || s->no_skin) return FLESH_OK;
  status = flesh_surface_read(surface, &run->surface);
  if (!status)
    status = flesh_skin_bind(flesh_scene_mesh(run->folder.scene), run->surface, &run->skin);
  return status;
}

int flesh_snapshot_open(flesh_snapshot *s, int count, char **paths)
{
  s->runs = calloc((size_t)count, sizeof *s->runs);
  if (!s->runs) return flesh_fail(FLESH_ERR_MEMORY, "out of memory for %d runs", count);
  s->count = count;
  for (int r = 0; r < count; r++) {
    int status = open_run(s, paths[r], &s->runs[r]);
    if (status) return status;
  }
  return choose_options(s);
}

void flesh_snapshot_close(flesh_snapshot *s)
{
  for (int r = 0; r < s->count; r++) {
    flesh_skin_destroy(&s->runs[r].skin);
    flesh_surface_destroy(&s->runs[r].surface);
    flesh_run_folder_close(&s->runs[r].folder);
  }
  free(s->runs);
  s->runs = NULL;
  s->count = 0;
}

/* Returns the time with as many decimals as tell all frames apart, at least three; in short form if that is more than
 * seven. */
static const char *time_text(const flesh_run_folder *run, flesh_arena *arena)
{
  double least = INFINITY;
  for (int k = 1; k < run->count; k++)
    if (run->frames[k].time > run->frames[k - 1].time)
      least = fmin(least, run->frames[k].time - run->frames[k - 1].time);
  if (run->count == 1 && run->state.t > 0) least = run->state.t;
  const double decimals = isfinite(least) ? fmax(3, -floor(log10(least))) : 3;
  return decimals > 7 ? flesh_arena_print(arena, "t = %.4g s", run->state.t)
                      : flesh_arena_print(arena, "t = %.*f s", (int)decimals, run->state.t);
}

int flesh_run_panel(flesh_run_folder *run, int k, flesh_picture_panel *panel)
{
  const int status = flesh_run_folder_load(run, k);
  if (status) return status;
  *panel = (flesh_picture_panel){.body = flesh_scene_body(run->scene),
                                 .x = run->state.x,
                                 .v = run->state.v,
                                 .system = flesh_scene_system(run->scene),
                                 .t = run->state.t};
  return FLESH_OK;
}

int flesh_snapshot_panel(flesh_snapshot *s, int r, int k, flesh_arena *arena, flesh_picture_panel *panel)
{
  flesh_snapshot_run *run = &s->runs[r];
  int status = flesh_run_panel(&run->folder, k, panel);
  if (status) return status;
  panel->title = s->bare || s->count < 2 ? NULL : run->title;
  panel->subtitle = s->bare ? NULL : time_text(&run->folder, arena);
  panel->surface = run->surface;
  panel->skin = run->skin;
  panel->scene = run->folder.scene;
  panel->column = s->error;
  return s->bare || panel->subtitle ? FLESH_OK : flesh_no_memory();
}

void flesh_snapshot_report(const flesh_snapshot *s, const flesh_picture_frame *frame)
{
  char name[64];
  double unit;
  const double *up = frame->view.zenith;
  printf("up: (%.3g, %.3g, %.3g), %s", up[0], up[1], up[2], s->up_origin);
  for (int r = 1; r < s->count && !s->up; r++) { /* all runs have one camera, that of the first */
    double own[3];
    flesh_scene_up(s->runs[r].folder.scene, own);
    if (fabs(own[0] - up[0]) + fabs(own[1] - up[1]) + fabs(own[2] - up[2]) > 1e-6)
      printf("; in %s it would be (%.3g, %.3g, %.3g)", s->runs[r].title, own[0], own[1], own[2]);
  }
  putchar('\n');
  if (frame->view.misses_all)
    printf("warning: nothing is seen: the bodies are outside of the picture or smaller than a pixel; leave out the "
           "camera's target and height (--target, --height), and they are fitted\n");
  if (s->options.field == FLESH_PICTURE_PLAIN) return;
  flesh_picture_quantity(s->options.field, frame, name, &unit);
  printf("colours: %s from %.6g to %.6g", name, frame->low / unit, frame->high / unit);
  if (isfinite(frame->least) && isfinite(frame->most))
    printf("; there is %.6g to %.6g", frame->least / unit + 0.0, frame->most / unit + 0.0);
  printf("%s\n", frame->inverted ? "; inverted tets are black" : "");
}
