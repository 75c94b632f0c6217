/* report.c: the measurements as a table, bench.csv and bench.json, and growth by fit. */
#include <gsl/gsl_fit.h>
#include <gsl/gsl_statistics_double.h>
#include <jansson.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>

#include "base/error.h"
#include "bench/bench.h"
#include "base/file.h"
#include "cli/json_memory.h"
#include "run/provenance.h"
#include "run/result.h"
#include "study/fields.h"
#include "study/table.h"

const char *const flesh_bench_level_names[FLESH_BENCH_LEVELS] = {"L2", "L3", "memory"};

static int is_kernel(const flesh_bench_row *row) { return !strcmp(row->group, "kernel"); }

double flesh_bench_seconds(const flesh_bench_row *row)
{
  return row->threads == 1 ? row->time.cpu_s : row->time.wall_s;
}

static double per_newton(const flesh_bench_row *row)
{
  return row->newton ? (double)row->linear / row->newton : NAN;
}

static void print_row(const flesh_bench_row *row)
{
  double time = flesh_bench_seconds(row);
  printf("%-24s %-4s %-5g %8d %3d ", row->name, flesh_energy_name(row->energy), row->poisson,
         row->tets, row->threads);
  if (row->status) {
    printf("%12s\n", "failed");
    return;
  }
  if (is_kernel(row))
    printf("%9.2f ns/tet  +-%4.1f %%  %5.1f %% of the ceiling (%s)\n", 1e9 * time / row->tets,
           100 * row->time.scatter, 100 * row->floor_s / time, flesh_bench_level_names[row->level]);
  else
    printf("%9.2f ms/step +-%4.1f %%  %6.1f Newton, %7.1f linear, %5.1f projected\n",
           1e3 * time / row->steps, 100 * row->time.scatter, (double)row->newton / row->steps,
           (double)row->linear / row->steps, (double)row->projections / row->steps);
  fflush(stdout);
}

int flesh_bench_add(flesh_bench_plan *plan, const flesh_bench_row *row)
{
  if (plan->row_count == FLESH_BENCH_ROWS)
    return flesh_fail(FLESH_ERR_ARGUMENT, "more than %d measurements; ask for fewer",
                      FLESH_BENCH_ROWS);
  plan->rows[plan->row_count++] = *row;
  if (!plan->quiet) print_row(row);
  return FLESH_OK;
}

void flesh_bench_print_ceilings(const flesh_bench_plan *plan)
{
  for (int k = 0; k < plan->ceiling_count; k++) {
    const flesh_bench_ceilings *c = &plan->ceilings[k];
    printf("%d thread%s: read", c->threads, c->threads == 1 ? "" : "s");
    for (int l = 0; l < FLESH_BENCH_LEVELS; l++)
      printf(" %s %.1f", flesh_bench_level_names[l], c->read[l] / 1e9);
    printf(" GB/s; a = b + s c");
    for (int l = 0; l < FLESH_BENCH_LEVELS; l++)
      printf(" %s %.1f", flesh_bench_level_names[l], c->triad[l] / 1e9);
    printf(" GB/s; multiply-add");
    for (int i = FLESH_INSTRUCTIONS_PORTABLE; i < FLESH_INSTRUCTIONS_COUNT; i++)
      if (c->multiply_add[i] > 0)
        printf(" %s %.1f", flesh_instructions_name((flesh_instructions)i),
               c->multiply_add[i] / 1e9);
    printf(" Gflop/s\n");
  }
  printf("L2 serves up to %.3g MB, L3 up to %.3g MB\n", (double)plan->level_bytes[FLESH_BENCH_L2] / (1 << 20),
         (double)plan->level_bytes[FLESH_BENCH_L3] / (1 << 20));
  fflush(stdout);
}

int flesh_bench_same_case(const flesh_bench_row *a, const flesh_bench_row *b)
{
  return !strcmp(a->name, b->name) && a->energy == b->energy && a->poisson == b->poisson &&
         a->threads == b->threads;
}

double flesh_bench_growth(const flesh_bench_plan *plan, const flesh_bench_row *like, int smallest,
                          int iterations)
{
  double x[FLESH_BENCH_ROWS], y[FLESH_BENCH_ROWS], constant, slope, c00, c01, c11, squares;
  size_t n = 0;
  for (int k = 0; k < plan->row_count; k++) {
    const flesh_bench_row *row = &plan->rows[k];
    if (!flesh_bench_same_case(row, like) || row->tets < smallest || row->status) continue;
    x[n] = log(row->tets);
    y[n] = log(iterations ? per_newton(row) : flesh_bench_seconds(row) / row->steps);
    n += isfinite(y[n]) != 0;
  }
  if (n < 2 || !(gsl_stats_variance(x, 1, n) > 1e-9)) return NAN;
  gsl_fit_linear(x, 1, y, 1, n, &constant, &slope, &c00, &c01, &c11, &squares);
  return slope;
}

