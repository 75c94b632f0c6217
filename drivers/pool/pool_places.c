/* pool_places.c: processes for cases, and what they say. */
#include "pool/pool_places.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/error.h"
#include "pool/process.h"
#include "run/ranks.h"

/* Time within which a process that was asked to stop must end, s; it stops by itself between two steps, and is killed
 * later. */
static const double GRACE = 2;

struct flesh_pool_process {
  flesh_process process; /* id 0: none */
  int number, killed;
  double started, deadline; /* monotonic seconds; INFINITY: none */
  flesh_text answer;        /* as it comes */
};

int flesh_places_open(int room, const flesh_pool_cases *cases, flesh_places *places)
{
  *places = (flesh_places){.cases = cases, .room = room, .limit = room};
  places->processes = calloc((size_t)room, sizeof *places->processes);
  places->polls = calloc((size_t)room, sizeof *places->polls);
  return places->processes && places->polls ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "out of memory");
}

static void tell_all(const flesh_places *places, int signal_number)
{
  for (int k = 0; k < places->room; k++)
    if (places->processes[k].process.id) kill(places->processes[k].process.id, signal_number);
}

void flesh_places_close(flesh_places *places)
{
  if (places->running) tell_all(places, SIGKILL);
  for (int k = 0; k < places->room && places->running; k++) {
    flesh_pool_process *p = &places->processes[k];
    if (!p->process.id) continue;
    while (waitpid(p->process.id, NULL, 0) < 0 && errno == EINTR) continue;
    close(p->process.pipe);
    free(p->answer.data);
  }
  free(places->processes);
  free(places->polls);
  *places = (flesh_places){0};
}

/* The life of a case's process. */
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

int flesh_places_start(flesh_places *places, int number, int *started)
{
  int place = 0, end = -1;
  flesh_process process;
  *started = 0;
  while (places->processes[place].process.id) place++;
  const int status = flesh_process_fork(&process, &end);
  if (status && places->running) {
    places->limit = places->running;
    return FLESH_OK;
  }
  if (status) return status;
  if (!process.id) work(places->cases, number, end);
  fcntl(process.pipe, F_SETFL, O_NONBLOCK);
  flesh_pool_process *p = &places->processes[place];
  *p = (flesh_pool_process){.process = process, .number = number, .started = flesh_wall_seconds(), .deadline = INFINITY};
  if (places->cases->max_seconds > 0) p->deadline = p->started + places->cases->max_seconds;
  places->running++;
  *started = 1;
  return FLESH_OK;
}

void flesh_places_stop(flesh_places *places)
{
  if (places->stopped) return;
  places->stopped = 1;
  tell_all(places, SIGTERM);
  for (int k = 0; k < places->room; k++) places->processes[k].deadline = fmin(places->processes[k].deadline, flesh_wall_seconds() + GRACE);
}

/* Reads what has come; whether the process has closed its end. */
static int drain(flesh_pool_process *p)
{
  char part[16384];
  for (;;) {
    const ssize_t got = read(p->process.pipe, part, sizeof part);
    if (got > 0) flesh_text_append(&p->answer, part, (size_t)got);
    else if (got == 0) return 1;
    else if (errno != EINTR) return errno != EAGAIN;
  }
}

static void collect(flesh_places *places, flesh_pool_process *p, flesh_pool_end *end)
{
  int ended = 0;
  while (waitpid(p->process.id, &ended, 0) < 0 && errno == EINTR) continue;
  close(p->process.pipe);
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
    places->polls[k] = (struct pollfd){.fd = p->process.id ? p->process.pipe : -1, .events = POLLIN};
    if (p->process.id && !p->killed) nearest = fmin(nearest, p->deadline);
  }
  if (poll(places->polls, (nfds_t)places->room, (int)fmax(0, ceil(1000 * (nearest - flesh_wall_seconds())))) < 0) {
    if (errno != EINTR) status = flesh_fail(FLESH_ERR_MEMORY, "the cases cannot be waited for: %s", strerror(errno));
    for (int k = 0; k < places->room; k++) places->polls[k].revents = 0;
  }
  for (int k = 0; k < places->room && !status; k++) {
    flesh_pool_process *p = &places->processes[k];
    if (!p->process.id) continue;
    if (places->polls[k].revents && drain(p)) {
      collect(places, p, end);
      return FLESH_OK;
    }
    if (flesh_wall_seconds() > p->deadline && !p->killed) {
      p->killed = 1;
      kill(p->process.id, SIGKILL);
    }
  }
  return status;
}
