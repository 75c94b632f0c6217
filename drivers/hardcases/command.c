/* command.c: `flesh hardcases`: runs the battery of hard cases. */
#include "commands.h"

#include <fnmatch.h>
#include <sha256.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "cli/interrupt.h"
#include "cli/lists.h"
#include "base/text.h"
#include "study/study.h"
#include "study/settings.h"
#include "run/ranks.h"
#include "hardcases/hardcases.h"
#include "material/form.h"
#include "study/embedded.h"

enum { LIST_LIMIT = 64, SETTING_LIMIT = 16384, RUN_LIMIT = 1000000 };

/* The lists on the command line (mesh_list NULL: none was given), the number of values in each, and the values; the plan
 * borrows the bodies. */
typedef struct request {
  const char *energy_list, *poisson_list, *step_list, *solver_list, *element_list, *mesh_list, *case_list, *share;
  int energies, poissons, steps, solvers, elements, bodies;
  flesh_energy energy[LIST_LIMIT];
  flesh_constants constants[LIST_LIMIT];
  double poisson[LIST_LIMIT], step[LIST_LIMIT];
  flesh_hardcases_solver solver[FLESH_HARDCASES_SOLVER_LIMIT];
  flesh_element element[FLESH_ELEMENT_COUNT];
  flesh_hardcases_body body[LIST_LIMIT];
  char files[LIST_LIMIT][FLESH_LIST_ITEM];
} request;

/* Adds the cases whose name or group matches the pattern; after a `!`, removes them from the cases so far, or from all
 * if it comes first. */
static int take_case(void *data, const char *item)
{
  flesh_hardcases_plan *plan = data;
  const int leave = *item == '!';
  int found = 0;
  if (leave && plan->case_count == 0) take_case(data, "*");
  for (int k = 0; k < plan->battery.count; k++) {
    const flesh_hardcases_case *hardcase = &plan->battery.cases[k];
    if (fnmatch(item + leave, hardcase->name, 0) && fnmatch(item + leave, hardcase->group, 0)) continue;
    found = 1;
    int place = 0;
    while (place < plan->case_count && plan->cases[place] != hardcase) place++;
    if (!leave && place == plan->case_count) plan->cases[plan->case_count++] = hardcase;
    if (leave && place < plan->case_count)
      memmove(plan->cases + place, plan->cases + place + 1, (size_t)(--plan->case_count - place) * sizeof hardcase);
  }
  return found ? FLESH_OK
               : flesh_fail(
                     FLESH_ERR_ARGUMENT,
                     "--cases has '%s'; it must be a case, a group or a pattern such as 'twist*' or '!twist*': "
                     "`flesh hardcases --list` shows them",
                     item);
}

static int take_solver(void *data, const char *item)
{
  request *l = data;
  const int all = !strcmp(item, "all"), ablation = !strcmp(item, "ablation");
  for (int s = 0; s < FLESH_HARDCASES_SOLVER_LIMIT; s++) {
    const char *name = flesh_hardcases_solver_name((flesh_hardcases_solver)s);
    const int taken = all        ? s < FLESH_HARDCASES_CLAMPED_ALWAYS
                      : ablation ? s == FLESH_HARDCASES_DEFAULT || flesh_hardcases_left_out((flesh_hardcases_solver)s)
                                 : name && !strcmp(item, name);
    for (int k = 0; k < l->solvers && taken; k++)
      if ((int)l->solver[k] == s) return flesh_list_fail_twice("solvers", name);
    if (taken) l->solver[l->solvers++] = (flesh_hardcases_solver)s;
    if (taken && !all && !ablation) return FLESH_OK;
  }
  return all || ablation
             ? FLESH_OK
             : flesh_fail(FLESH_ERR_ARGUMENT,
                          "--solvers has '%s'; the solvers are default, kinsol-line-search, plain, always-projected, "
                          "never-projected, clamped, absolute, trust-region, or all of them: all; clamped-always, "
                          "absolute-always, trust-region-always; and without-TECHNIQUE, with the techniques of "
                          "`flesh schema solver`",
                          item);
}