/* Whether the row is the first of its case. */
static int leads(const flesh_bench_plan *plan, int index)
{
  for (int k = 0; k < index; k++)
    if (flesh_bench_same_case(&plan->rows[k], &plan->rows[index])) return 0;
  return 1;
}

/* Peak memory of the whole process, including the measurements of the machine. */
static long peak_memory_kB(void)
{
  struct rusage usage;
  return getrusage(RUSAGE_SELF, &usage) ? 0 : usage.ru_maxrss;
}

static void print_growth_from(double growth, int smallest)
{
  char text[FLESH_TABLE_TEXT];
  if (!isnan(growth)) printf(" (from %d 000 tets: %s)", smallest / 1000, flesh_table_text(text, "%.2f", growth));
}

void flesh_bench_print_end(const flesh_bench_plan *plan)
{
  char text[FLESH_TABLE_TEXT];
  for (int k = 0; k < plan->row_count; k++) {
    const flesh_bench_row *row = &plan->rows[k];
    double growth = is_kernel(row) ? NAN : flesh_bench_growth(plan, row, 0, 0);
    if (isnan(growth) || !leads(plan, k)) continue;
    printf("growth of %s %s %g, %d thread%s: time ~ tets^%s", row->name,
           flesh_energy_name(row->energy), row->poisson, row->threads, row->threads == 1 ? "" : "s",
           flesh_table_text(text, "%.2f", growth));
    print_growth_from(flesh_bench_growth(plan, row, FLESH_BENCH_TIME_FROM, 0), FLESH_BENCH_TIME_FROM);
    printf(", linear iterations ~ tets^%s", flesh_table_text(text, "%.2f", flesh_bench_growth(plan, row, 0, 1)));
    print_growth_from(flesh_bench_growth(plan, row, FLESH_BENCH_LINEAR_FROM, 1), FLESH_BENCH_LINEAR_FROM);
    putchar('\n');
  }
  for (int k = 0; k < plan->memory_count; k++)
    printf("memory at %d tets: %s %.0f bytes/tet\n", plan->memory[k].tets, plan->memory[k].owner,
           plan->memory[k].bytes / plan->memory[k].tets);
  printf("most memory resident at a time: %.0f MB\n", (double)peak_memory_kB() / 1e3 * 1.024);
}

#define ROW(kind, name) {#name, FLESH_FIELD_##kind, offsetof(flesh_bench_row, name)}
#define TIME(kind, name) {#name, FLESH_FIELD_##kind, offsetof(flesh_bench_row, time.name)}
/* Fields of every row, of kernels, of steps. */
static const flesh_study_field all_fields[] = {ROW(DOUBLE, poisson), ROW(INT, tets), ROW(INT, nodes), ROW(INT, threads),
                                               TIME(DOUBLE, wall_s), TIME(DOUBLE, cpu_s), TIME(DOUBLE, scatter),
                                               TIME(INT, repeats), {0}};
static const flesh_study_field kernel_fields[] = {ROW(DOUBLE, bytes), ROW(DOUBLE, operations), ROW(DOUBLE, floor_s), {0}};
static const flesh_study_field step_fields[] = {ROW(INT, steps), ROW(INT, newton), ROW(INT, linear),
                                                ROW(INT, assemblies), ROW(INT, projections), ROW(INT, backtracks), {0}};

static int write_csv(const flesh_bench_plan *plan)
{
  flesh_file file;
  int status = flesh_table_open(plan->out, "bench.csv", &file);
  if (status) return status;
  fputs(
      "group,name,energy,poisson,tets,nodes,threads,status,wall_s,cpu_s,scatter,repeats,ns_per_tet,"
      "bytes,operations,floor_s,level,steps,newton,linear,assemblies,projections,backtracks,"
      "answer,element\n",
      file.stream);
  for (int k = 0; k < plan->row_count; k++) {
    const flesh_bench_row *row = &plan->rows[k];
    fprintf(file.stream, "%s,%s,%s", row->group, row->name, flesh_energy_name(row->energy));
    flesh_fields_print(file.stream, all_fields, "poisson", "threads", row);
    fprintf(file.stream, ",%s", flesh_status_name(row->status));
    flesh_fields_print(file.stream, all_fields, "wall_s", "repeats", row);
    flesh_table_field(file.stream, 1e9 * flesh_bench_seconds(row) / row->tets / (row->steps ? row->steps : 1));
    flesh_fields_print(file.stream, kernel_fields, "bytes", "floor_s", row);
    fprintf(file.stream, ",%s", is_kernel(row) ? flesh_bench_level_names[row->level] : "");
    flesh_fields_print(file.stream, step_fields, "steps", "backtracks", row);
    flesh_table_field(file.stream, is_kernel(row) ? NAN : row->answer);
    fprintf(file.stream, ",%s", flesh_element_name(row->element));
    putc('\n', file.stream);
  }
  return flesh_file_commit(&file);
}

