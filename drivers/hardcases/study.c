/* study.c: runs the battery as a study: a case for each run, with its figures as the record. */
#include <assert.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "base/confine.h"
#include "base/file.h"
#include "base/text.h"
#include "flesh/version.h"
#include "hardcases/hardcases.h"
#include "cli/json_memory.h"
#include "study/embedded.h"
#include "study/study.h"

#define FIGURE(kind, name) {#name, FLESH_FIELD_##kind, offsetof(flesh_hardcases_figures, name)}
#define COUNT(name) {#name, FLESH_FIELD_LONG, offsetof(flesh_hardcases_figures, counts.name)}
#define LONGEST(kind, name) {"longest_" #name, FLESH_FIELD_##kind, offsetof(flesh_hardcases_figures, longest.name)}
static const flesh_study_field fields[] = {
    {"status_code", FLESH_FIELD_INT, offsetof(flesh_hardcases_figures, status)},
    {"end_kind", FLESH_FIELD_INT, offsetof(flesh_hardcases_figures, end)},
    FIGURE(INT, tets), FIGURE(INT, rank), FIGURE(INT, steps), COUNT(solves), FIGURE(LONG, retried),
    COUNT(unconverged), COUNT(at_rounding), COUNT(untanglings), COUNT(untangled_nodes),
    FIGURE(LONG, rises), FIGURE(LONG, rises_checked), FIGURE(DOUBLE, worst_rise), FIGURE(INT, finite),
    FIGURE(INT, max_inverted), FIGURE(INT, inverted_end), FIGURE(DOUBLE, distance), FIGURE(DOUBLE, volume_error),
    FIGURE(DOUBLE, recovered_at), FIGURE(DOUBLE, gradient), FIGURE(DOUBLE, smallest_eigenvalue),
    FIGURE(INT, negative_eigenvalues), COUNT(newton), COUNT(linear), COUNT(direct),
    COUNT(projections), COUNT(backtracks), FIGURE(DOUBLE, newton_ratio), FIGURE(DOUBLE, time_ratio),
    FIGURE(DOUBLE, wall_s), FIGURE(DOUBLE, cpu_s), FIGURE(DOUBLE, simulated_s), FIGURE(DOUBLE, stressed_rest),
    LONGEST(LONG, step), LONGEST(LONG, newton), LONGEST(LONG, linear), LONGEST(LONG, cuts), LONGEST(DOUBLE, ratio),
    LONGEST(DOUBLE, t), {0}};
static_assert(sizeof(((flesh_hardcases_figures *)0)->end) == sizeof(int), "an end is read as a number");

/* Columns, in the order of the values in make_case. */
static const flesh_study_column columns[] = {{.name = "case_name", .key = "--cases"},
                                             {.name = "mesh", .key = "--meshes"},
                                             {.name = "seed", .key = "--seeds"},
                                             {.name = "energy", .key = "--energies"},
                                             {.name = "constants", .key = "--energies"},
                                             {.name = "poisson", .key = "--poisson"},
                                             {.name = "step", .key = "--steps"},
                                             {.name = "element", .key = "--elements"},
                                             {.name = "solver", .key = "--solvers"},
                                             {.name = "case_sum", .key = "FILE", .is_digest = 1},
                                             {0}};

static int make_case(const void *data, int number, flesh_study_case *made)
{
  const flesh_hardcases_run *run = &((const flesh_hardcases_plan *)data)->runs[number];
  const flesh_hardcases_case *hardcase = run->hardcase;
  const flesh_hardcases_setting *s = run->setting;
  *made = (flesh_study_case){.repeat = 1};
  const char *const values[] = {hardcase->name, !s->body ? "" : s->body->file ? s->body->file : s->body->name,
                                flesh_arena_print(&made->arena, "%d", run->seed), flesh_energy_name(s->energy),
                                flesh_constants_name(s->constants), flesh_study_case_number(made, flesh_hardcases_poisson(run)),
                                flesh_study_case_number(made, hardcase->step > 0 ? hardcase->step : s->step),
                                flesh_element_name(s->element), flesh_hardcases_solver_name(s->solver),
                                hardcase->fingerprint ? flesh_arena_print(&made->arena, "#%llx", hardcase->fingerprint) : ""};
  memcpy(made->values, values, sizeof values);
  return FLESH_OK;
}

/* Removes files that a run which ended well no longer needs; the command can make them again. */
static void shed(const char *out, const flesh_hardcases_run *run)
{
  static const char *const large[] = {"body.mesh", "start.txt", "frame_first.txt", "frame_early.txt", "out/state.txt"};
  for (size_t k = 0; k < sizeof large / sizeof *large; k++)
    flesh_path_unlink(flesh_path("%s/%s/%s", out, flesh_hardcases_run_folder(run), large[k]));
}

