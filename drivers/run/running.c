/* running.c: runs a scene with history, frames, progress, budget and a result that is always valid. */
#include "run/running.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/clock.h"
#include "cli/json_memory.h"
#include "base/text.h"
#include "cli/interrupt.h"
#include "run/describe.h"
#include "run/start.h"
#include "time/integrator.h"

enum { OBSERVER_LIMIT = 16 };

static int show_progress(void *data, const flesh_step_record *record)
{
  flesh_running *r = data;
  double now = flesh_wall_seconds();
  if (now - r->last_progress < 0.1 && !record->last) return FLESH_OK;
  r->last_progress = now;
  double end = flesh_scene_times(r->scene)->end, t = record->state->t;
  double part = end > r->start_t ? (t - r->start_t) / (end - r->start_t) : 1;
  double left = part > 0 ? (now - r->started) * (1 - part) / part : NAN;
  fprintf(stderr, "\r\033[Kt %.4g / %.4g s  %3.0f %%  newton %d  least J %.3f  ", t, end, 100 * part,
          record->stats->newton, record->J_min);
  if (isfinite(left)) fprintf(stderr, "%.0f s left", ceil(left));
  fflush(stderr);
  return FLESH_OK;
}

/* Seconds without a report after which the progress of a long step is printed; it is printed again whenever the step
 * has lasted twice as long, but at least every ten minutes. */
static const double first_report = 10, longest_pause = 600;

static int note_step(void *data, const flesh_step_record *record)
{
  flesh_running *r = data;
  r->last_step = flesh_wall_seconds();
  r->next_report = r->last_step + first_report;
  r->step = record->step;
  return FLESH_OK;
}

/* Reports the progress of a step that takes long. */
static void report_long_step(flesh_running *r)
{
  const double now = flesh_wall_seconds(), lasting = now - r->last_step;
  if (r->options->quiet || !r->integrator || now < r->next_report) return;
  const flesh_progress p = flesh_integrator_progress(r->integrator);
  r->next_report = now + (lasting < longest_pause ? lasting : longest_pause);
  fprintf(stderr, "%sstep %d has taken %.0f s: from t = %g s with h = %.3g s", r->progress ? "\r\033[K" : "",
          r->step + 1, lasting, p.t, p.h);
  if (p.target > 0) fprintf(stderr, ", Newton iteration %d, %ld linear ones", p.newton + 1, p.linear);
  if (p.residual > 0) fprintf(stderr, ", residual %.3g N, wanted %.3g N", p.residual, p.target);
  fputc('\n', stderr);
  fflush(stderr);
}

/* Seconds for which a run with checkpoints that is asked to end may go on, to finish its step and write it. */
static const double grace = 10;

static int stop(void *data)
{
  flesh_running *r = data;
  report_long_step(r);
  const int status = flesh_running_asked_to_end(r);
  if (!status || !r->checkpoint.on) return status;
  const double now = flesh_wall_seconds();
  if (r->checkpoint.asked == 0) r->checkpoint.asked = now;
  return now - r->checkpoint.asked < grace ? FLESH_OK : status;
}

static int create_integrator(flesh_running *r)
{
  const flesh_ranks *ranks = r->options->ranks;
  flesh_solver_options solver = *flesh_scene_solver(r->scene);
  if (ranks) solver.threads = flesh_ranks_threads(ranks, r->scene);
  const int status = flesh_start_integrator(r->scene, flesh_ranks_system(ranks, r->scene), &solver, &r->integrator);
  if (!status) flesh_integrator_costs(r->integrator)->timed = r->options->profile;
  return status;
}

/* Lists the observers of the run and returns their number. */
static int list_observers(flesh_running *r, flesh_observer observers[OBSERVER_LIMIT])
{
  const flesh_runner_options *options = r->options;
  int count = 0;
  observers[count++] = (flesh_observer){flesh_figures_observe, r->figures};
  observers[count++] = (flesh_observer){note_step, r};
  observers[count++] = (flesh_observer){flesh_run_trace_observe, &r->trace};
  if (r->history) observers[count++] = (flesh_observer){flesh_history_observe, r->history};
  if (r->probes && !options->ranks) observers[count++] = (flesh_observer){flesh_probes_observe, r->probes};
  if (r->frames) observers[count++] = (flesh_observer){flesh_frames_observe, r->frames};
  if (r->skin_frames) observers[count++] = (flesh_observer){flesh_skin_frames_observe, r->skin_frames};
  if (r->progress) observers[count++] = (flesh_observer){show_progress, r};
  for (int o = 0; o < options->observer_count && count < OBSERVER_LIMIT - 1; o++)
    observers[count++] = options->observers[o];
  if (r->checkpoint.on && !options->ranks) observers[count++] = (flesh_observer){flesh_running_observe_checkpoint, r};
  return count;
}