/* Reads "8x4x2", the cells of a block, or a file, whose name is the word between folder and suffix. */
static int take_body(void *data, const char *item)
{
  request *l = data;
  if (l->bodies == LIST_LIMIT)
    return flesh_fail(FLESH_ERR_ARGUMENT, "--meshes has more than %d items", LIST_LIMIT);
  flesh_hardcases_body *b = &l->body[l->bodies];
  int end = 0;
  *b = (flesh_hardcases_body){0};
  if (sscanf(item, "%dx%dx%d%n", &b->cells[0], &b->cells[1], &b->cells[2], &end) == 3 && !item[end]) {
    for (int c = 0; c < 3; c++)
      if (b->cells[c] < 1 || b->cells[c] > 200)
        return flesh_fail(FLESH_ERR_ARGUMENT, "--meshes has '%s'; a block has 1 to 200 cells along each axis", item);
    snprintf(b->name, sizeof b->name, "%.63s", item);
  } else {
    const char *slash = strrchr(item, '/'), *name = slash ? slash + 1 : item;
    flesh_mesh *mesh = NULL;
    int status = flesh_mesh_read(item, &mesh);
    flesh_mesh_destroy(&mesh);
    if (status) return status;
    snprintf(b->name, sizeof b->name, "%.*s", (int)strcspn(name, "."), name);
    for (char *c = b->name; *c; c++)
      if (!strchr("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_", *c)) *c = '_';
    b->file = l->files[l->bodies];
    snprintf(l->files[l->bodies], sizeof *l->files, "%s", item);
  }
  for (int k = 0; k < l->bodies; k++)
    if (!strcmp(l->body[k].name, b->name))
      return flesh_fail(FLESH_ERR_ARGUMENT, "--meshes has two meshes called '%s'; names must differ",
                        b->name);
  l->bodies++;
  return FLESH_OK;
}

/* Reads all lists except the cases. FLESH_ERR_ARGUMENT with what would be valid. */
static int read_lists(request *l)
{
  enum { ROOM = LIST_LIMIT };
  int status = flesh_list_energies(l->energy_list, ROOM, l->energy, l->constants, &l->energies);
  if (!status)
    status = flesh_list_numbers("poisson", l->poisson_list, FLESH_LIST_POISSON, ROOM, l->poisson, &l->poissons);
  if (!status) status = flesh_list_numbers("steps", l->step_list, FLESH_LIST_POSITIVE, ROOM, l->step, &l->steps);
  if (!status) status = flesh_list_each("solvers", l->solver_list, take_solver, l);
  if (!status) status = flesh_list_elements(l->element_list, l->element, &l->elements);
  return status || !l->mesh_list ? status : flesh_list_each("meshes", l->mesh_list, take_body, l);
}

/* Checks that no case has a scale or an offset, which apply only to bodies of --meshes. */
static int check_bodies(const flesh_hardcases_plan *plan)
{
  for (int k = 0; k < plan->case_count; k++)
    if (plan->cases[k]->scale > 0 || plan->cases[k]->offset < 0 || plan->cases[k]->offset > 0)
      return flesh_fail(FLESH_ERR_ARGUMENT, "%s has a scale or an offset, which apply to bodies of --meshes; give --meshes, "
                                            "or leave the case out", plan->cases[k]->name);
  return FLESH_OK;
}

/* Combines every value of each list with every value of the others; the last of `digits` changes fastest. */
static int make_settings(const request *l, flesh_hardcases_plan *plan)
{
  enum { ELEMENT, SOLVER, ENERGY, STEP, POISSON, BODY, LISTS };
  const int lengths[LISTS] = {l->elements, l->solvers, l->energies, l->steps, l->poissons, l->bodies ? l->bodies : 1};
  double all = 1;
  for (int k = 0; k < LISTS; k++) all *= lengths[k];
  if (all > SETTING_LIMIT) return flesh_fail(FLESH_ERR_ARGUMENT, "the lists make more than %d settings", SETTING_LIMIT);
  plan->settings = flesh_arena_take(&plan->battery.arena, (size_t)all * sizeof *plan->settings);
  if (!plan->settings) return flesh_no_memory();
  for (; plan->setting_count < (int)all; plan->setting_count++) {
    int digits[LISTS], left = plan->setting_count;
    for (int k = LISTS - 1; k >= 0; left /= lengths[k--]) digits[k] = left % lengths[k];
    plan->settings[plan->setting_count] = (flesh_hardcases_setting){.energy = l->energy[digits[ENERGY]],
                                                                    .constants = l->constants[digits[ENERGY]],
                                                                    .poisson = l->poisson[digits[POISSON]],
                                                                    .step = l->step[digits[STEP]],
                                                                    .first_poisson = digits[POISSON] == 0,
                                                                    .first_step = digits[STEP] == 0,
                                                                    .solver = l->solver[digits[SOLVER]],
                                                                    .element = l->element[digits[ELEMENT]],
                                                                    .body = l->bodies ? &l->body[digits[BODY]] : NULL};
  }
  return FLESH_OK;
}

