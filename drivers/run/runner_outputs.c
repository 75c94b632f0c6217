/* runner_outputs.c: claims the folder of a run and creates its files, or reopens them when it resumes; composes
 * result.json. */
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/error.h"
#include "base/sync.h"
#include "cli/json_memory.h"
#include "cli/output.h"
#include "cli/path.h"
#include "error/companion.h"
#include "mesh/mesh.h"
#include "output/resume.h"
#include "output/skin_frames.h"
#include "run/provenance.h"
#include "run/running.h"
#include "scene/scene.h"
#include "time/integrator.h"

/* The files that a run writes into its folder, and how they begin, by which an older run's file is told from other
 * files. */
static const struct {
  const char *name, *begin;
} written[] = {{"scene.yaml", "# Every key in force"},
               {"history.csv", "t,step,h,"},
               {"probes.csv", "t [s],"},
               {"state.txt", "# t "},
               {"result.json", "{\n  \"status\""},
               {FLESH_CHECKPOINT_NAME, "flesh checkpoint"}};
enum { WRITTEN = sizeof written / sizeof *written };

/* Refuses a file of that name that begins otherwise: no run has written it. */
static int check_begin(const char *path, const char *begin)
{
  char head[32];
  const int status = flesh_path_check(path), file = status ? -1 : flesh_path_open(path, O_RDONLY | O_NONBLOCK, 0);
  if (file < 0) return status; /* errors are reported when it is replaced */
  const ssize_t got = read(file, head, strlen(begin));
  close(file);
  if (!got || (got == (ssize_t)strlen(begin) && !memcmp(head, begin, (size_t)got))) return FLESH_OK;
  return flesh_fail(FLESH_ERR_FILE,
                    "%s: no run has written this file, and a run into this folder would replace it; give "
                    "another folder, or move it away",
                    path);
}

/* Returns whether both paths name the same place, whether or not there is anything. */
static int same_place(const char *a, const char *b)
{
  const char *paths[2] = {a, b}, *bases[2];
  struct stat folders[2];
  for (int k = 0; k < 2; k++) {
    const char *slash = strrchr(paths[k], '/');
    if (flesh_path_stat(slash ? flesh_path("%.*s", (int)(slash + 1 - paths[k]), paths[k]) : ".", &folders[k])) return 0;
    bases[k] = slash ? slash + 1 : paths[k];
  }
  return folders[0].st_dev == folders[1].st_dev && folders[0].st_ino == folders[1].st_ino &&
         !strcmp(bases[0], bases[1]);
}

static int check_files(const char *out, const char *save_state, flesh_inputs *inputs)
{
  static const char *const subfolders[] = {"frames", "skin", "error", NULL};
  const char *names[WRITTEN + 1] = {NULL};
  for (int k = 0; k < WRITTEN; k++) names[k] = written[k].name;
  int status = flesh_inputs_spare_in(inputs, out, names, subfolders);
  for (int k = 0; k < WRITTEN && !status; k++) {
    const char *path = flesh_path("%s/%s", out, written[k].name);
    status = check_begin(path, written[k].begin);
    if (!status && save_state && strcmp(written[k].name, "state.txt") && same_place(path, save_state))
      status = flesh_fail(FLESH_ERR_ARGUMENT, "--save-state is %s, which the run writes itself; give another name",
                          save_state);
  }
  for (int k = 0; subfolders[k] && !status; k++) {
    const char *path = flesh_path("%s/%s", out, subfolders[k]);
    struct stat info;
    if (!flesh_path_stat(path, &info) && !S_ISDIR(info.st_mode)) status = flesh_folder_make(path); /* fails */
  }
  return status;
}

int flesh_running_claim(const flesh_running *r, flesh_folder_claim *claim)
{
  const flesh_runner_options *options = r->options;
  const char *out = options->out, *save_state = options->save_state;
  flesh_inputs inputs = {0};
  if (options->scene_path) flesh_inputs_add_scene(&inputs, options->scene_path, r->scene);
  int status = save_state ? flesh_output_prepare(save_state, &inputs) : FLESH_OK;
  if (options->resume) flesh_inputs_close(&inputs); /* the scene is the folder's own file, which is not written again */
  if (!status && out) status = flesh_output_claim(out, "run", claim);
  if (!status && out) status = check_files(out, save_state, &inputs);
  flesh_inputs_close(&inputs);
  return status;
}

