/* command.c: `flesh sweep SPEC`: runs many cases from one spec into one database: a sweep as a study, the settings of
 * each of its cases, and running a case in a process of its own. */
#include "commands.h"

#include <stdio.h>
#include <stdlib.h>

#include "base/archive.h"
#include "base/confine.h"
#include "base/error.h"
#include "base/text.h"
#include "cli/json_memory.h"
#include "flesh/status.h"
#include "cli/interrupt.h"
#include "cli/options.h"
#include "cli/path.h"
#include "run/provenance.h"
#include "run/ranks.h"
#include "run/runner.h"
#include "study/study.h"
#include "sweep/sweep.h"
#include "study/embedded.h"

static void choose_values(const flesh_sweep *sweep, long number, flesh_study_case *made)
{
  long left = number;
  made->repeat = (int)(left % sweep->repeats) + 1;
  left /= sweep->repeats;
  for (int g = sweep->group_count - 1; g >= 0; g--) {
    const flesh_sweep_group *group = &sweep->groups[g];
    for (int c = group->first; c < group->first + group->columns; c++) {
      made->values[c] = sweep->columns[c].values[left % group->count];
      made->nodes[c] = sweep->columns[c].nodes[left % group->count];
    }
    left /= group->count;
  }
}

static int make_case(const void *data, int number, flesh_study_case *made)
{
  const flesh_sweep *sweep = ((const flesh_sweep_work *)data)->sweep;
  char seed[16];
  *made = (flesh_study_case){.scene = sweep->scene};
  choose_values(sweep, number, made);
  flesh_overrides_copy(&made->overrides, &(flesh_texts){.count = sweep->set.count, .values = sweep->set.texts});
  for (int c = 0; c < sweep->column_count; c++)
    if (!strcmp(sweep->columns[c].key, "scene")) made->scene = made->values[c];
    else flesh_overrides_add(&made->overrides, sweep->columns[c].key, made->values[c]);
  snprintf(seed, sizeof seed, "%d", sweep->seed + made->repeat - 1);
  if (sweep->seed >= 0) flesh_overrides_add(&made->overrides, "output.seed", seed);
  if (!made->overrides.failed) return FLESH_OK;
  flesh_study_case_free(made);
  return flesh_no_memory();
}

/* Reads the scene as the case will. */
static int build(const flesh_sweep *sweep, int number)
{
  const flesh_sweep_work given = {sweep, NULL};
  flesh_study_case c;
  flesh_scene *scene = NULL;
  int status = make_case(&given, number, &c);
  if (status) return status;
  status = flesh_overrides_read(&c.overrides, c.scene, &scene);
  flesh_scene_destroy(&scene);
  flesh_study_case_free(&c);
  return status;
}

/* Fails with the sentence of the first case if no case of the shard can be built; tries the cases in order, before
 * anything is written. Returns FLESH_OK if that is not found out (memory, a signal). */
static int try_cases(const flesh_sweep *sweep, int shard, int shards)
{
  char first[900] = "";
  int cases = 0, refused = FLESH_OK;
  for (int number = shard - 1; number < sweep->case_count; number += shards, cases++) {
    int status = build(sweep, number);
    if (!status || status == FLESH_ERR_MEMORY || flesh_interrupt_signal()) return FLESH_OK;
    if (refused) continue;
    refused = status;
    snprintf(first, sizeof first, "%s", flesh_error_text());
  }
  if (!refused) return FLESH_OK;
  return cases == 1 ? flesh_fail(refused, "its only case is refused: %s", first)
                    : flesh_fail(refused, "all %d cases are refused; the first: %s", cases, first);
}

static json_t *refused(int status)
{
  return json_pack("{sssisosn}", "status", status == FLESH_ERR_MEMORY ? "failed" : "refused", "exit_code",
                   flesh_exit_code(status), "message", flesh_json_text(flesh_error_text()), "result");
}

static json_t *run_scene(const flesh_sweep *sweep, const flesh_study_case *c, const char *folder)
{
  flesh_scene *scene = NULL;
  flesh_figures figures = {0};
  flesh_outcome outcome = {0};
  int status = flesh_overrides_read(&c->overrides, c->scene, &scene);
  if (status) return refused(status);
  const flesh_runner_options options = {.out = folder, .scene_path = c->scene, .max_seconds = sweep->max_seconds,
                                        .no_frames = !folder, .quiet = 1};
  flesh_runner_run(scene, &options, &figures, &outcome);
  json_t *result = flesh_outcome_json(&outcome);
  json_object_set_new(result, "figures", flesh_figures_json(&figures, flesh_scene_system(scene), scene));
  json_object_set_new(result, "materials", flesh_materials_json(scene));
  json_object_set_new(result, "inputs", flesh_provenance_scene(scene, c->scene));
  json_t *record = json_pack("{sssisO}", "status", flesh_outcome_word(&outcome), "exit_code", outcome.exit_code,
                             "message", json_object_get(result, "message"));
  json_object_set_new(record, "result", result);
  flesh_figures_close(&figures);
  flesh_scene_destroy(&scene);
  return record;
}

