/* results.c: executes the SQL that turns a study's cases into results. */
#include "study/results.h"

#include <gsl/gsl_cdf.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/confine.h"
#include "base/error.h"
#include "cli/json_memory.h"
#include "cli/path.h"
#include "flesh/status.h"
#include "picture/plot.h"
#include "study/database.h"
#include "study/formats.h"
#include "study/csv.h"

/* Implements number(format, x) and cell(format, width, x). */
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

static void print_path(sqlite3_context *context, int count, sqlite3_value **values)
{
  (void)count, (void)values;
  sqlite3_result_text(context, sqlite3_user_data(context), -1, SQLITE_TRANSIENT);
}

static void test_signs(sqlite3_context *context, int count, sqlite3_value **values)
{
  const int wins = sqlite3_value_int(values[0]), losses = sqlite3_value_int(values[1]), most = wins > losses ? wins : losses;
  (void)count;
  const int all = wins + losses;
  sqlite3_result_double(context, all > 0 ? fmin(1, 2 * gsl_cdf_binomial_Q((unsigned)most - 1, 0.5, (unsigned)all)) : 1);
}

typedef enum piece { NUMBER, STATUS, PLOT, QUOTED, QUOTED_TICK, QUOTED_FILE, LOG_TICKS, COLOUR, SHELL_WORD } piece;

static void write_plot(FILE *stream, int count, sqlite3_value **values)
{
  static const char *const axes[] = {"x", "y"};
  const char *texts[6];
  for (int k = 0; k < 6; k++) texts[k] = (const char *)sqlite3_value_text(values[k]);
  flesh_plot_begin(stream, texts[0], count < 8 ? ".png" : (const char *)sqlite3_value_text(values[7]),
                   sqlite3_value_int(values[1]), sqlite3_value_int(values[2]));
  if (count < 7 || sqlite3_value_type(values[6]) != SQLITE_NULL)
    flesh_plot_style(stream, count < 7 || sqlite3_value_int(values[6]));
  if (texts[3]) flesh_plot_title(stream, texts[3]);
  for (int k = 0; k < 2; k++)
    if (texts[4 + k]) flesh_plot_label(stream, axes[k], texts[4 + k]);
}

/* Implements the functions that print pieces of texts and scripts. */
static void print_piece(sqlite3_context *context, int count, sqlite3_value **values)
{
  char *text = NULL;
  size_t size = 0;
  const piece which = (piece)(intptr_t)sqlite3_user_data(context);
  if (which == NUMBER && sqlite3_value_type(values[0]) == SQLITE_NULL) return;
  FILE *stream = open_memstream(&text, &size);
  const int is_numeric = which == NUMBER || which == STATUS || which == COLOUR;
  const char *first = is_numeric ? NULL : (const char *)sqlite3_value_text(values[0]);
  if (!first) first = "";
  if (stream) switch (which) {
    case NUMBER: flesh_number_print(stream, sqlite3_value_double(values[0])); break;
    case STATUS: fputs(flesh_status_name((flesh_status)sqlite3_value_int(values[0])), stream); break;
    case PLOT: write_plot(stream, count, values); break;
    case QUOTED: flesh_plot_quote(stream, first); break;
    case QUOTED_TICK: flesh_plot_quote_tick(stream, first); break;
    case QUOTED_FILE: flesh_plot_quote_file(stream, first, (const char *)sqlite3_value_text(values[1])); break;
    case LOG_TICKS: flesh_plot_log_ticks(stream, first, sqlite3_value_double(values[1]), sqlite3_value_double(values[2])); break;
    case SHELL_WORD: flesh_shell_word_print(stream, first); break;
    case COLOUR: fputs(flesh_plot_colour(sqlite3_value_int(values[0])), stream);
    }
  if (stream && !fclose(stream)) sqlite3_result_text(context, text, -1, SQLITE_TRANSIENT);
  else sqlite3_result_error_nomem(context);
  free(text);
}

