/* machine.c: timing, and the ceilings of the machine: bandwidths and multiply-adds. */
#define _GNU_SOURCE
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/error.h"
#include "base/sort.h"
#include "bench/bench.h"
#include "bench/peak.h"

/* Least duration of a repeat, s. */
#define SHORTEST 2e-3

/* Calls the work `calls` times, after `prepare`. *wall, *cpu: seconds of one call. */
static int run_once(int (*prepare)(void *data), int (*work)(void *data), void *data, int calls,
                    double *wall, double *cpu)
{
  int status = prepare ? prepare(data) : FLESH_OK;
  double w = flesh_wall_seconds(), c = flesh_cpu_seconds();
  for (int k = 0; k < calls && !status; k++) status = work(data);
  *cpu = (flesh_cpu_seconds() - c) / calls;
  *wall = (flesh_wall_seconds() - w) / calls;
  return status;
}

int flesh_bench_measure(int (*prepare)(void *data), int (*work)(void *data), void *data,
                        int repeats, flesh_bench_time *time)
{
  double wall[FLESH_BENCH_MOST_REPEATS], cpu[FLESH_BENCH_MOST_REPEATS];
  int calls = 1, status = run_once(prepare, work, data, 1, &wall[0], &cpu[0]);
  if (!prepare && cpu[0] < SHORTEST) calls = (int)(SHORTEST / (cpu[0] + 1e-7)) + 1;
  for (int r = calls == 1; r < repeats && !status; r++)
    status = run_once(prepare, work, data, calls, &wall[r], &cpu[r]);
  if (status) return status;
  qsort(wall, (size_t)repeats, sizeof *wall, flesh_compare_double);
  qsort(cpu, (size_t)repeats, sizeof *cpu, flesh_compare_double);
  double middle = cpu[repeats / 2];
  *time = (flesh_bench_time){.wall_s = wall[repeats / 2],
                             .cpu_s = middle,
                             .best_wall_s = wall[0],
                             .best_cpu_s = cpu[0],
                             .repeats = repeats};
  if (middle > 0) time->scatter = (cpu[3 * repeats / 4] - cpu[repeats / 4]) / 2 / middle;
  return FLESH_OK;
}

json_t *flesh_bench_row(const char *group, const char *name, const flesh_mesh *mesh, const flesh_bench_time *time)
{
#define TIME(kind, name) {#name, FLESH_FIELD_##kind, offsetof(flesh_bench_time, name)}
  static const flesh_study_field times[] = {TIME(DOUBLE, wall_s), TIME(DOUBLE, cpu_s), TIME(DOUBLE, scatter),
                                            TIME(INT, repeats), {0}};
  json_t *row = json_pack("{ss ss si si}", "group", group, "name", name, "tets", flesh_mesh_tet_count(mesh), "nodes",
                          flesh_mesh_node_count(mesh));
  json_object_update_new(row, flesh_fields_json(times, time));
  return row;
}

/* The smallest cache that data of some size fit into, or memory. */
typedef enum level { L2, L3, MEMORY, LEVELS } level;
static const char *const level_names[LEVELS] = {"L2", "L3", "memory"};

/* Highest rates of the machine with some number of threads. */
typedef struct ceilings {
  double read[LEVELS];                           /* B/s, summing an array */
  double triad[LEVELS];                          /* B/s, a = b + s c, 24 bytes per number */
  double multiply_add[FLESH_INSTRUCTIONS_COUNT]; /* operations/s, two per multiply-add; 0: not on this machine */
} ceilings;

static const flesh_bench_peak *peak_of(flesh_instructions instructions)
{
#ifdef FLESH_HAVE_X86_64
  if (instructions == FLESH_INSTRUCTIONS_AVX512) return &flesh_bench_peak_avx512;
  if (instructions == FLESH_INSTRUCTIONS_AVX2) return &flesh_bench_peak_avx2;
#endif
  (void)instructions;
  return &flesh_bench_peak_portable;
}

/* Work on arrays of which every thread has its own part. */
typedef struct stream {
  const flesh_bench_peak *peak;
  flesh_threads *threads;
  flesh_task *part; /* work of one thread */
  int count;
  double *a, *b, *c;
  size_t n; /* length of one thread's part */
  long repeats;
  double sums[FLESH_THREADS_MAX];
} stream;

static void read_part(void *data, int task)
{
  stream *s = data;
  for (long r = 0; r < s->repeats; r++)
    s->sums[task] += s->peak->read(s->a + (size_t)task * s->n, s->n);
}

static void triad_part(void *data, int task)
{
  stream *s = data;
  size_t at = (size_t)task * s->n;
  for (long r = 0; r < s->repeats; r++) s->peak->triad(s->a + at, s->b + at, s->c + at, 0.5, s->n);
}

static void multiply_part(void *data, int task)
{
  stream *s = data;
  s->sums[task] += s->peak->multiply_add(s->repeats, 0.999);
}

static int run_parts(void *data)
{
  stream *s = data;
  flesh_threads_run(s->threads, s->count, s->part, s);
  return FLESH_OK;
}

