/* pool_slots.c: runs cases in processes, so that a crash or a hang is a result, too, and reads their answers. */
#include "pool/pool_slots.h"

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

int flesh_slots_fit(int jobs, int count)
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

int flesh_slots_open(int room, const flesh_pool_cases *cases, flesh_slots *slots)
{
  *slots = (flesh_slots){.cases = cases, .room = room, .limit = room};
  slots->processes = calloc((size_t)room, sizeof *slots->processes);
  slots->polls = calloc((size_t)room, sizeof *slots->polls);
  return slots->processes && slots->polls ? FLESH_OK : flesh_no_memory();
}

static void signal_all(const flesh_slots *slots, int signal_number)
{
  for (int k = 0; k < slots->room; k++)
    if (slots->processes[k].id) kill(slots->processes[k].id, signal_number);
}

void flesh_slots_close(flesh_slots *slots)
{
  if (slots->running) signal_all(slots, SIGKILL);
  for (int k = 0; k < slots->room && slots->running; k++) {
    flesh_pool_process *p = &slots->processes[k];
    if (!p->id) continue;
    while (waitpid(p->id, NULL, 0) < 0 && errno == EINTR) continue;
    close(p->pipe);
    free(p->answer.data);
  }
  free(slots->processes);
  free(slots->polls);
  *slots = (flesh_slots){0};
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

int flesh_slots_start(flesh_slots *slots, int number, int *started)
{
  int slot = 0;
  flesh_pool_process new = {.number = number, .started = flesh_wall_seconds(), .deadline = INFINITY};
  *started = 0;
  while (slots->processes[slot].id) slot++;
  const int status = fork_off(&new);
  if (status && slots->running) {
    slots->limit = slots->running;
    return FLESH_OK;
  }
  if (status) return status;
  if (!new.id) work(slots->cases, number, new.pipe);
  fcntl(new.pipe, F_SETFL, O_NONBLOCK);
  if (slots->cases->max_seconds > 0) new.deadline = new.started + slots->cases->max_seconds;
  slots->processes[slot] = new;
  slots->running++;
  *started = 1;
  return FLESH_OK;
}

void flesh_slots_stop(flesh_slots *slots)
{
  if (slots->stopped) return;
  slots->stopped = 1;
  signal_all(slots, SIGTERM);
  for (int k = 0; k < slots->room; k++)
    slots->processes[k].deadline = fmin(slots->processes[k].deadline, flesh_wall_seconds() + GRACE);
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

static void collect(flesh_slots *slots, flesh_pool_process *p, flesh_pool_end *end)
{
  int ended = 0;
  while (waitpid(p->id, &ended, 0) < 0 && errno == EINTR) continue;
  close(p->pipe);
  *end = (flesh_pool_end){p->number, ended, p->killed, flesh_wall_seconds() - p->started, p->answer};
  *p = (flesh_pool_process){0};
  slots->running--;
}

int flesh_slots_wait(flesh_slots *slots, int milliseconds, flesh_pool_end *end)
{
  double nearest = flesh_wall_seconds() + 1e-3 * milliseconds;
  int status = FLESH_OK;
  *end = (flesh_pool_end){.number = -1};
  for (int k = 0; k < slots->room; k++) {
    const flesh_pool_process *p = &slots->processes[k];
    slots->polls[k] = (struct pollfd){.fd = p->id ? p->pipe : -1, .events = POLLIN};
    if (p->id && !p->killed) nearest = fmin(nearest, p->deadline);
  }
  if (poll(slots->polls, (nfds_t)slots->room, (int)fmax(0, ceil(1000 * (nearest - flesh_wall_seconds())))) < 0) {
    if (errno != EINTR) status = flesh_fail(FLESH_ERR_MEMORY, "the cases cannot be waited for: %s", strerror(errno));
    for (int k = 0; k < slots->room; k++) slots->polls[k].revents = 0;
  }
  for (int k = 0; k < slots->room && !status; k++) {
    flesh_pool_process *p = &slots->processes[k];
    if (!p->id) continue;
    if (slots->polls[k].revents && drain(p)) {
      collect(slots, p, end);
      return FLESH_OK;
    }
    if (flesh_wall_seconds() > p->deadline && !p->killed) {
      p->killed = 1;
      kill(p->id, SIGKILL);
    }
  }
  return status;
}