/* Adds a warning to result.json and, if `spoken`, prints it to stderr. */
__attribute__((format(printf, 4, 5))) static void warn(const flesh_running *r, flesh_outcome *outcome, int spoken,
                                                       const char *format, ...)
{
  char words[2 * sizeof outcome->warning];
  va_list arguments, again;
  va_start(arguments, format);
  va_copy(again, arguments);
  vsnprintf(words, sizeof words, format, arguments);
  va_end(arguments);
  flesh_text_add(outcome->warning, sizeof outcome->warning, "%s%s", *outcome->warning ? "; " : "", words);
  if (spoken && !r->options->quiet) {
    fputs("flesh: warning: ", stderr);
    vfprintf(stderr, format, again);
    putc('\n', stderr);
  }
  va_end(again);
}

/* Collects the effects' messages about their internal variables. */
static void tell_effects(const flesh_running *r, flesh_outcome *outcome)
{
  const flesh_system *system = flesh_scene_system(r->scene);
  for (int e = 0; r->state.internal && e < flesh_system_effect_count(system); e++) {
    char words[300] = "";
    const flesh_effect *effect = flesh_system_effect(system, e);
    const flesh_effect_internal *can = effect->operations->internal;
    if (can && can->tell) can->tell(effect, flesh_internal_of(system, e, r->state.internal), sizeof words, words);
    if (!*words) continue;
    flesh_text_add(outcome->notes, sizeof outcome->notes, "%s%s: %s", *outcome->notes ? "; " : "",
                   effect->operations->name, words);
    if (!r->options->quiet) printf("%s: %s\n", effect->operations->name, words);
  }
}

/* Returns whether rounding hides the forces: most solves ended at rounding, the last one with *part of the forces out
 * of balance. */
static int rounding_hides(const flesh_figures *figures, double tolerance, double *part)
{
  *part = figures->residual / figures->residual_target * tolerance; /* the target is the tolerance times the forces */
  return figures->at_rounding > figures->solves / 2 && *part > 0.1 && *part < INFINITY;
}

/* Adds warnings and messages about the run, whether it succeeded or failed. */
static void tell_outcome(flesh_running *r, int status, flesh_outcome *outcome)
{
  flesh_figures *figures = r->figures;
  char words[300];
  double part, first;
  if (r->progress) fputs("\r\033[K", stderr);
  figures->balance = *flesh_integrator_energy_balance(r->integrator);
  tell_effects(r, outcome);
  figures->separation = flesh_integrator_separation(r->integrator);
  const flesh_separation *separation = &figures->separation;
  if (separation->ignored)
    warn(r, outcome, 1, "surfaces that intersect at the start (%d place%s) are not apart at the end (%d place%s): there is "
                        "no contact there", separation->begun, separation->begun == 1 ? "" : "s", separation->ignored,
         separation->ignored == 1 ? "" : "s");
  const char *warning = flesh_integrator_warning(r->integrator);
  if (warning) warn(r, outcome, status != FLESH_ERR_ENERGY, "%s", warning);
  if (!status && !flesh_running_is_split(r)) figures->stressed_rest = flesh_stressed_rest(r->scene, &r->trace, &r->state);
  if (figures->stressed_rest > 0)
    warn(r, outcome, 1, "the body is at rest in a stressed state: %.4g J of strain energy, and no load holds it (a tangle, "
                        "or another stable shape than the one at rest)", figures->stressed_rest);
  if (rounding_hides(figures, flesh_scene_solver(r->scene)->newton_tolerance, &part))
    warn(r, outcome, 1, "%ld of %ld solves ended at rounding, the last with %.3g N out of balance, %.2g of the forces to "
                        "balance: the motion is not to be trusted; a nearly flat tet (`flesh mesh info`), a tiny body or too "
                        "small a load does that", figures->at_rounding, figures->solves, figures->residual, part);
  const int over = flesh_steps_over(r->scene, r->state.t, &first);
  if (over)
    warn(r, outcome, 1, "in %d step%s, first at t = %.6g s, loads or motions begin, turn or end more than once within the "
                        "step; backward-euler takes them as they are at its end and misses a pulse before it: make time.step "
                        "shorter, or take another method", over, over == 1 ? "" : "s", first);
  figures->longest_step = flesh_longest_step_find(&r->trace, figures->unfinished_newton, figures->unfinished_linear);
  if (flesh_longest_step_tell(&figures->longest_step, sizeof words, words)) warn(r, outcome, 1, "%s", words);
  if (status == FLESH_ERR_SOLVE || status == FLESH_ERR_INTEGRATOR || status == FLESH_ERR_NONFINITE ||
      status == FLESH_ERR_ENERGY) {
    const flesh_failure *failure = flesh_integrator_failure(r->integrator);
    if (failure && !failure->status) failure = NULL; /* no step failed: an accepted one made the bad number */
    outcome->has_failure = failure != NULL;
    if (failure) outcome->failure = *failure;
    if (failure) outcome->advice = flesh_failure_advice(failure, r->scene, figures);
  }
}

