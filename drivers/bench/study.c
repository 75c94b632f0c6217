/* study.c: a benchmark as a study: its cases, and their rows as records. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/file.h"
#include "base/text.h"
#include "bench/bench.h"
#include "run/provenance.h"
#include "study/embedded.h"

/* The figure that every case has; what was measured stands in its rows. */
static const flesh_study_field fields[] = {{"status_code", FLESH_FIELD_INT, offsetof(flesh_bench_case, status)}, {0}};

/* In the order of the values of make_case. */
static const flesh_study_column columns[] = {{.name = "part", .key = "--cases"},
                                             {.name = "energy", .key = "--energies"},
                                             {.name = "poisson", .key = "--poisson"},
                                             {.name = "cells", .key = "--cells"},
                                             {.name = "element", .key = "--element"},
                                             {.name = "threads", .key = "--threads"}};
enum { COLUMNS = sizeof columns / sizeof *columns };

int flesh_bench_make_cases(flesh_bench_plan *plan)
{
  const int most = plan->thread_count * (1 + plan->energy_count * plan->poisson_count * plan->size_count * plan->part_count);
  flesh_bench_case *c = plan->cases = calloc((size_t)most, sizeof *c);
  if (!c) return flesh_no_memory();
  for (int t = 0; t < plan->thread_count; t++)
    *c++ = (flesh_bench_case){.part = "machine", .threads = plan->threads[t]};
  for (int e = 0; e < plan->energy_count; e++)
    for (int r = 0; r < plan->poisson_count; r++)
      for (int s = 0; s < plan->size_count; s++)
        for (int p = 0; p < plan->part_count; p++) {
          /* The work of a kernel does not depend on the ratio. */
          if (!strcmp(plan->parts[p], "kernels") && (r || plan->element != FLESH_ELEMENT_TET4)) continue;
          for (int t = 0; t < plan->thread_count; t++)
            *c++ = (flesh_bench_case){.part = plan->parts[p], .energy = plan->energies[e], .poisson = plan->poissons[r],
                                      .cells = plan->sizes[s], .threads = plan->threads[t]};
        }
  plan->case_count = (int)(c - plan->cases);
  return FLESH_OK;
}

static int make_case(const void *data, int number, flesh_study_case *made)
{
  const flesh_bench_plan *plan = data;
  const flesh_bench_case *c = &plan->cases[number];
  struct {
    char poisson[FLESH_NUMBER_SIZE], cells[40], threads[16];
  } *texts = calloc(1, sizeof *texts);
  if (!texts) return flesh_no_memory();
  *made = (flesh_study_case){.owned = texts,
                             .values = {c->part, c->cells ? flesh_energy_name(c->energy) : "", texts->poisson, texts->cells,
                                        c->cells ? flesh_element_name(plan->element) : "", texts->threads}};
  if (c->cells) flesh_number_text(c->poisson, texts->poisson);
  if (c->cells) snprintf(texts->cells, sizeof texts->cells, "%dx%dx%d", c->cells[0], c->cells[1], c->cells[2]);
  snprintf(texts->threads, sizeof texts->threads, "%d", c->threads);
  return FLESH_OK;
}

/* The first case tells SQL what all have in common. */
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

/* Steps that cannot be solved are a measurement; other failures end the study. */
static int take(void *data, int number, const json_t *record)
{
  const flesh_bench_plan *plan = data;
  char message[FLESH_STUDY_MESSAGE];
  int crashed_by, status = flesh_fields_take(fields, "bench.db", record, &plan->cases[number], message, &crashed_by);
  if (status) return status;
  status = crashed_by ? FLESH_ERR_SOLVE : plan->cases[number].status;
  return status && (crashed_by || status != FLESH_ERR_SOLVE) ? flesh_fail(status, "%s", message) : FLESH_OK;
}

static void title(const void *data, int number, char *text, size_t size)
{
  const flesh_bench_case *c = &((const flesh_bench_plan *)data)->cases[number];
  snprintf(text, size, "%s, %d thread%s", c->part, c->threads, c->threads == 1 ? "" : "s");
  if (c->cells)
    flesh_text_add(text, size, ", %s %g, %dx%dx%d", flesh_energy_name(c->energy), c->poisson, c->cells[0], c->cells[1],
                   c->cells[2]);
}

flesh_study flesh_bench_study(flesh_bench_plan *plan)
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
                       .column_count = COLUMNS,
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
                       .take = take,
                       .title = title,
                       .taker = plan};
}