static int is_run(const flesh_hardcases_case *hardcase, const flesh_hardcases_setting *setting)
{
  return (isnan(hardcase->poisson) || setting->first_poisson) && (isnan(hardcase->step) || setting->first_step);
}

/* Returns whether the share includes the run's problem: its case, seed and setting without solver and element. Runs that are
 * compared are thus chosen together, and everyone can repeat the choice by SHA-256. */
static int is_shared(const flesh_hardcases_plan *plan, const flesh_hardcases_case *hardcase, const flesh_hardcases_setting *s,
                     int seed)
{
  char problem[512], digest[SHA256_DIGEST_STRING_LENGTH];
  snprintf(problem, sizeof problem, "%s %s %d %s %s %g %g", hardcase->name, s->body ? s->body->name : "", seed,
           flesh_energy_name(s->energy), flesh_constants_name(s->constants), s->poisson,
           hardcase->is_static ? 0 : s->step);
  SHA256Data((const uint8_t *)problem, strlen(problem), digest);
  digest[8] = 0;
  const double place = (double)strtoul(digest, NULL, 16) * 0x1p-32;
  return place >= plan->share[0] && place < plan->share[1];
}

static int make_runs(flesh_hardcases_plan *plan)
{
  const double most = (double)plan->setting_count * plan->case_count * plan->seeds;
  if (most > RUN_LIMIT)
    return flesh_fail(FLESH_ERR_ARGUMENT, "%d cases, %d settings and %d seeds may be %.0f runs; there may be at most %d",
                      plan->case_count, plan->setting_count, plan->seeds, most, RUN_LIMIT);
  plan->runs = calloc((size_t)plan->setting_count * (size_t)plan->case_count * (size_t)plan->seeds,
                      sizeof *plan->runs);
  if (!plan->runs) return flesh_no_memory();
  for (int s = 0; s < plan->setting_count; s++)
    for (int c = 0; c < plan->case_count; c++)
      for (int seed = 1; seed <= plan->seeds; seed++) {
        const flesh_hardcases_case *hardcase = plan->cases[c];
        if (!is_run(hardcase, &plan->settings[s]) || (seed > 1 && !hardcase->random) ||
            !is_shared(plan, hardcase, &plan->settings[s], seed))
          continue;
        plan->runs[plan->run_count++] = (flesh_hardcases_run){hardcase, &plan->settings[s], seed};
      }
  return FLESH_OK;
}

/* Runs the battery, or exports it, on the first rank. */
static int batter(const flesh_study *study, const flesh_study_options *options)
{
  const flesh_hardcases_plan *plan = study->data;
  if (plan->export) return flesh_hardcases_export(plan);
  printf("%d runs: %d cases, %d settings; %d at a time\n", plan->run_count, plan->case_count,
         plan->setting_count, flesh_pool_slots(options->ranks, options->jobs, plan->run_count));
  fflush(stdout);
  return flesh_study_do(study, options);
}

/* Returns "Neo,A,...": the forms that have a volume term. */
static const char *forms_with_lambda(char text[256])
{
  *text = 0;
  for (int e = 0; e < FLESH_ENERGY_COUNT; e++)
    if (flesh_forms[e].limit) flesh_text_add(text, 256, "%s%s", *text ? "," : "", flesh_forms[e].name);
  return text;
}

