/* command.c: `flesh report`: writes results as one HTML file that opens offline. */
#include "commands.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include "base/confine.h"
#include "base/error.h"
#include "report/report.h"
#include "cli/json_memory.h"
#include "cli/options.h"
#include "cli/output.h"
#include "run/provenance.h"
#include "study/embedded.h"

/* Size in bytes up to which a report can be sent by mail. */
static const double LARGE = 20e6;

/* A kind of results, recognised by a file in the folder. */
typedef struct kind {
  const char *file, *title, *sql; /* SQL of a study; NULL for a sweep, and for a run, which has no title either */
} kind;
static const kind kinds[] = {{"drift.csv", "How the energies keep the volume", "report_drift"},
                             {"accuracy.json", "What accuracy costs", "report_accuracy"},
                             {"hardcases.csv", "Hard cases", "report_hardcases"},
                             {"bench.json", "What kernels and steps take", "report_bench"},
                             {"fit.db", "Fit", "report_fit"},
                             {"sweep.db", "Sweep", NULL},
                             {"scene.yaml", NULL, NULL}};

static int find_kind(const char *path, const kind **found)
{
  enum { COUNT = sizeof kinds / sizeof *kinds };
  static const kind database = {"", "Sweep", NULL};
  struct stat info;
  if (flesh_path_stat(path, &info))
    return flesh_fail(FLESH_ERR_FILE, "%s: there is no such folder", *path ? path : "''");
  if (!S_ISDIR(info.st_mode)) {
    *found = &database;
    if (flesh_report_is_database(path)) return FLESH_OK;
    return flesh_fail(FLESH_ERR_FILE,
                      "%s: this is a file; a report takes the folder of a result, or the database (.db) of a sweep",
                      path);
  }
  const int status = flesh_confine(path);
  if (status) return status;
  for (*found = kinds; *found < kinds + COUNT; ++*found)
    if (flesh_report_has(path, (*found)->file)) return FLESH_OK;
  return flesh_fail(
      FLESH_ERR_FILE,
      "%s: this is no folder of a result: it has none of scene.yaml, drift.csv, accuracy.json, "
      "hardcases.csv, bench.json, fit.db and sweep.db",
      path);
}

/* Adds all runs as one part that compares them, and every other result as a part of its own, in the order given. */
static int gather(flesh_report *report, int count, char **paths)
{
  char **runs = flesh_arena_take(&report->arena, (size_t)count * sizeof *runs);
  const kind **found = flesh_arena_take(&report->arena, (size_t)count * sizeof *found);
  int run_count = 0, status = runs && found ? FLESH_OK : flesh_report_no_memory();
  for (int k = 0; k < count && !status; k++) {
    status = find_kind(paths[k], &found[k]);
    if (!status && !found[k]->title) runs[run_count++] = paths[k];
  }
  if (!status && run_count) status = flesh_report_add_runs(report, run_count, runs);
  for (int k = 0; k < count && !status; k++)
    if (found[k]->sql) status = flesh_report_add_study(report, found[k]->title, found[k]->sql, paths[k]);
    else if (found[k]->title) status = flesh_report_add_sweep(report, paths[k]);
  return status;
}

static int make(flesh_report *report, int count, char **paths, const char *title, const char *out,
                json_t *program)
{
  size_t size, packed;
  int status = gather(report, count, paths);
  if (!status) status = flesh_report_make_view(report);
  if (status) return status;
  json_t *shown = flesh_json_text(title), *head = json_pack("{sOsO}", "title", shown, "program", program);
  status = head ? flesh_report_write(report, json_string_value(shown), head, out, &size, &packed)
                : flesh_report_no_memory();
  json_decref(shown);
  json_decref(head);
  if (status) return status;
  printf("report: %s, %.2f MB, of which %.2f MB are data", out, size / 1e6, packed / 1e6);
  size_t frames = 0, k;
  const json_t *run;
  json_array_foreach(json_object_get(report->view, "runs"), k, run) frames +=
      json_array_size(json_object_get(run, "times"));
  if (frames)
    printf(": %zu frame%s of %d run%s", frames, frames == 1 ? "" : "s", report->shown_count,
           report->shown_count == 1 ? "" : "s");
  putchar('\n');
  if (size > LARGE)
    fprintf(stderr,
            "flesh report: %s has more than %.0f MB; --frames N takes fewer frames of each run\n",
            out, LARGE / 1e6);
  return FLESH_OK;
}

int flesh_command_report(int argc, char **argv)
{
  const char *out = NULL, *title = NULL;
  flesh_report report = {0};
  const flesh_option options[] = {
      {"out", "FILE", FLESH_OPTION_TEXT, &out, "report to write, its name ends in .html"},
      {"title", "TEXT", FLESH_OPTION_TEXT, &title, "title of the report (default: flesh report and the first RESULT)"},
      {"frames", "N", FLESH_OPTION_COUNT, &report.most_frames,
       "frames of each run at most, evenly taken, the first and the last among them (default: all)"},
      {.name = NULL}};
  const flesh_usage usage = {"report", "RESULT... --out FILE", "Writes results as one HTML file that opens offline in a browser.",
                             flesh_own_text("report_help"), 1, INT_MAX, options, NULL, 0};
  json_t *program = flesh_provenance_program(argc, argv);
  int count, code = flesh_options_read(&usage, argc, argv, &count);
  if (code == FLESH_OPTIONS_GO_ON &&
      (!out || strlen(out) < 6 || strcmp(out + strlen(out) - 5, ".html")))
    code = flesh_option_refuse(usage.command, "out", out, "a file whose name ends in .html");
  if (code != FLESH_OPTIONS_GO_ON) {
    json_decref(program);
    return code;
  }
  char words[300];
  snprintf(words, sizeof words, "flesh report: %.250s%s", argv[1], count > 1 ? " and more" : "");
  report.parts = json_array();
  int status = flesh_report_bytes_open(&report.numbers);
  if (!status) status = flesh_report_bytes_open(&report.still);
  if (!status) status = flesh_output_prepare_from(out, count, argv + 1, NULL);
  if (!status) status = make(&report, count, argv + 1, title ? title : words, out, program);
  if (!status && flesh_json_lacks())
    status = flesh_report_no_memory();
  free(report.shown);
  flesh_arena_free(&report.arena);
  flesh_report_bytes_close(&report.numbers);
  flesh_report_bytes_close(&report.still);
  json_decref(report.parts);
  json_decref(report.view);
  json_decref(program);
  return status ? flesh_command_fail(usage.command, status) : 0;
}