/* Finds the rate of a ceiling from the best time: CPU time if only one thread works, else wall time. `each`: bytes or
 * operations per number. */
static int find_rate(stream *s, flesh_task *part, int repeats, double each, size_t numbers, double *rate)
{
  flesh_bench_time time = {0};
  s->part = part;
  const int status = flesh_bench_measure(NULL, run_parts, s, repeats, &time);
  *rate = each * (double)numbers * s->count * (double)s->repeats / (s->count == 1 ? time.best_cpu_s : time.best_wall_s);
  return status;
}

/* Finds the bandwidths when every thread works on `bytes`. */
static int find_bandwidth(stream *s, size_t bytes, int repeats, double *read, double *triad)
{
  s->n = bytes / sizeof(double) / 64 * 64;
  s->repeats = bytes < 1 << 20 ? 20 : 1;
  const int status = find_rate(s, read_part, repeats, 8, s->n, read);
  s->n = s->n / 3 / 64 * 64;
  return status ? status : find_rate(s, triad_part, repeats, 24, s->n, triad);
}

static int find_for_threads(stream *s, int repeats, const size_t sets[LEVELS], ceilings *c)
{
  flesh_instructions best;
  int status = flesh_instructions_find(FLESH_INSTRUCTIONS_AUTO, &best);
  s->peak = peak_of(best);
  for (int l = 0; l < LEVELS && !status; l++) {
    size_t bytes = l == MEMORY ? sets[l] / (size_t)s->count : sets[l];
    status = find_bandwidth(s, bytes, repeats, &c->read[l], &c->triad[l]);
  }
  for (int k = FLESH_INSTRUCTIONS_PORTABLE; k <= (int)best && !status; k++) {
    s->peak = peak_of((flesh_instructions)k);
    s->repeats = 200000;
    status = find_rate(s, multiply_part, repeats, s->peak->operations, 1, &c->multiply_add[k]);
  }
  s->peak = peak_of(best);
  return status;
}

/* Measures these threads' share of L3, because systems report the total of a socket or of the host: the largest size,
 * L2 times a power of two, that is read at a speed nearer to L3's than to memory's. */
static int find_l3(stream *s, int repeats, const ceilings *c, const size_t sets[LEVELS], size_t *l3)
{
  double between = sqrt(c->read[L3] * c->read[MEMORY]), read, triad;
  *l3 = sets[L3] * (size_t)s->count;
  for (size_t bytes = 2 * *l3; bytes < sets[MEMORY]; bytes *= 2) {
    const int status = find_bandwidth(s, bytes / (size_t)s->count, repeats, &read, &triad);
    if (status || read < between) return status;
    *l3 = bytes;
  }
  return FLESH_OK;
}

static json_t *row_of(const ceilings *c, size_t l2, size_t l3)
{
  json_t *read = json_object(), *triad = json_object(), *operations = json_object();
  for (int l = 0; l < LEVELS; l++) {
    json_object_set_new(read, level_names[l], json_real(c->read[l]));
    json_object_set_new(triad, level_names[l], json_real(c->triad[l]));
  }
  for (int k = FLESH_INSTRUCTIONS_PORTABLE; k < FLESH_INSTRUCTIONS_COUNT; k++)
    if (c->multiply_add[k] > 0)
      json_object_set_new(operations, flesh_instructions_name((flesh_instructions)k), json_real(c->multiply_add[k]));
  return json_pack("{ss so so so s{sf sf}}", "group", "machine", "read_bytes_per_s", read, "triad_bytes_per_s", triad,
                   "operations_per_s", operations, "level_bytes", level_names[L2], (double)l2, level_names[L3], (double)l3);
}

int flesh_bench_machine(const flesh_bench_plan *plan, int threads, json_t *rows)
{
  const long reported = sysconf(_SC_LEVEL2_CACHE_SIZE);
  const size_t l2 = reported > 0 ? (size_t)reported : 1 << 20;
  /* L2 and L3: bytes per thread; memory: bytes of all threads together. */
  const size_t sets[LEVELS] = {l2 / 2, 2 * l2, 256u << 20};
  size_t room = sets[MEMORY] + 2 * (size_t)threads * l2, l3 = 0;
  double *numbers = aligned_alloc(64, room / 64 * 64);
  stream *s = calloc(1, sizeof *s);
  ceilings c = {0};
  int status = numbers && s ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory to measure the machine");
  if (!status) {
    memset(numbers, 0, room / 64 * 64);
    *s = (stream){.count = threads, .a = numbers};
    s->b = numbers + room / 24 / 64 * 64;
    s->c = s->b + room / 24 / 64 * 64;
    status = flesh_threads_create(threads, &s->threads);
    if (!status) status = find_for_threads(s, plan->repeats, sets, &c);
    if (!status) status = find_l3(s, plan->repeats, &c, sets, &l3);
    flesh_threads_destroy(&s->threads);
  }
  if (!status) json_array_append_new(rows, row_of(&c, l2, l3));
  free(s);
  free(numbers);
  return status;
}
