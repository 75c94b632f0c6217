/* export.c: `flesh sweep export DB`: the results as CSV or JSON Lines. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/error.h"
#include "base/file.h"
#include "cli/options.h"
#include "cli/output.h"
#include "study/csv.h"
#include "sweep/sweep.h"

static void print_json_text(FILE *stream, const char *text)
{
  flesh_text quoted = {0};
  flesh_text_quote(&quoted, text);
  if (!quoted.failed) fwrite(quoted.data, 1, quoted.size, stream);
  free(quoted.data);
}

static void print_value(FILE *stream, sqlite3_stmt *query, int column, int json)
{
  switch (sqlite3_column_type(query, column)) {
  case SQLITE_INTEGER:
    fprintf(stream, "%lld", (long long)sqlite3_column_int64(query, column));
    break;
  case SQLITE_FLOAT:
    if (json && !isfinite(sqlite3_column_double(query, column))) fputs("null", stream);
    else flesh_number_print(stream, sqlite3_column_double(query, column));
    break;
  case SQLITE_NULL:
    if (json) fputs("null", stream);
    break;
  default: {
    const char *text = (const char *)sqlite3_column_text(query, column);
    if (json) print_json_text(stream, text ? text : "");
    else flesh_csv_print(stream, text ? text : "");
  }
  }
}

static int print_table(flesh_study_store *store, const char *columns, const char *view, const char *where, int json,
                       FILE *stream)
{
  sqlite3_stmt *query = NULL;
  const char *rest = "";
  char *sql = sqlite3_mprintf("SELECT %s FROM %s WHERE (%s\n) ORDER BY %s", columns, view, where,
                              strcmp(view, "rows") ? "id" : "case_id, number");
  if (!sql) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  int code = sqlite3_prepare_v2(store->database, sql, -1, &query, &rest), status = FLESH_OK;
  if (code || *rest || !sqlite3_stmt_readonly(query)) {
    status = flesh_fail(FLESH_ERR_ARGUMENT, "%s: --columns %s, --where %s: %s", store->path, columns, where,
                        code ? sqlite3_errmsg(store->database) : "not a list of columns and a condition");
    sqlite3_free(sql);
    sqlite3_finalize(query);
    return status;
  }
  int count = sqlite3_column_count(query);
  for (int c = 0; !json && c < count; c++) {
    if (c) putc(',', stream);
    flesh_csv_print(stream, sqlite3_column_name(query, c));
  }
  if (!json) putc('\n', stream);
  while ((code = sqlite3_step(query)) == SQLITE_ROW) {
    for (int c = 0; c < count; c++) {
      if (json) fputs(c ? ", " : "{", stream);
      else if (c) putc(',', stream);
      if (json) print_json_text(stream, sqlite3_column_name(query, c));
      if (json) fputs(": ", stream);
      print_value(stream, query, c, json);
    }
    fputs(json ? "}\n" : "\n", stream);
  }
  if (code != SQLITE_DONE) status = flesh_study_store_fail(store, "cannot be read");
  sqlite3_finalize(query);
  sqlite3_free(sql);
  return status;
}

int flesh_sweep_export(int argc, char **argv)
{
  const char *format = "csv", *out = NULL, *columns = "*", *where = "1", *table = "results";
  const flesh_option rows[] = {
      {"format", "csv|jsonl", FLESH_OPTION_TEXT, &format, "CSV with a header (default) or JSON Lines"},
      {"table", "results|rows", FLESH_OPTION_TEXT, &table,
       "a row per case (default), or per row of the tables of drift, accuracy and hardcases"},
      {"columns", "LIST", FLESH_OPTION_TEXT, &columns, "columns or SQLite's expressions of them (default *: all)"},
      {"where", "CONDITION", FLESH_OPTION_TEXT, &where, "which rows, as in --where \"status = 'complete'\""},
      {"out", "FILE", FLESH_OPTION_TEXT, &out, "write this file (default: standard output)"},
      {0}};
  const flesh_usage usage = {"sweep export", "DB", "Writes the results of a sweep as a table.", NULL, 1, 1, rows, NULL, 0};
  flesh_study_store store = {.lock = -1};
  flesh_file file = {0};
  int count, code = flesh_options_read(&usage, argc, argv, &count);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  int json = !strcmp(format, "jsonl"), status = FLESH_OK;
  if (!json && strcmp(format, "csv"))
    status = flesh_fail(FLESH_ERR_ARGUMENT, "--format is '%s'; it must be csv or jsonl", format);
  if (!status && strcmp(table, "results") && strcmp(table, "rows"))
    status = flesh_fail(FLESH_ERR_ARGUMENT, "--table is '%s'; it must be results or rows", table);
  if (!status) status = flesh_study_store_read(argv[1], &store);
  if (!status && out) status = flesh_output_prepare_from(out, 1, argv + 1, NULL);
  if (!status && out) status = flesh_file_open(out, &file);
  if (!status) status = print_table(&store, columns, table, where, json, out ? file.stream : stdout);
  if (!status && out) status = flesh_file_commit(&file);
  flesh_file_abandon(&file);
  flesh_study_store_close(&store);
  return status ? flesh_command_fail("sweep export", status) : 0;
}
