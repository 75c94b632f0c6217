/* run.c: implements a study as a command: runs the cases, each in a process of its own, and writes each as it ends. */
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/clock.h"
#include "base/error.h"
#include "base/folder.h"
#include "cli/interrupt.h"
#include "cli/json_memory.h"
#include "cli/output.h"
#include "cli/path.h"
#include "run/ranks.h"
#include "scene/words.h"
#include "study/bodies.h"
#include "study/results.h"
#include "study/study.h"

/* Seconds for which a case waits until another process has left its folder. */
static const double PATIENCE = 5;

/* A study that runs; data for the processes of its cases. On ranks behind the first, which have no database, only `study`
 * is set. */
typedef struct crew {
  const flesh_study *study;
  flesh_study_store *store;
  const flesh_study_options *options;
  flesh_pool *pool;
  int *running, count; /* numbers of the running cases */
  int total, before;   /* number of cases of the study, and of those already done at the start */
  int done, failed;
  double started, shown;
} crew;

/* Waits until no other process fills the case's folder: the process of a case whose study was killed ends a moment
 * after its claim in the database does. A process that still holds the folder then does not belong to a study; the case
 * reports that. */
static void wait_for(const char *folder)
{
  flesh_folder_claim claim;
  if (!flesh_folder_claim_take(folder, "flesh", PATIENCE, &claim)) flesh_folder_claim_release(&claim);
}

/* Cleans up after the process of a case that was killed and has ended. */
static void tidy(const crew *w, int number)
{
  char *folder = w->study->folder ? w->study->folder(w->study->data, number) : NULL;
  if (folder && !flesh_path_access(folder, F_OK)) wait_for(folder);
  free(folder);
}

/* Redirects the output of the case into log.txt of its folder, or discards it. */
static void direct_output(const char *folder)
{
  int nowhere = open("/dev/null", O_RDWR), log = nowhere;
  if (folder) wait_for(folder);
  if (folder && !flesh_folder_make(folder))
    log = flesh_path_open(flesh_path("%s/log.txt", folder), O_WRONLY | O_CREAT | O_TRUNC | O_NONBLOCK, 0666);
  dup2(nowhere, STDIN_FILENO);
  dup2(log < 0 ? nowhere : log, STDOUT_FILENO);
  dup2(log < 0 ? nowhere : log, STDERR_FILENO);
}

/* Runs in a case's process; the process that has started it holds the claim in the database. */
static void work(const void *data, int number, flesh_text *answer)
{
  const crew *w = data;
  const flesh_study *study = w->study;
  if (w->store) close(w->store->lock);
  char *folder = study->folder ? study->folder(study->data, number) : NULL;
  if (study->folder) direct_output(folder);
  json_t *record = study->work(study->data, number, folder);
  char *text = json_dumps(record, JSON_COMPACT);
  if (!text || flesh_json_lacks()) _exit(1);
  flesh_text_append(answer, text, strlen(text));
}

/* Starts the case, or releases it. If no more processes can be started, the running ones continue. */
static int begin(crew *w, int number)
{
  int started = 0;
  const int status = flesh_pool_start(w->pool, number, &started);
  if (!status && started) {
    w->running[w->count++] = number;
    return FLESH_OK;
  }
  const int released = flesh_study_store_release(w->store, number);
  if (released || status) return released ? released : status;
  if (!w->options->quiet)
    fprintf(stderr, "flesh %s: %s; from now on %d at a time\n", w->study->name, flesh_error_text(), w->count);
  return FLESH_OK;
}

/* Prints a case's values, numbers with the names of their columns, and how the case ended. */
static void print_title(const flesh_study *study, int number, const char *ended)
{
  flesh_study_case c;
  double value;
  char shown[FLESH_SHOW_SIZE];
  if (study->make(study->data, number, &c)) return;
  for (int k = 0; study->columns[k].name; k++) {
    if (!c.values[k] || !*c.values[k] || study->columns[k].is_digest) continue;
    const int is_number = flesh_number_parse(c.values[k], &value);
    fprintf(stderr, "%s%s%s%s", k ? ", " : "  ", is_number ? study->columns[k].name : "", is_number ? " " : "",
            flesh_word_show(c.values[k], shown));
  }
  fprintf(stderr, ": %s", ended);
  flesh_study_case_free(&c);
}

static void show_progress(crew *w, int number, const char *ended)
{
  double time = flesh_wall_seconds();
  int finished = w->before + w->done;
  if (w->options->quiet || !isatty(STDERR_FILENO) || (time - w->shown < 0.1 && finished < w->total)) return;
  w->shown = time;
  fprintf(stderr, "\r\033[K%d of %d cases", finished, w->total);
  if (w->failed) fprintf(stderr, ", %d not complete", w->failed);
  if (w->done && finished < w->total)
    fprintf(stderr, ", %.0f s left", ceil((time - w->started) * (w->total - finished) / w->done));
  print_title(w->study, number, ended);
  fflush(stderr);
}