static json_t *do_case(const void *data, int number, const char *folder)
{
  (void)folder;
#define NAME(id, name, ...) name,
  static const char *const names[] = {FLESH_HARDCASES_OUTCOME_LIST(NAME)};
  const flesh_hardcases_plan *plan = data;
  const flesh_hardcases_run *run = &plan->runs[number];
  flesh_hardcases_figures figures;
  flesh_hardcases_run_one(plan, run, &figures);
  const flesh_hardcases_outcome outcome = flesh_hardcases_judge(run->hardcase, &figures);
  if (plan->lean && outcome <= (plan->filters ? FLESH_HARDCASES_UNCONVERGED : FLESH_HARDCASES_RECOVERED)) shed(plan->options.out, run);
  return flesh_fields_record(names[outcome], figures.exit_code, figures.message, flesh_fields_json(fields, &figures));
}

/* Returns facts for the SQL about a run of the plan, whether it is done or not. */
static json_t *facts_of(const void *data, int number)
{
  const flesh_hardcases_plan *plan = data;
  const flesh_hardcases_run *run = &plan->runs[number];
  const flesh_hardcases_case *hardcase = run->hardcase;
  const flesh_hardcases_setting *s = run->setting;
  flesh_hardcases_setting alike = *s; /* the same setting on the cases' own meshes */
  char title[112], sheet[112];
  alike.body = NULL;
  flesh_hardcases_setting_title(s, title);
  flesh_hardcases_setting_title(&alike, sheet);
  return json_pack(
      "{ss ss si ss ss sf sf ss ss ss sb sb sb ss sf so so si ss sf sf sb sb}", "case", hardcase->name, "group", hardcase->group,
      "seed", run->seed, "energy", flesh_energy_name(s->energy), "constants", flesh_constants_name(s->constants), "poisson",
      flesh_hardcases_poisson(run), "step", hardcase->step > 0 ? hardcase->step : s->step, "solver",
      flesh_hardcases_solver_name(s->solver), "element", flesh_element_name(s->element), "mesh", s->body ? s->body->name : "",
      "static", hardcase->is_static, "random", hardcase->random, "hardest", hardcase->expects == FLESH_HARDCASES_HARDEST,
      "title", title, "own_poisson", hardcase->poisson > 0 ? hardcase->poisson : 0.0, "folder",
      flesh_json_text(flesh_hardcases_run_folder(run)), "out", flesh_json_text(plan->options.out), "setting",
      (int)(s - plan->settings), "sheet", sheet, "setting_poisson", s->poisson, "setting_step", s->step, "held",
      hardcase->held == FLESH_HARDCASES_FACE, "first_of_own", s->first_poisson && !isnan(hardcase->poisson));
}

static int make_body(const void *data, int number, flesh_mesh **mesh, flesh_camera *camera)
{
  const flesh_hardcases_plan *plan = data;
  for (int d = 0; d < 3; d++) camera->target[d] = 0;
  return flesh_hardcases_run_mesh(plan, &plan->runs[number], mesh);
}

/* Computes the fingerprint: of everything beside the columns' values on which results depend. */
static void make_fingerprint(flesh_hardcases_plan *plan)
{
  char budget[FLESH_NUMBER_SIZE], *to = plan->fingerprint;
  const size_t size = sizeof plan->fingerprint;
  *to = 0;
  flesh_text_add(to, size, "flesh %s, %s s%s%s", flesh_version(), flesh_number_text(plan->max_seconds, budget),
                 plan->quick ? ", quick" : "", plan->filters ? ", filters" : plan->shapes ? ", shapes" : "");
  for (int k = 0; k < plan->options.overrides.texts.count; k++) flesh_text_add(to, size, ", %s", plan->options.overrides.texts.values[k]);
}

flesh_study flesh_hardcases_study(flesh_hardcases_plan *plan)
{
  make_fingerprint(plan);
  return (flesh_study){.name = "hardcases",
                       .fingerprint = plan->fingerprint,
                       .different = "its runs had another --quick, --filters, --shapes, --max-seconds or --set, or were made "
                                    "by another version of flesh; give them as they were, leave out --resume to begin anew",
                       .columns = columns,
                       .case_count = plan->run_count,
                       /* Time for two phases, and for judging the end. */
                       .max_seconds = plan->max_seconds > 0 ? 3 * plan->max_seconds + 20 : 0,
                       .budget = plan->max_seconds,
                       .facts = facts_of,
                       .results = {flesh_own_text("hardcases"),
                                   flesh_own_text(plan->filters    ? "profiles"
                                                                        : plan->ablation ? "ablation"
                                                                                         : "recovery"),
                                   plan->filters ? NULL : flesh_own_text("matrix"), flesh_own_text("hardcases_pictures")},
                       .again = "exit_code = 3", /* the case could not write its files */
                       .data = plan,
                       .make = make_case,
                       .fields = fields,
                       .body = plan->filters ? NULL : make_body,
                       .work = do_case};
}
