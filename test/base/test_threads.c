// TEST quick
/* test_threads.c: every task runs once, on any number of threads, in runs that follow each other closely. */
#include "flesh/threads.h"

#include <stdatomic.h>
#include <math.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/parallel_vector.h"
#include "base/threads.h"
#include "test.h"

enum { MOST = FLESH_TASKS_MAX };
static const int counts[] = {1, 2, 3, 8, 0};
enum { COUNTS = sizeof counts / sizeof counts[0] };

typedef struct record {
  int calls[MOST]; /* written only by its task: a data race would mean a task on two threads at once */
  atomic_int total;
  double sums[MOST];
} record;

static void count_call(void *data, int task)
{
  record *r = data;
  r->calls[task]++;
  atomic_fetch_add(&r->total, 1);
}

static void every_task_runs_once(void)
{
  record *r = malloc(sizeof *r);
  static const int sizes[] = {0, 1, 2, 3, 7, 100, MOST};
  for (int c = 0; c < COUNTS; c++) {
    flesh_threads *threads = NULL;
    CHECK_OK(flesh_threads_create(counts[c], &threads));
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
      memset(r, 0, sizeof *r);
      flesh_threads_run(threads, sizes[s], count_call, r);
      int wrong = 0;
      for (int k = 0; k < MOST; k++) wrong += r->calls[k] != (k < sizes[s]);
      CHECK(wrong == 0 && atomic_load(&r->total) == sizes[s]);
    }
    flesh_threads_destroy(&threads);
    CHECK(threads == NULL);
  }
  memset(r, 0, sizeof *r);
  flesh_threads_run(NULL, 5, count_call, r);
  CHECK(atomic_load(&r->total) == 5);
  free(r);
}

/* Thousands of short runs, with occasional pauses in which the threads fall asleep: no thread takes a task of the
 * previous run, and none is lost. */
static void runs_follow_closely(void)
{
  record *r = calloc(1, sizeof *r);
  flesh_threads *threads = NULL;
  CHECK_OK(flesh_threads_create(3, &threads));
  int expected = 0;
  for (int run = 0; run < 20000; run++) {
    int tasks = 2 + run % 5;
    flesh_threads_run(threads, tasks, count_call, r);
    expected += tasks;
    if (run % 4000 == 0) usleep(3000);
    if (atomic_load(&r->total) != expected) break;
  }
  CHECK(atomic_load(&r->total) == expected);
  flesh_threads_destroy(&threads);
  free(r);
}

/* A thousand terms 1/i each, whose sum depends on the order of addition. */
static void sum_part(void *data, int task)
{
  record *r = data;
  double sum = 0;
  for (int i = 1; i <= 1000; i++) sum += 1.0 / (1000.0 * task + i);
  r->sums[task] = sum;
}

static void sums_have_the_same_bits(void)
{
  record *r = calloc(1, sizeof *r);
  double first = 0;
  for (int c = 0; c < COUNTS; c++) {
    flesh_threads *threads = NULL;
    CHECK_OK(flesh_threads_create(counts[c], &threads));
    flesh_threads_run(threads, 1000, sum_part, r);
    double sum = 0;
    for (int k = 0; k < 1000; k++) sum += r->sums[k];
    if (c == 0) first = sum;
    CHECK(memcmp(&sum, &first, sizeof sum) == 0);
    flesh_threads_destroy(&threads);
  }
  CHECK_NEAR(first, 14.392726722865, 1e-11); /* ln 1e6 + Euler's constant + 5e-7 */
  free(r);
}

/* A fork inherits the pool, but not its threads. */
static void a_fork_goes_on_alone(void)
{
  record *r = calloc(1, sizeof *r);
  flesh_threads *threads = NULL;
  CHECK_OK(flesh_threads_create(2, &threads));
  flesh_threads_run(threads, 10, count_call, r);
  fflush(stdout);
  pid_t child = fork();
  if (child == 0) {
    alarm(1800); /* rather than hang */
    flesh_threads_run(threads, 10, count_call, r);
    flesh_threads_destroy(&threads);
    _exit(atomic_load(&r->total) == 20 ? 0 : 1);
  }
  int status = 1;
  CHECK(child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0);
  flesh_threads_destroy(&threads);
  free(r);
}

static void bad_numbers_are_refused(void)
{
  static const int bad[] = {-1, FLESH_THREADS_MAX + 1};
  for (int k = 0; k < 2; k++) {
    flesh_threads *threads = NULL;
    CHECK(flesh_threads_create(bad[k], &threads) == FLESH_ERR_ARGUMENT && threads == NULL);
    CHECK(strstr(flesh_error_text(), "must be in 0 to 256") != NULL);
  }
  flesh_threads_destroy(NULL);
}

/* Sums over long and short arrays have the same bits on any number of threads; a single number that differs is seen
 * wherever it is. */
static void arrays_are_cut_by_their_length(void)
{
  static const int lengths[] = {0, 1, 63, 4096, 4097, 100003, 1000001};
  for (size_t l = 0; l < sizeof lengths / sizeof lengths[0]; l++) {
    const int n = lengths[l];
    double *x = malloc(((size_t)n + 1) * sizeof *x), *y = malloc(((size_t)n + 1) * sizeof *y), first = NAN;
    long double expected = 0;
    for (int i = 0; i < n; i++) {
      x[i] = sin(i);
      expected += (long double)x[i] * x[i];
    }
    for (int c = 0; c < COUNTS; c++) {
      flesh_threads *threads = NULL;
      CHECK_OK(flesh_threads_create(counts[c], &threads));
      const double sum = flesh_dot(threads, n, x, x);
      CHECK_NEAR(sum, (double)expected, 1e-12 * (double)expected);
      if (c == 0) first = sum;
      CHECK(sum == first && flesh_norm(threads, n, x) == sqrt(sum));
      memset(y, 0, ((size_t)n + 1) * sizeof *y);
      flesh_copy(threads, n, x, y);
      CHECK(y[n] == 0 && flesh_same(threads, n, x, y));
      for (int at = 0; at < n; at = 3 * at + 1) {
        y[at] = 2 + at;
        CHECK(!flesh_same(threads, n, x, y) && flesh_largest(threads, n, y) == 2 + at);
        y[at] = x[at];
      }
      flesh_threads_destroy(&threads);
    }
    free(x);
    free(y);
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST_OF_THREADS(every_task_runs_once), TEST_OF_THREADS(runs_follow_closely),
                   TEST_OF_THREADS(sums_have_the_same_bits), TEST_OF_THREADS(a_fork_goes_on_alone),
                   TEST(bad_numbers_are_refused), TEST_OF_THREADS(arrays_are_cut_by_their_length));
}