/* Returns the record of a case whose process reported nothing. */
static json_t *silent(const crew *w, const flesh_pool_end *end)
{
  char message[200];
  const int ended = end->ended;
  if (end->killed && w->study->max_seconds > 0) {
    snprintf(message, sizeof message, "it did not stop by itself: ended %g s after its budget of %g s was spent",
             w->study->max_seconds - w->study->budget, w->study->budget);
    return flesh_fields_record("out of budget", flesh_exit_code(FLESH_ERR_BUDGET), message, NULL);
  }
  if (WIFSIGNALED(ended))
    snprintf(message, sizeof message, "its process was ended by signal %d (%s)", WTERMSIG(ended),
             strsignal(WTERMSIG(ended)));
  else snprintf(message, sizeof message, "its process ended without a result, exit code %d", WEXITSTATUS(ended));
  return flesh_fields_record("crashed", WIFSIGNALED(ended) ? 128 + WTERMSIG(ended) : 1, message, NULL);
}

/* Writes the row of a case that has ended; claims and starts the next. */
static int collect(crew *w, const flesh_pool_end *end)
{
  int next = -1, status, place = 0;
  while (w->running[place] != end->number) place++;
  w->running[place] = w->running[--w->count];
  if (WIFSIGNALED(end->ended)) tidy(w, end->number);
  const flesh_text *answer = &end->answer;
  json_t *record = answer->data && !answer->failed ? json_loadb(answer->data, answer->size, 0, NULL) : NULL;
  int reported = record != NULL;
  if (!record) record = silent(w, end);
  const char *word = json_string_value(json_object_get(record, "status"));
  int stopped = flesh_interrupt_signal() != 0;
  if (stopped && ((reported && !strcmp(word, "interrupted")) || (!reported && WIFSIGNALED(end->ended))))
    status = flesh_study_store_release(w->store, end->number);
  else {
    status = flesh_study_store_finish(w->store, end->number, record, end->seconds, stopped ? NULL : &next);
    w->done += !status;
    w->failed += !status && w->study->folder && strcmp(word, "complete");
    if (!status && w->study->take) status = w->study->take(w->study->data, end->number, record);
  }
  if (!status && next >= 0) status = begin(w, next);
  show_progress(w, end->number, word);
  json_decref(record);
  return status;
}

/* Runs cases until none is left to start and all running ones have ended. */
static int run_all(crew *w)
{
  int status = FLESH_OK, left = 1;
  while (!status && (left || w->count)) {
    while (!status && left && flesh_pool_has_room(w->pool) && !flesh_interrupt_signal()) {
      int number;
      status = flesh_study_store_claim(w->store, &number);
      if (!status && number < 0) left = 0;
      else if (!status) status = begin(w, number);
    }
    if (flesh_interrupt_signal()) left = 0;
    if (status || !w->count) continue;
    flesh_pool_end end;
    status = flesh_pool_wait(w->pool, &end);
    if (!status && end.number >= 0) status = collect(w, &end);
  }
  return status;
}

int flesh_study_run(const flesh_study *study, flesh_study_store *store, const flesh_study_options *options)
{
  crew w = {.study = study, .store = store, .options = options, .started = flesh_wall_seconds()};
  const flesh_pool_cases cases = {work, &w, study->max_seconds};
  const int count = flesh_study_store_count(store, NULL);
  int abandoned = 0, elsewhere, status = flesh_pool_open(options->ranks, options->jobs, count, &cases, &w.pool);
  w.running = calloc((size_t)flesh_pool_slots(options->ranks, options->jobs, count) + 1, sizeof *w.running);
  if (!status && !w.running) status = flesh_no_memory();
  while (!status) {
    status = flesh_study_store_recover(store, &abandoned, &elsewhere);
    w.total = flesh_study_store_count(store, NULL);
    if (!w.done) w.before = w.total - flesh_study_store_count(store, "planned") - elsewhere;
    if (!status) status = run_all(&w);
    /* Another process may have ended meanwhile without finishing its cases. */
    if (!status && !flesh_interrupt_signal()) status = flesh_study_store_recover(store, &abandoned, &elsewhere);
    if (!abandoned || flesh_interrupt_signal()) break;
  }
  char words[1024];
  snprintf(words, sizeof words, "%s", flesh_error_text());
  const int done = w.before + w.done;
  flesh_pool_close(&w.pool);
  for (int k = 0; k < w.count; k++) tidy(&w, w.running[k]);
  if (!options->quiet && isatty(STDERR_FILENO)) fputs("\r\033[K", stderr);
  free(w.running);
  if (status) return flesh_fail(status, "%s", words);
  return flesh_interrupt_signal()
             ? flesh_fail(FLESH_ERR_INTERRUPTED, "interrupted after %d of %d cases; --resume goes on", done, w.total)
             : FLESH_OK;
}

