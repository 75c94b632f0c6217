/* command.c: `flesh sweep SPEC`: many cases from one spec into one database. */
#include "commands.h"

#include <stdio.h>
#include <stdlib.h>

#include "base/archive.h"
#include "base/confine.h"
#include "base/error.h"
#include "flesh/status.h"
#include "cli/interrupt.h"
#include "base/file.h"
#include "cli/options.h"
#include "cli/path.h"
#include "run/ranks.h"
#include "study/lead.h"
#include "sweep/sweep.h"
#include "study/embedded.h"

static void print_plan(const flesh_sweep *sweep, int shard, int shards)
{
  int cases = sweep->case_count >= shard ? (sweep->case_count - shard) / shards + 1 : 0;
  printf("%d case%s of flesh run", cases, cases == 1 ? "" : "s");
  if (shards > 1) printf(" in shard %d/%d of %d", shard, shards, sweep->case_count);
  printf("\nscene: %s\n", sweep->scene);
  for (int s = 0; s < sweep->set.count; s++) printf("  %s\n", sweep->set.texts[s]);
  for (int g = 0; g < sweep->group_count; g++)
    for (int c = 0; c < sweep->groups[g].columns; c++) {
      const flesh_sweep_column *column = &sweep->columns[sweep->groups[g].first + c];
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

/* Into the database that is open. */
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

/* On the first rank; the exit code. */
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
    status = flesh_sweep_case_try(&set->sweep, set->shard, set->shards);
  if (!status) status = flesh_folder_make(set->options.out);
  if (!status) {
    flesh_folder_clear(set->options.out);
    status = flesh_study_store_open(&set->study, &set->options, &store);
  }
  if (!status) status = sweep_into(set, &store);
  flesh_study_store_close(&store);
  return status ? flesh_command_fail("sweep", status) : 0;
}

/* Checks the columns. The reason why no case can be built comes before what its absence makes of them. */
static int check(const settings *set)
{
  const int status = flesh_study_store_check(&set->study);
  char words[1024];
  snprintf(words, sizeof words, "%s", flesh_error_text());
  const int refused = status ? flesh_sweep_case_try(&set->sweep, 1, 1) : FLESH_OK;
  return !status || refused ? refused : flesh_fail(status, "%s", words);
}

/* The spec, on every rank, and its cases; the exit code. */
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
