/* studies.c: comparisons in a report: of energies, of methods, of solvers in hard cases, of kernels and steps.
 *
 * data/studies/report_*.sql describes each. A row of a SELECT is used as the line `-- to NAME` above the SELECT says:
 *   tables   file, open: the file becomes a table of the part, a row of the SQL table `tables` (name, number), and, if there
 *            is an SQL table of its name, that table's content
 *   texts    file, which is printed in the verdict
 *   verdict  a sentence
 *   notes    a sentence on what is missing or was left out
 *   plots    title, x, y, logarithmic axes ("xy"), lines, table (-1: the runs' histories), and group, column, its text
 *   grids    JSON
 *   figures  the rows are a table, whose title is in their first column
 *   results  a table like that without its empty columns; its columns as JSON are in the SQL table `tables`
 *   folded   a table like that of figures, folded
 *   histories  folder, file, title and colour: the file becomes a table, and a series of the last plot
 *   runs     folder, title of its bodies, whether they may be missing
 *   sources  title, file, key (NULL: the file is a text; "": all of the JSON)
 *   given    title, text, whether it is JSON: a source that SQL has made
 *   failure  words after the folder's name: the report fails with them
 * is_there(file) says whether the folder has the file, colour_of(energy) is the energy's colour; number() is that of
 * study/results.h. */
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "cli/json_memory.h"
#include "material/form.h"
#include "report/report.h"
#include "study/database.h"
#include "study/embedded.h"
#include "study/results.h"

enum { MOST_COLUMNS = 32, MOST_ROWS = 2000 };

json_t *flesh_report_part(flesh_report *report, const char *title, const char *path)
{
  json_t *part = json_pack("{sosos[]s[]s[]s[]s[]s[]}", "title", flesh_json_text(title), "path", flesh_json_text(path),
                           "verdict", "notes", "tables", "plots", "grids", "sources");
  json_array_append_new(report->parts, part);
  return part;
}

/* Adds a value, which it takes ownership of, to a list of the part. */
static void add(json_t *part, const char *list, json_t *value) { json_array_append_new(json_object_get(part, list), value); }

void flesh_report_note(json_t *part, const char *format, ...)
{
  char text[2048];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  add(part, "notes", flesh_json_text(text));
}

typedef struct maker {
  flesh_report *report;
  json_t *part;
  const char *folder;
  sqlite3 *database;
} maker;

static void test_file(sqlite3_context *context, int count, sqlite3_value **values)
{
  const maker *m = sqlite3_user_data(context);
  const char *name = (const char *)sqlite3_value_text(values[0]);
  (void)count;
  sqlite3_result_int(context, name && flesh_report_has(m->folder, name));
}

static void find_colour(sqlite3_context *context, int count, sqlite3_value **values)
{
  const char *letter = (const char *)sqlite3_value_text(values[0]);
  (void)count;
  for (int e = 0; e < FLESH_ENERGY_COUNT; e++)
    if (letter && !strcmp(letter, flesh_forms[e].name)) sqlite3_result_text(context, flesh_forms[e].colour, -1, SQLITE_STATIC);
}

/* Adds a table; takes ownership of the columns. Returns the table's number. Tables that are not open are folded. */
static int put_table(const maker *m, const char *title, json_t *columns, int open)
{
  add(m->part, "tables", json_pack("{sosbso}", "title", flesh_json_text(title), "open", open, "columns", columns));
  return (int)json_array_size(json_object_get(m->part, "tables")) - 1;
}

/* Adds a folded text, as a scene, or JSON, as provenance; takes ownership of the value. NULL is left out. */
static void put_source(const maker *m, const char *title, json_t *value)
{
  if (value) add(m->part, "sources", json_pack("{soso}", "title", flesh_json_text(title), "value", value));
}

static void bind(sqlite3_stmt *insert, int at, const json_t *value, int numbers)
{
  if (json_is_string(value) && !numbers) sqlite3_bind_text(insert, at, json_string_value(value), -1, SQLITE_STATIC);
  else if (json_is_number(value)) sqlite3_bind_double(insert, at, json_number_value(value));
  else sqlite3_bind_null(insert, at);
}

/* Fills the SQL table of that name, if there is one: `number` from 0, and the file's columns by their names. Columns
 * that are declared REAL get numbers only. */
