/* runner.c: runs a scene with history, frames, progress, budget and a result that is always valid.
 */
#include "base/threads.h"
#include "shared/runner.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "base/error.h"
#include "shared/interrupt.h"
#include "base/file.h"
#include "shared/options.h"
#include "shared/provenance.h"
#include "shared/output.h"
#include "shared/stressed_rest.h"

enum { OBSERVER_LIMIT = 16 };

typedef struct runner {
  const flesh_scene *scene;
  const flesh_runner_options *options;
  char *path; /* room for out/name */
  flesh_history *history;
  flesh_probes *probes; /* NULL without any */
  flesh_frames *frames;
  flesh_surface *surface; /* of the skin, with the next two; NULL without one */
  flesh_skin *skin;
  flesh_skin_frames *skin_frames;
  flesh_integrator *integrator;
  flesh_state state;
  double started; /* monotonic seconds */
  double last_progress;
  double last_step, next_word; /* monotonic seconds: the last step's end; when a long one is spoken of */
  int step;                    /* the last one taken */
  double start_t;
  flesh_rest_trace trace;
  int progress; /* show a line */
  int running; /* result.json says so */
  json_t *program, *inputs;
} runner;

static double seconds(clockid_t clock)
{
  struct timespec now;
  clock_gettime(clock, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static const char *in_out(runner *r, const char *name)
{
  sprintf(r->path, "%s/%s", r->options->out, name);
  return r->path;
}

static int show_progress(void *data, const flesh_step_record *record)
{
  runner *r = data;
  double now = seconds(CLOCK_MONOTONIC);
  if (now - r->last_progress < 0.1 && !record->last) return FLESH_OK;
  r->last_progress = now;
  double end = flesh_scene_times(r->scene)->end, t = record->state->t;
  double part = end > r->start_t ? (t - r->start_t) / (end - r->start_t) : 1;
  double left = part > 0 ? (now - r->started) * (1 - part) / part : NAN;
  fprintf(stderr, "\r\033[Kt %.4g / %.4g s  %3.0f %%  newton %d  min J %.3f  ", t, end, 100 * part,
          record->stats->newton, record->min_J);
  if (isfinite(left)) fprintf(stderr, "%.0f s left", ceil(left));
  fflush(stderr);
  return FLESH_OK;
}

/* A run of which nothing is heard for this long says what goes on, and again whenever it has lasted twice as long, but
 * once in ten minutes at least. */
static const double first_word = 10, longest_silence = 600;

static int note_step(void *data, const flesh_step_record *record)
{
  runner *r = data;
  r->last_step = seconds(CLOCK_MONOTONIC);
  r->next_word = r->last_step + first_word;
  r->step = record->step;
  return FLESH_OK;
}

/* What a step that takes long is at. */
static void speak_of_long_step(runner *r)
{
  const double now = seconds(CLOCK_MONOTONIC), lasting = now - r->last_step;
  if (r->options->quiet || !r->integrator || now < r->next_word) return;
  const flesh_progress p = flesh_integrator_progress(r->integrator);
  r->next_word = now + (lasting < longest_silence ? lasting : longest_silence);
  fprintf(stderr, "%sstep %d has taken %.0f s: from t = %g s with h = %.3g s", r->progress ? "\r\033[K" : "",
          r->step + 1, lasting, p.t, p.h);
  if (p.target > 0)
    fprintf(stderr, ", Newton iteration %d, %ld linear ones, residual %.3g N, wanted %.3g N", p.newton + 1, p.linear,
            p.residual, p.target);
  fputc('\n', stderr);
  fflush(stderr);
}

static int stop(void *data)
{
  runner *r = data;
  speak_of_long_step(r);
  if (flesh_interrupt_signal())
    return flesh_fail(FLESH_ERR_INTERRUPTED, "interrupted by %s at t = %g s",
                      flesh_interrupt_name(), r->state.t);
  if (r->options->max_seconds > 0 &&
      seconds(CLOCK_MONOTONIC) - r->started > r->options->max_seconds)
    return flesh_fail(FLESH_ERR_BUDGET, "the budget of %g s is spent at t = %g s",
                      r->options->max_seconds, r->state.t);
  return FLESH_OK;
}

static json_t *result_of(runner *r, json_t *outcome, const flesh_figures *figures)
{
  json_object_set_new(outcome, "figures",
                      flesh_figures_json(figures, flesh_scene_system(r->scene)));
  if (r->integrator)
    json_object_set_new(outcome, "effects", flesh_costs_json(flesh_integrator_costs(r->integrator),
                                                             flesh_scene_system(r->scene)));
  json_object_set_new(outcome, "materials", flesh_materials_json(r->scene));
  json_object_set(outcome, "inputs", r->inputs);
  json_object_set(outcome, "program", r->program);
  return outcome;
}

/* Frames of an older run would not belong to this one's history. */
static void drop_frames(runner *r)
{
  char *folder = strdup(in_out(r, "frames"));
  struct stat info;
  flesh_frames *frames = NULL;
  if (folder && !stat(folder, &info) && S_ISDIR(info.st_mode) &&
      !flesh_frames_create(folder, flesh_scene_mesh(r->scene), 1, &frames)) {
    flesh_frames_close(&frames);
    unlink(in_out(r, "frames/frames.pvd"));
    rmdir(folder); /* stays where something else is in it */
  }
  free(folder);
}

/* Binds the scene's skin, if frames of it are wanted: what is wrong with it is reported before anything is written. */
static int bind_skin(runner *r)
{
  const flesh_scene_output *output = flesh_scene_outputs(r->scene);
  if (!output->skin.surface || r->options->no_frames || output->frame_interval < 1) return FLESH_OK;
  int status = flesh_surface_read(output->skin.surface, &r->surface);
  return status ? status : flesh_skin_bind(flesh_scene_mesh(r->scene), r->surface, &r->skin);
}

/* Opens the skin's files, and says what of it is outside the body. */
static int open_skin(runner *r, int every)
{
  const flesh_scene_output *output = flesh_scene_outputs(r->scene);
  flesh_skin_info info;
  if (!r->skin) return FLESH_OK;
  int status = flesh_skin_frames_create(in_out(r, "skin"), r->skin, r->surface, output->skin.formats,
                                        every, &r->skin_frames);
  if (!status) status = flesh_skin_write(r->skin, in_out(r, "skin/binding.txt"));
  if (status || r->options->quiet) return status;
  flesh_skin_inspect(r->skin, &info);
  flesh_skin_print(stdout, output->skin.surface, &info);
  return FLESH_OK;
}

/* Whether a file could be written there; it is not touched. */
static int probe(const char *path)
{
  flesh_file file;
  int status = flesh_file_open(path, &file);
  flesh_file_abandon(&file);
  return status;
}

/* An older run's would not belong to this one. */
static int open_probes(runner *r)
{
  int count;
  const flesh_probe *probes = flesh_scene_probes(r->scene, &count);
  unlink(in_out(r, "probes.csv"));
  return !count ? FLESH_OK
                : flesh_probes_create(in_out(r, "probes.csv"), flesh_scene_body(r->scene),
                                      flesh_scene_system(r->scene), flesh_scene_times(r->scene)->method, count, probes,
                                      &r->probes);
}

/* Everything that can fail for want of a writable place fails here, before any solve. */
static int open_outputs(runner *r, flesh_figures *figures)
{
  const flesh_runner_options *options = r->options;
  r->path = malloc(strlen(options->out) + 64);
  if (!r->path) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  r->program = flesh_provenance_program(options->argc, options->argv);
  const flesh_solver_options *solver = flesh_scene_solver(r->scene);
  int threads = solver->threads ? solver->threads : flesh_threads_available();
  json_object_set_new(r->program, "threads", json_integer(threads));
  const char *preconditioner = flesh_preconditioner_used(r->scene);
  json_object_set_new(r->program, "preconditioner",
                      preconditioner ? json_string(preconditioner) : json_null());
  r->inputs = flesh_provenance_scene(r->scene, options->scene_path);
  json_t *running = json_pack("{ss}", "status", "running");
  int status = flesh_json_write(in_out(r, "result.json"), result_of(r, running, figures));
  if (status) return status; /* an older run's results still stand */
  r->running = 1;
  unlink(in_out(r, "state.txt"));
  flesh_skin_frames_remove(in_out(r, "skin"));
  unlink(in_out(r, "skin/binding.txt"));
  rmdir(in_out(r, "skin")); /* stays where something else is in it */
  status = flesh_scene_write(r->scene, in_out(r, "scene.yaml"));
  if (!status)
    status =
        flesh_history_create(in_out(r, "history.csv"), flesh_scene_system(r->scene), &r->history);
  if (!status) status = open_probes(r);
  if (status) return status;
  const flesh_scene_output *output = flesh_scene_outputs(r->scene);
  const int every = output->frame_interval;
  if (options->no_frames || every < 1) drop_frames(r);
  else
    status =
        flesh_frames_create(in_out(r, "frames"), flesh_scene_mesh(r->scene), every, &r->frames);
  if (!status && r->frames)
    status = flesh_frames_set_fields(r->frames, flesh_scene_body(r->scene), flesh_scene_system(r->scene),
                                     flesh_scene_times(r->scene)->method, output->fields, output->fields_at);
  if (!status && r->frames) status = open_skin(r, every);
  return status;
}

static int open_state(runner *r)
{
  size_t unknowns = (size_t)flesh_system_unknowns(flesh_scene_system(r->scene));
  r->state.x = malloc(sizeof(double) * unknowns);
  r->state.v = malloc(sizeof(double) * unknowns);
  r->state.multiplier_count = flesh_system_multiplier_count(flesh_scene_system(r->scene));
  if (r->state.multiplier_count) r->state.multipliers = calloc((size_t)r->state.multiplier_count, sizeof(double));
  if (!r->state.x || !r->state.v || (r->state.multiplier_count && !r->state.multipliers))
    return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  flesh_scene_start(r->scene, &r->state);
  r->start_t = r->state.t;
  if (r->start_t > flesh_scene_times(r->scene)->end)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "%s: the start state is at t = %g s, after time.end = %g s",
                      r->options->scene_path, r->start_t, flesh_scene_times(r->scene)->end);
  return FLESH_OK;
}

static int create_integrator(runner *r)
{
  const flesh_scene_time *time = flesh_scene_times(r->scene);
  int status = flesh_integrator_create(flesh_scene_system(r->scene), time->method, flesh_scene_solver(r->scene),
                                       &r->integrator);
  if (!status) status = flesh_integrator_set_adaptive(r->integrator, &time->adaptive);
  if (!status) status = flesh_integrator_set_method_options(r->integrator, &time->options);
  if (!status) status = flesh_integrator_set_max_energy_gain(r->integrator, time->max_energy_gain);
  if (!status) flesh_integrator_costs(r->integrator)->timed = r->options->profile;
  return status;
}

/* Returns how many there are. */
static int list_observers(runner *r, flesh_figures *figures, flesh_observer observers[OBSERVER_LIMIT])
{
  const flesh_runner_options *options = r->options;
  int count = 0;
  observers[count++] = (flesh_observer){flesh_figures_observe, figures};
  observers[count++] = (flesh_observer){note_step, r};
  observers[count++] = (flesh_observer){flesh_rest_trace_observe, &r->trace};
  if (r->history) observers[count++] = (flesh_observer){flesh_history_observe, r->history};
  if (r->probes) observers[count++] = (flesh_observer){flesh_probes_observe, r->probes};
  if (r->frames) observers[count++] = (flesh_observer){flesh_frames_observe, r->frames};
  if (r->skin_frames)
    observers[count++] = (flesh_observer){flesh_skin_frames_observe, r->skin_frames};
  if (r->progress) observers[count++] = (flesh_observer){show_progress, r};
  for (int o = 0; o < options->observer_count && count < OBSERVER_LIMIT; o++)
    observers[count++] = options->observers[o];
  return count;
}

/* What a user should know of the run, whether it failed or not. */
static void tell_outcome(runner *r, int status, flesh_figures *figures, flesh_outcome *outcome)
{
  if (r->progress) fputs("\r\033[K", stderr);
  figures->balance = *flesh_integrator_energy_balance(r->integrator);
  const char *warning = flesh_integrator_warning(r->integrator);
  if (warning) snprintf(outcome->warning, sizeof outcome->warning, "%s", warning);
  if (!status) figures->stressed_rest = flesh_stressed_rest(r->scene, &r->trace, &r->state);
  if (figures->stressed_rest > 0) {
    snprintf(outcome->warning, sizeof outcome->warning,
             "the body is at rest in a stressed state: %.4g J of strain energy, and no load holds it (a tangle, or "
             "another stable shape than the one at rest)", figures->stressed_rest);
    warning = outcome->warning;
  }
  if (warning && status != FLESH_ERR_ENERGY && !r->options->quiet) fprintf(stderr, "flesh: warning: %s\n", warning);
  if (status == FLESH_ERR_SOLVE || status == FLESH_ERR_INTEGRATOR || status == FLESH_ERR_NONFINITE ||
      status == FLESH_ERR_ENERGY) {
    const flesh_failure *failure = flesh_integrator_failure(r->integrator);
    if (failure && !failure->status) failure = NULL; /* a step that was taken made the number */
    outcome->has_failure = failure != NULL;
    if (failure) outcome->failure = *failure;
    if (failure) outcome->advice = flesh_failure_advice(failure, r->scene, figures);
  }
}

static int simulate(runner *r, flesh_figures *figures, flesh_outcome *outcome)
{
  const flesh_scene_time *time = flesh_scene_times(r->scene);
  flesh_observer observers[OBSERVER_LIMIT];
  flesh_solve_stats unfinished;
  int status = create_integrator(r);
  if (status) return status;
  const flesh_run_options run = {.unfinished = &unfinished,
                                 .h = time->step,
                                 .end = time->end,
                                 .observer_count = list_observers(r, figures, observers),
                                 .observers = observers,
                                 .stop = stop,
                                 .stop_data = r};
  double cpu = seconds(CLOCK_PROCESS_CPUTIME_ID);
  r->started = seconds(CLOCK_MONOTONIC);
  status = flesh_run(flesh_scene_system(r->scene), r->integrator, &run, &r->state, NULL);
  flesh_figures_add_unfinished(figures, &unfinished);
  figures->wall_s = seconds(CLOCK_MONOTONIC) - r->started;
  figures->cpu_s = seconds(CLOCK_PROCESS_CPUTIME_ID) - cpu;
  struct rusage usage;
  if (!getrusage(RUSAGE_SELF, &usage)) figures->peak_memory_kB = usage.ru_maxrss;
  tell_outcome(r, status, figures, outcome);
  return status;
}

/* The last good state is kept however the run ended. */
static int keep_state(runner *r)
{
  int nodes = flesh_mesh_node_count(flesh_scene_mesh(r->scene));
  int status =
      r->options->out ? flesh_state_write(in_out(r, "state.txt"), nodes, &r->state) : FLESH_OK;
  if (r->options->save_state) {
    int saved = flesh_state_write(r->options->save_state, nodes, &r->state);
    if (!status) status = saved;
  }
  return status;
}

/* On a full disk the file that says "running" makes room for the one that says how the run ended. */
static int keep_result(runner *r, const flesh_outcome *outcome, const flesh_figures *figures)
{
  int status = FLESH_OK;
  for (int tries = 0; tries < 2; tries++) {
    if (tries) unlink(in_out(r, "result.json"));
    status = flesh_json_write(in_out(r, "result.json"), result_of(r, flesh_outcome_json(outcome), figures));
    if (!status) break;
  }
  return status;
}

static void note(flesh_outcome *outcome, int status)
{
  const char *text = flesh_error_text();
  outcome->status = status;
  outcome->exit_code = flesh_exit_code(status);
  if (status == FLESH_ERR_INTERRUPTED) outcome->exit_code = flesh_interrupt_exit_code();
  snprintf(outcome->message, sizeof outcome->message, "%s",
           !status ? ""
           : *text ? text
                   : flesh_status_text(status));
}

int flesh_runner_run(const flesh_scene *scene, const flesh_runner_options *options,
                     flesh_figures *figures, flesh_outcome *outcome)
{
  runner r = {
      .scene = scene, .options = options, .progress = !options->quiet && isatty(STDERR_FILENO)};
  *outcome = (flesh_outcome){.advice = ""};
  int status = flesh_figures_open(figures, flesh_scene_system(scene));
  if (!status) status = open_state(&r);
  if (!status && options->out) status = bind_skin(&r);
  if (!status && options->save_state) status = probe(options->save_state);
  flesh_folder_claim claim = {.descriptor = -1};
  if (!status) status = flesh_run_output_claim(scene, options->scene_path, options->save_state, options->out, &claim);
  if (!status && options->out) status = open_outputs(&r, figures);
  int prepared = !status;
  if (!status) status = simulate(&r, figures, outcome);
  note(outcome, status);
  /* Each of these is written even when another could not be. */
  int kept[5] = {FLESH_OK, FLESH_OK, FLESH_OK, FLESH_OK, FLESH_OK};
  if (prepared) kept[0] = keep_state(&r);
  if (kept[0] && !outcome->status) note(outcome, kept[0]);
  kept[1] = flesh_history_close(&r.history);
  if (kept[1] && !outcome->status) note(outcome, kept[1]);
  kept[4] = flesh_probes_close(&r.probes);
  if (kept[4] && !outcome->status) note(outcome, kept[4]);
  flesh_frames_close(&r.frames);
  kept[3] = flesh_skin_frames_close(&r.skin_frames);
  if (kept[3] && !outcome->status) note(outcome, kept[3]);
  flesh_skin_destroy(&r.skin);
  flesh_surface_destroy(&r.surface);
  if (r.running) kept[2] = keep_result(&r, outcome, figures);
  if (kept[2] && !outcome->status) note(outcome, kept[2]);
  if (r.integrator && options->profile && !options->quiet)
    flesh_costs_print(stdout, flesh_integrator_costs(r.integrator), flesh_scene_system(scene));
  flesh_integrator_destroy(&r.integrator);
  flesh_folder_claim_release(&claim);
  json_decref(r.program);
  json_decref(r.inputs);
  free(r.state.x);
  free(r.state.v);
  free(r.state.multipliers);
  free(r.path);
  flesh_rest_trace_clear(&r.trace);
  return outcome->status;
}