static int simulate(flesh_running *r, flesh_outcome *outcome)
{
  flesh_figures *figures = r->figures;
  const flesh_scene_time *time = flesh_scene_times(r->scene);
  const flesh_ranks *ranks = r->options->ranks;
  flesh_observer observers[OBSERVER_LIMIT];
  const flesh_observer of_ranks[] = {{flesh_running_observe_ranks, r}, {flesh_running_observe_checkpoint, r}};
  const int count = flesh_ranks_first(ranks) ? list_observers(r, observers) : 0;
  flesh_solve_stats unfinished;
  const flesh_run_options run = {.unfinished = &unfinished,
                                 .h = time->step,
                                 .end = time->end,
                                 .observer_count = ranks ? 1 + r->checkpoint.on : count,
                                 .observers = ranks ? of_ranks : observers,
                                 .stop = stop,
                                 .stop_data = r};
  r->cpu_begin = flesh_cpu_seconds();
  r->checkpoint.at = flesh_wall_seconds();
  r->last_step = r->checkpoint.at;
  r->next_report = r->last_step + first_report;
  r->started = r->checkpoint.at - (r->options->resume ? r->options->resume->head.wall_s : 0);
  r->set_up = r->options->begun > 0 ? r->checkpoint.at - r->options->begun : 0;
  const flesh_system *system = flesh_ranks_system(ranks, r->scene);
  r->observers = observers;
  r->observer_count = count;
  int status = r->options->resume
               ? flesh_run_resume(system, r->integrator, &run, r->step, r->start_t, ranks ? &r->own : &r->state, NULL)
               : flesh_run(system, r->integrator, &run, ranks ? &r->own : &r->state, NULL);
  if (flesh_ranks_first(ranks) && !flesh_running_is_split(r)) status = flesh_start_place(r->scene, &r->state, status);
  flesh_figures_add_unfinished(figures, &unfinished);
  figures->wall_s = flesh_wall_seconds() - r->started;
  figures->cpu_s = r->cpu_before + flesh_cpu_seconds() - r->cpu_begin;
  struct rusage usage;
  if (!getrusage(RUSAGE_SELF, &usage)) figures->peak_memory_kB = usage.ru_maxrss;
  if (flesh_ranks_first(ranks)) tell_outcome(r, status, outcome);
  return status;
}

/* Writes result.json. On a full disk the file that says "running" is removed to make room. */
static int keep_result(flesh_running *r, const flesh_outcome *outcome)
{
  const char *path = flesh_running_path(r, "result.json");
  const int status = flesh_json_write(path, flesh_running_result(r, flesh_outcome_json(outcome)));
  if (!status) return FLESH_OK;
  flesh_path_unlink(path);
  return flesh_json_write(path, flesh_running_result(r, flesh_outcome_json(outcome)));
}

/* Records a failure, unless the run had failed before. */
static void note(flesh_outcome *outcome, int status)
{
  const char *text = flesh_error_text();
  if (!status || outcome->status) return;
  outcome->status = status;
  outcome->exit_code = flesh_exit_code(status);
  snprintf(outcome->message, sizeof outcome->message, "%s", *text ? text : flesh_status_text(status));
}

/* Restores the run's memory and files from a checkpoint; every rank calls it. */
static int resume_from_checkpoint(flesh_running *r)
{
  const flesh_runner_options *options = r->options;
  const flesh_checkpoint_head *head = &options->resume->head;
  int status = flesh_running_restore(r);
  r->checkpoint.on = 1;
  if (!status && flesh_ranks_first(options->ranks)) status = flesh_running_open(r);
  if (!status && !options->quiet)
    printf("goes on after step %d, t = %g s%s\n", head->step, r->state.t,
           !head->exact         ? "; IDA starts anew there: the motion agrees with an unbroken one within time.tolerance"
           : r->checkpoint.fits ? ""
                                : "; another number of ranks has come there: the motion agrees with theirs within the solves' "
                                   "tolerance");
  return flesh_ranks_agree(options->ranks, status);
}

/* Prepares the outputs of a run on the first rank, or in a process without ranks; those of a run that resumes are opened
 * once its memory is restored. */
