/* command.c: `flesh report`: writes results as one HTML file that opens offline: the parts about runs (verdict, figures,
 * histories, probes, scenes and provenance), made by data/studies/report_runs.sql, and about the database of a sweep, by
 * report_sweep.sql; the page with its payload: JSON and numbers, deflated (RFC 1950) and in base 64 (RFC 4648). */
#include "commands.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "base/confine.h"
#include "base/error.h"
#include "base/file.h"
#include "cli/json_memory.h"
#include "cli/options.h"
#include "cli/output.h"
#include "report/report.h"
#include "run/provenance.h"
#include "run/run_folder.h"
#include "study/database.h"
#include "study/embedded.h"
#include "study/study.h"

static int open_bytes(flesh_report_bytes *bytes)
{
  bytes->stream = open_memstream(&bytes->data, &bytes->size);
  return bytes->stream ? FLESH_OK : flesh_report_no_memory();
}

/* Closes bytes, which may be zeroed. */
static void close_bytes(flesh_report_bytes *bytes)
{
  if (bytes->stream) fclose(bytes->stream);
  free(bytes->data);
  *bytes = (flesh_report_bytes){0};
}

/* ---- the page ---- */

/* Prints text escaped for HTML. */
static void print_escaped(FILE *stream, const char *text)
{
  for (; *text; text++)
    if (*text == '&') fputs("&amp;", stream);
    else if (*text == '<') fputs("&lt;", stream);
    else if (*text == '>') fputs("&gt;", stream);
    else putc(*text, stream);
}

static void print_base64(FILE *stream, const char *bytes, size_t size)
{
  static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const unsigned char *data = (const unsigned char *)bytes;
  for (size_t k = 0; k < size; k += 3) {
    const size_t left = size - k;
    const unsigned bits = (unsigned)data[k] << 16 | (left > 1 ? (unsigned)data[k + 1] << 8 : 0) |
                          (left > 2 ? (unsigned)data[k + 2] : 0);
    putc(letters[bits >> 18], stream);
    putc(letters[bits >> 12 & 63], stream);
    putc(left > 1 ? letters[bits >> 6 & 63] : '=', stream);
    putc(left > 2 ? letters[bits & 63] : '=', stream);
  }
}

/* Prints the first sentence of each part's verdict, which can be read without scripts. */
static void print_lead(FILE *stream, const json_t *parts)
{
  const json_t *part;
  size_t k;
  fputs("<div id=\"lead\">", stream);
  json_array_foreach(parts, k, part) {
    const char *said = json_string_value(json_array_get(json_object_get(part, "verdict"), 0));
    if (!said || strchr(said, '\n')) continue;
    fputs("<p>", stream);
    if (json_array_size(parts) > 1) {
      print_escaped(stream, json_string_value(json_object_get(part, "title")));
      fputs(": ", stream);
    }
    print_escaped(stream, said);
    fputs("</p>", stream);
  }
  fputs("</div>\n", stream);
}

/* Prints the picture as an element, or nothing if there is none. */
static void print_still(FILE *stream, const flesh_report_bytes *still)
{
  if (!still->size) return;
  fputs("<img id=\"still\" alt=\"The bodies as they are first seen\" src=\"data:image/png;base64,", stream);
  print_base64(stream, still->data, still->size);
  fputs("\">\n", stream);
}