/* Registers the functions that results.h describes. */
static int add_functions(sqlite3 *database, const char *path)
{
  static const struct {
    const char *name;
    int count;
    void (*call)(sqlite3_context *, int, sqlite3_value **);
    piece data; /* used by print_piece */
  } rows[] = {{"number", 2, print_number, 0}, {"cell", 3, print_number, 0}, {"status_name", 1, print_piece, STATUS},
              {"sign_test", 2, test_signs, 0}, {"number", 1, print_piece, NUMBER}, {"plot", 6, print_piece, PLOT},
              {"plot", 7, print_piece, PLOT}, {"plot", 8, print_piece, PLOT}, {"quoted", 1, print_piece, QUOTED},
              {"quoted_tick", 1, print_piece, QUOTED_TICK}, {"quoted_file", 2, print_piece, QUOTED_FILE},
              {"log_ticks", 3, print_piece, LOG_TICKS}, {"colour", 1, print_piece, COLOUR},
              {"shell_word", 1, print_piece, SHELL_WORD}};
  for (size_t k = 0; k < sizeof rows / sizeof *rows; k++)
    if (sqlite3_create_function(database, rows[k].name, rows[k].count, SQLITE_UTF8 | SQLITE_DETERMINISTIC,
                                (void *)(intptr_t)rows[k].data, rows[k].call, NULL, NULL))
      return flesh_no_memory();
  return sqlite3_create_function(database, "path", 0, SQLITE_UTF8, (void *)path, print_path, NULL, NULL) ? flesh_no_memory()
                                                                                                        : FLESH_OK;
}

/* Finds the name in the line `-- to NAME` among the comments at the beginning of the statement; "" if there is none. */
static void find_target(const char *sql, char name[64])
{
  *name = 0;
  for (sql += strspn(sql, " \n"); !strncmp(sql, "--", 2); sql += strcspn(sql, "\n"), sql += strspn(sql, " \n"))
    if (sscanf(sql, "-- to %63[a-z_.*]", name) == 1) return;
}

typedef struct maker {
  const char *path;
  const flesh_results *to;
  char *text, name[64]; /* name of the text */
  size_t size;
  FILE *words; /* NULL: no text is written */
} maker;

static int write_table(const maker *m, sqlite3_stmt *query, const char *name)
{
  flesh_file file;
  int status = flesh_file_open(flesh_path("%s/%s", m->to->out, name), &file);
  if (status) return status;
  status = flesh_format_print(m->path, query, &flesh_format_csv, file.stream);
  if (!status) return flesh_file_commit(&file);
  flesh_file_abandon(&file);
  return status;
}

static int fail_to_read(const maker *m, sqlite3_stmt *query)
{
  return flesh_database_fail(sqlite3_db_handle(query), m->path, "cannot be read");
}

static void print_row(FILE *stream, sqlite3_stmt *query, int column)
{
  fprintf(stream, "%s\n", (const char *)sqlite3_column_text(query, column));
}

/* Writes a script, which is drawn, or its data: the first column of all rows; with `each` the second column of this
 * row. */
static int write_script(const maker *m, sqlite3_stmt *query, const char *name, const char *suffix, int each)
{
  flesh_file file;
  int code = SQLITE_ROW, status = flesh_plot_open(m->to->out, name, suffix, &file);
  if (status) return status;
  for (; code == SQLITE_ROW; code = each ? SQLITE_DONE : sqlite3_step(query)) print_row(file.stream, query, each);
  if (code != SQLITE_DONE) {
    flesh_file_abandon(&file);
    return fail_to_read(m, query);
  }
  status = flesh_file_commit(&file);
  if (!status && !strcmp(suffix, ".gp")) m->to->draw(m->to->data, m->to->out, name);
  return status;
}