/* Removes the frames of an older run, which do not belong to this one's history. */
static void drop_frames(flesh_running *r)
{
  const char *folder = flesh_running_path(r, "frames");
  struct stat info;
  flesh_frames *frames = NULL;
  if (!flesh_path_stat(folder, &info) && S_ISDIR(info.st_mode) &&
      !flesh_frames_create(folder, flesh_scene_mesh(r->scene), 1, &frames)) {
    flesh_frames_close(&frames);
    flesh_path_unlink(flesh_running_path(r, "frames/frames.pvd"));
    flesh_path_remove_folder(folder); /* fails, and the folder stays, if it has other files */
  }
}

/* Removes the companion runs of an older run, which do not belong to this one. */
static void drop_companions(flesh_running *r)
{
  for (const char *const *folder = flesh_error_folders; *folder; folder++) {
    for (int k = 0; k < WRITTEN; k++)
      flesh_path_unlink(flesh_path("%s/%s/%s", r->options->out, *folder, written[k].name));
    flesh_path_remove_folder(flesh_running_path(r, *folder)); /* fails, and the folder stays, if it has other files */
  }
  flesh_path_remove_folder(flesh_running_path(r, "error"));
}

int flesh_running_set_fields(const flesh_running *r, flesh_frames *frames, const flesh_body *body,
                             const flesh_system *system)
{
  const flesh_scene_output *output = flesh_scene_outputs(r->scene);
  return flesh_frames_set_fields(frames, body, system, flesh_scene_times(r->scene)->method, output->fields,
                                 output->fields_at);
}

int flesh_running_open_probes(flesh_running *r)
{
  int count;
  const flesh_ranks *ranks = r->options->ranks;
  const flesh_checkpoint *from = r->options->resume;
  const flesh_probe *probes =
      ranks ? flesh_scene_share_probes(ranks->share, &count) : flesh_scene_probes(r->scene, &count);
  const flesh_body *body = ranks ? flesh_scene_share_body(ranks->share) : flesh_scene_body(r->scene);
  const flesh_system *system = flesh_ranks_system(ranks, r->scene);
  const flesh_method method = flesh_scene_times(r->scene)->method;
  const char *path = r->options->out ? flesh_running_path(r, "probes.csv") : NULL;
  if (!from && path && flesh_ranks_first(ranks)) flesh_path_unlink(path); /* an older run's file does not belong to this one */
  if (!count) return FLESH_OK;
  int status = flesh_probes_open(body, system, method, count, probes, &r->probes);
  if (!status && !ranks && r->scene->keys.output.error_bars) status = flesh_probes_smooth(&r->probes);
  if (!status && path)
    status = from ? flesh_probes_resume(&r->probes, path, (long)from->head.probes) : flesh_probes_begin(&r->probes, path);
  if (!status) flesh_probes_note(r->probes, r->figures->probes);
  return status;
}

/* Writes result.json with the status "running". */
static int write_running(flesh_running *r)
{
  const flesh_runner_options *options = r->options;
  r->program = flesh_provenance_program(options->argc, options->argv);
  json_object_set_new(r->program, "threads", json_integer(flesh_ranks_threads(options->ranks, r->scene)));
  const char *preconditioner = flesh_ranks_preconditioner(options->ranks, r->scene);
  json_object_set_new(r->program, "preconditioner",
                      preconditioner ? json_string(preconditioner) : json_null());
  if (!r->inputs) r->inputs = flesh_provenance_scene(r->scene, options->scene_path);
  if (flesh_running_is_split(r))
    json_object_set_new(r->inputs, "mesh", flesh_provenance_mesh(&options->ranks->whole));
  json_t *running = json_pack("{ss}", "status", "running");
  int status = flesh_json_write(flesh_running_path(r, "result.json"), flesh_running_result(r, running));
  if (status) return status; /* the results of an older run are still valid */
  r->running = 1;
  flesh_path_unlink(flesh_running_path(r, "state.txt"));
  return FLESH_OK;
}

