/* run.c: runs the cases of a sweep, each in a process of its own, and writes each as it ends. */
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "base/error.h"
#include "shared/interrupt.h"
#include "shared/json_memory.h"
#include "base/file.h"
#include "base/folder.h"
#include "shared/process.h"
#include "sweep/sweep.h"

/* What stops by itself does so between two steps; what does not within this time is ended. */
static const double GRACE = 2;
/* How long a case waits for the end of another process in its folder, s. */
static const double PATIENCE = 5;

typedef struct job {
  pid_t process; /* 0: none */
  int id, pipe;
  double started, deadline; /* monotonic seconds; INFINITY: none */
  int killed;
  flesh_text answer; /* JSON, as it comes */
} job;

typedef struct crew {
  const flesh_sweep *sweep;
  flesh_sweep_store *store;
  const flesh_sweep_run_options *options;
  int room, limit; /* jobs there is room for, and that may run at a time */
  job *jobs;
  int running, signalled;
  int total, before; /* cases of the database, and those that were done at the start */
  int done, failed;
  double started, shown;
} crew;

static double now(void)
{
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int has_folder(const crew *w) { return w->sweep->keep || w->sweep->command != FLESH_SWEEP_RUN; }

static char *case_folder(const crew *w, int id)
{
  char *folder = malloc(strlen(w->options->out) + 40);
  if (folder) sprintf(folder, "%s/cases/%06d", w->options->out, id);
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
  char *folder = has_folder(w) ? case_folder(w, id) : NULL;
  if (folder && !access(folder, F_OK)) wait_for(folder);
  free(folder);
}

/* The life of a case's process; it ends with its parent. */
static void work(const crew *w, int id, int pipe, pid_t parent)
{
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
  char *folder = has_folder(w) ? case_folder(w, id) : NULL;
  int nowhere = open("/dev/null", O_RDWR), log = nowhere;
  if (has_folder(w) && !folder) _exit(1);
  if (folder) wait_for(folder);
  if (folder && !flesh_folder_make(folder)) {
    char *path = malloc(strlen(folder) + 16);
    if (path) sprintf(path, "%s/log.txt", folder);
    log = path ? open(path, O_WRONLY | O_CREAT | O_TRUNC, 0666) : nowhere;
    free(path);
  }
  dup2(nowhere, STDIN_FILENO);
  dup2(log < 0 ? nowhere : log, STDOUT_FILENO);
  dup2(log < 0 ? nowhere : log, STDERR_FILENO);
  flesh_sweep_case c;
  if (flesh_sweep_case_make(w->sweep, id, &c)) _exit(1);
  json_t *record = flesh_sweep_case_run(w->sweep, &c, folder);
  char *text = json_dumps(record, JSON_COMPACT);
  fflush(NULL);
  if (!text || flesh_json_lacks()) _exit(1);
  for (size_t size = strlen(text), done = 0; done < size;) {
    ssize_t written = write(pipe, text + done, size - done);
    if (written < 0 && errno != EINTR) _exit(1);
    if (written > 0) done += (size_t)written;
  }
  _exit(0);
}

static int start(crew *w, int id)
{
  int ends[2], place = 0;
  while (w->jobs[place].process) place++;
  job *j = &w->jobs[place];
  if (pipe(ends)) return flesh_fail(FLESH_ERR_FILE, "no pipe to a new process: %s", strerror(errno));
  fflush(NULL);
  pid_t parent = getpid(), process = fork();
  if (process < 0) {
    close(ends[0]);
    close(ends[1]);
    return flesh_fail(FLESH_ERR_MEMORY, "no new process: %s", strerror(errno));
  }
  if (!process) {
    close(ends[0]);
    close(w->store->lock); /* the claim is its parent's */
    work(w, id, ends[1], parent);
  }
  close(ends[1]);
  fcntl(ends[0], F_SETFL, O_NONBLOCK);
  *j = (job){.process = process, .id = id, .pipe = ends[0], .started = now(), .deadline = INFINITY};
  if (w->sweep->max_seconds > 0) j->deadline = j->started + w->sweep->max_seconds + GRACE;
  w->running++;
  return FLESH_OK;
}

/* Starts the case, or gives it back. Where no more processes can be had, those that run go on. */
static int begin(crew *w, int id)
{
  int status = start(w, id);
  if (!status) return FLESH_OK;
  char words[512];
  snprintf(words, sizeof words, "%s", flesh_error_text());
  int released = flesh_sweep_store_release(w->store, id);
  if (released || !w->running) return released ? released : flesh_fail(status, "%s", words);
  w->limit = w->running;
  if (!w->options->quiet) fprintf(stderr, "flesh sweep: %s; from now on %d at a time\n", words, w->limit);
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

/* What is known of a case whose process reported nothing. */
static json_t *silent(const crew *w, const job *j, int ended)
{
  char message[160];
  if (j->killed && w->sweep->max_seconds > 0) {
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

/* Reads what has come; whether the process has closed its end. */
static int drain(job *j)
{
  char part[16384];
  for (;;) {
    ssize_t got = read(j->pipe, part, sizeof part);
    if (got > 0) flesh_text_append(&j->answer, part, (size_t)got);
    else if (got == 0) return 1;
    else if (errno != EINTR) return errno != EAGAIN;
  }
}

/* Writes the row of a case that has ended and takes the next. */
static int collect(crew *w, job *j)
{
  int ended = 0, next = 0, status;
  double seconds = now() - j->started;
  while (waitpid(j->process, &ended, 0) < 0 && errno == EINTR) continue;
  if (WIFSIGNALED(ended)) tidy(w, j->id);
  close(j->pipe);
  json_t *record = j->answer.data && !j->answer.failed ? json_loadb(j->answer.data, j->answer.size, 0, NULL) : NULL;
  int reported = record != NULL;
  if (!record) record = silent(w, j, ended);
  const char *word = json_string_value(json_object_get(record, "status"));
  int stopped = flesh_interrupt_signal() != 0;
  if (stopped && ((reported && !strcmp(word, "interrupted")) || (!reported && WIFSIGNALED(ended))))
    status = flesh_sweep_store_release(w->store, j->id);
  else {
    status = flesh_sweep_store_finish(w->store, j->id, record, seconds, stopped ? NULL : &next);
    w->done += !status;
    w->failed += !status && strcmp(word, "complete");
  }
  json_decref(record);
  free(j->answer.data);
  *j = (job){0};
  w->running--;
  if (!status && next) status = begin(w, next);
  show_progress(w);
  return status;
}

static void tell_all(crew *w, int signal_number)
{
  for (int j = 0; j < w->room; j++)
    if (w->jobs[j].process) kill(w->jobs[j].process, signal_number);
}

/* Waits until something happens to a job, and deals with it. */
static int attend(crew *w)
{
  struct pollfd *polls = calloc((size_t)w->room, sizeof *polls);
  if (!polls) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  double nearest = now() + 0.5;
  for (int j = 0; j < w->room; j++) {
    polls[j] = (struct pollfd){.fd = w->jobs[j].process ? w->jobs[j].pipe : -1, .events = POLLIN};
    if (w->jobs[j].process) nearest = fmin(nearest, w->jobs[j].deadline);
  }
  int status = FLESH_OK;
  if (poll(polls, (nfds_t)w->room, (int)fmax(0, ceil(1000 * (nearest - now())))) < 0) {
    if (errno != EINTR) status = flesh_fail(FLESH_ERR_MEMORY, "the cases cannot be waited for: %s", strerror(errno));
    for (int j = 0; j < w->room; j++) polls[j].revents = 0;
  }
  for (int j = 0; !status && j < w->room; j++) {
    job *at = &w->jobs[j];
    if (!at->process || polls[j].fd != at->pipe) continue;
    if (polls[j].revents && drain(at)) status = collect(w, at);
    else if (now() > at->deadline && !at->killed) {
      at->killed = 1;
      kill(at->process, SIGKILL);
    }
  }
  free(polls);
  if (flesh_interrupt_signal() && !w->signalled) { /* a signal sent to this process alone is passed on, once */
    w->signalled = 1;
    tell_all(w, SIGTERM);
    for (int j = 0; j < w->room; j++)
      if (w->jobs[j].process) w->jobs[j].deadline = fmin(w->jobs[j].deadline, now() + GRACE);
  }
  return status;
}

/* Until nothing is left to be begun and all that runs has ended. */
static int run_all(crew *w)
{
  int status = FLESH_OK, left = 1;
  while (!status && (left || w->running)) {
    while (!status && left && w->running < w->limit && !flesh_interrupt_signal()) {
      int id;
      status = flesh_sweep_store_claim(w->store, &id);
      if (!status && !id) left = 0;
      else if (!status) status = begin(w, id);
    }
    if (flesh_interrupt_signal()) left = 0;
    if (!status && w->running) status = attend(w);
  }
  return status;
}

int flesh_sweep_run(const flesh_sweep *sweep, flesh_sweep_store *store, const flesh_sweep_run_options *options)
{
  crew w = {.sweep = sweep, .store = store, .options = options, .started = now()};
  w.room = w.limit = flesh_process_fit(options->jobs, flesh_sweep_store_count(store, NULL));
  w.jobs = calloc((size_t)w.room, sizeof *w.jobs);
  if (!w.jobs) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  int abandoned, elsewhere, status;
  do {
    status = flesh_sweep_store_recover(store, &abandoned, &elsewhere);
    w.total = flesh_sweep_store_count(store, NULL);
    if (!w.done) w.before = w.total - flesh_sweep_store_count(store, "planned") - elsewhere;
    if (!status) status = run_all(&w);
    /* Another process may have ended meanwhile without having finished its cases. */
    if (!status && !flesh_interrupt_signal()) status = flesh_sweep_store_recover(store, &abandoned, &elsewhere);
  } while (!status && abandoned && !flesh_interrupt_signal());
  if (status) tell_all(&w, SIGKILL);
  for (int j = 0; j < w.room; j++)
    if (w.jobs[j].process) {
      waitpid(w.jobs[j].process, NULL, 0);
      tidy(&w, w.jobs[j].id);
      close(w.jobs[j].pipe);
      free(w.jobs[j].answer.data);
    }
  if (!options->quiet && isatty(STDERR_FILENO)) fputs("\r\033[K", stderr);
  free(w.jobs);
  if (!status && flesh_interrupt_signal())
    status = flesh_fail(FLESH_ERR_INTERRUPTED, "interrupted; --resume goes on");
  return status;
}