/* Deflates into *packed (new) the length of the JSON as twelve digits, the JSON, and the numbers. */
static int pack(const flesh_report *report, json_t *head, char **packed, size_t *size)
{
  json_t *all = json_pack("{sOsOsO}", "head", head, "parts", report->parts, "view", report->view);
  char *text = all ? json_dumps(all, JSON_COMPACT | JSON_REAL_PRECISION(9)) : NULL;
  flesh_report_bytes plain = {0};
  int status = text && !flesh_json_lacks() ? open_bytes(&plain) : FLESH_ERR_MEMORY;
  *packed = NULL;
  if (!status) {
    fprintf(plain.stream, "%012zu%s", strlen(text), text);
    fwrite(report->numbers.data, 1, report->numbers.size, plain.stream);
    status = flesh_report_bytes_flush(&plain);
  }
  uLongf room = compressBound((uLong)plain.size);
  if (!status) *packed = malloc(room);
  if (!*packed || compress2((Bytef *)*packed, &room, (Bytef *)plain.data, (uLong)plain.size, Z_BEST_COMPRESSION) != Z_OK)
    status = flesh_report_no_memory();
  *size = room;
  close_bytes(&plain);
  free(text);
  json_decref(all);
  return status;
}

/* Prints the page up to the mark; returns the rest behind it. */
static const char *print_up_to(FILE *stream, const char *mark, const char *page)
{
  const char *at = strstr(page, mark);
  fwrite(page, 1, (size_t)(at - page), stream);
  return at + strlen(mark);
}

/* Writes the page, completely or not at all; *size: bytes of the file, *packed: bytes of its payload. */
static int write_page(const flesh_report *report, const char *title, json_t *head, const char *path, size_t *size,
                      size_t *packed)
{
  char *payload = NULL;
  flesh_file file;
  int status = pack(report, head, &payload, packed);
  if (!status) status = flesh_file_open(path, &file);
  if (!status) {
    const char *rest = print_up_to(file.stream, "@TITLE@", flesh_report_page);
    print_escaped(file.stream, title);
    rest = print_up_to(file.stream, "@LEAD@", rest);
    print_lead(file.stream, report->parts);
    rest = print_up_to(file.stream, "@STILL@", rest);
    print_still(file.stream, &report->still);
    rest = print_up_to(file.stream, "@PAYLOAD@", rest);
    print_base64(file.stream, payload, *packed);
    fputs(rest, file.stream);
    *size = (size_t)ftell(file.stream);
    status = flesh_file_commit(&file);
  }
  free(payload);
  return status;
}

/* ---- parts about runs and sweeps ---- */

static int insert_run(flesh_study_store *store, int number, const char *folder)
{
  const char *name;
  const size_t length = flesh_run_folder_name(folder, &name);
  json_t *result = NULL, *shown = flesh_json_bytes(name, length);
  int status = flesh_report_file(folder, "result.json", 1, &result);
  char *text = json_is_object(result) ? json_dumps(result, JSON_COMPACT) : NULL;
  if (!status)
    status = flesh_study_store_execute(store, "INSERT INTO runs VALUES (%d, %Q, %Q, %Q)", number, folder,
                                       json_string_value(shown), text);
  json_decref(shown);
  json_decref(result);
  free(text);
  return status;
}

/* Fills the part by the text `sql` on a database in memory with the table of report_runs.sql. */
static int tell(flesh_report *report, json_t *part, const char *folder, const char *sql, int count, char *const *folders)
{
  flesh_study_store store = {.path = "a report"};
  if (sqlite3_open(":memory:", &store.database)) {
    sqlite3_close(store.database);
    return flesh_report_no_memory();
  }
  int status = flesh_study_store_execute(&store, "CREATE TABLE runs (number INTEGER PRIMARY KEY, folder, name, result)");
  for (int r = 0; r < count && !status; r++) status = insert_run(&store, r, folders[r]);
  if (!status) status = flesh_report_tell(report, part, folder, sql, store.database);
  sqlite3_close(store.database);
  return status;
}

/* Appends a part about the folder of a study by the text `sql`, on a database with the table of report_runs.sql. */
static int add_study(flesh_report *report, const char *title, const char *sql, const char *folder)
{
  return tell(report, flesh_report_part(report, title, folder), folder, sql, 1, (char *const[]){(char *)folder});
}

/* Returns the column to plot against time at first: the first of `wanted` that a table has, else the last of
 * `wanted`. */
