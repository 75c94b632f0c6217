/* command.c: `flesh bench`: measures how close flesh runs to this machine's limits, and how that changes with size and
 * threads. A benchmark is a study, whose cases have their rows as records. */
#include "commands.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/file.h"
#include "base/scan.h"
#include "bench/bench.h"
#include "cli/interrupt.h"
#include "cli/lists.h"
#include "cli/path.h"
#include "run/provenance.h"
#include "study/study.h"
#include "study/embedded.h"

/* Returns whether the item is "AxBxC" with whole numbers; those above 1e9 become 1e9. */
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

/* Takes a size: 48x13x13, or a number of tets, for which the bar of the same proportions with the nearest number is
 * taken. */
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

/* Checks the lists against each other and against this machine. */
static int check_lists(const flesh_bench_plan *plan)
{
  flesh_instructions usable;
  for (int k = 0; k < plan->poisson_count; k++)
    if (plan->poissons[k] == 0.5 && plan->element != FLESH_ELEMENT_TET10_MEAN)
      return flesh_fail(FLESH_ERR_ARGUMENT,
                        "--poisson: 0.5 needs --element tet10-mean, which alone keeps the volume of tets");
  for (int k = 0; k < plan->thread_count; k++)
    if (plan->threads[k] > FLESH_THREADS_MAX)
      return flesh_fail(FLESH_ERR_ARGUMENT, "--threads: %g is more than %d", plan->threads[k], FLESH_THREADS_MAX);
  return flesh_instructions_find(plan->instructions, &usable);
}

/* The only field of every case; its measurements are in its rows. */
static const flesh_study_field fields[] = {{"status_code", FLESH_FIELD_INT, offsetof(flesh_bench_case, status)}, {0}};

/* Columns, in the order of the values of make_case. */
static const flesh_study_column columns[] = {{.name = "part", .key = "--cases"},
                                             {.name = "energy", .key = "--energies"},
                                             {.name = "poisson", .key = "--poisson"},
                                             {.name = "cells", .key = "--cells"},
                                             {.name = "element", .key = "--element"},
                                             {.name = "threads", .key = "--threads"},
                                             {0}};

/* Makes the cases of the lists; they are to be freed. FLESH_ERR_MEMORY. */
static int make_cases(flesh_bench_plan *plan)
{
  const int most = plan->thread_count * (1 + plan->energy_count * plan->poisson_count * plan->size_count * plan->part_count);
  flesh_bench_case *c = plan->cases = calloc((size_t)most, sizeof *c);
  if (!c) return flesh_no_memory();
  for (int t = 0; t < plan->thread_count; t++)
    *c++ = (flesh_bench_case){.part = "machine", .threads = (int)plan->threads[t]};
  for (int e = 0; e < plan->energy_count; e++)
    for (int r = 0; r < plan->poisson_count; r++)
      for (int s = 0; s < plan->size_count; s++)
        for (int p = 0; p < plan->part_count; p++) {
          const char *part = flesh_bench_parts[plan->parts[p]];
          /* A kernel's work does not depend on Poisson's ratio. */
          if (!strcmp(part, "kernels") && (r || plan->element != FLESH_ELEMENT_TET4)) continue;
          for (int t = 0; t < plan->thread_count; t++)
            *c++ = (flesh_bench_case){.part = part, .energy = plan->energies[e], .poisson = plan->poissons[r],
                                      .cells = plan->sizes[s], .threads = (int)plan->threads[t]};
        }
  plan->case_count = (int)(c - plan->cases);
  return FLESH_OK;
}

static int make_case(const void *data, int number, flesh_study_case *made)
{
  const flesh_bench_plan *plan = data;
  const flesh_bench_case *c = &plan->cases[number];
  *made = (flesh_study_case){.values = {c->part, "", "", "", "", NULL}};
  made->values[5] = flesh_arena_print(&made->arena, "%d", c->threads);
  if (!c->cells) return FLESH_OK; /* the machine alone */
  made->values[1] = flesh_energy_name(c->energy);
  made->values[2] = flesh_study_case_number(made, c->poisson);
  made->values[3] = flesh_arena_print(&made->arena, "%dx%dx%d", c->cells[0], c->cells[1], c->cells[2]);
  made->values[4] = flesh_element_name(plan->element);
  return FLESH_OK;
}

