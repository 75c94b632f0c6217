/* command.c: `flesh bench`: how close flesh runs to this machine's limits, and how it grows. */
#include "commands.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "bench/bench.h"
#include "cli/interrupt.h"
#include "cli/json_memory.h"
#include "cli/lists.h"
#include "cli/path.h"
#include "study/lead.h"
#include "study/embedded.h"

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
  if (plan->size_count == FLESH_BENCH_LIST)
    return flesh_fail(FLESH_ERR_ARGUMENT, "--cells has more than %d values", FLESH_BENCH_LIST);
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

static int read_parts(flesh_bench_plan *plan, const char *text)
{
  int chosen[FLESH_BENCH_LIST];
  const int status = flesh_list_words("cases", text, flesh_bench_parts, chosen, &plan->part_count);
  for (int k = 0; k < plan->part_count; k++) plan->parts[k] = flesh_bench_parts[chosen[k]];
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

/* On the first rank. */
static int compare(void *data)
{
  flesh_bench_plan *plan = data;
  const flesh_study study = flesh_bench_study(plan);
  int status = flesh_study_do(&study, &plan->options);
  if (status || !plan->json) return status;
  json_t *all;
  status = flesh_json_read(flesh_path("%s/bench.json", plan->options.out), &all);
  if (status) return status;
  json_dumpf(all, stdout, JSON_INDENT(2));
  putchar('\n');
  json_decref(all);
  return FLESH_OK;
}

int flesh_command_bench(int argc, char **argv)
{
  const char *sizes = "6000,48x13x13", *energies = "S", *poissons = "0.45,0.49", *threads = "1";
  const char *cases = "kernels,swing,twist,crush,drop,static", *instructions = "auto", *element = "tet4";
  flesh_bench_plan plan = {.options = {.out = "out/bench", .jobs = 1}, .repeats = 3, .steps = 10, .tolerance = 1e-6};
  const flesh_option rows[] = {
      {"cells", "LIST", FLESH_OPTION_TEXT, &sizes, "cells as 48x13x13, or numbers of tets (default 6000,48x13x13)"},
      {"energies", "LIST", FLESH_OPTION_TEXT, &energies, "forms of the energy (default S)"},
      {"poisson", "LIST", FLESH_OPTION_TEXT, &poissons, "Poisson's ratios (default 0.45,0.49)"},
      {"threads", "LIST", FLESH_OPTION_TEXT, &threads, "numbers of threads (default 1)"},
      {"cases", "LIST", FLESH_OPTION_TEXT, &cases, "of kernels,swing,twist,crush,drop,static (default all)"},
      {"element", "tet4|tet10|tet10-mean", FLESH_OPTION_TEXT, &element,
       "of the steps (default tet4); with ten nodes no kernels are measured"},
      {"steps", "N", FLESH_OPTION_COUNT, &plan.steps, "steps of a case (default 10)"},
      {"repeats", "N", FLESH_OPTION_COUNT, &plan.repeats, "repeats of everything, at most 101 (default 3)"},
      {"tolerance", "TAU", FLESH_OPTION_POSITIVE, &plan.tolerance, "of Newton's iteration (default 1e-6)"},
      {"instructions", "auto|portable|avx2|avx512", FLESH_OPTION_TEXT, &instructions,
       "vector instructions of the kernels (default auto)"},
      {"json", NULL, FLESH_OPTION_SWITCH, &plan.json, "print bench.json in place of the table"},
      FLESH_STUDY_OPTION_ROWS(&plan.options, "bench", "also with further sizes, energies, threads and cases"),
      {0}};
  const flesh_usage usage = {"bench", "", "Measures flesh against the limits of this machine.", flesh_own_text("bench_help"),
                             0, 0, rows, NULL, FLESH_EXITS_OF_SOLVES | FLESH_EXITS_OF_INTERRUPTS};
  int count, status = FLESH_OK, code = flesh_study_open(&plan.options, &usage, argc, argv, &count);
  if (code != FLESH_OPTIONS_GO_ON) {
    flesh_study_close(&plan.options);
    return code;
  }
  plan.options.quiet = plan.json;
  if (plan.repeats > FLESH_BENCH_MOST_REPEATS)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "--repeats is %d; it must be 1 to %d", plan.repeats, FLESH_BENCH_MOST_REPEATS);
  if (!status) status = take_element(&plan, element); /* which allows some of Poisson's ratios */
  if (!status) status = flesh_list_each("cells", sizes, take_size, &plan);
  if (!status) status = flesh_list_energies(energies, FLESH_BENCH_LIST, plan.energies, NULL, &plan.energy_count);
  if (!status) status = read_numbers(&plan, poissons, threads);
  if (!status) status = read_parts(&plan, cases);
  if (!status) status = take_instructions(&plan, instructions);
  if (!status) status = flesh_bench_make_cases(&plan);
  flesh_interrupt_watch();
  const flesh_study study = flesh_bench_study(&plan);
  code = flesh_study_lead(&study, &plan.options, status, compare, &plan);
  flesh_study_close(&plan.options);
  free(plan.cases);
  return code;
}