static int draw(const maker *m, sqlite3_stmt *query, const char *name, const char *suffix)
{
  if (!m->to->draw) return FLESH_OK;
  const int each = !strcmp(name, "each");
  int code = sqlite3_step(query), status = FLESH_OK;
  for (; each && code == SQLITE_ROW && !status; code = sqlite3_step(query))
    status = write_script(m, query, (const char *)sqlite3_column_text(query, 0), suffix, 1);
  if (code == SQLITE_ROW && !status) return write_script(m, query, name, suffix, 0);
  if (code != SQLITE_DONE && !status) return fail_to_read(m, query);
  if (!each) { /* remove the files of an earlier study */
    flesh_path_unlink(flesh_path("%s/%s%s", m->to->out, name, suffix));
    flesh_path_unlink(flesh_path("%s/%s.png", m->to->out, name));
  }
  return status;
}

static int write_json(const maker *m, sqlite3_stmt *query, const char *name)
{
  if (sqlite3_step(query) != SQLITE_ROW) return fail_to_read(m, query);
  json_t *value = json_loads((const char *)sqlite3_column_text(query, 0), JSON_DECODE_ANY, NULL);
  return value ? flesh_json_write(flesh_path("%s/%s", m->to->out, name), value) : flesh_no_memory();
}

static int execute(void *data, sqlite3_stmt *query, const char *target)
{
  maker *m = data;
  const char *dot = strrchr(target, '.');
  if (dot && !strcmp(dot, ".csv")) return write_table(m, query, target);
  if (dot && !strcmp(dot, ".json")) return write_json(m, query, target);
  if (dot && (!strcmp(dot, ".gp") || !strcmp(dot, ".dat"))) {
    char name[64];
    snprintf(name, sizeof name, "%.*s", (int)(dot - target), target);
    return draw(m, query, strcmp(name, "*") ? name : m->to->picture, dot);
  }
  const int to_stdout = !strcmp(target, "stdout"), to_stderr = !strcmp(target, "stderr");
  FILE *stream = to_stderr ? stderr : !to_stdout ? m->words : m->to->quiet ? NULL : stdout;
  if (*target && !to_stdout && !to_stderr && strcmp(target, "error")) snprintf(m->name, sizeof m->name, "%s", target);
  int code;
  while ((code = sqlite3_step(query)) == SQLITE_ROW)
    if (!strcmp(target, "error"))
      return flesh_fail(FLESH_ERR_ARGUMENT, "%s", (const char *)sqlite3_column_text(query, 0));
    else if (stream && *target) print_row(stream, query, 0);
  return code == SQLITE_DONE ? FLESH_OK : fail_to_read(m, query);
}

int flesh_results_each(sqlite3 *database, const char *path, const char *sql, flesh_results_execute *execute_one, void *data)
{
  char target[64];
  int status = add_functions(database, path);
  while (*sql && !status) {
    sqlite3_stmt *query = NULL;
    const char *rest = sql;
    if (sqlite3_prepare_v2(database, sql, -1, &query, &rest))
      status = flesh_database_fail(database, path, "cannot be asked for results");
    find_target(sql, target);
    if (!status && query) status = execute_one(data, query, target);
    sqlite3_finalize(query);
    sql = rest;
  }
  return status;
}

/* Writes the text into the file and to stdout. */
static int say(const char *folder, const char *name, const char *text)
{
  flesh_file file;
  int status = flesh_file_open(flesh_path("%s/%s", folder, name), &file);
  if (status) return status;
  fputs(text, file.stream);
  status = flesh_file_commit(&file);
  fputs(text, stdout);
  return status;
}

int flesh_results_make(sqlite3 *database, const char *path, const char *const *sql, const flesh_results *to)
{
  maker m = {.path = path, .to = to};
  int status = FLESH_OK;
  if (to->words && !(m.words = open_memstream(&m.text, &m.size))) return flesh_no_memory();
  for (; *sql && !status; sql++) status = flesh_results_each(database, path, *sql, execute, &m);
  if (m.words && fclose(m.words) && !status) status = flesh_no_memory();
  if (!status && to->words && *m.name) status = say(to->out, m.name, m.text);
  free(m.text);
  return status;
}