static const char *first_column(const json_t *part, const char *const *wanted)
{
  const json_t *tables = json_object_get(part, "tables"), *table;
  size_t k;
  for (; wanted[1]; wanted++)
    json_array_foreach(tables, k, table) if (flesh_report_column(json_object_get(table, "columns"),
                                                                 *wanted)) return *wanted;
  return *wanted;
}

/* Appends a part about all runs. */
static int add_runs(flesh_report *report, int count, char *const *folders)
{
  static const char *const motions[] = {"volume_ratio", "energy_total", "newton", NULL};
  json_t *part = flesh_report_part(report, count > 1 ? "Runs" : "Run", count > 1 ? "" : folders[0]);
  const int status = tell(report, part, "", "report_runs", count, folders);
  const json_t *tables = json_object_get(part, "tables"), *plots = json_object_get(part, "plots");
  const json_t *last = json_object_get(json_array_get(tables, json_array_size(tables) - 1), "columns");
  const char *second = json_string_value(json_object_get(json_array_get(last, 1), "name"));
  json_object_set_new(json_array_get(plots, 0), "y", json_string(first_column(part, motions)));
  json_object_set_new(json_array_get(plots, 1), "y", json_string(second ? second : ""));
  return status;
}

/* Returns whether the path ends as that of a database. */
static int is_database(const char *path)
{
  const size_t length = strlen(path);
  return length > 3 && !strcmp(path + length - 3, ".db");
}

/* Appends a part about a sweep, given by its folder or its database. */
static int add_sweep(flesh_report *report, const char *path)
{
  static const char asked[] = "SELECT 1 FROM cases, results, rows, parameters, derived, meta, workers";
  sqlite3 *database = NULL;
  sqlite3_stmt *query = NULL;
  char *whole = strdup(is_database(path) ? path : flesh_report_path(path, "sweep.db"));
  if (!whole) return flesh_report_no_memory();
  json_t *part = flesh_report_part(report, "Sweep", whole);
  int status = flesh_path_check(whole);
  if (!status) status = flesh_database_read(whole, SQLITE_OPEN_READONLY, &database);
  if (!status && sqlite3_prepare_v2(database, asked, -1, &query, NULL))
    status = flesh_database_fail(database, whole, "this is no database of a sweep");
  sqlite3_finalize(query);
  if (!status) status = flesh_report_tell(report, part, whole, "report_sweep", database);
  sqlite3_close(database);
  free(whole);
  return status;
}

/* ---- the command ---- */

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
    if (is_database(path)) return FLESH_OK;
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
  if (!status && run_count) status = add_runs(report, run_count, runs);
  for (int k = 0; k < count && !status; k++)
    if (found[k]->sql) status = add_study(report, found[k]->title, found[k]->sql, paths[k]);
    else if (found[k]->title) status = add_sweep(report, paths[k]);
  return status;
}

static int make(flesh_report *report, int count, char **paths, const char *title, const char *out,
                json_t *program)
{
  size_t size = 0, packed = 0;
  int status = gather(report, count, paths);
  if (!status) status = flesh_report_make_view(report);
  if (status) return status;
  json_t *shown = flesh_json_text(title), *head = json_pack("{sOsO}", "title", shown, "program", program);
  status = head ? write_page(report, json_string_value(shown), head, out, &size, &packed)
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
  int status = open_bytes(&report.numbers);
  if (!status) status = open_bytes(&report.still);
  if (!status) status = flesh_output_prepare_from(out, count, argv + 1, NULL);
  if (!status) status = make(&report, count, argv + 1, title ? title : words, out, program);
  if (!status && flesh_json_lacks())
    status = flesh_report_no_memory();
  free(report.shown);
  flesh_arena_free(&report.arena);
  close_bytes(&report.numbers);
  close_bytes(&report.still);
  json_decref(report.parts);
  json_decref(report.view);
  json_decref(program);
  return status ? flesh_command_fail(usage.command, status) : 0;
}