/* Chooses the lists that were not given, each from the first applicable row that has it. */
static void choose_lists(request *asked, const flesh_hardcases_plan *plan, char every[256])
{
  const struct {
    int applies;
    const char *energies, *poissons, *elements, *meshes, *solvers;
  } rows[] = {
      {plan->filters && plan->quick, NULL, "0.45", NULL, "4x2x2", NULL},
      {plan->filters, "S", "0.3,0.45,0.49,0.499,0.4999,0.49999", "tet4,tet10,tet10-mean", "8x4x2,16x8x8,32x16x16",
       "default,clamped,absolute,trust-region,always-projected,clamped-always,absolute-always,trust-region-always"},
      {plan->shapes, "S,E", "0.3,0.45,0.49,0.495", NULL, "8x4x4", NULL},
      {plan->ablation, "S", "0.45,0.49,0.4999", "tet4,tet10-mean", NULL, "ablation"},
      {plan->quick, "S,E", "0.45,0.49", NULL, NULL, NULL},
      {1, forms_with_lambda(every), "0,0.3,0.45,0.49,0.499,0.4999", "tet4", NULL, "default"}};
  for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
    if (!rows[k].applies) continue;
    if (!asked->energy_list) asked->energy_list = rows[k].energies;
    if (!asked->poisson_list) asked->poisson_list = rows[k].poissons;
    if (!asked->element_list) asked->element_list = rows[k].elements;
    if (!asked->mesh_list) asked->mesh_list = rows[k].meshes;
    if (!asked->solver_list) asked->solver_list = rows[k].solvers;
  }
}

/* Reads "LOW:HIGH". */
static int read_share(const char *text, double share[2])
{
  int end = 0;
  if (sscanf(text, "%lf:%lf%n", &share[0], &share[1], &end) == 2 && !text[end] && share[0] >= 0 && share[0] < share[1] &&
      share[1] <= 1)
    return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT, "--share is '%s'; it must be LOW:HIGH with 0 <= LOW < HIGH <= 1, as in 0:0.05", text);
}

/* Makes the plan from the request. */
static int choose(request *asked, flesh_hardcases_plan *plan)
{
  char every[256];
  if (plan->filters && (plan->shapes || plan->ablation))
    return flesh_fail(FLESH_ERR_ARGUMENT, "--filters is a study of its own; it cannot be run with %s",
                      plan->shapes ? "--shapes" : "--ablation");
  if (plan->ablation && asked->solver_list && !(strstr(asked->solver_list, "default") && strstr(asked->solver_list, "without-")))
    return flesh_fail(FLESH_ERR_ARGUMENT, "--solvers is '%s'; with --ablation it must have default and a without-TECHNIQUE",
                      asked->solver_list);
  plan->lean = plan->filters || plan->shapes || plan->ablation;
  choose_lists(asked, plan, every);
  if (plan->seeds < 1) plan->seeds = plan->filters && !plan->quick ? 5 : 1;
  if (!(plan->max_seconds > 0)) plan->max_seconds = plan->quick ? 15 : 30;
  int status = read_share(asked->share, plan->share);
  if (!status) status = read_lists(asked);
  if (!status) status = flesh_list_each("cases", asked->case_list, take_case, plan);
  if (!status && plan->case_count == 0)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "--cases '%s' leaves none; `flesh hardcases --list` shows them",
                        asked->case_list);
  if (!status && !asked->mesh_list) status = check_bodies(plan);
  return status ? status : make_settings(asked, plan);
}

/* Lists the cases of the file, NULL: those of the program for the plan's kind, or runs them. Returns the exit code. */
static int list_or_batter(const char *path, int list, request *asked, flesh_hardcases_plan *plan)
{
  flesh_hardcases_battery *battery = &plan->battery;
  const char *own = plan->filters ? "filters" : plan->shapes ? "shapes" : "battery";
  int status = flesh_hardcases_open_battery(path, own, battery);
  if (!status && !(plan->cases = flesh_arena_take(&battery->arena, sizeof *plan->cases * (size_t)battery->count)))
    status = flesh_no_memory();
  if (list && status) return flesh_command_fail("hardcases", status);
  for (int k = 0; list && k < battery->count && flesh_ranks_first(plan->options.ranks); k++)
    printf("%-10s %-20s %s\n", battery->cases[k].group, battery->cases[k].name, battery->cases[k].doc);
  if (list) return 0;
  if (!status) status = choose(asked, plan);
  flesh_interrupt_watch();
  if (!status) status = make_runs(plan);
  const flesh_study study = flesh_hardcases_study(plan);
  return flesh_study_lead(&study, &plan->options, status, batter);
}

