/* bench.h: `flesh bench`: what the machine can do, what every kernel and whole step takes of it. It is a study (study.h):
 * each number of threads is a case that finds the machine's ceilings, each bar a case of all kernels and one for each way
 * that it moves; bench.sql makes of them what is told. */
#ifndef FLESH_BENCH_BENCH_H
#define FLESH_BENCH_BENCH_H

#include <jansson.h>

#include "flesh/flesh.h"
#include "study/study.h"

enum { FLESH_BENCH_LIST = 16 };

/* Medians of the repeats of one call, the best of them, and how far they scatter: half of the range
 * in which the middle half of them lies, over the median. */
typedef struct flesh_bench_time {
  double wall_s, cpu_s, best_wall_s, best_cpu_s, scatter;
  int repeats;
} flesh_bench_time;

enum { FLESH_BENCH_MOST_REPEATS = 101 };

/* Calls work(data) `repeats` times; short work several times per repeat, and once before. `prepare`
 * (NULL: none) is called before each work(data), which is then never short, and not measured.
 * Returns the first status that is not FLESH_OK. */
int flesh_bench_measure(int (*prepare)(void *data), int (*work)(void *data), void *data,
                        int repeats, flesh_bench_time *time);
/* New object of what a row has of it; of a bar's size with its mesh. */
json_t *flesh_bench_row(const char *group, const char *name, const flesh_mesh *mesh, const flesh_bench_time *time);

typedef struct flesh_bench_case {
  const char *part; /* "machine", "kernels", "swing", ... */
  flesh_energy energy;
  double poisson;
  const int *cells; /* along x, y, z */
  int threads;
  int status; /* of its record */
} flesh_bench_case;

typedef struct flesh_bench_plan {
  flesh_study_options options;
  int size_count, sizes[FLESH_BENCH_LIST][3]; /* cells along x, y, z */
  int energy_count;
  flesh_energy energies[FLESH_BENCH_LIST];
  int poisson_count;
  double poissons[FLESH_BENCH_LIST];
  int thread_count, threads[FLESH_BENCH_LIST];
  int part_count;
  const char *parts[FLESH_BENCH_LIST]; /* of flesh_bench_parts */
  int repeats, steps;
  double tolerance;
  flesh_instructions instructions;
  flesh_element element; /* of the steps; kernels are of four-node tets */
  int json;              /* bench.json is printed in place of the table */
  int case_count;
  flesh_bench_case *cases;
  char fingerprint[512];
} flesh_bench_plan;

/* "kernels", "swing", ..., NULL at the end. */
extern const char *const flesh_bench_parts[];

/* The bar of one size: its mesh, one material, density 1000 kg/m^3. */
typedef struct flesh_bench_bar {
  flesh_mesh *mesh;
  double *density;
  flesh_material material;
  flesh_body body;
  double mesh_bytes;
} flesh_bench_bar;
int flesh_bench_bar_open(const flesh_bench_plan *plan, const flesh_bench_case *c, flesh_bench_bar *bar);
void flesh_bench_bar_close(flesh_bench_bar *bar);

/* Each adds what it has measured to `rows`, a row of the ceilings, of each kernel, of the steps. A step that cannot be
 * solved (FLESH_ERR_SOLVE) has a row, too. */
int flesh_bench_machine(const flesh_bench_plan *plan, int threads, json_t *rows);
int flesh_bench_kernels(const flesh_bench_plan *plan, const flesh_bench_bar *bar, int threads, json_t *rows);
int flesh_bench_steps(const flesh_bench_plan *plan, const flesh_bench_bar *bar, const char *name, int threads, json_t *rows);

#endif