/* Removes what an older run left in the folder beside the files that are replaced, and writes the scene. */
static int replace_older(flesh_running *r)
{
  int status = FLESH_OK;
  if (!flesh_path_unlink(flesh_running_path(r, FLESH_CHECKPOINT_NAME))) status = flesh_sync(r->options->out);
  if (status) return status;
  drop_companions(r);
  flesh_skin_frames_remove(flesh_running_path(r, "skin"));
  flesh_path_unlink(flesh_running_path(r, "skin/binding.txt"));
  flesh_path_remove_folder(flesh_running_path(r, "skin")); /* fails, and the folder stays, if it has other files */
  return flesh_scene_write(r->scene, flesh_running_path(r, "scene.yaml"));
}

/* Opens the skin's files; if the run begins, also prints how much of the skin is outside the body. */
static int open_skin(flesh_running *r, int every)
{
  const flesh_scene_output *output = flesh_scene_outputs(r->scene);
  const flesh_checkpoint *from = r->options->resume;
  flesh_skin_info info;
  int status = (from ? flesh_skin_frames_open : flesh_skin_frames_create)(
      flesh_running_path(r, "skin"), r->skin, r->surface, output->skin.formats, every, &r->skin_frames);
  if (!status && from)
    return flesh_skin_frames_resume(&r->skin_frames, from->head.step, flesh_running_path(r, "frames"),
                                    flesh_scene_mesh(r->scene));
  if (!status) status = flesh_skin_write(r->skin, flesh_running_path(r, "skin/binding.txt"));
  if (status || r->options->quiet) return status;
  flesh_skin_inspect(r->skin, &info);
  flesh_skin_print(stdout, output->skin.surface, &info);
  return FLESH_OK;
}

/* Opens the files of frames, of which there is one for every so many steps. */
static int open_frames(flesh_running *r, int every)
{
  const flesh_checkpoint *from = r->options->resume;
  const flesh_mesh *mesh = flesh_scene_mesh(r->scene);
  const char *folder = flesh_running_path(r, "frames");
  int status = from ? flesh_frames_resume(folder, mesh, every, from->head.step, &r->frames)
                    : flesh_frames_create(folder, mesh, every, &r->frames);
  if (flesh_running_is_split(r)) flesh_frames_close(&r->frames); /* each rank writes its own frames */
  if (status || !r->frames) return status;
  status = flesh_running_set_fields(r, r->frames, flesh_scene_body(r->scene), flesh_scene_system(r->scene));
  return status || !r->skin ? status : open_skin(r, every);
}

int flesh_running_open(flesh_running *r)
{
  const flesh_checkpoint *from = r->options->resume;
  const flesh_system *system = flesh_running_system(r);
  const int every = r->options->no_frames ? 0 : flesh_scene_outputs(r->scene)->frame_interval;
  int status = write_running(r);
  if (!status && !from) status = replace_older(r);
  if (!status)
    status = from ? flesh_history_resume(flesh_running_path(r, "history.csv"), system, (long)from->head.history, &r->history)
                  : flesh_history_create(flesh_running_path(r, "history.csv"), system, &r->history);
  if (!status && !r->options->ranks) status = flesh_running_open_probes(r);
  if (!status && every >= 1) return open_frames(r, every);
  if (!status && !from) drop_frames(r);
  return status;
}

const char *flesh_running_path(const flesh_running *r, const char *name) { return flesh_path("%s/%s", r->options->out, name); }

json_t *flesh_running_result(flesh_running *r, json_t *outcome)
{
  json_object_set_new(outcome, "figures", flesh_figures_json(r->figures, flesh_running_system(r), r->scene));
  if (r->integrator)
    json_object_set_new(outcome, "effects", flesh_costs_json(flesh_integrator_costs(r->integrator),
                                                             flesh_running_system(r)));
  json_object_set_new(outcome, "materials", flesh_materials_json(r->scene));
  if (r->resumed) json_object_set(outcome, "resumed", r->resumed);
  json_object_set(outcome, "inputs", r->inputs);
  json_object_set(outcome, "program", r->program);
  if (r->ranks) json_object_set(outcome, "ranks", r->ranks);
  return outcome;
}

int flesh_running_is_split(const flesh_running *r) { return flesh_scene_mesh(r->scene)->split != NULL; }

const flesh_system *flesh_running_system(const flesh_running *r)
{
  return flesh_running_is_split(r) ? flesh_ranks_system(r->options->ranks, r->scene) : flesh_scene_system(r->scene);
}
