/* process.c: forks, and brings results back through a pipe. */
#include "pool/process.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/error.h"
#include "cli/interrupt.h"

/* Below a pipe's buffer: a process can end before anybody reads. */
enum { LIMIT = 32 << 10 };

int flesh_process_fit(int jobs, int count)
{
  const rlim_t others = 64; /* files that are open besides, here and in the processes, which inherit the pipes */
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

int flesh_process_fork(flesh_process *process, int *write_end)
{
  int ends[2];
  *process = (flesh_process){0};
  if (pipe(ends)) return flesh_fail(FLESH_ERR_FILE, "no pipe to a new process: %s", strerror(errno));
  fflush(NULL);
  pid_t parent = getpid(), id = fork();
  if (id < 0) {
    close(ends[0]);
    close(ends[1]);
    return flesh_fail(FLESH_ERR_MEMORY, "no new process: %s", strerror(errno));
  }
  if (id == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL); /* it does not outlive who would collect it */
    if (getppid() != parent) _exit(1);
    close(ends[0]);
    *write_end = ends[1];
    return FLESH_OK;
  }
  close(ends[1]);
  *process = (flesh_process){id, ends[0]};
  return FLESH_OK;
}

int flesh_process_start(void (*work)(const void *data, void *result), const void *data,
                        const void *result, size_t size, flesh_process *process)
{
  _Alignas(max_align_t) char copy[LIMIT];
  int end;
  *process = (flesh_process){0};
  if (size > LIMIT)
    return flesh_fail(FLESH_ERR_ARGUMENT, "a result of %zu bytes is too large for a pipe", size);
  const int status = flesh_process_fork(process, &end);
  if (status || process->id) return status;
  memcpy(copy, result, size);
  work(data, copy);
  ssize_t written = write(end, copy, size);
  _exit(written == (ssize_t)size ? 0 : 1);
}

/* Takes the result of a process that has ended; `ended` is waitpid's status. Fills `result` and returns 0, or leaves it
 * and returns the signal that ended the process, -1 when it was none. */
static int collect(flesh_process *process, int ended, void *result, size_t size)
{
  _Alignas(max_align_t) char copy[LIMIT];
  ssize_t got = read(process->pipe, copy, size);
  close(process->pipe);
  *process = (flesh_process){0};
  if (got == (ssize_t)size) {
    memcpy(result, copy, size);
    return 0;
  }
  return WIFSIGNALED(ended) ? WTERMSIG(ended) : -1;
}

int flesh_process_wait(flesh_process *process, double max_seconds, void (*attend)(const void *data), const void *data,
                       void *result, size_t size)
{
  const double grace = 2; /* for what stops by itself between steps */
  double deadline = max_seconds > 0 ? flesh_wall_seconds() + max_seconds + grace : 0;
  int told = 0;
  for (;;) {
    struct pollfd end = {.fd = process->pipe, .events = POLLIN};
    int ready = poll(&end, 1, 50);
    if (ready > 0 || (ready < 0 && errno != EINTR)) break; /* without poll, it is waited for */
    if (attend) attend(data);
    if (flesh_interrupt_signal() && !told) {
      kill(process->id, SIGTERM);
      told = 1;
      deadline = flesh_wall_seconds() + grace;
    }
    if (deadline > 0 && flesh_wall_seconds() > deadline) kill(process->id, SIGKILL);
  }
  int ended = 0;
  while (waitpid(process->id, &ended, 0) < 0 && errno == EINTR) continue;
  return collect(process, ended, result, size);
}
