/* command.c: `flesh sweep SPEC`: many cases from one spec into one database. */
#include "sweep/command.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "base/error.h"
#include "flesh/status.h"
#include "shared/interrupt.h"
#include "base/file.h"
#include "shared/options.h"
#include "sweep/sweep.h"

static const char details[] =
    "Runs a scene repeatedly as SPEC, in YAML, says, each case in a process of its own, and writes a row for\n"
    "each into DIR/sweep.db (SQLite, WAL). A case that fails, crashes or hangs is a row that says so. Killed at any\n"
    "moment, the same command with --resume goes on: what is finished stays, what was in flight begins again. Several\n"
    "processes may share one database on one machine; of several machines each makes a shard, to be joined by "
    "merge:\n\n"
    "  flesh sweep export DB [--format csv|jsonl]     the results as a table\n"
    "  flesh sweep plot DB --x COLUMN --y COLUMN      any figure against any axis, also as a heat map\n"
    "  flesh sweep merge OUT.db IN.db...              joins shards\n\n"
    "  scene: scene.yaml\n"
    "  set: {time.end: 1}\n"
    "  axes:\n"
    "    - {key: body.material.energy, values: [B, S]}\n"
    "    - {key: body.material.young, from: 1e4, to: 1e6, count: 5, spacing: logarithmic}\n"
    "    - sample: {count: 64, axes: [{key: body.material.poisson, from: 0.3, to: 0.49}]}\n"
    "  columns: [{name: work, is: newton * tets}]\n\n";

/* The keys and tables as text for the help; new. */
static char *make_details(void)
{
  char *text = NULL;
  size_t size;
  FILE *stream = open_memstream(&text, &size);
  if (!stream) return NULL;
  fputs(details, stream);
  flesh_sweep_describe_keys(stream);
  fprintf(stream, "\n%s", flesh_sweep_schema_text);
  fclose(stream);
  return text;
}

/* "2/8": counted from 1. */
static int read_shard(const char *text, int *shard, int *shards)
{
  char end;
  if (!text) return FLESH_OK;
  if (sscanf(text, "%d/%d%c", shard, shards, &end) == 2 && *shard >= 1 && *shard <= *shards) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT, "--shard is '%s'; it must be i/n with i from 1 to n, as in 2/8", text);
}