static char *case_folder(const void *data, int number)
{
  const flesh_sweep_work *given = data;
  return given->sweep->keep ? flesh_text_new("%s/cases/%06d", given->out, number + 1) : NULL;
}

static json_t *run_case(const void *data, int number, const char *folder)
{
  const flesh_sweep *sweep = ((const flesh_sweep_work *)data)->sweep;
  flesh_study_case c;
  int status = sweep->keep && !folder ? flesh_no_memory() : make_case(data, number, &c);
  if (status) return refused(status);
  json_t *record = run_scene(sweep, &c, folder);
  flesh_study_case_free(&c);
  return record;
}

/* Returns the names of the figures in result.json, and of the energies and probes of the first scene that can be read,
 * as "name", "energies.name" and probes."name".max. */
static json_t *figure_names(const void *data)
{
  const flesh_sweep *sweep = ((const flesh_sweep_work *)data)->sweep;
  json_t *names = json_array(), *figures = NULL, *value;
  flesh_scene *scene = NULL;
  flesh_figures empty = {0};
  const char *key, *inner;
  for (int number = 0; number < sweep->case_count && !scene; number++) {
    flesh_study_case c;
    if (make_case(data, number, &c) || flesh_interrupt_signal()) return names;
    flesh_overrides_read(&c.overrides, c.scene, &scene);
    flesh_study_case_free(&c);
  }
  if (scene && !flesh_figures_open(&empty, flesh_scene_system(scene), scene))
    figures = flesh_figures_json(&empty, flesh_scene_system(scene), scene);
  json_object_foreach(figures, key, value) {
    json_t *below;
    const char *const of_probe[] = {"final", "min", "max"};
    if (!json_is_object(value)) json_array_append_new(names, json_string(key));
    else if (!strcmp(key, "energies"))
      json_object_foreach(value, inner, below) json_array_append_new(names, json_sprintf("energies.%s", inner));
    else
      json_object_foreach(value, inner, below)
        for (int k = 0; k < 3; k++) json_array_append_new(names, json_sprintf("probes.\"%s\".%s", inner, of_probe[k]));
  }
  json_decref(figures);
  flesh_figures_close(&empty);
  flesh_scene_destroy(&scene);
  return names;
}

flesh_study flesh_sweep_study(const flesh_sweep_work *given)
{
  /* Seconds after the end of its budget by which a case must have ended; it stops by itself between two steps, and is
   * killed later. */
  static const double grace = 2;
  const flesh_sweep *sweep = given->sweep;
  return (flesh_study){.name = "sweep",
                       .text = sweep->text,
                       .path = sweep->path,
                       .fingerprint = sweep->fingerprint,
                       .different = sweep->keep
                                        ? "the spec or the scene it names has changed since, and cases that keep folders "
                                          "cannot get further values; undo the change"
                                        : "the spec or the scene it names has changed since, in more than the values of "
                                          "axes and derived columns; undo the change",
                       .columns = sweep->columns,
                       .repeats = sweep->repeats,
                       .derived_count = sweep->derived.count,
                       .derived = sweep->derived.values,
                       .case_count = sweep->case_count,
                       .max_seconds = sweep->max_seconds > 0 ? sweep->max_seconds + grace : 0,
                       .budget = sweep->max_seconds,
                       .asks = 1,
                       .data = given,
                       .make = make_case,
                       .figures = figure_names,
                       .work = run_case,
                       .folder = case_folder};
}

static void print_plan(const flesh_sweep *sweep, int shard, int shards)
{
  int cases = sweep->case_count >= shard ? (sweep->case_count - shard) / shards + 1 : 0;
  printf("%d case%s of flesh run", cases, cases == 1 ? "" : "s");
  if (shards > 1) printf(" in shard %d/%d of %d", shard, shards, sweep->case_count);
  printf("\nscene: %s\n", sweep->scene);
  for (int s = 0; s < sweep->set.count; s++) printf("  %s\n", sweep->set.texts[s]);
  for (int g = 0; g < sweep->group_count; g++)
    for (int c = 0; c < sweep->groups[g].columns; c++) {
      const flesh_study_column *column = &sweep->columns[sweep->groups[g].first + c];
      int count = sweep->groups[g].count, shown = count < 8 ? count : 4;
      printf("%s %s (%s), %d value%s:", c ? "  with" : "axis", column->name, column->key, count, count == 1 ? "" : "s");
      for (int k = 0; k < shown; k++) printf("%s %s", k ? "," : "", column->values[k]);
      if (shown < count) printf(", ..., %s", column->values[count - 1]);
      putchar('\n');
    }
  if (sweep->repeats > 1) printf("repeats: %d\n", sweep->repeats);
  if (sweep->max_seconds > 0) printf("budget of each case: %g s\n", sweep->max_seconds);
}

static void report(flesh_study_store *store)
{
  sqlite3_stmt *query;
  const int cases = flesh_study_store_count(store, NULL);
  printf("%d case%s:", cases, cases == 1 ? "" : "s");
  if (!sqlite3_prepare_v2(store->database, "SELECT status, count(*) FROM temp.wanted JOIN cases USING (id) "
                                           "GROUP BY status ORDER BY 2 DESC", -1, &query, NULL))
    for (int k = 0; sqlite3_step(query) == SQLITE_ROW; k++)
      printf("%s %d %s", k ? "," : "", sqlite3_column_int(query, 1), sqlite3_column_text(query, 0));
  sqlite3_finalize(query);
  printf("\nresults: %s\n", store->path);
}