static int prepare(flesh_running *r, flesh_folder_claim *claim)
{
  const flesh_runner_options *options = r->options;
  int status = flesh_start_make(r->scene, &r->state);
  r->start_t = r->state.t;
  if (!status) status = flesh_start_check(r->scene);
  if (!status && options->out && !options->no_frames) status = flesh_start_skin(r->scene, &r->surface, &r->skin);
  if (!status && options->save_state) { /* to see whether it can be written; it stays as it is */
    flesh_file file;
    status = flesh_file_open(options->save_state, &file);
    flesh_file_abandon(&file);
  }
  if (!status) status = flesh_running_claim(r, claim);
  if (status || options->resume) return status;
  return options->out ? flesh_running_open(r) : options->ranks ? FLESH_OK : flesh_running_open_probes(r);
}

/* Writes the results; each is written even if another could not be. */
static void finish(flesh_running *r, int prepared, flesh_outcome *outcome)
{
  const int nodes = flesh_mesh_node_count(flesh_scene_mesh(r->scene));
  const char *last_states[] = {r->options->out ? flesh_running_path(r, "state.txt") : NULL, r->options->save_state};
  for (int k = 0; k < 2 && prepared && !flesh_running_is_split(r); k++) /* the last good state, however the run ended */
    if (last_states[k]) note(outcome, flesh_state_write(last_states[k], nodes, &r->state));
  note(outcome, flesh_history_close(&r->history));
  note(outcome, flesh_probes_close(&r->probes));
  flesh_frames_close(&r->frames);
  note(outcome, flesh_skin_frames_close(&r->skin_frames));
  flesh_skin_destroy(&r->skin);
  flesh_surface_destroy(&r->surface);
  if (r->running) note(outcome, keep_result(r, outcome));
  if (prepared && r->checkpoint.on && !outcome->status) note(outcome, flesh_running_drop_checkpoint(r));
  if (r->integrator && r->options->profile && !r->options->quiet)
    flesh_costs_print(stdout, flesh_integrator_costs(r->integrator), flesh_running_system(r));
}

static void close_running(flesh_running *r)
{
  flesh_integrator_destroy(&r->integrator);
  flesh_probes_close(&r->probes); /* the other ranks' probes, which write no file */
  json_decref(r->program);
  json_decref(r->inputs);
  json_decref(r->resumed);
  json_decref(r->warning);
  json_decref(r->ranks);
  free(r->state.x);
  free(r->own.x);
  free(r->stage.x);
  flesh_proximity_clear(&r->proximity);
  free(r->J_mean);
  flesh_frames_close(&r->part_frames);
  flesh_run_trace_clear(&r->trace);
}

int flesh_runner_run(const flesh_scene *scene, const flesh_runner_options *options,
                     flesh_figures *figures, flesh_outcome *outcome)
{
  flesh_running r = {.scene = scene, .options = options, .progress = !options->quiet && isatty(STDERR_FILENO),
                     .figures = figures, .checkpoint = {.step = -1}};
  const int first = flesh_ranks_first(options->ranks);
  flesh_folder_claim claim = {.descriptor = -1};
  *outcome = (flesh_outcome){.advice = ""};
  r.checkpoint.on = options->out && (options->checkpoint.seconds > 0 || options->checkpoint.steps > 0);
  if (flesh_scene_warning(scene) && !options->resume) r.warning = flesh_json_text(flesh_scene_warning(scene));
  int status = flesh_figures_open(figures, flesh_running_system(&r), scene);
  if (options->ranks) {
    if (!status) status = flesh_running_share(&r);
    status = flesh_ranks_agree(options->ranks, status);
  }
  if (!status) status = create_integrator(&r); /* refuses what it cannot do before anything is written */
  if (!status && first) status = prepare(&r, &claim);
  status = flesh_ranks_agree(options->ranks, status);
  if (!status && options->resume) status = resume_from_checkpoint(&r);
  if (first && r.warning) warn(&r, outcome, 1, "%s", json_string_value(r.warning));
  const int begun = !status, prepared = begun && first;
  if (begun && options->ranks) status = flesh_running_open_parts(&r);
  if (!status) status = simulate(&r, outcome);
  if (status == FLESH_ERR_INTERRUPTED)
    flesh_interrupt_adopt(flesh_ranks_largest(options->ranks, flesh_interrupt_signal()));
  note(outcome, status);
  if (begun && flesh_running_is_split(&r)) note(outcome, flesh_running_keep_parts(&r));
  r.ranks = flesh_ranks_json(options->ranks);
  if (first) finish(&r, prepared, outcome);
  close_running(&r);
  flesh_folder_claim_release(&claim);
  return outcome->status;
}
