/* results.c: what a study's SQL makes of its cases. */
#include "study/results.h"

#include <gsl/gsl_cdf.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "flesh/status.h"
#include "study/database.h"
#include "study/formats.h"
#include "study/table.h"

/* number(format, x); cell(format, width, x). */
static void print_number(sqlite3_context *context, int count, sqlite3_value **values)
{
  char text[FLESH_TABLE_TEXT] = "-", cell[2 * FLESH_TABLE_TEXT];
  const char *format = (const char *)sqlite3_value_text(values[0]);
  const int known = sqlite3_value_type(values[count - 1]) != SQLITE_NULL;
  const double value = sqlite3_value_double(values[count - 1]);
  const size_t digits = format ? strspn(format, "%+.0123456789") : 0;
  if (!digits || *format != '%' || !strchr("efg", format[digits]) || !format[digits] || format[digits + 1])
    return sqlite3_result_error(context, "the format is not one of a number", -1);
  if (known) flesh_table_text(text, count > 2 && fabs(value) >= 1e5 ? "%.0e" : format, value);
  snprintf(cell, sizeof cell, " %*s", count > 2 ? sqlite3_value_int(values[1]) % FLESH_TABLE_TEXT : 0, text);
  sqlite3_result_text(context, count > 2 ? cell : text, -1, SQLITE_TRANSIENT);
}

static void print_status(sqlite3_context *context, int count, sqlite3_value **values)
{
  (void)count;
  sqlite3_result_text(context, flesh_status_name((flesh_status)sqlite3_value_int(values[0])), -1, SQLITE_STATIC);
}

static void test_signs(sqlite3_context *context, int count, sqlite3_value **values)
{
  const int wins = sqlite3_value_int(values[0]), losses = sqlite3_value_int(values[1]), most = wins > losses ? wins : losses;
  (void)count;
  sqlite3_result_double(context, wins + losses > 0 ? fmin(1, 2 * gsl_cdf_binomial_Q((unsigned)most - 1, 0.5, (unsigned)(wins + losses))) : 1);
}

/* The functions of results.h. */
static int add_functions(sqlite3 *database)
{
  static const struct {
    const char *name;
    int count;
    void (*call)(sqlite3_context *, int, sqlite3_value **);
  } rows[] = {{"number", 2, print_number}, {"cell", 3, print_number}, {"status_name", 1, print_status}, {"sign_test", 2, test_signs}};
  for (size_t k = 0; k < sizeof rows / sizeof *rows; k++)
    if (sqlite3_create_function(database, rows[k].name, rows[k].count, SQLITE_UTF8 | SQLITE_DETERMINISTIC, NULL, rows[k].call,
                                NULL, NULL))
      return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  return FLESH_OK;
}

/* The name in the line `-- to NAME` among the comments that the statement begins with; empty: there is none. */
static void find_target(const char *sql, char name[64])
{
  *name = 0;
  for (sql += strspn(sql, " \n"); !strncmp(sql, "--", 2); sql += strcspn(sql, "\n"), sql += strspn(sql, " \n"))
    if (sscanf(sql, "-- to %63[a-z_.]", name) == 1) return;
}

typedef struct maker {
  const char *path, *out;
  char *text, name[64]; /* of the words */
  size_t size;
  FILE *words; /* NULL: there is to be no text */
} maker;

static int write_table(const maker *m, sqlite3_stmt *query, const char *name)
{
  flesh_file file;
  int status = flesh_table_open(m->out, name, &file);
  if (status) return status;
  status = flesh_format_print(m->path, query, &flesh_format_csv, file.stream);
  if (!status) return flesh_file_commit(&file);
  flesh_file_abandon(&file);
  return status;
}

static int execute(maker *m, sqlite3_stmt *query, const char *target)
{
  const size_t length = strlen(target);
  if (length > 4 && !strcmp(target + length - 4, ".csv")) return write_table(m, query, target);
  FILE *stream = strcmp(target, "stdout") ? m->words : stdout;
  if (*target && stream != stdout) snprintf(m->name, sizeof m->name, "%s", target);
  int code;
  while ((code = sqlite3_step(query)) == SQLITE_ROW)
    if (stream && *target) fprintf(stream, "%s\n", (const char *)sqlite3_column_text(query, 0));
  return code == SQLITE_DONE ? FLESH_OK : flesh_database_fail(sqlite3_db_handle(query), m->path, "cannot be read");
}

static int execute_all(maker *m, sqlite3 *database, const char *sql)
{
  char target[64];
  int status = FLESH_OK;
  while (*sql && !status) {
    sqlite3_stmt *query = NULL;
    const char *rest = sql;
    if (sqlite3_prepare_v2(database, sql, -1, &query, &rest)) status = flesh_database_fail(database, m->path, "cannot be asked for results");
    find_target(sql, target);
    if (!status && query) status = execute(m, query, target);
    sqlite3_finalize(query);
    sql = rest;
  }
  return status;
}

static void say(const void *text, FILE *stream) { fputs(text, stream); }

int flesh_results_make(sqlite3 *database, const char *path, const char *const *sql, const char *out, int words)
{
  maker m = {.path = path, .out = out};
  int status = add_functions(database);
  if (status) return status;
  if (words && !(m.words = open_memstream(&m.text, &m.size))) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  for (; *sql && !status; sql++) status = execute_all(&m, database, *sql);
  if (m.words && fclose(m.words) && !status) status = flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  if (!status && words && *m.name) status = flesh_table_say(out, m.name, say, m.text);
  free(m.text);
  return status;
}
