/* runner_outputs.c: creates the files of a run, or reopens them when it resumes; composes result.json. */
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/confine.h"
#include "cli/json_memory.h"
#include "cli/path.h"
#include "base/sync.h"
#include "output/resume.h"
#include "output/skin_frames.h"
#include "run/provenance.h"
#include "run/running.h"
#include "time/integrator.h"

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
  static const char *const folders[] = {"error/mesh", "error/mesh_2",       "error/step", "error/step_2",
                                        "error/twice", "error/mesh_2_steps", "error"};
  static const char *const files[] = {"history.csv", "probes.csv", "result.json", "scene.yaml", "state.txt"};
  for (size_t k = 0; k < sizeof folders / sizeof *folders; k++) {
    for (size_t f = 0; f < sizeof files / sizeof *files && strchr(folders[k], '/'); f++)
      flesh_path_unlink(flesh_path("%s/%s/%s", r->options->out, folders[k], files[f]));
    flesh_path_remove_folder(flesh_running_path(r, folders[k])); /* fails, and the folder stays, if it has other files */
  }
}

/* Opens the skin's files, and prints how much of the skin is outside the body. */
static int open_skin(flesh_running *r, int every)
{
  const flesh_scene_output *output = flesh_scene_outputs(r->scene);
  flesh_skin_info info;
  if (!r->skin) return FLESH_OK;
  int status = flesh_skin_frames_create(flesh_running_path(r, "skin"), r->skin, r->surface, output->skin.formats,
                                        every, &r->skin_frames);
  if (!status) status = flesh_skin_write(r->skin, flesh_running_path(r, "skin/binding.txt"));
  if (status || r->options->quiet) return status;
  flesh_skin_inspect(r->skin, &info);
  flesh_skin_print(stdout, output->skin.surface, &info);
  return FLESH_OK;
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
  int status = from || !r->options->out ? flesh_probes_open(body, system, method, count, probes, &r->probes)
                                        : flesh_probes_create(path, body, system, method, count, probes, &r->probes);
  if (!status && from) status = flesh_probes_resume(&r->probes, path, (long)from->head.probes);
  if (!status) flesh_probes_note(r->probes, r->figures->probes);
  return status;
}

/* Adds the fields that the scene asks for to the frames. */
static int set_fields(flesh_running *r)
{
  const flesh_scene_output *output = flesh_scene_outputs(r->scene);
  return flesh_frames_set_fields(r->frames, flesh_scene_body(r->scene), flesh_scene_system(r->scene),
                                 flesh_scene_times(r->scene)->method, output->fields, output->fields_at);
}

/* Writes result.json with the status "running". */
static int write_running(flesh_running *r, flesh_figures *figures)
{
  const flesh_runner_options *options = r->options;
  r->program = flesh_provenance_program(options->argc, options->argv);
  json_object_set_new(r->program, "threads", json_integer(flesh_ranks_threads(options->ranks, r->scene)));
  const char *preconditioner =
      flesh_preconditioner_used(r->scene, flesh_ranks_take_volumes_out(options->ranks, r->scene));
  json_object_set_new(r->program, "preconditioner",
                      preconditioner ? json_string(preconditioner) : json_null());
  if (!r->inputs) r->inputs = flesh_provenance_scene(r->scene, options->scene_path);
  if (flesh_running_is_split(r))
    json_object_set_new(r->inputs, "mesh", flesh_provenance_mesh(&options->ranks->whole));
  json_t *running = json_pack("{ss}", "status", "running");
  int status = flesh_json_write(flesh_running_path(r, "result.json"), flesh_running_result(r, running, figures));
  if (status) return status; /* the results of an older run are still valid */
  r->running = 1;
  flesh_path_unlink(flesh_running_path(r, "state.txt"));
  return FLESH_OK;
}

int flesh_running_open(flesh_running *r, flesh_figures *figures)
{
  const flesh_runner_options *options = r->options;
  int status = write_running(r, figures);
  if (status) return status;
  if (!flesh_path_unlink(flesh_running_path(r, FLESH_CHECKPOINT_NAME))) status = flesh_sync(options->out);
  if (status) return status;
  drop_companions(r);
  flesh_skin_frames_remove(flesh_running_path(r, "skin"));
  flesh_path_unlink(flesh_running_path(r, "skin/binding.txt"));
  flesh_path_remove_folder(flesh_running_path(r, "skin")); /* fails, and the folder stays, if it has other files */
  status = flesh_scene_write(r->scene, flesh_running_path(r, "scene.yaml"));
  if (!status)
    status =
        flesh_history_create(flesh_running_path(r, "history.csv"), flesh_running_system(r), &r->history);
  if (!status && !options->ranks) status = flesh_running_open_probes(r);
  if (status) return status;
  int every = flesh_scene_outputs(r->scene)->frame_interval;
  if (options->no_frames || every < 1) drop_frames(r);
  else
    status =
        flesh_frames_create(flesh_running_path(r, "frames"), flesh_scene_mesh(r->scene), every, &r->frames);
  if (flesh_running_is_split(r)) flesh_frames_close(&r->frames); /* each rank writes its own frames */
  if (!status && r->frames) status = set_fields(r);
  if (!status && r->frames) status = open_skin(r, every);
  return status;
}

/* Reopens the skin's files; what is outside the body was printed when the run began. */
static int reopen_skin(flesh_running *r, int every, int last)
{
  const int status = flesh_skin_frames_open(flesh_running_path(r, "skin"), r->skin, r->surface,
                                            flesh_scene_outputs(r->scene)->skin.formats, every, &r->skin_frames);
  return status ? status : flesh_skin_frames_resume(&r->skin_frames, last, flesh_running_path(r, "frames"),
                                                    flesh_scene_mesh(r->scene));
}

int flesh_running_reopen(flesh_running *r, flesh_figures *figures, const flesh_checkpoint_head *head)
{
  int status = write_running(r, figures), every = flesh_scene_outputs(r->scene)->frame_interval;
  const flesh_system *system = flesh_running_system(r);
  if (!status)
    status = flesh_history_resume(flesh_running_path(r, "history.csv"), system, (long)head->history, &r->history);
  if (!status && !r->options->ranks) status = flesh_running_open_probes(r);
  if (status || r->options->no_frames || every < 1) return status;
  status = flesh_frames_resume(flesh_running_path(r, "frames"), flesh_scene_mesh(r->scene), every, head->step, &r->frames);
  if (flesh_running_is_split(r)) flesh_frames_close(&r->frames); /* each rank continues its own frames */
  if (!status && r->frames) status = set_fields(r);
  return status || !r->skin ? status : reopen_skin(r, every, head->step);
}

const char *flesh_running_path(const flesh_running *r, const char *name) { return flesh_path("%s/%s", r->options->out, name); }

json_t *flesh_running_result(flesh_running *r, json_t *outcome, const flesh_figures *figures)
{
  json_object_set_new(outcome, "figures",
                      flesh_figures_json(figures, flesh_running_system(r), r->scene));
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

int flesh_running_is_split(const flesh_running *r) { return r->options->ranks && flesh_ranks_mesh_is_split(r->scene); }

const flesh_system *flesh_running_system(const flesh_running *r)
{
  return flesh_running_is_split(r) ? flesh_ranks_system(r->options->ranks, r->scene) : flesh_scene_system(r->scene);
}
