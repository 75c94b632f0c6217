/* command.c: `flesh sweep SPEC`: runs many cases from one spec into one database: a sweep as a study, the settings of
 * each of its cases, and running a case in a process of its own. */
#include "commands.h"

#include <stdio.h>
#include <stdlib.h>

#include "base/archive.h"
#include "base/confine.h"
#include "base/error.h"
#include "base/text.h"
#include "flesh/status.h"
#include "cli/interrupt.h"
#include "cli/options.h"
#include "cli/path.h"
#include "run/ranks.h"
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
  const flesh_sweep *sweep = data;
  char seed[16];
  *made = (flesh_study_case){.scene = sweep->scene};
  choose_values(sweep, number, made);
  flesh_overrides_copy(&made->overrides, &(flesh_texts){.count = sweep->set.count, .values = sweep->set.texts});
  for (int c = 0; c < sweep->column_count; c++)
    if (!strcmp(sweep->columns[c].key, "scene")) made->scene = made->values[c];
    else flesh_overrides_add(&made->overrides, sweep->columns[c].key, made->values[c]);
  snprintf(seed, sizeof seed, "%d", sweep->seed + made->repeat - 1);
  if (sweep->seed >= 0) flesh_overrides_add(&made->overrides, "output.seed", seed);
  return FLESH_OK;
}

/* Reads the scene as the case will. */
static int read_case(const flesh_sweep *sweep, int number, flesh_scene **scene)
{
  flesh_study_case c;
  make_case(sweep, number, &c);
  const int status = flesh_overrides_read(&c.overrides, c.scene, scene);
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
    flesh_scene *scene = NULL;
    const int status = read_case(sweep, number, &scene);
    flesh_scene_destroy(&scene);
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
  return flesh_fields_record(status == FLESH_ERR_MEMORY ? "failed" : "refused", flesh_exit_code(status), flesh_error_text(),
                             NULL);
}

static char *case_folder(const void *data, int number)
{
  const flesh_sweep *sweep = data;
  return sweep->keep ? flesh_text_new("%s/cases/%06d", sweep->out, number + 1) : NULL;
}

static json_t *run_case(const void *data, int number, const char *folder)
{
  const flesh_sweep *sweep = data;
  flesh_scene *scene = NULL;
  flesh_study_case c;
  flesh_outcome outcome;
  make_case(data, number, &c);
  const flesh_runner_options options = {.out = folder, .scene_path = c.scene, .max_seconds = sweep->max_seconds,
                                        .no_frames = !folder, .quiet = 1};
  const int status = sweep->keep && !folder ? flesh_no_memory() : flesh_overrides_read(&c.overrides, c.scene, &scene);
  json_t *record = status ? refused(status) : flesh_study_run_scene(scene, &options, &outcome);
  flesh_scene_destroy(&scene);
  flesh_study_case_free(&c);
  return record;
}

/* Returns the figures, without values, that the first scene that can be read will have in its result.json. */
static json_t *figures_of(const void *data)
{
  const flesh_sweep *sweep = data;
  json_t *figures = NULL;
  flesh_scene *scene = NULL;
  flesh_figures empty = {0};
  for (int number = 0; number < sweep->case_count && !scene && !flesh_interrupt_signal(); number++)
    read_case(sweep, number, &scene);
  if (scene && !flesh_figures_open(&empty, flesh_scene_system(scene), scene))
    figures = flesh_figures_json(&empty, flesh_scene_system(scene), scene);
  flesh_figures_close(&empty);
  flesh_scene_destroy(&scene);
  return figures;
}

flesh_study flesh_sweep_study(flesh_sweep *sweep)
{
  /* Seconds after the end of its budget by which a case must have ended; it stops by itself between two steps, and is
   * killed later. */
  static const double grace = 2;
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
                       .results = {flesh_own_text("sweep")},
                       .data = sweep,
                       .make = make_case,
                       .figures = figures_of,
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
      const int count = column->count, shown = count < 8 ? count : 4;
      printf("%s %s (%s), %d value%s:", c ? "  with" : "axis", column->name, column->key, count, count == 1 ? "" : "s");
      for (int k = 0; k < shown; k++) printf("%s %s", k ? "," : "", column->values[k]);
      if (shown < count) printf(", ..., %s", column->values[count - 1]);
      putchar('\n');
    }
  if (sweep->repeats > 1) printf("repeats: %d\n", sweep->repeats);
  if (sweep->max_seconds > 0) printf("budget of each case: %g s\n", sweep->max_seconds);
}

/* Runs the sweep on the first rank, or prints its plan. */
static int sweep_all(const flesh_study *study, const flesh_study_options *options)
{
  const flesh_sweep *sweep = study->data;
  int shard, shards, status = flesh_study_read_shard(options->shard, &shard, &shards);
  if (sweep->is_dry) {
    print_plan(sweep, shard, shards);
    return FLESH_OK;
  }
  if (!flesh_path_is_file(flesh_path("%s/%s.db", options->out, study->name))) status = try_cases(sweep, shard, shards);
  if (!status) status = flesh_folder_make(options->out);
  if (status) return status;
  flesh_folder_clear(options->out);
  return flesh_study_do(study, options);
}

/* Checks the columns. If no case can be built, that reason is reported rather than its consequences for the columns. */
static int check(const flesh_study *study, const flesh_sweep *sweep)
{
  const int status = flesh_study_store_check(study);
  char words[1024];
  snprintf(words, sizeof words, "%s", flesh_error_text());
  const int refused = status ? try_cases(sweep, 1, 1) : FLESH_OK;
  return !status || refused ? refused : flesh_fail(status, "%s", words);
}

/* Reads the spec, on every rank, and runs its cases; returns the exit code. */
static int read_and_sweep(const char *path, int is_dry, flesh_study_options *options)
{
  flesh_interrupt_watch();
  flesh_sweep sweep = {0};
  int shard, shards, status = flesh_study_read_shard(options->shard, &shard, &shards);
  if (!status) status = flesh_sweep_read(path, &sweep);
  sweep.out = options->out, sweep.is_dry = is_dry;
  const flesh_study study = flesh_sweep_study(&sweep);
  if (!status) status = check(&study, &sweep);
  if (!status) status = flesh_confine(options->out);
  const char *print = status ? "" : sweep.fingerprint;
  const int same = flesh_ranks_same(options->ranks, flesh_archive_sum(0, print, strlen(print)), "another sweep");
  const int code = flesh_study_lead(&study, options, status ? status : same, sweep_all);
  flesh_sweep_close(&sweep);
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
  flesh_study_options options = {.out = "out/sweep"};
  int is_dry = 0;
  const flesh_option rows[] = {
      FLESH_STUDY_OPTION_ROWS(&options, "sweep", "also with further values of axes and other derived columns"),
      FLESH_STUDY_OPTION_JOBS(&options),
      {"dry-run", NULL, FLESH_OPTION_SWITCH, &is_dry, "check the spec and print the plan"},
      {"quiet", NULL, FLESH_OPTION_SWITCH, &options.quiet, "print errors only"},
      {0}};
  char *text = flesh_settings_help(flesh_own_text("sweep_help"), flesh_sweep_keys, flesh_own_text("tables_help"));
  const flesh_usage usage = {"sweep", "SPEC", "Runs the cases of a spec into one database.", text, 1, 1, rows, verbs,
                             FLESH_EXITS_OF_INTERRUPTS};
  int count, code = flesh_study_open(&options, &usage, argc, argv, &count);
  if (code == FLESH_OPTIONS_GO_ON) code = read_and_sweep(argv[1], is_dry, &options);
  flesh_study_close(&options);
  free(text);
  return code;
}
