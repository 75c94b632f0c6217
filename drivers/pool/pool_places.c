/* pool_places.c: runs cases in processes, so that a crash or a hang is a result, too, and reads their answers. */
#include "pool/pool_places.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/error.h"
#include "run/ranks.h"

/* Time within which a process that was asked to stop must end, s; it stops by itself between two steps. After it, the
 * process is killed. */
static const double GRACE = 2;

struct flesh_pool_process {
  pid_t id; /* 0: none */
  int pipe; /* end from which its answer is read; the process closes the other one when it ends */
  int number, killed;
  double started, deadline; /* monotonic, s; INFINITY: none */
  flesh_text answer;        /* as it comes */
};

int flesh_places_fit(int jobs, int count)
{
  const rlim_t others = 64; /* files that may be open besides, here and in the processes, which inherit the pipes */
  struct rlimit limit;
  if (jobs > count) jobs = count;
  if (jobs < 1) jobs = 1;
  if (getrlimit(RLIMIT_NOFILE, &limit) || limit.rlim_cur == RLIM_INFINITY) return jobs;
  rlim_t wanted = (rlim_t)jobs + others;
  if (limit.rlim_cur < wanted) {
    struct rlimit raised = {limit.rlim_max < wanted ? limit.rlim_max : wanted, limit.rlim_max};
    if (!setrlimit(RLIMIT_NOFILE, &raised)) limit = raised;
  }
  if (limit.rlim_cur >= wanted) return jobs;
  return limit.rlim_cur > others ? (int)(limit.rlim_cur - others) : 1;
}

int flesh_places_open(int room, const flesh_pool_cases *cases, flesh_places *places)
{
  *places = (flesh_places){.cases = cases, .room = room, .limit = room};
  places->processes = calloc((size_t)room, sizeof *places->processes);
  places->polls = calloc((size_t)room, sizeof *places->polls);
  return places->processes && places->polls ? FLESH_OK : flesh_no_memory();
}

static void tell_all(const flesh_places *places, int signal_number)
{
  for (int k = 0; k < places->room; k++)
    if (places->processes[k].id) kill(places->processes[k].id, signal_number);
}

void flesh_places_close(flesh_places *places)
{
  if (places->running) tell_all(places, SIGKILL);
  for (int k = 0; k < places->room && places->running; k++) {
    flesh_pool_process *p = &places->processes[k];
    if (!p->id) continue;
    while (waitpid(p->id, NULL, 0) < 0 && errno == EINTR) continue;
    close(p->pipe);
    free(p->answer.data);
  }
  free(places->processes);
  free(places->polls);
  *places = (flesh_places){0};
}

/* Does a case in its process, which then ends. */
static void work(const flesh_pool_cases *cases, int number, int pipe)
{
  flesh_text answer = {0};
  flesh_ranks_forget();
  cases->work(cases->data, number, &answer);
  fflush(NULL);
  if (answer.failed) _exit(1);
  for (size_t done = 0; done < answer.size;) {
    const ssize_t written = write(pipe, answer.data + done, answer.size - done);
    if (written < 0 && errno != EINTR) _exit(1);
    if (written > 0) done += (size_t)written;
  }
  _exit(0);
}

/* Makes a new process that ends with its parent. In the new process p->id is 0, and `pipe` is the end to write into.
 * FLESH_ERR_FILE, FLESH_ERR_MEMORY. */
static int fork_off(flesh_pool_process *p)
{
  int ends[2];
  if (pipe(ends)) return flesh_fail(FLESH_ERR_FILE, "cannot open a pipe to a new process: %s", strerror(errno));
  fflush(NULL);
  const pid_t parent = getpid();
  p->id = fork();
  if (p->id < 0) {
    close(ends[0]);
    close(ends[1]);
    return flesh_fail(FLESH_ERR_MEMORY, "cannot start a new process: %s", strerror(errno));
  }
  if (p->id == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL); /* ends with the parent, which collects its answer */
    if (getppid() != parent) _exit(1);
  }
  p->pipe = ends[p->id ? 0 : 1];
  close(ends[p->id ? 1 : 0]);
  return FLESH_OK;
}

int flesh_places_start(flesh_places *places, int number, int *started)
{
  int place = 0;
  flesh_pool_process new = {.number = number, .started = flesh_wall_seconds(), .deadline = INFINITY};
  *started = 0;
  while (places->processes[place].id) place++;
  const int status = fork_off(&new);
  if (status && places->running) {
    places->limit = places->running;
    return FLESH_OK;
  }
  if (status) return status;
  if (!new.id) work(places->cases, number, new.pipe);
  fcntl(new.pipe, F_SETFL, O_NONBLOCK);
  if (places->cases->max_seconds > 0) new.deadline = new.started + places->cases->max_seconds;
  places->processes[place] = new;
  places->running++;
  *started = 1;
  return FLESH_OK;
}

void flesh_places_stop(flesh_places *places)
{
  if (places->stopped) return;
  places->stopped = 1;
  tell_all(places, SIGTERM);
  for (int k = 0; k < places->room; k++)
    places->processes[k].deadline = fmin(places->processes[k].deadline, flesh_wall_seconds() + GRACE);
}

/* Reads what has come. Returns whether the process has closed its end. */
static int drain(flesh_pool_process *p)
{
  char part[16384];
  for (;;) {
    const ssize_t got = read(p->pipe, part, sizeof part);
    if (got > 0) flesh_text_append(&p->answer, part, (size_t)got);
    else if (got == 0) return 1;
    else if (errno != EINTR) return errno != EAGAIN;
  }
}

static void collect(flesh_places *places, flesh_pool_process *p, flesh_pool_end *end)
{
  int ended = 0;
  while (waitpid(p->id, &ended, 0) < 0 && errno == EINTR) continue;
  close(p->pipe);
  *end = (flesh_pool_end){p->number, ended, p->killed, flesh_wall_seconds() - p->started, p->answer};
  *p = (flesh_pool_process){0};
  places->running--;
}

int flesh_places_wait(flesh_places *places, int milliseconds, flesh_pool_end *end)
{
  double nearest = flesh_wall_seconds() + 1e-3 * milliseconds;
  int status = FLESH_OK;
  *end = (flesh_pool_end){.number = -1};
  for (int k = 0; k < places->room; k++) {
    const flesh_pool_process *p = &places->processes[k];
    places->polls[k] = (struct pollfd){.fd = p->id ? p->pipe : -1, .events = POLLIN};
    if (p->id && !p->killed) nearest = fmin(nearest, p->deadline);
  }
  if (poll(places->polls, (nfds_t)places->room, (int)fmax(0, ceil(1000 * (nearest - flesh_wall_seconds())))) < 0) {
    if (errno != EINTR) status = flesh_fail(FLESH_ERR_MEMORY, "the cases cannot be waited for: %s", strerror(errno));
    for (int k = 0; k < places->room; k++) places->polls[k].revents = 0;
  }
  for (int k = 0; k < places->room && !status; k++) {
    flesh_pool_process *p = &places->processes[k];
    if (!p->id) continue;
    if (places->polls[k].revents && drain(p)) {
      collect(places, p, end);
      return FLESH_OK;
    }
    if (flesh_wall_seconds() > p->deadline && !p->killed) {
      p->killed = 1;
      kill(p->id, SIGKILL);
    }
  }
  return status;
}
