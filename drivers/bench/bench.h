/* bench.h: `flesh bench`: what the machine can do, what every kernel and whole step takes of it. */
#ifndef FLESH_BENCH_BENCH_H
#define FLESH_BENCH_BENCH_H

#include <stddef.h>

#include "flesh/flesh.h"

enum { FLESH_BENCH_LIST = 16, FLESH_BENCH_ROWS = 4096 };

/* Tets from which growth is fitted: of time, beyond the last cache; of iterations, where the bar of
 * 48 672 tets takes part. */
enum { FLESH_BENCH_TIME_FROM = 200000, FLESH_BENCH_LINEAR_FROM = 48000 };

/* Medians of the repeats of one call, the best of them, and how far they scatter: half of the range
 * in which the middle half of them lies, over the median. */
typedef struct flesh_bench_time {
  double wall_s, cpu_s, best_wall_s, best_cpu_s, scatter;
  int repeats;
} flesh_bench_time;

/* Calls work(data) `repeats` times; short work several times per repeat, and once before. `prepare`
 * (NULL: none) is called before each work(data), which is then never short, and not measured.
 * Returns the first status that is not FLESH_OK. */
int flesh_bench_measure(int (*prepare)(void *data), int (*work)(void *data), void *data,
                        int repeats, flesh_bench_time *time);

/* The cache or memory that data of a size fit into. */
typedef enum flesh_bench_level {
  FLESH_BENCH_L2,
  FLESH_BENCH_L3,
  FLESH_BENCH_MEMORY,
  FLESH_BENCH_LEVELS
} flesh_bench_level;
extern const char *const flesh_bench_level_names[FLESH_BENCH_LEVELS];

/* The machine's highest rates with one number of threads. */
typedef struct flesh_bench_ceilings {
  int threads;
  double read[FLESH_BENCH_LEVELS];  /* B/s, sums of what is read */
  double triad[FLESH_BENCH_LEVELS]; /* B/s, a = b + s c: 24 bytes a number */
  double
      multiply_add[FLESH_INSTRUCTIONS_COUNT]; /* operations/s, two each; 0: not on this machine */
} flesh_bench_ceilings;

typedef struct flesh_bench_row {
  const char *group; /* "kernel", "step", "static" */
  const char *name;
  flesh_energy energy;
  double poisson;
  flesh_element element;
  int tets, nodes, threads;
  flesh_bench_time time;
  /* Kernels: the least bytes moved and operations done, by count, and the time they take at the
   * ceilings; 0 where not counted. */
  double bytes, operations, floor_s;
  flesh_bench_level level; /* where they live */
  /* Steps: counters of all of them together. */
  int steps, newton, linear, assemblies, projections, backtracks;
  int status;    /* a case that fails is a row too */
  double answer; /* 2-norm of the displacement at the end, m: same work, same answer */
} flesh_bench_row;

typedef struct flesh_bench_memory {
  const char *owner;
  int tets;
  double bytes;
} flesh_bench_memory;

typedef struct flesh_bench_plan {
  const char *out;
  int size_count, sizes[FLESH_BENCH_LIST][3]; /* cells along x, y, z */
  int energy_count;
  flesh_energy energies[FLESH_BENCH_LIST];
  int poisson_count;
  double poissons[FLESH_BENCH_LIST];
  int thread_count, threads[FLESH_BENCH_LIST];
  int case_count;
  const char *cases[FLESH_BENCH_LIST]; /* of flesh_bench_cases */
  int repeats, steps;
  double tolerance;
  flesh_instructions instructions;
  flesh_element element; /* of the steps; kernels are of four-node tets */
  int quiet; /* nothing on stdout while measuring */

  int ceiling_count;
  flesh_bench_ceilings ceilings[FLESH_BENCH_LIST]; /* of every thread count */
  size_t level_bytes[FLESH_BENCH_LEVELS];          /* up to which a level serves, found with
                                                      threads[0]; memory: 0 */
  int row_count, memory_count;
  flesh_bench_row rows[FLESH_BENCH_ROWS];
  flesh_bench_memory memory[FLESH_BENCH_LIST * 8];
} flesh_bench_plan;

/* "kernels", "swing", ..., NULL at the end. */
extern const char *const flesh_bench_cases[];

/* The bar of one size: its mesh, one material, density 1000 kg/m^3. */
typedef struct flesh_bench_bar {
  flesh_mesh *mesh;
  double *density;
  flesh_material material;
  flesh_body body;
  double mesh_bytes;
} flesh_bench_bar;
int flesh_bench_bar_open(const flesh_bench_plan *plan, int size, flesh_energy energy,
                         double poisson, flesh_bench_bar *bar);
void flesh_bench_bar_close(flesh_bench_bar *bar);

int flesh_bench_find_ceilings(flesh_bench_plan *plan);
/* Rows of the kernels at one size, energy, ratio and number of threads. */
int flesh_bench_kernels(flesh_bench_plan *plan, const flesh_bench_bar *bar, int threads);
/* A row of a whole case; notes who holds memory where `memory` is 1. */
int flesh_bench_steps(flesh_bench_plan *plan, const flesh_bench_bar *bar, const char *name,
                      int threads, int memory);

/* The seconds that a row is judged by: CPU time of one thread, wall time of several. */
double flesh_bench_seconds(const flesh_bench_row *row);
/* Whether two rows differ in nothing but the size. */
int flesh_bench_same_case(const flesh_bench_row *a, const flesh_bench_row *b);

/* Takes a row over, printing it; fails when there is no room. */
int flesh_bench_add(flesh_bench_plan *plan, const flesh_bench_row *row);

/* log-log slope through the rows of one step's case, or NaN for fewer than two sizes of at least
 * `smallest` tets: of time per step where `iterations` is 0, else of linear iterations per Newton
 * iteration. */
double flesh_bench_growth(const flesh_bench_plan *plan, const flesh_bench_row *like, int smallest,
                          int iterations);

void flesh_bench_print_ceilings(const flesh_bench_plan *plan);
void flesh_bench_print_end(const flesh_bench_plan *plan);
/* bench.csv and bench.json in plan->out; `json` also on stdout. */
int flesh_bench_write(const flesh_bench_plan *plan, int argc, char **argv, int json);
/* roofline.png and growth.png. */
int flesh_bench_draw(const flesh_bench_plan *plan);

#endif