static void print_plan(const flesh_sweep *sweep, int shard, int shards)
{
  int cases = sweep->case_count >= shard ? (sweep->case_count - shard) / shards + 1 : 0;
  printf("%d cases of flesh %s", cases, flesh_sweep_commands[sweep->command]);
  if (shards > 1) printf(" in shard %d/%d of %d", shard, shards, sweep->case_count);
  printf("\nscene: %s\n", sweep->scene ? sweep->scene : "those of the battery");
  for (int s = 0; s < sweep->set_count; s++) printf("  %s\n", sweep->set[s]);
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

static void report(flesh_sweep_store *store)
{
  sqlite3_stmt *query;
  printf("%d cases:", flesh_sweep_store_count(store, NULL));
  if (!sqlite3_prepare_v2(store->database, "SELECT status, count(*) FROM cases GROUP BY status ORDER BY 2 DESC", -1,
                          &query, NULL))
    for (int k = 0; sqlite3_step(query) == SQLITE_ROW; k++)
      printf("%s %d %s", k ? "," : "", sqlite3_column_int(query, 1), sqlite3_column_text(query, 0));
  sqlite3_finalize(query);
  printf("\nresults: %s\n", store->path);
}

typedef struct settings {
  const char *out, *shard;
  int jobs, resume, dry, quiet, argc;
  char **argv;
} settings;

static int sweep_all(const char *path, const settings *set)
{
  flesh_sweep sweep;
  flesh_sweep_store store = {.lock = -1};
  int shard = 1, shards = 1, status = read_shard(set->shard, &shard, &shards);
  if (status) return status;
  status = flesh_sweep_read(path, &sweep);
  if (!status) status = flesh_sweep_store_check(&sweep);
  if (!status && set->dry) print_plan(&sweep, shard, shards);
  if (!status && !set->dry) {
    char *database = malloc(strlen(set->out) + 16);
    if (database) sprintf(database, "%s/sweep.db", set->out);
    if (database && access(database, F_OK)) status = flesh_sweep_case_try(&sweep, shard, shards);
    if (!status) status = database ? flesh_folder_make(set->out) : flesh_fail(FLESH_ERR_MEMORY, "out of memory");
    if (!status) {
      flesh_folder_clear(set->out);
      status = flesh_sweep_store_open(database, &sweep, shard, shards, set->resume, set->argc, set->argv, &store);
    }
    free(database);
    if (!status) {
      const flesh_sweep_run_options options = {.jobs = set->jobs, .quiet = set->quiet, .out = set->out};
      status = flesh_sweep_run(&sweep, &store, &options);
      char words[1024];
      snprintf(words, sizeof words, "%s", flesh_error_text());
      int viewed = flesh_sweep_store_make_views(&store);
      if (status) flesh_fail(status, "%s", words);
      else status = viewed;
      if (!set->quiet) report(&store);
      if (!status) status = flesh_sweep_store_judge(&store);
    }
    flesh_sweep_store_close(&store);
  }
  flesh_sweep_close(&sweep);
  return status;
}

int flesh_command_sweep(int argc, char **argv)
{
  static const struct {
    const char *name;
    int (*run)(int argc, char **argv);
  } verbs[] = {{"export", flesh_sweep_export}, {"plot", flesh_sweep_plot}, {"merge", flesh_sweep_merge}};
  for (size_t v = 0; argc > 1 && v < sizeof verbs / sizeof *verbs; v++)
    if (!strcmp(argv[1], verbs[v].name)) return verbs[v].run(argc - 1, argv + 1);
  long processors = sysconf(_SC_NPROCESSORS_ONLN);
  settings set = {.out = NULL, .jobs = processors > 1 ? (int)processors : 1};
  char **words = malloc(sizeof *words * (size_t)(argc + 1)); /* argv is permuted below */
  if (!words) return flesh_command_fail("sweep", flesh_fail(FLESH_ERR_MEMORY, "out of memory"));
  for (int a = 0; a < argc; a++) words[a] = argv[a];
  set.argc = argc;
  set.argv = words;
  const flesh_option rows[] = {
      {"out", "DIR", FLESH_OPTION_TEXT, &set.out, "folder of the results (default out/sweep)"},
      {"jobs", "N", FLESH_OPTION_COUNT, &set.jobs, "cases at a time (default: the processors)"},
      {"resume", NULL, FLESH_OPTION_SWITCH, &set.resume, "go on with DIR/sweep.db, or begin when there is none"},
      {"shard", "I/N", FLESH_OPTION_TEXT, &set.shard, "only every N-th case from the I-th on, counted from 1"},
      {"dry-run", NULL, FLESH_OPTION_SWITCH, &set.dry, "check the spec and print the plan"},
      {"quiet", NULL, FLESH_OPTION_SWITCH, &set.quiet, "print errors only"},
      {0}};
  char *text = make_details();
  const flesh_usage usage = {"sweep", "SPEC", "Runs the cases of a spec into one database.", text, 1, 1, rows};
  int count, code = flesh_options_read(&usage, argc, argv, &count);
  if (code == FLESH_OPTIONS_GO_ON) {
    if (!set.out) set.out = "out/sweep";
    flesh_interrupt_watch();
    int status = sweep_all(argv[1], &set);
    code = status ? flesh_command_fail("sweep", status) : 0;
    if (status == FLESH_ERR_INTERRUPTED) code = flesh_interrupt_exit_code();
  }
  free(text);
  free(words);
  return code;
}