int flesh_command_hardcases(int argc, char **argv)
{
  request *asked = calloc(1, sizeof *asked);
  if (!asked) return flesh_command_fail("hardcases", flesh_no_memory());
  asked->step_list = "1/60", asked->case_list = "*", asked->share = "0:1";
  flesh_hardcases_plan plan = {.options = {.out = "out/hardcases"}};
  int list = 0, count;
  const flesh_option rows[] = {
      {"energies", "LIST", FLESH_OPTION_TEXT, &asked->energy_list,
       "forms, NAME or NAME.CONSTANTS (default all that have a lambda; S,E with --quick)"},
      {"poisson", "LIST", FLESH_OPTION_TEXT, &asked->poisson_list,
       "Poisson's ratios (default 0,0.3,0.45,0.49,0.499,0.4999; 0.45,0.49 with --quick)"},
      {"steps", "LIST", FLESH_OPTION_TEXT, &asked->step_list,
       "steps of the cases without one of their own (default 1/60)"},
      {"cases", "LIST", FLESH_OPTION_TEXT, &asked->case_list,
       "cases, groups or patterns, without those after a ! (default: all)"},
      {"solvers", "LIST", FLESH_OPTION_TEXT, &asked->solver_list,
       "default, kinsol-line-search, plain, always-projected, never-projected, clamped, absolute,\n"
       "                         trust-region or all; without-TECHNIQUE, as without-watchdog (default: default)"},
      {"elements", "LIST", FLESH_OPTION_TEXT, &asked->element_list,
       "tet4, tet10 or tet10-mean; the latter two put nodes on the edges of the same meshes (default: tet4)"},
      {"seeds", "N", FLESH_OPTION_COUNT, &plan.seeds,
       "how often the random cases run, each with other numbers (default 1; 5 with --filters)"},
      {"share", "LOW:HIGH", FLESH_OPTION_TEXT, &asked->share,
       "only the runs whose hash is in this part of 0:1; of one case, seed, form, ratio, mesh and step all or none"},
      {"filters", NULL, FLESH_OPTION_SWITCH, &plan.filters,
       "compare eigenvalue filters by performance profiles"},
      {"shapes", NULL, FLESH_OPTION_SWITCH, &plan.shapes,
       "run the cases that suit bodies of any shape on those of --meshes (default 8x4x4)"},
      {"ablation", NULL, FLESH_OPTION_SWITCH, &plan.ablation,
       "compare the default solver with and without each technique; also with --shapes"},
      {"meshes", "LIST", FLESH_OPTION_TEXT, &asked->mesh_list,
       "cells of blocks, as in 8x4x2, or mesh files whose flat face of least x is held, not the cases' own"},
      {"quick", NULL, FLESH_OPTION_SWITCH, &plan.quick, "smaller meshes and fewer settings: minutes"},
      {"max-seconds", "S", FLESH_OPTION_POSITIVE, &plan.max_seconds,
       "budget of each phase of a run (default 30; 15 with --quick)"},
      FLESH_STUDY_OPTION_SET(&plan.options, "a value of all scenes, as in --set solver.max_newton=50"),
      FLESH_STUDY_OPTION_ROWS(&plan.options, "hardcases", "also with further cases and settings"),
      FLESH_STUDY_OPTION_JOBS(&plan.options),
      {"list", NULL, FLESH_OPTION_SWITCH, &list, "print the cases and end"},
      {"export", NULL, FLESH_OPTION_SWITCH, &plan.export, "write the static cases as data for other solvers and end"},
      {0}};
  char *text = flesh_settings_help(
      flesh_own_text("hardcases_help"), (flesh_settings_part[]){{"Keys of FILE", flesh_hardcases_keys, NULL}, {0}}, "");
  const flesh_usage usage = {"hardcases", "[FILE]", "Runs the battery of hard cases.", text, 0, 1, rows, NULL,
                             FLESH_EXITS_OF_INTERRUPTS};
  int code = flesh_study_open(&plan.options, &usage, argc, argv, &count);
  if (code == FLESH_OPTIONS_GO_ON) code = list_or_batter(count ? argv[1] : NULL, list, asked, &plan);
  flesh_study_close(&plan.options);
  flesh_hardcases_close_battery(&plan.battery);
  free(plan.runs), free(asked), free(text);
  return code;
}