static int fill(const maker *m, const char *name, const json_t *columns)
{
  const json_t *values[MOST_COLUMNS] = {NULL};
  int numbers[MOST_COLUMNS] = {0};
  char words[4 * MOST_COLUMNS] = "?";
  sqlite3_stmt *named = NULL, *insert = NULL;
  char *sql = sqlite3_mprintf("SELECT * FROM \"%.*w\"", (int)strcspn(name, "."), name);
  const int there = sql && !sqlite3_prepare_v2(m->database, sql, -1, &named, NULL), count = sqlite3_column_count(named);
  for (int c = 1; c < count && c < MOST_COLUMNS; c++) {
    values[c] = flesh_report_column(columns, sqlite3_column_name(named, c));
    numbers[c] = sqlite3_column_decltype(named, c) != NULL;
    strcat(words, ",?");
  }
  sqlite3_finalize(named);
  sqlite3_free(sql);
  if (!there) return FLESH_OK;
  sql = sqlite3_mprintf("INSERT INTO \"%.*w\" VALUES (%s)", (int)strcspn(name, "."), name, words);
  int bad = !sql || sqlite3_prepare_v2(m->database, sql, -1, &insert, NULL);
  for (size_t row = 0; row < flesh_report_rows(columns) && !bad; row++) {
    sqlite3_bind_int64(insert, 1, (sqlite3_int64)row);
    for (int c = 1; c < count; c++) bind(insert, c + 1, json_array_get(values[c], row), numbers[c]);
    bad = sqlite3_step(insert) != SQLITE_DONE;
    sqlite3_reset(insert);
  }
  sqlite3_finalize(insert);
  sqlite3_free(sql);
  return bad ? flesh_database_fail(m->database, m->folder, "cannot be read") : FLESH_OK;
}

/* Adds a file as a table, or a note if there is no such file. */
static int add_table(const maker *m, const char *name, int open)
{
  json_t *columns;
  int status = flesh_report_csv(m->folder, name, 0, &columns, NULL);
  if (!columns && !status) flesh_report_note(m->part, "There is no %s that can be read.", name);
  if (!columns) return status;
  char *sql = sqlite3_mprintf("INSERT INTO tables VALUES (%Q, %d, NULL)", name, put_table(m, name, columns, open));
  if (!sql || sqlite3_exec(m->database, sql, NULL, NULL, NULL)) status = flesh_report_no_memory();
  sqlite3_free(sql);
  return status ? status : fill(m, name, columns);
}

/* Adds the verdict that the command has written. */
static int add_text(const maker *m, const char *name)
{
  json_t *text;
  const int status = flesh_report_file(m->folder, name, &text);
  if (text) add(m->part, "verdict", text);
  else if (!status) flesh_report_note(m->part, "There is no %s: the command did not end.", name);
  return status;
}

/* Adds a file as a folded text or, with a key, as JSON: the key's value, or all of it for "". */
static int add_source(const maker *m, const char *title, const char *name, const char *key)
{
  json_t *value;
  const int status = (key ? flesh_report_json : flesh_report_file)(m->folder, name, &value);
  put_source(m, title, key && *key ? json_incref(json_object_get(value, key)) : json_incref(value));
  json_decref(value);
  return status;
}

/* Adds a file of a folder as a folded table and as a series of the last plot, or a note if it cannot be read. */
static int add_history(const maker *m, const char *name, const char *file, const char *label, const char *colour)
{
  const json_t *plots = json_object_get(m->part, "plots");
  char title[300];
  json_t *columns = NULL;
  int step;
  const int status = flesh_report_csv(flesh_report_path(m->folder, name), file, MOST_ROWS, &columns, &step);
  if (!columns && !status) flesh_report_note(m->part, "%s has no %s that can be read.", label, file);
  if (!columns) return status;
  snprintf(title, sizeof title, "%s: %s", label, file);
  if (step > 1) flesh_report_note(m->part, "Of %s of %s one row in %d is here.", file, label, step);
  json_array_append_new(json_object_get(json_array_get(plots, json_array_size(plots) - 1), "series"),
                        json_pack("{sisoss*}", "table", put_table(m, title, columns, 0), "name", flesh_json_text(label),
                                  "colour", colour));
  return status;
}

/* Adds a folder whose bodies are shown. */
static int add_run(const maker *m, const char *name, const char *title, int optional)
{
  flesh_report *r = m->report;
  flesh_report_shown *longer = realloc(r->shown, sizeof *longer * (size_t)(r->shown_count + 1));
  if (!longer) return flesh_report_no_memory();
  r->shown = longer;
  flesh_report_shown *s = &longer[r->shown_count++];
  *s = (flesh_report_shown){.folder = flesh_arena_print(&r->arena, "%s", flesh_report_path(m->folder, name)),
                            .name = flesh_arena_print(&r->arena, "%s", title), .optional = optional};
  return s->folder && s->name ? FLESH_OK : flesh_report_no_memory();
}

static json_t *optional(const char *text) { return text ? flesh_json_text(text) : NULL; }

/* Adds a plot of columns x and y, which the reader may exchange for others; series are added later, or come from one
 * table by its column `group`. */
