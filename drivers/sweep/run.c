/* run.c: runs the cases of a sweep, each in a process of its own, and writes each as it ends. */
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "base/confine.h"
#include "base/error.h"
#include "cli/interrupt.h"
#include "cli/json_memory.h"
#include "base/file.h"
#include "base/folder.h"
#include "sweep/sweep.h"

/* Time after the end of its budget within which a case must end, s; it stops by itself between two steps, and is killed
 * later. */
static const double GRACE = 2;
/* How long a case waits for the end of another process in its folder, s. */
static const double PATIENCE = 5;

typedef struct crew {
  const flesh_sweep *sweep;
  flesh_sweep_store *store;
  const flesh_sweep_run_options *options;
  flesh_pool *pool;
  int *running, count; /* numbers of the cases that run */
  int total, before;   /* cases of the database, and those that were done at the start */
  int done, failed;
  double started, shown;
} crew;

static double now(void)
{
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int has_folder(const flesh_sweep *sweep) { return sweep->keep || sweep->command != FLESH_SWEEP_RUN; }

static char *case_folder(const char *out, int id)
{
  char *folder = malloc(strlen(out) + 40);
  if (folder) sprintf(folder, "%s/cases/%06d", out, id);
  return folder;
}

/* Waits until nobody else fills the case's folder: a case whose sweep was killed ends a moment after its claim in the
 * database has. Who still holds it then is no part of a sweep; the case says so. */
static void wait_for(const char *folder)
{
  flesh_folder_claim claim;
  if (!flesh_folder_claim_take(folder, "flesh sweep", PATIENCE, &claim)) flesh_folder_claim_release(&claim);
}

/* Clears away what the process of a case left that was killed, and is gone. */
static void tidy(const crew *w, int id)
{
  char *folder = has_folder(w->sweep) ? case_folder(w->options->out, id) : NULL;
  if (folder && !flesh_path_access(folder, F_OK)) wait_for(folder);
  free(folder);
}

/* The life of a case's process; the claim in the database is that of the one that has started it. */
static void work(const void *data, int id, flesh_text *answer)
{
  const flesh_sweep_work *given = data;
  const flesh_sweep *sweep = given->sweep;
  if (given->store) close(given->store->lock);
  char *folder = has_folder(sweep) ? case_folder(given->out, id) : NULL;
  int nowhere = open("/dev/null", O_RDWR), log = nowhere;
  if (has_folder(sweep) && !folder) _exit(1);
  if (folder) wait_for(folder);
  if (folder && !flesh_folder_make(folder)) {
    char *path = malloc(strlen(folder) + 16);
    if (path) sprintf(path, "%s/log.txt", folder);
    log = path ? flesh_path_open(path, O_WRONLY | O_CREAT | O_TRUNC | O_NONBLOCK, 0666) : nowhere;
    free(path);
  }
  dup2(nowhere, STDIN_FILENO);
  dup2(log < 0 ? nowhere : log, STDOUT_FILENO);
  dup2(log < 0 ? nowhere : log, STDERR_FILENO);
  flesh_sweep_case c;
  if (flesh_sweep_case_make(sweep, id, &c)) _exit(1);
  json_t *record = flesh_sweep_case_run(sweep, &c, folder);
  char *text = json_dumps(record, JSON_COMPACT);
  if (!text || flesh_json_lacks()) _exit(1);
  flesh_text_append(answer, text, strlen(text));
}

flesh_pool_cases flesh_sweep_pool_cases(const flesh_sweep_work *given)
{
  return (flesh_pool_cases){work, given, given->sweep->max_seconds > 0 ? given->sweep->max_seconds + GRACE : 0};
}

/* Starts the case, or gives it back. Where no more processes can be had, those that run go on. */
static int begin(crew *w, int id)
{
  int started = 0;
  const int status = flesh_pool_start(w->pool, id, &started);
  if (!status && started) {
    w->running[w->count++] = id;
    return FLESH_OK;
  }
  char words[512];
  snprintf(words, sizeof words, "%s", flesh_error_text());
  const int released = flesh_sweep_store_release(w->store, id);
  if (released || status) return released ? released : flesh_fail(status, "%s", words);
  if (!w->options->quiet) fprintf(stderr, "flesh sweep: %s; from now on %d at a time\n", words, w->count);
  return FLESH_OK;
}

static void show_progress(crew *w)
{
  double time = now();
  int finished = w->before + w->done;
  if (w->options->quiet || !isatty(STDERR_FILENO) || time - w->shown < 0.1) return;
  w->shown = time;
  fprintf(stderr, "\r\033[K%d of %d cases", finished, w->total);
  if (w->failed) fprintf(stderr, ", %d not complete", w->failed);
  if (w->done) fprintf(stderr, ", %.0f s left", ceil((time - w->started) * (w->total - finished) / w->done));
  fflush(stderr);
}

/* The result of a case whose process reported nothing. */
static json_t *silent(const crew *w, const flesh_pool_end *end)
{
  char message[160];
  const int ended = end->ended;
  if (end->killed && w->sweep->max_seconds > 0) {
    snprintf(message, sizeof message, "it did not stop by itself: ended %g s after its budget of %g s was spent", GRACE,
             w->sweep->max_seconds);
    return json_pack("{sssisssn}", "status", "out of budget", "exit_code", 6, "message", message, "result");
  }
  if (WIFSIGNALED(ended))
    snprintf(message, sizeof message, "its process was ended by signal %d (%s)", WTERMSIG(ended),
             strsignal(WTERMSIG(ended)));
  else snprintf(message, sizeof message, "its process ended without a result, exit code %d", WEXITSTATUS(ended));
  return json_pack("{sssisssn}", "status", "crashed", "exit_code",
                   WIFSIGNALED(ended) ? 128 + WTERMSIG(ended) : 1, "message", message, "result");
}

/* Writes the row of a case that has ended and takes the next. */
static int collect(crew *w, const flesh_pool_end *end)
{
  int next = 0, status, place = 0;
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
    status = flesh_sweep_store_release(w->store, end->number);
  else {
    status = flesh_sweep_store_finish(w->store, end->number, record, end->seconds, stopped ? NULL : &next);
    w->done += !status;
    w->failed += !status && strcmp(word, "complete");
  }
  json_decref(record);
  if (!status && next) status = begin(w, next);
  show_progress(w);
  return status;
}

/* Until nothing is left to be begun and all that runs has ended. */
static int run_all(crew *w)
{
  int status = FLESH_OK, left = 1;
  while (!status && (left || w->count)) {
    while (!status && left && flesh_pool_has_room(w->pool) && !flesh_interrupt_signal()) {
      int id;
      status = flesh_sweep_store_claim(w->store, &id);
      if (!status && !id) left = 0;
      else if (!status) status = begin(w, id);
    }
    if (flesh_interrupt_signal()) left = 0;
    if (status || !w->count) continue;
    flesh_pool_end end;
    status = flesh_pool_wait(w->pool, &end);
    if (!status && end.number >= 0) status = collect(w, &end);
  }
  return status;
}

int flesh_sweep_run(const flesh_sweep_work *given, flesh_sweep_store *store, const flesh_sweep_run_options *options)
{
  const flesh_pool_cases cases = flesh_sweep_pool_cases(given);
  crew w = {.sweep = given->sweep, .store = store, .options = options, .started = now()};
  const int count = flesh_sweep_store_count(store, NULL);
  int abandoned = 0, elsewhere, status = flesh_pool_open(options->ranks, options->jobs, count, &cases, &w.pool);
  w.running = calloc((size_t)flesh_pool_places(options->ranks, options->jobs, count) + 1, sizeof *w.running);
  if (!status && !w.running) status = flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  while (!status) {
    status = flesh_sweep_store_recover(store, &abandoned, &elsewhere);
    w.total = flesh_sweep_store_count(store, NULL);
    if (!w.done) w.before = w.total - flesh_sweep_store_count(store, "planned") - elsewhere;
    if (!status) status = run_all(&w);
    /* Another process may have ended meanwhile without having finished its cases. */
    if (!status && !flesh_interrupt_signal()) status = flesh_sweep_store_recover(store, &abandoned, &elsewhere);
    if (!abandoned || flesh_interrupt_signal()) break;
  }
  char words[1024];
  snprintf(words, sizeof words, "%s", flesh_error_text());
  flesh_pool_close(&w.pool);
  for (int k = 0; k < w.count; k++) tidy(&w, w.running[k]);
  if (!options->quiet && isatty(STDERR_FILENO)) fputs("\r\033[K", stderr);
  free(w.running);
  if (status) return flesh_fail(status, "%s", words);
  return flesh_interrupt_signal() ? flesh_fail(FLESH_ERR_INTERRUPTED, "interrupted; --resume goes on") : FLESH_OK;
}
