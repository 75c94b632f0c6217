/* threads.c: a pool of POSIX threads.
 *
 * Every thread has its own range of the tasks, so that it finds its data in its own cache from one run to the next.
 * When its range is done it takes tasks of the others: a thread that the machine keeps busy elsewhere delays only the
 * tasks it has begun. */
#define _GNU_SOURCE /* sched_getaffinity */
#include "flesh/threads.h"

#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdint.h>
#include <unistd.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/team.h"
#include "base/threads.h"

/* Polls of an idle thread before it sleeps, some tenths of a millisecond: waking takes as long, and the serial parts of
 * a solve are shorter. LOOKS: polls of a caller for the last tasks before it yields, some tens of microseconds. */
enum { IDLE_LOOKS = 32000, LOOKS = 4000 };

/* Least stack size in bytes: frames of kernels have up to 350 kB, and the system's limit for the caller may be
 * small. */
enum { STACK = 1 << 21 };

/* Tasks left to one thread: generation << 32 | next << 16 | end, in one word so that a thread that is still in an
 * earlier run takes none. */
typedef struct range {
  _Alignas(64) _Atomic uint64_t left;
} range;

typedef struct worker {
  flesh_threads *pool;
  int number;
  pthread_t thread;
} worker;

struct flesh_threads {
  int count, started; /* threads with the caller's, and those made by pthread_create */
  int process; /* the process (see below) that has the threads */
  range *ranges;   /* [count] */
  worker *workers; /* [count], the first is unused */
  flesh_task *task;
  void *data;
  _Atomic int unfinished; /* tasks of this run that are not finished */
  _Atomic uint32_t generation;
  _Atomic int sleeping, ending;
  pthread_mutex_t mutex;
  pthread_cond_t wake;
  const flesh_team *team;
};

/* Generation of this process, counted over forks, as asking the system (getpid) takes as long as a short task. */
static atomic_int process;
static pthread_once_t watched = PTHREAD_ONCE_INIT;

static void count_fork(void) { atomic_fetch_add(&process, 1); }

static void watch_forks(void) { pthread_atfork(NULL, NULL, count_fork); }

static int has_threads(const flesh_threads *self) { return self->process == atomic_load(&process); }

static inline void pause_briefly(void)
{
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#endif
}

/* Takes the next task of a range in this generation; -1: none is left. */
static int take(range *r, uint32_t generation)
{
  uint64_t left = atomic_load(&r->left);
  for (;;) {
    int next = (int)(left >> 16 & 0xffff), end = (int)(left & 0xffff);
    if ((uint32_t)(left >> 32) != generation || next >= end) return -1;
    if (atomic_compare_exchange_weak(&r->left, &left, left + 0x10000)) return next;
  }
}

static void work(flesh_threads *self, int number, uint32_t generation)
{
  int finished = 0; /* subtracted once at the end, as threads contend for the counter */
  for (int k = 0; k < self->count; k++) {
    range *r = &self->ranges[(number + k) % self->count];
    for (int task = take(r, generation); task >= 0; task = take(r, generation)) {
      self->task(self->data, task);
      finished++;
    }
  }
  if (finished > 0) atomic_fetch_sub(&self->unfinished, finished);
}

/* Returns the generation after `seen`, and waits for it if need be. */
static uint32_t next_generation(flesh_threads *self, uint32_t seen)
{
  for (int look = 0; look < IDLE_LOOKS; look++) {
    uint32_t now = atomic_load(&self->generation);
    if (now != seen || atomic_load(&self->ending)) return now;
    pause_briefly();
  }
  pthread_mutex_lock(&self->mutex);
  atomic_fetch_add(&self->sleeping, 1);
  uint32_t now;
  while ((now = atomic_load(&self->generation)) == seen && !atomic_load(&self->ending))
    pthread_cond_wait(&self->wake, &self->mutex);
  atomic_fetch_sub(&self->sleeping, 1);
  pthread_mutex_unlock(&self->mutex);
  return now;
}

static void *worker_main(void *data)
{
  worker *self = data;
  uint32_t generation = 0;
  for (;;) {
    generation = next_generation(self->pool, generation);
    if (atomic_load(&self->pool->ending)) return NULL;
    work(self->pool, self->number, generation);
  }
}

int flesh_threads_available(void)
{
  cpu_set_t set;
  if (!sched_getaffinity(0, sizeof set, &set)) return CPU_COUNT(&set);
  long online = sysconf(_SC_NPROCESSORS_ONLN);
  return online > 0 ? (int)online : 1;
}

