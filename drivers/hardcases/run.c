/* run.c: runs a case of the battery and judges what came of it. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/error.h"
#include "cli/overrides.h"
#include "run/runner.h"
#include "hardcases/hardcases.h"
#include "hardcases/end.h"
#include "hardcases/watch.h"

/* Reads a phase's scene with the command line's overrides, which become part of its file, so that
 * the file alone gives the same run. */
static int read_phase(const flesh_hardcases_plan *plan, const char *path, flesh_scene **scene)
{
  int count = plan->overrides->count;
  int status = flesh_scene_read(path, count, plan->overrides->values, scene);
  return status || !count ? status : flesh_scene_write(*scene, path);
}

/* The worse of the phases counts. */
static void note_longest(flesh_hardcases_figures *f, const flesh_longest_step *longest)
{
  if (longest->ratio > f->longest.ratio || !isfinite(f->longest.ratio)) f->longest = *longest;
}

/* Runs a phase into folder/out; returns its status. */
static int run_phase(const flesh_hardcases_plan *plan, const flesh_scene *scene, const char *folder,
                     const char *name, flesh_hardcases_watch *watch)
{
  char out[1400], path[1500];
  flesh_figures figures = {0};
  flesh_outcome outcome = {0};
  flesh_hardcases_figures *f = watch->figures;
  snprintf(out, sizeof out, "%s/%s", folder, name);
  snprintf(path, sizeof path, "%s/scene.yaml", folder);
  const flesh_observer watching = {flesh_hardcases_watch_observe, watch};
  const flesh_runner_options options = {.out = out,
                                        .scene_path = path,
                                        .max_seconds = plan->max_seconds,
                                        .no_frames = 1,
                                        .quiet = 1,
                                        .observer_count = 1,
                                        .observers = &watching};
  flesh_runner_run(scene, &options, &figures, &outcome);
  f->status = outcome.has_failure ? outcome.failure.status : outcome.status;
  f->exit_code = outcome.exit_code;
  f->stressed_rest = figures.stressed_rest;
  note_longest(f, &figures.longest_step);
  snprintf(f->message, sizeof f->message, "%.399s", outcome.message);
  f->wall_s += isfinite(figures.wall_s) ? figures.wall_s : 0;
  f->cpu_s += isfinite(figures.cpu_s) ? figures.cpu_s : 0;
  flesh_figures_close(&figures);
  return outcome.status;
}

/* The shape to come back to: by the phase that is to do so, from rest. NULL: none. */
static int find_rest(const flesh_hardcases_plan *plan, const char *folder, flesh_mesh **rest)
{
  char file[1400];
  flesh_scene *last = NULL;
  flesh_overrides overrides;
  int status = flesh_overrides_copy(&overrides, plan->overrides);
  if (status) return status;
  status = flesh_overrides_add(&overrides, "start", "null"); /* it is not there yet */
  snprintf(file, sizeof file, "%s/release.yaml", folder);
  if (flesh_path_access(file, F_OK)) snprintf(file, sizeof file, "%s/scene.yaml", folder);
  if (!status) status = flesh_scene_read(file, overrides.texts.count, overrides.texts.values, &last);
  if (!status) flesh_hardcases_rest_shape(last, flesh_scene_times(last)->end, rest);
  flesh_scene_destroy(&last);
  flesh_overrides_close(&overrides);
  return status;
}

static int is_back(const flesh_hardcases_figures *f)
{
  return f->distance < FLESH_HARDCASES_TOLERANCE && f->volume_error < FLESH_HARDCASES_TOLERANCE &&
         !f->inverted_end;
}

static int refuse(flesh_hardcases_figures *f, int status)
{
  f->status = status;
  f->exit_code = flesh_exit_code(status);
  snprintf(f->message, sizeof f->message, "%.399s", flesh_error_text());
  return status;
}

void flesh_hardcases_run_one(const flesh_hardcases_plan *plan, const flesh_hardcases_run *run,
                             flesh_hardcases_figures *f)
{
  char folder[256], path[1300], file[1400];
  flesh_scene *scene = NULL, *release = NULL;
  flesh_mesh *rest = NULL;
  flesh_hardcases_run_folder(run, folder);
  snprintf(path, sizeof path, "%s/%s", plan->out, folder);
  int status = flesh_hardcases_write_scene(plan, run, path);
  snprintf(file, sizeof file, "%s/scene.yaml", path);
  if (!status) status = read_phase(plan, file, &scene);
  if (!status) status = find_rest(plan, path, &rest);
  flesh_hardcases_watch watch = {.folder = path, .figures = f};
  if (!status) status = flesh_hardcases_watch_open(&watch, flesh_scene_mesh(scene));
  if (status) {
    refuse(f, status);
    goto done;
  }
  f->tets = flesh_mesh_tet_count(flesh_scene_mesh(scene));
  f->finite = 1;
  double end = flesh_scene_times(scene)->end;
  watch.rest = rest;
  watch.early = 0.1 * end;
  status = run_phase(plan, scene, path, "out", &watch);
  snprintf(file, sizeof file, "%s/release.yaml", path);
  if (!status && flesh_path_access(file, F_OK) == 0) {
    status = read_phase(plan, file, &release);
    if (status) {
      refuse(f, status);
      goto done;
    }
    end = flesh_scene_times(release)->end;
    flesh_hardcases_watch_release(&watch);
    status = run_phase(plan, release, path, "release", &watch);
  }
  flesh_hardcases_watch_finish(&watch);
  if (status) goto done;
  f->rank = flesh_hardcases_rank(flesh_scene_mesh(scene), watch.last.x);
  if (!is_back(f) && f->finite)
    flesh_hardcases_judge_end(release ? release : scene, end, watch.last.x, rest, f);
done:
  flesh_hardcases_watch_close(&watch);
  flesh_mesh_destroy(&rest);
  flesh_scene_destroy(&release);
  flesh_scene_destroy(&scene);
}

flesh_hardcases_outcome flesh_hardcases_judge(const flesh_hardcases_run *run)
{
  const flesh_hardcases_figures *f = &run->figures;
  if (f->crashed_by) return FLESH_HARDCASES_CRASHED;
  switch (f->status) {
  case FLESH_OK:
    break;
  case FLESH_ERR_BUDGET:
    return FLESH_HARDCASES_BUDGET;
  case FLESH_NONFINITE:
  case FLESH_ERR_NONFINITE:
    return FLESH_HARDCASES_NONFINITE;
  case FLESH_ERR_INTERRUPTED:
    return FLESH_HARDCASES_NOT_RUN;
  default:
    return FLESH_HARDCASES_STOPPED;
  }
  if (!f->finite) return FLESH_HARDCASES_NONFINITE;
  if (f->unconverged || f->rises) return FLESH_HARDCASES_UNCONVERGED;
  int kept = run->row->flags & FLESH_HARDCASES_KEPT_EQUILIBRIUM;
  if (kept && f->rank < 2 && f->end != FLESH_HARDCASES_END_MOVING) return FLESH_HARDCASES_EQUILIBRIUM;
  if (!is_back(f)) return f->stressed_rest > 0 ? FLESH_HARDCASES_AT_REST : FLESH_HARDCASES_NOT_RECOVERED;
  return f->untanglings ? FLESH_HARDCASES_UNTANGLED : FLESH_HARDCASES_RECOVERED;
}
