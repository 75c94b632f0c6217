/* command.c: `flesh bench`: how close flesh runs to this machine's limits, and how it grows. */
#include "commands.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "bench/bench.h"
#include "cli/interrupt.h"
#include "cli/lists.h"
#include "base/file.h"
#include "cli/options.h"
#include "picture/plot.h"
#include "cli/output.h"

static const char details[] =
    "Measures what this machine can do (bandwidth where data live, multiply-adds per instruction set), then every\n"
    "kernel of a step against the bytes and operations that it needs at least, then whole backward-Euler steps of\n"
    "1/60 s of a bar with the proportions 48 x 13 x 13 (swing: held at one end under gravity; twist: half a turn in\n"
    "0.5 s; crush: to 0.6 of its length; drop: onto a plane 5 cm below) and its equilibrium at g = 0.5 (static,\n"
    "tolerance 1e-8). Times are medians of the repeats, CPU time for one thread and wall time for more; +- is half\n"
    "the range of the middle half of the repeats. Newton and linear iterations and the answer do not depend on the\n"
    "machine: two programs that differ in them did not do the same work.\n\n"
    "Writes into DIR: bench.csv (a row per measurement), bench.json (with ceilings, memory by owner and growth\n"
    "exponents by fit), roofline.png and growth.png.\n";

static int fail_full(const char *option)
{
  return flesh_fail(FLESH_ERR_ARGUMENT, "--%s has more than %d values", option, FLESH_BENCH_LIST);
}

/* Whether the item is "AxBxC", of whole numbers; those beyond 1e9 are given as that. */
static int parse_cells(const char *item, int cells[3])
{
  for (int d = 0; d < 3; d++) {
    char *end;
    const long number = strtol(item, &end, 10);
    if (end == item || *end != (d < 2 ? 'x' : 0)) return 0;
    cells[d] = (int)(number < 0 ? 0 : number > 1000000000 ? 1000000000 : number);
    item = end + 1;
  }
  return 1;
}

/* 48x13x13, or a number of tets: the bar of the same proportions with the nearest number. */
static int take_size(void *data, const char *item)
{
  flesh_bench_plan *plan = data;
  if (plan->size_count == FLESH_BENCH_LIST) return fail_full("cells");
  int *cells = plan->sizes[plan->size_count];
  double tets;
  if (parse_cells(item, cells)) {
    if (cells[0] < 1 || cells[1] < 1 || cells[2] < 1 ||
        6.0 * cells[0] * cells[1] * cells[2] > 2e8)
      return flesh_fail(FLESH_ERR_ARGUMENT,
                        "--cells: '%s' must have at least one cell along each axis and at most 2e8 tets", item);
  } else {
    if (flesh_option_number(item, &tets) || !(tets >= 6 && tets <= 2e8))
      return flesh_fail(FLESH_ERR_ARGUMENT,
                        "--cells: '%s' is neither a number of tets in 6 to 2e8 nor cells such as 48x13x13", item);
    double across = cbrt(tets / 6 * 13 / 48);
    cells[1] = cells[2] = across < 1 ? 1 : (int)lround(across);
    cells[0] = (int)lround(fmax(1, tets / 6 / cells[1] / cells[2]));
  }
  plan->size_count++;
  return FLESH_OK;
}

static int take_energy(void *data, const char *item)
{
  flesh_bench_plan *plan = data;
  if (plan->energy_count == FLESH_BENCH_LIST) return fail_full("energies");
  const int status = flesh_energy_from_name(item, &plan->energies[plan->energy_count++]);
  return status ? flesh_fail_within(status, "--energies: ") : FLESH_OK;
}

