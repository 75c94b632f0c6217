/* bench.h: `flesh bench`: measures the limits of the machine, and how near to them every kernel and whole steps run. It
 * is a study (study.h): each number of threads is a case that finds the machine's ceilings; each bar has one case for
 * all kernels and one for each way in which it moves. bench.sql makes the results from them. */
#ifndef FLESH_BENCH_BENCH_H
#define FLESH_BENCH_BENCH_H

#include <jansson.h>

#include "flesh/flesh.h"
#include "study/study.h"

enum { FLESH_BENCH_LIST = 16 };

/* Times of one call, s: medians and least values over the repeats. `scatter`: half of the interquartile range of the
 * CPU time over its median. */
typedef struct flesh_bench_time {
  double wall_s, cpu_s, best_wall_s, best_cpu_s, scatter;
  int repeats;
} flesh_bench_time;

enum { FLESH_BENCH_MOST_REPEATS = 101 };

/* Measures work(data) `repeats` times. Short work is called several times per repeat, after one call that does not
 * count. `prepare` (NULL: none) is called before each work(data) and not measured; work is then called once per repeat,
 * however short it is. Returns the first status that is not FLESH_OK. */
int flesh_bench_measure(int (*prepare)(void *data), int (*work)(void *data), void *data,
                        int repeats, flesh_bench_time *time);
/* Returns a new object with the group, the name, the times and the mesh's numbers of tets and nodes. */
json_t *flesh_bench_row(const char *group, const char *name, const flesh_mesh *mesh, const flesh_bench_time *time);

typedef struct flesh_bench_case {
  const char *part; /* "machine", "kernels", "swing", ... */
  flesh_energy energy;
  double poisson;
  const int *cells; /* numbers of cells along x, y, z */
  int threads;
  int status; /* status that its record has */
} flesh_bench_case;

typedef struct flesh_bench_plan {
  flesh_study_options options;
  int size_count, sizes[FLESH_BENCH_LIST][3]; /* numbers of cells along x, y, z */
  int energy_count;
  flesh_energy energies[FLESH_BENCH_LIST];
  int poisson_count;
  double poissons[FLESH_BENCH_LIST];
  int thread_count;
  double threads[FLESH_BENCH_LIST]; /* whole */
  int part_count, parts[FLESH_BENCH_LIST]; /* indices into flesh_bench_parts */
  int repeats, steps;
  double tolerance;
  flesh_instructions instructions;
  flesh_element element; /* used in the steps; kernels are measured with four-node tets */
  int json;              /* print bench.json instead of the table */
  int case_count;
  flesh_bench_case *cases;
  char fingerprint[512];
} flesh_bench_plan;

/* The parts that can be measured: "kernels", "swing", ...; NULL ends them. */
extern const char *const flesh_bench_parts[];

/* A bar of one size: its mesh, one material, density 1000 kg/m^3. */
typedef struct flesh_bench_bar {
  flesh_mesh *mesh;
  double *density;
  flesh_material material;
  flesh_body body;
  double mesh_bytes;
} flesh_bench_bar;
int flesh_bench_bar_open(const flesh_bench_plan *plan, const flesh_bench_case *c, flesh_bench_bar *bar);
void flesh_bench_bar_close(flesh_bench_bar *bar);

/* Each function appends what it has measured to `rows`: a row for the ceilings, one for each kernel, or one for the
 * steps. Steps that cannot be solved (FLESH_ERR_SOLVE) have a row, too. */
int flesh_bench_machine(const flesh_bench_plan *plan, int threads, json_t *rows);
int flesh_bench_kernels(const flesh_bench_plan *plan, const flesh_bench_bar *bar, int threads, json_t *rows);
int flesh_bench_steps(const flesh_bench_plan *plan, const flesh_bench_bar *bar, const char *name, int threads, json_t *rows);

#endif