/* Returns facts that all cases have in common, once, for the first. */
static json_t *facts_of(const void *data, int number)
{
  const flesh_bench_plan *plan = data;
  flesh_instructions used = FLESH_INSTRUCTIONS_AUTO;
  if (number) return NULL;
  flesh_instructions_find(plan->instructions, &used);
  return json_pack("{so ss sf}", "program", flesh_provenance_program(plan->options.argc, plan->options.argv), "instructions",
                   flesh_instructions_name(used), "newton_tolerance", plan->tolerance);
}

static int measure(const flesh_bench_plan *plan, const flesh_bench_case *c, json_t *rows)
{
  if (!c->cells) return flesh_bench_machine(plan, c->threads, rows);
  flesh_bench_bar bar;
  int status = flesh_bench_bar_open(plan, c, &bar);
  if (!status)
    status = strcmp(c->part, "kernels") ? flesh_bench_steps(plan, &bar, c->part, c->threads, rows)
                                        : flesh_bench_kernels(plan, &bar, c->threads, rows);
  flesh_bench_bar_close(&bar);
  return status;
}

static json_t *do_case(const void *data, int number, const char *folder)
{
  (void)folder;
  const flesh_bench_plan *plan = data;
  flesh_bench_case c = plan->cases[number];
  json_t *rows = json_array();
  c.status = measure(plan, &c, rows);
  const char *word = c.status == FLESH_ERR_INTERRUPTED ? "interrupted" : c.status ? "failed" : "complete";
  json_t *record = flesh_fields_record(word, flesh_exit_code(c.status), c.status ? flesh_error_text() : "",
                                       flesh_fields_json(fields, &c));
  json_object_set_new(record, "rows", rows);
  return record;
}

/* Takes a record. Steps that cannot be solved are a result; other failures end the study. */
static int take(void *data, int number, const json_t *record)
{
  const flesh_bench_plan *plan = data;
  char message[FLESH_STUDY_MESSAGE];
  int crashed_by, status = flesh_fields_take(fields, "bench.db", record, &plan->cases[number], message, &crashed_by);
  if (status) return status;
  status = crashed_by ? FLESH_ERR_SOLVE : plan->cases[number].status;
  return status && (crashed_by || status != FLESH_ERR_SOLVE) ? flesh_fail(status, "%s", message) : FLESH_OK;
}

/* Returns the plan as a study, which borrows it and stores records in it. */
static flesh_study describe_study(flesh_bench_plan *plan)
{
  char build[FLESH_IDENTITY_SIZE], tolerance[FLESH_NUMBER_SIZE];
  json_t *program = flesh_provenance_program(0, NULL);
  flesh_provenance_identity(build);
  build[strcspn(build, ",")] = 0;
  snprintf(plan->fingerprint, sizeof plan->fingerprint, "%.100s, %.100s, %s, %d steps, %d repeats, tolerance %s", build,
           json_string_value(json_object_get(program, "cpu")), flesh_instructions_name(plan->instructions), plan->steps,
           plan->repeats, flesh_number_text(plan->tolerance, tolerance));
  json_decref(program);
  return (flesh_study){.name = "bench",
                       .fingerprint = plan->fingerprint,
                       .different = "its times, of another program, machine or way to measure, would not compare; leave out "
                                    "--resume to begin anew",
                       .columns = columns,
                       .case_count = plan->case_count,
                       .facts = facts_of,
                       .results = {flesh_own_text("bench")},
                       .words = "bench.json",
                       .again = "exit_code NOT IN (0, 4)", /* 4: steps that cannot be solved */
                       .data = plan,
                       .make = make_case,
                       .fields = fields,
                       .work = do_case,
                       .take = take};
}

/* Runs the study, and prints bench.json if asked to; called on the first rank. */
static int measure_all(const flesh_study *study, const flesh_study_options *options)
{
  const flesh_bench_plan *plan = study->data;
  char *text = NULL;
  size_t size;
  int status = flesh_study_do(study, options);
  if (!status && plan->json) status = flesh_file_load(flesh_path("%s/bench.json", options->out), &text, &size);
  if (text) fputs(text, stdout);
  free(text);
  return status;
}

