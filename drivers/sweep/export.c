/* export.c: `flesh sweep export DB`: the results as a table. */
#include <stdio.h>

#include "base/error.h"
#include "base/file.h"
#include "cli/options.h"
#include "cli/output.h"
#include "study/formats.h"
#include "sweep/sweep.h"

#define NAME_OF(name, doc) "|" #name
#define DOC_OF(name, doc) ", " doc

/* NULL: there is none of that name. */
static const flesh_format *find_format(const char *name)
{
#define IF_IT_IS(own, doc) \
  if (!strcmp(name, #own)) return &flesh_format_##own;
  FLESH_FORMAT_LIST(IF_IT_IS)
  return NULL;
}

static int print_table(flesh_study_store *store, const char *columns, const char *view, const char *where,
                       const flesh_format *format, FILE *stream)
{
  sqlite3_stmt *query = NULL;
  const char *rest = "";
  char words[FLESH_STUDY_WORDS];
  char *sql = sqlite3_mprintf("SELECT %s FROM %s WHERE (%s\n) ORDER BY %s", columns, view, where ? where : "1",
                              strcmp(view, "rows") ? "id" : "case_id, number");
  if (!sql) return flesh_no_memory();
  int code = sqlite3_prepare_v2(store->database, sql, -1, &query, &rest), status = FLESH_OK;
  if (code || *rest || !sqlite3_stmt_readonly(query))
    status = flesh_fail(FLESH_ERR_ARGUMENT, "%s: --columns %s%s%s: %s", store->path, columns, where ? ", --where " : "",
                        where ? where : "",
                        code ? flesh_study_store_words(store, view, words) : "not a list of columns and a condition");
  if (!status) status = flesh_format_print(store->path, query, format, stream);
  sqlite3_finalize(query);
  sqlite3_free(sql);
  return status;
}

int flesh_sweep_export(int argc, char **argv)
{
  const char *format = "csv", *out = NULL, *columns = "*", *where = NULL, *table = "results";
  const flesh_option rows[] = {
      {"format", &(FLESH_FORMAT_LIST(NAME_OF))[1], FLESH_OPTION_TEXT, &format, &(FLESH_FORMAT_LIST(DOC_OF))[2]},
      {"table", "results|rows", FLESH_OPTION_TEXT, &table,
       "a row per case (default), or per row of the tables that cases of accuracy and bench make"},
      {"columns", "LIST", FLESH_OPTION_TEXT, &columns, "columns or SQLite's expressions of them (default *: all)"},
      {"where", "CONDITION", FLESH_OPTION_TEXT, &where, "which rows, as in --where \"status = 'complete'\""},
      {"out", "FILE", FLESH_OPTION_TEXT, &out, "write this file (default: standard output)"},
      {0}};
  const flesh_usage usage = {"sweep export", "DB", "Writes the results of a sweep as a table.", NULL, 1, 1, rows, NULL, 0};
  flesh_study_store store = {.lock = -1};
  flesh_file file = {0};
  int count, code = flesh_options_read(&usage, argc, argv, &count);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  const flesh_format *chosen = find_format(format);
  int status = FLESH_OK;
  if (!chosen)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "--format is '%s'; it must be %s", format, &(FLESH_FORMAT_LIST(NAME_OF))[1]);
  if (!status && strcmp(table, "results") && strcmp(table, "rows"))
    status = flesh_fail(FLESH_ERR_ARGUMENT, "--table is '%s'; it must be results or rows", table);
  if (!status) status = flesh_study_store_read(argv[1], &store);
  if (!status && out) status = flesh_output_prepare_from(out, 1, argv + 1, NULL);
  if (!status && out) status = flesh_file_open(out, &file);
  if (!status) status = print_table(&store, columns, table, where, chosen, out ? file.stream : stdout);
  if (!status && out) status = flesh_file_commit(&file);
  flesh_file_abandon(&file);
  flesh_study_store_close(&store);
  return status ? flesh_command_fail("sweep export", status) : 0;
}
