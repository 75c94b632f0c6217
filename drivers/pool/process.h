/* process.h: work done in a process of its own, so that a crash or a hang in it is an answer too.
 */
#ifndef FLESH_POOL_PROCESS_H
#define FLESH_POOL_PROCESS_H

#include <stddef.h>
#include <sys/types.h>

typedef struct flesh_process {
  pid_t id; /* 0: none */
  int pipe; /* what it writes its result into; readable or closed when it has ended */
} flesh_process;

/* How many of `jobs` processes at a time make sense for `count` pieces of work, and can be had: no more than there is
 * work for, and than files may be open, a pipe for each (that limit is raised as far as it may be). At least 1. */
int flesh_process_fit(int jobs, int count);

/* A new process that ends with its parent. In the parent *process is it; in the new one its id is 0, and what it has to
 * say goes into *write_end before it leaves by _exit. Errors: FLESH_ERR_FILE, FLESH_ERR_MEMORY. */
int flesh_process_fork(flesh_process *process, int *write_end);

/* Runs work(data, result) in a new process on a copy of `result` [size bytes, at most 32 KiB of
 * plain data], which flesh_process_wait brings back. */
int flesh_process_start(void (*work)(const void *data, void *result), const void *data,
                        const void *result, size_t size, flesh_process *process);

/* Waits for the process to end, fills `result` and returns 0, or leaves it and returns the signal that ended the
 * process, -1 when it was none. Calls attend(data) now and then, where it is not NULL. A signal that came (see
 * interrupt.h) is passed on to the process, once; after `max_seconds` (0: never), or when a second signal is needed, it
 * is killed. */
int flesh_process_wait(flesh_process *process, double max_seconds, void (*attend)(const void *data), const void *data,
                       void *result, size_t size);

#endif
