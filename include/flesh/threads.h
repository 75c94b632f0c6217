/* threads.h: a pool of threads that share the tasks of a step.
 *
 * Results are bitwise the same for any number of threads if work is divided into tasks by its size alone, every task
 * writes objects of its own that no other task reads or writes (the two halves of a word that is written as a whole
 * are one object), and the sums of tasks are added in the tasks' order afterwards. All tasks of flesh obey this.
 * Functions that return no status cannot fail. */
#ifndef FLESH_THREADS_H
#define FLESH_THREADS_H

#include "flesh/status.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct flesh_threads flesh_threads;

enum { FLESH_THREADS_MAX = 256, FLESH_TASKS_MAX = 65535 };

/* A task of flesh_threads_run, number 0 <= task < tasks. It returns no status: errors go into `data`. */
typedef void flesh_task(void *data, int task);

/* Creates a pool of `count` threads, including the caller's; 0: as many as this process has processors.
 * FLESH_ERR_ARGUMENT outside 0 to FLESH_THREADS_MAX. Returns new. Further errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_threads_create(int count, flesh_threads **threads);
/* NULL-safe; sets *threads to NULL. */
FLESH_API void flesh_threads_destroy(flesh_threads **threads);

/* Calls task(data, 0) ... task(data, tasks - 1), tasks <= FLESH_TASKS_MAX, in any order and on any thread, and
 * returns when all are done. If `threads` is NULL, or was inherited by a fork, all tasks run in the caller's thread.
 * One caller at a time; tasks must not call it for the same `threads`. Allocates nothing. */
FLESH_API void flesh_threads_run(flesh_threads *threads, int tasks, flesh_task *task, void *data);

#ifdef __cplusplus
}
#endif
#endif