static int read_numbers(flesh_bench_plan *plan, const char *poissons, const char *threads)
{
  double counts[FLESH_BENCH_LIST];
  int status = flesh_list_numbers("poisson", poissons, FLESH_LIST_POISSON, FLESH_BENCH_LIST, plan->poissons,
                                  &plan->poisson_count);
  if (!status)
    status = flesh_list_numbers("threads", threads, FLESH_LIST_COUNT, FLESH_BENCH_LIST, counts, &plan->thread_count);
  for (int k = 0; k < plan->poisson_count && !status; k++)
    if (plan->poissons[k] == 0.5 && plan->element != FLESH_ELEMENT_TET10_MEAN)
      status = flesh_fail(FLESH_ERR_ARGUMENT,
                          "--poisson: 0.5 needs --element tet10-mean, which alone keeps the volume of tets");
  for (int k = 0; k < plan->thread_count && !status; k++) {
    if (counts[k] > FLESH_THREADS_MAX)
      status = flesh_fail(FLESH_ERR_ARGUMENT, "--threads: %g is more than %d", counts[k], FLESH_THREADS_MAX);
    else plan->threads[k] = (int)counts[k];
  }
  return status;
}

static int read_cases(flesh_bench_plan *plan, const char *text)
{
  int chosen[FLESH_BENCH_LIST];
  const int status = flesh_list_words("cases", text, flesh_bench_cases, chosen, &plan->case_count);
  for (int k = 0; k < plan->case_count; k++) plan->cases[k] = flesh_bench_cases[chosen[k]];
  return status;
}

static int take_instructions(flesh_bench_plan *plan, const char *text)
{
  for (int k = 0; k < FLESH_INSTRUCTIONS_COUNT; k++)
    if (!strcmp(text, flesh_instructions_name((flesh_instructions)k)))
      plan->instructions = (flesh_instructions)k;
  if (strcmp(text, flesh_instructions_name(plan->instructions)))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "--instructions is '%s'; it must be one of auto, portable, avx2, avx512", text);
  flesh_instructions usable;
  return flesh_instructions_find(plan->instructions, &usable);
}

static int take_element(flesh_bench_plan *plan, const char *text)
{
  flesh_element elements[FLESH_ELEMENT_COUNT];
  int count, status = flesh_list_elements("element", text, elements, &count);
  if (!status && count > 1) status = flesh_fail(FLESH_ERR_ARGUMENT, "--element is '%s'; it must be one element", text);
  if (!status) plan->element = elements[0];
  return status;
}

/* All cases of one bar; kernels at its first ratio only, on which their work does not depend. */
static int measure_bar(flesh_bench_plan *plan, int size, flesh_energy energy, int ratio)
{
  flesh_bench_bar bar;
  int status = flesh_bench_bar_open(plan, size, energy, plan->poissons[ratio], &bar);
  for (int c = 0; c < plan->case_count && !status; c++)
    for (int t = 0; t < plan->thread_count && !status; t++) {
      int kernels = !strcmp(plan->cases[c], "kernels"), noted = 0;
      for (int k = 0; k < plan->memory_count; k++)
        noted |= plan->memory[k].tets == flesh_mesh_tet_count(bar.mesh);
      if (kernels && ratio == 0 && plan->element == FLESH_ELEMENT_TET4) status = flesh_bench_kernels(plan, &bar, plan->threads[t]);
      if (!kernels)
        status = flesh_bench_steps(plan, &bar, plan->cases[c], plan->threads[t], !noted);
      if (!status && flesh_interrupt_signal())
        status = flesh_fail(FLESH_ERR_INTERRUPTED, "stopped by %s", flesh_interrupt_name());
    }
  flesh_bench_bar_close(&bar);
  return status;
}

static int measure(flesh_bench_plan *plan)
{
  int status = flesh_bench_find_ceilings(plan);
  if (status) return status;
  if (!plan->quiet) flesh_bench_print_ceilings(plan);
  for (int e = 0; e < plan->energy_count && !status; e++)
    for (int r = 0; r < plan->poisson_count && !status; r++)
      for (int s = 0; s < plan->size_count && !status; s++)
        status = measure_bar(plan, s, plan->energies[e], r);
  return status;
}