static json_t *ceilings_json(const flesh_bench_plan *plan)
{
  json_t *list = json_array();
  for (int k = 0; k < plan->ceiling_count; k++) {
    const flesh_bench_ceilings *c = &plan->ceilings[k];
    json_t *one = json_object(), *read = json_object(), *triad = json_object(),
           *ops = json_object();
    json_object_set_new(one, "threads", json_integer(c->threads));
    for (int l = 0; l < FLESH_BENCH_LEVELS; l++) {
      json_object_set_new(read, flesh_bench_level_names[l], flesh_json_number(c->read[l]));
      json_object_set_new(triad, flesh_bench_level_names[l], flesh_json_number(c->triad[l]));
    }
    for (int i = FLESH_INSTRUCTIONS_PORTABLE; i < FLESH_INSTRUCTIONS_COUNT; i++)
      if (c->multiply_add[i] > 0)
        json_object_set_new(ops, flesh_instructions_name((flesh_instructions)i),
                            flesh_json_number(c->multiply_add[i]));
    json_object_set_new(one, "read_bytes_per_s", read);
    json_object_set_new(one, "triad_bytes_per_s", triad);
    json_object_set_new(one, "operations_per_s", ops);
    json_array_append_new(list, one);
  }
  return list;
}

static json_t *row_json(const flesh_bench_plan *plan, const flesh_bench_row *row)
{
  json_t *o = json_pack("{ss ss ss ss ss}", "group", row->group, "name", row->name, "energy",
                        flesh_energy_name(row->energy), "status", flesh_status_name(row->status), "element",
                        flesh_element_name(row->element));
  json_object_update_new(o, flesh_fields_json(all_fields, row));
  json_object_update_new(o, flesh_fields_json(is_kernel(row) ? kernel_fields : step_fields, row));
  if (is_kernel(row)) {
    json_object_set_new(o, "level", json_string(flesh_bench_level_names[row->level]));
    return o;
  }
  json_object_set_new(o, "answer_m", flesh_json_number(row->answer));
  json_object_set_new(o, "growth_time", flesh_json_number(flesh_bench_growth(plan, row, 0, 0)));
  json_object_set_new(o, "growth_time_from_200000",
                      flesh_json_number(flesh_bench_growth(plan, row, FLESH_BENCH_TIME_FROM, 0)));
  json_object_set_new(o, "growth_linear_from_48000",
                      flesh_json_number(flesh_bench_growth(plan, row, FLESH_BENCH_LINEAR_FROM, 1)));
  return o;
}

int flesh_bench_write(const flesh_bench_plan *plan, int argc, char **argv, int json)
{
  char path[1400];
  int status = write_csv(plan);
  if (status) return status;
  flesh_instructions used = FLESH_INSTRUCTIONS_AUTO;
  flesh_instructions_find(plan->instructions, &used);
  json_t *all = json_object(), *rows = json_array(), *memory = json_array();
  for (int k = 0; k < plan->row_count; k++)
    json_array_append_new(rows, row_json(plan, &plan->rows[k]));
  for (int k = 0; k < plan->memory_count; k++)
    json_array_append_new(memory, json_pack("{ss si sf}", "owner", plan->memory[k].owner, "tets",
                                            plan->memory[k].tets, "bytes", plan->memory[k].bytes));
  json_object_set_new(all, "program", flesh_provenance_program(argc, argv));
  json_object_set_new(all, "instructions", json_string(flesh_instructions_name(used)));
  json_object_set_new(all, "newton_tolerance", flesh_json_number(plan->tolerance));
  json_object_set_new(all, "ceilings", ceilings_json(plan));
  json_object_set_new(all, "level_bytes", json_pack("{sf sf}", "L2", (double)plan->level_bytes[FLESH_BENCH_L2], "L3",
                                                    (double)plan->level_bytes[FLESH_BENCH_L3]));
  json_object_set_new(all, "measurements", rows);
  json_object_set_new(all, "memory", memory);
  json_object_set_new(all, "peak_memory_kB", json_integer(peak_memory_kB()));
  if (json && !flesh_json_lacks()) {
    json_dumpf(all, stdout, JSON_INDENT(2));
    putchar('\n');
  }
  snprintf(path, sizeof path, "%s/bench.json", plan->out);
  return flesh_json_write(path, all);
}