int flesh_command_bench(int argc, char **argv)
{
  const char *sizes = "6000,48x13x13", *energies = "S", *poissons = "0.45,0.49", *threads = "1";
  const char *cases = "kernels,swing,twist,crush,drop,static";
  int element = 0, instructions = 0;
  flesh_bench_plan plan = {.options = {.out = "out/bench", .jobs = 1}, .repeats = 3, .steps = 10, .tolerance = 1e-6};
  const flesh_option rows[] = {
      {"cells", "LIST", FLESH_OPTION_TEXT, &sizes, "cells as 48x13x13, or numbers of tets (default 6000,48x13x13)"},
      {"energies", "LIST", FLESH_OPTION_TEXT, &energies, "forms of the energy (default S)"},
      {"poisson", "LIST", FLESH_OPTION_TEXT, &poissons, "Poisson's ratios (default 0.45,0.49)"},
      {"threads", "LIST", FLESH_OPTION_TEXT, &threads, "numbers of threads (default 1)"},
      {"cases", "LIST", FLESH_OPTION_TEXT, &cases, "some of kernels,swing,twist,crush,drop,static (default all)"},
      {"element", "tet4|tet10|tet10-mean", FLESH_OPTION_CHOICE, &element, /* values from FLESH_ELEMENT_TET4 on */
       "element of the steps (default tet4); with ten nodes no kernels are measured"},
      {"steps", "N", FLESH_OPTION_COUNT, &plan.steps, "steps of a case (default 10)"},
      {"repeats", "N", FLESH_OPTION_COUNT, &plan.repeats, "repeats of everything, at most 101 (default 3)"},
      {"tolerance", "TAU", FLESH_OPTION_POSITIVE, &plan.tolerance, "tolerance of Newton's iteration (default 1e-6)"},
      {"instructions", "auto|portable|avx2|avx512", FLESH_OPTION_CHOICE, &instructions, /* of flesh_instructions */
       "vector instructions of the kernels (default auto)"},
      {"json", NULL, FLESH_OPTION_SWITCH, &plan.json, "print bench.json instead of the table"},
      FLESH_STUDY_OPTION_ROWS(&plan.options, "bench", "also with further sizes, energies, threads and cases"),
      {0}};
  const flesh_usage usage = {"bench", "", "Measures flesh against the limits of this machine.", flesh_own_text("bench_help"),
                             0, 0, rows, NULL, FLESH_EXITS_OF_SOLVES | FLESH_EXITS_OF_INTERRUPTS};
  int count, status = FLESH_OK, code = flesh_study_open(&plan.options, &usage, argc, argv, &count);
  if (code == FLESH_OPTIONS_GO_ON) {
    plan.options.quiet = plan.json;
    plan.element = (flesh_element)(FLESH_ELEMENT_TET4 + element);
    plan.instructions = (flesh_instructions)instructions;
    if (plan.repeats > FLESH_BENCH_MOST_REPEATS)
      status = flesh_fail(FLESH_ERR_ARGUMENT, "--repeats is %d; it must be 1 to %d", plan.repeats, FLESH_BENCH_MOST_REPEATS);
    if (!status) status = flesh_list_each("cells", sizes, take_size, &plan);
    if (!status) status = flesh_list_energies(energies, FLESH_BENCH_LIST, plan.energies, NULL, &plan.energy_count);
    if (!status)
      status = flesh_list_numbers("poisson", poissons, FLESH_LIST_POISSON, FLESH_BENCH_LIST, plan.poissons, &plan.poisson_count);
    if (!status)
      status = flesh_list_numbers("threads", threads, FLESH_LIST_COUNT, FLESH_BENCH_LIST, plan.threads, &plan.thread_count);
    if (!status) status = flesh_list_words("cases", cases, flesh_bench_parts, plan.parts, &plan.part_count);
    if (!status) status = check_lists(&plan);
    if (!status) status = make_cases(&plan);
    flesh_interrupt_watch();
    const flesh_study study = describe_study(&plan);
    code = flesh_study_lead(&study, &plan.options, status, measure_all);
  }
  flesh_study_close(&plan.options);
  free(plan.cases);
  return code;
}