/* Makes the results with the study's SQL, and draws the bodies that it asks for. */
static int make_results(const flesh_study *study, flesh_study_store *store, const flesh_study_options *options, int ran,
                        flesh_plot_outcome *made)
{
  const flesh_results to = {options->out, !ran || ran == FLESH_ERR_INTERRUPTED, options->quiet, NULL,
                            ran ? NULL : flesh_plot_draw_noted, made};
  int status = flesh_study_store_make_views(store);
  if (study->facts && !status)
    status = flesh_study_store_execute(store, "CREATE TEMP TABLE IF NOT EXISTS facts (number INTEGER PRIMARY KEY, data TEXT)");
  for (int number = 0; number < study->case_count && study->facts && !status; number++) {
    json_t *facts = study->facts(study->data, number);
    if (!facts) continue;
    char *text = json_dumps(facts, JSON_COMPACT);
    json_decref(facts);
    status = text ? flesh_study_store_execute(store, "INSERT OR REPLACE INTO facts VALUES (%d, %Q)", number, text)
                  : flesh_no_memory();
    free(text);
  }
  if (!status) status = flesh_results_make(store->database, store->path, study->results, &to);
  if (!status && !ran && study->body) flesh_study_draw_bodies(study, store->database, options->out, made);
  return status;
}

int flesh_study_conclude(const flesh_study *study, flesh_study_store *store, const flesh_study_options *options, int ran)
{
  char words[1024];
  flesh_plot_outcome made = {0};
  const char *out = options->out;
  snprintf(words, sizeof words, "%s", flesh_error_text());
  int status = make_results(study, store, options, ran, &made);
  if (ran) return flesh_fail(ran, "%s", words);
  if (!status) status = flesh_plot_accept(study->name, flesh_plot_ended(&made));
  if (!status && !options->quiet && (study->body || made.count))
    printf("\nresults: %s/%s.csv, %s/%s, %s %s/*.png\n", out, study->table ? study->table : study->name, out,
           study->words ? study->words : "verdict.txt",
           made.status ? "what could be drawn of the pictures" : "pictures", out);
  return status;
}

int flesh_study_do(const flesh_study *study, const flesh_study_options *options)
{
  flesh_study_store store;
  int status = flesh_study_store_open(study, options, &store);
  if (!status && study->take) status = flesh_study_store_load(&store, study);
  if (!status) status = flesh_study_run(study, &store, options);
  if (!status && !study->asks) status = flesh_study_store_judge(&store);
  /* The cases that are done are reported in any case. */
  if (*store.worker) status = flesh_study_conclude(study, &store, options, status);
  flesh_study_store_close(&store);
  return status;
}

int flesh_study_open(flesh_study_options *options, const flesh_usage *usage, int argc, char **argv, int *count)
{
  int status = flesh_ranks_open(&options->ranks);
  options->argc = argc;
  options->argv = calloc((size_t)argc + 1, sizeof *argv);
  if (options->argv) memcpy(options->argv, argv, sizeof *argv * (size_t)argc);
  else if (!status) status = flesh_no_memory();
  return status ? flesh_command_fail(usage->command, status)
                : flesh_ranks_read_options(options->ranks, usage, argc, argv, count, NULL, NULL);
}

void flesh_study_close(flesh_study_options *options)
{
  flesh_ranks_close(&options->ranks);
  flesh_overrides_close(&options->overrides);
  free(options->argv);
}

typedef struct leader {
  const flesh_study *study;
  const flesh_study_options *options;
  flesh_study_course *course;
} leader;

/* Runs the study on the first rank, with the folder claimed unless it is shared; returns the exit code. */
static int lead(void *data)
{
  const leader *l = data;
  flesh_folder_claim claim = {.descriptor = -1};
  int status = l->study->asks ? FLESH_OK : flesh_output_claim(l->options->out, l->study->name, &claim);
  if (!status) status = l->course ? l->course(l->study, l->options) : flesh_study_do(l->study, l->options);
  flesh_folder_claim_release(&claim);
  return status ? flesh_command_fail(l->study->name, status) : 0;
}

int flesh_study_lead(const flesh_study *study, flesh_study_options *options, int status, flesh_study_course *course)
{
  int shard, shards;
  if (!status) status = flesh_study_read_shard(options->shard, &shard, &shards);
  options->jobs = flesh_pool_jobs(options->ranks, options->jobs);
  const crew w = {.study = study};
  const flesh_pool_cases cases = {work, &w, study->max_seconds};
  leader l = {study, options, course};
  return flesh_pool_lead(options->ranks, study->name, status, options->jobs, &cases, lead, &l);
}