int flesh_command_bench(int argc, char **argv)
{
  const char *sizes = "6000,48x13x13", *energies = "S", *poissons = "0.45,0.49", *threads = "1";
  const char *cases = "kernels,swing,twist,crush,drop,static", *instructions = "auto", *element = "tet4";
  int json = 0;
  flesh_bench_plan *plan = calloc(1, sizeof *plan);
  if (!plan) return flesh_command_fail("bench", flesh_fail(FLESH_ERR_MEMORY, "out of memory"));
  plan->out = "out/bench";
  plan->repeats = 3;
  plan->steps = 10;
  plan->tolerance = 1e-6;
  const flesh_option rows[] = {
      {"cells", "LIST", FLESH_OPTION_TEXT, &sizes, "cells as 48x13x13, or numbers of tets (default 6000,48x13x13)"},
      {"energies", "LIST", FLESH_OPTION_TEXT, &energies, "forms of the energy (default S)"},
      {"poisson", "LIST", FLESH_OPTION_TEXT, &poissons, "Poisson's ratios (default 0.45,0.49)"},
      {"threads", "LIST", FLESH_OPTION_TEXT, &threads, "numbers of threads (default 1)"},
      {"cases", "LIST", FLESH_OPTION_TEXT, &cases, "of kernels,swing,twist,crush,drop,static (default all)"},
      {"element", "tet4|tet10|tet10-mean", FLESH_OPTION_TEXT, &element,
       "of the steps (default tet4); with ten nodes no kernels are measured"},
      {"steps", "N", FLESH_OPTION_COUNT, &plan->steps, "steps of a case (default 10)"},
      {"repeats", "N", FLESH_OPTION_COUNT, &plan->repeats, "repeats of everything, at most 101 (default 3)"},
      {"tolerance", "TAU", FLESH_OPTION_POSITIVE, &plan->tolerance, "of Newton's iteration (default 1e-6)"},
      {"instructions", "auto|portable|avx2|avx512", FLESH_OPTION_TEXT, &instructions,
       "vector instructions of the kernels (default auto)"},
      {"json", NULL, FLESH_OPTION_SWITCH, &json, "print bench.json in place of the table"},
      {"out", "DIR", FLESH_OPTION_TEXT, &plan->out, "folder of the results (default out/bench)"},
      {0}};
  const flesh_usage usage = {"bench", "", "Measures flesh against the limits of this machine.", details, 0, 0,
                             rows, NULL, FLESH_EXITS_OF_SOLVES | FLESH_EXITS_OF_INTERRUPTS};
  int count, code = flesh_options_read(&usage, argc, argv, &count);
  if (code != FLESH_OPTIONS_GO_ON) {
    free(plan);
    return code;
  }
  plan->quiet = json;
  int status = take_element(plan, element); /* which allows some of Poisson's ratios */
  if (!status) status = flesh_list_each("cells", sizes, take_size, plan);
  if (!status) status = flesh_list_each("energies", energies, take_energy, plan);
  if (!status) status = read_numbers(plan, poissons, threads);
  if (!status) status = read_cases(plan, cases);
  if (!status) status = take_instructions(plan, instructions);
  flesh_interrupt_watch();
  flesh_folder_claim claim = {.descriptor = -1};
  if (!status) status = flesh_output_claim(plan->out, "bench", &claim);
  if (!status) status = measure(plan);
  if (!status && !json) flesh_bench_print_end(plan);
  if (!status) status = flesh_bench_write(plan, argc, argv, json);
  if (!status) status = flesh_plot_accept("bench", flesh_bench_draw(plan));
  flesh_folder_claim_release(&claim);
  if (!status && !json)
    printf("results: %s/bench.csv, %s/bench.json, pictures %s/*.png\n", plan->out, plan->out, plan->out);
  code = status ? flesh_command_fail("bench", status) : 0;
  if (status == FLESH_ERR_INTERRUPTED) code = flesh_interrupt_exit_code();
  free(plan);
  return code;
}