static void add_plot(const maker *m, sqlite3_stmt *row, const char *const t[9])
{
  add(m->part, "plots",
      json_pack("{sososo s[bb] sbsb sis[] so*so*so*}", "title", flesh_json_text(t[0]), "x", flesh_json_text(t[1]), "y",
                flesh_json_text(t[2]), "log", strchr(t[3], 'x') != NULL, strchr(t[3], 'y') != NULL, "lines",
                sqlite3_column_int(row, 4), "choose", 1, "table", sqlite3_column_int(row, 5), "series", "group", optional(t[6]),
                "where", optional(t[7]), "is", optional(t[8])));
}

static int take_row(const maker *m, sqlite3_stmt *row, const char *name)
{
  const char *t[9] = {NULL};
  for (int c = 0; c < 9 && c < sqlite3_column_count(row); c++) t[c] = (const char *)sqlite3_column_text(row, c);
  if (!*name || !t[0]) return FLESH_OK;
  if (!strcmp(name, "tables")) return add_table(m, t[0], sqlite3_column_int(row, 1));
  if (!strcmp(name, "texts")) return add_text(m, t[0]);
  if (!strcmp(name, "sources")) return add_source(m, t[0], t[1], t[2]);
  if (!strcmp(name, "histories")) return add_history(m, t[0], t[1], t[2], t[3]);
  if (!strcmp(name, "runs")) return add_run(m, t[0], t[1], sqlite3_column_int(row, 2));
  if (!strcmp(name, "failure")) return flesh_fail(FLESH_ERR_FILE, "%s/%s", m->folder, t[0]);
  if (!strcmp(name, "plots")) add_plot(m, row, t);
  if (!strcmp(name, "given") && t[1])
    put_source(m, t[0], sqlite3_column_int(row, 2) ? json_loads(t[1], 0, NULL) : flesh_json_text(t[1]));
  if (!strcmp(name, "verdict") || !strcmp(name, "notes")) add(m->part, name, flesh_json_text(t[0]));
  if (!strcmp(name, "grids")) add(m->part, name, json_loads(t[0], 0, NULL));
  return FLESH_OK;
}

static int fail(const maker *m) { return flesh_database_fail(m->database, m->folder, "cannot be reported"); }

/* Removes columns without a value in any row. */
static void drop_empty(json_t *columns)
{
  for (size_t k = json_array_size(columns); k-- > 0;) {
    const json_t *values = json_object_get(json_array_get(columns, k), "values"), *value;
    size_t i, found = 0;
    json_array_foreach(values, i, value) found +=
        !json_is_null(value) && strcmp(json_is_string(value) ? json_string_value(value) : "-", "");
    if (!found) json_array_remove(columns, k);
  }
}

/* Adds the rows as a table; `results` are kept for later statements, too. */
static int add_figures(const maker *m, sqlite3_stmt *query, const char *name)
{
  const int results = !strcmp(name, "results"), code = sqlite3_step(query);
  if (code != SQLITE_ROW) return code == SQLITE_DONE ? FLESH_OK : fail(m);
  const char *title = flesh_arena_print(&m->report->arena, "%s", (const char *)sqlite3_column_text(query, 0));
  sqlite3_reset(query);
  json_t *columns = title ? flesh_report_query(query, 1) : NULL;
  if (results) drop_empty(columns);
  char *text = results && columns ? json_dumps(columns, JSON_COMPACT) : NULL;
  char *sql = text ? sqlite3_mprintf("INSERT INTO tables VALUES (%Q, 0, %Q)", title, text) : NULL;
  int status = columns ? FLESH_OK : fail(m);
  if (columns) put_table(m, title, columns, strcmp(name, "folded"));
  if (columns && results && (!sql || sqlite3_exec(m->database, sql, NULL, NULL, NULL))) status = flesh_report_no_memory();
  sqlite3_free(sql);
  free(text);
  return status;
}

static int is_table(const char *name)
{
  return !strcmp(name, "figures") || !strcmp(name, "results") || !strcmp(name, "folded");
}

static int execute(void *data, sqlite3_stmt *query, const char *name)
{
  const maker *m = data;
  int code, status = FLESH_OK;
  if (is_table(name)) return add_figures(m, query, name);
  while (!status && (code = sqlite3_step(query)) == SQLITE_ROW) status = take_row(m, query, name);
  return status || code == SQLITE_DONE ? status : fail(m);
}

int flesh_report_tell(flesh_report *report, json_t *part, const char *folder, const char *sql, sqlite3 *database)
{
  maker m = {.report = report, .part = part, .folder = folder, .database = database};
  const int bad = sqlite3_create_function(database, "is_there", 1, SQLITE_UTF8, &m, test_file, NULL, NULL) ||
                  sqlite3_create_function(database, "colour_of", 1, SQLITE_UTF8, NULL, find_colour, NULL, NULL) ||
                  sqlite3_exec(database, "CREATE TEMP TABLE tables (name, number, columns)", NULL, NULL, NULL);
  return bad ? flesh_report_no_memory() : flesh_results_each(database, folder, flesh_own_text(sql), execute, &m);
}