typedef struct settings {
  int shard, shards;
  int dry;
  flesh_study_options options;
  flesh_sweep sweep;
  flesh_study study;
} settings;

/* Runs the sweep with an open database. */
static int sweep_into(settings *set, flesh_study_store *store)
{
  int status = flesh_study_run(&set->study, store, &set->options);
  char words[1024];
  snprintf(words, sizeof words, "%s", flesh_error_text());
  int viewed = flesh_study_store_make_views(store);
  if (status) flesh_fail(status, "%s", words);
  else status = viewed;
  if (!set->options.quiet) report(store);
  return status ? status : flesh_study_store_judge(store, "status = 'refused'", 1, "are refused");
}

/* Runs the sweep on the first rank; returns the exit code. */
static int sweep_all(void *data)
{
  settings *set = data;
  flesh_study_store store = {.lock = -1};
  int status = FLESH_OK;
  if (set->dry) {
    print_plan(&set->sweep, set->shard, set->shards);
    return 0;
  }
  if (!flesh_path_is_file(flesh_path("%s/%s.db", set->options.out, set->study.name)))
    status = try_cases(&set->sweep, set->shard, set->shards);
  if (!status) status = flesh_folder_make(set->options.out);
  if (!status) {
    flesh_folder_clear(set->options.out);
    status = flesh_study_store_open(&set->study, &set->options, &store);
  }
  if (!status) status = sweep_into(set, &store);
  flesh_study_store_close(&store);
  return status ? flesh_command_fail("sweep", status) : 0;
}

/* Checks the columns. If no case can be built, that reason is reported rather than its consequences for the columns. */
static int check(const settings *set)
{
  const int status = flesh_study_store_check(&set->study);
  char words[1024];
  snprintf(words, sizeof words, "%s", flesh_error_text());
  const int refused = status ? try_cases(&set->sweep, 1, 1) : FLESH_OK;
  return !status || refused ? refused : flesh_fail(status, "%s", words);
}

/* Reads the spec, on every rank, and runs its cases; returns the exit code. */
static int read_and_sweep(const char *path, settings *set)
{
  flesh_interrupt_watch();
  const flesh_sweep_work given = {&set->sweep, set->options.out};
  int status = flesh_study_read_shard(set->options.shard, &set->shard, &set->shards);
  if (!status) status = flesh_sweep_read(path, &set->sweep);
  set->study = flesh_sweep_study(&given);
  if (!status) status = check(set);
  if (!status) status = flesh_confine(set->options.out);
  const char *print = status ? "" : set->sweep.fingerprint;
  const int same = flesh_ranks_same(set->options.ranks, flesh_archive_sum(0, print, strlen(print)), "another sweep");
  if (!status) status = same;
  set->options.jobs = flesh_pool_jobs(set->options.ranks, set->options.jobs);
  const flesh_study_work work = {&set->study, NULL};
  const flesh_pool_cases cases = flesh_study_pool_cases(&work);
  const int code = flesh_pool_lead(set->options.ranks, "sweep", status, set->options.jobs, &cases, sweep_all, set);
  flesh_sweep_close(&set->sweep);
  return code;
}

int flesh_command_sweep(int argc, char **argv)
{
  static const flesh_subcommand verbs[] = {{"export", "write the results as a table", flesh_sweep_export},
                                           {"plot", "draw any figure against any axis", flesh_sweep_plot},
                                           {"merge", "join shards", flesh_sweep_merge},
                                           {0}};
  for (const flesh_subcommand *verb = verbs; argc > 1 && verb->name; verb++)
    if (!strcmp(argv[1], verb->name)) return verb->run(argc - 1, argv + 1);
  settings set = {.options = {.out = "out/sweep"}};
  const flesh_option rows[] = {
      FLESH_STUDY_OPTION_ROWS(&set.options, "sweep", "also with further values of axes and other derived columns"),
      FLESH_STUDY_OPTION_JOBS(&set.options),
      {"dry-run", NULL, FLESH_OPTION_SWITCH, &set.dry, "check the spec and print the plan"},
      {"quiet", NULL, FLESH_OPTION_SWITCH, &set.options.quiet, "print errors only"},
      {0}};
  char *text = flesh_settings_help(flesh_own_text("sweep_help"), flesh_sweep_describe_keys, flesh_own_text("tables_help"));
  const flesh_usage usage = {"sweep", "SPEC", "Runs the cases of a spec into one database.", text, 1, 1, rows, verbs,
                             FLESH_EXITS_OF_INTERRUPTS};
  int count, code = flesh_study_open(&set.options, &usage, argc, argv, &count);
  if (code == FLESH_OPTIONS_GO_ON) code = read_and_sweep(argv[1], &set);
  flesh_study_close(&set.options);
  free(text);
  return code;
}