static int start_workers(flesh_threads *self)
{
  pthread_attr_t attributes;
  size_t stack = 0;
  if (pthread_attr_init(&attributes)) return flesh_fail(FLESH_ERR_MEMORY, "no memory for threads");
  if (!pthread_attr_getstacksize(&attributes, &stack) && stack < STACK) pthread_attr_setstacksize(&attributes, STACK);
  /* The workers block all signals: these are the caller's business. */
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, &before);
  int failed = 0;
  for (int k = 1; k < self->count && !failed; k++) {
    self->workers[k] = (worker){.pool = self, .number = k};
    failed = pthread_create(&self->workers[k].thread, &attributes, worker_main, &self->workers[k]);
    self->started += !failed;
  }
  pthread_attr_destroy(&attributes);
  pthread_sigmask(SIG_SETMASK, &before, NULL);
  return failed ? flesh_fail(FLESH_ERR_MEMORY, "the system cannot make %d threads", self->count)
                : FLESH_OK;
}

int flesh_threads_create(int count, flesh_threads **threads)
{
  FLESH_NEED({threads, "threads"});
  *threads = NULL;
  if (count < 0 || count > FLESH_THREADS_MAX)
    return flesh_fail(FLESH_ERR_ARGUMENT, "threads is %d; it must be in 0 to %d", count,
                      FLESH_THREADS_MAX);
  if (count == 0) count = flesh_threads_available();
  if (count > FLESH_THREADS_MAX) count = FLESH_THREADS_MAX;
  flesh_threads *self = flesh_calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for threads");
  self->count = count;
  pthread_once(&watched, watch_forks);
  self->process = atomic_load(&process);
  pthread_mutex_init(&self->mutex, NULL);
  pthread_cond_init(&self->wake, NULL);
  self->ranges = flesh_aligned_alloc(sizeof(range), (size_t)count * sizeof *self->ranges);
  self->workers = flesh_calloc((size_t)count, sizeof *self->workers);
  int status = FLESH_OK;
  if (!self->ranges || !self->workers)
    status = flesh_fail(FLESH_ERR_MEMORY, "no memory for %d threads", count);
  for (int k = 0; k < count && !status; k++) atomic_init(&self->ranges[k].left, 0);
  if (!status) status = start_workers(self);
  if (status) flesh_threads_destroy(&self);
  *threads = self;
  return status;
}

void flesh_threads_destroy(flesh_threads **threads)
{
  if (!threads || !*threads) return;
  flesh_threads *self = *threads;
  if (has_threads(self)) { /* a fork has no worker threads */
    pthread_mutex_lock(&self->mutex);
    atomic_store(&self->ending, 1);
    pthread_cond_broadcast(&self->wake);
    pthread_mutex_unlock(&self->mutex);
    for (int k = 1; k <= self->started; k++) pthread_join(self->workers[k].thread, NULL);
    pthread_cond_destroy(&self->wake);
    pthread_mutex_destroy(&self->mutex);
  }
  flesh_free(self->ranges);
  flesh_free(self->workers);
  flesh_free(self);
  *threads = NULL;
}

void flesh_threads_set_team(flesh_threads *threads, const flesh_team *team) { threads->team = team; }

const flesh_team *flesh_threads_team(const flesh_threads *threads) { return threads ? threads->team : NULL; }

void flesh_threads_run(flesh_threads *self, int tasks, flesh_task *task, void *data)
{
  if (!self || self->count == 1 || tasks < 2 || !has_threads(self)) {
    for (int k = 0; k < tasks; k++) task(data, k);
    return;
  }
  uint32_t generation = atomic_load(&self->generation) + 1;
  self->task = task;
  self->data = data;
  atomic_store(&self->unfinished, tasks);
  for (int k = 0; k < self->count; k++) {
    uint64_t begin = (uint64_t)tasks * (uint64_t)k / (uint64_t)self->count;
    uint64_t end = (uint64_t)tasks * (uint64_t)(k + 1) / (uint64_t)self->count;
    atomic_store(&self->ranges[k].left, (uint64_t)generation << 32 | begin << 16 | end);
  }
  atomic_store(&self->generation, generation);
  if (atomic_load(&self->sleeping)) {
    pthread_mutex_lock(&self->mutex);
    pthread_cond_broadcast(&self->wake);
    pthread_mutex_unlock(&self->mutex);
  }
  work(self, 0, generation);
  for (int look = 0; atomic_load(&self->unfinished) > 0; look++)
    if (look < LOOKS) pause_briefly();
    else sched_yield();
}
