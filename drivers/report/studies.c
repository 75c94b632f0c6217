/* studies.c: reads tables and texts for a report, and makes comparisons: of energies, of methods, of solvers in hard
 * cases, of kernels and steps.
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
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "base/confine.h"
#include "base/error.h"
#include "base/scan.h"
#include "cli/json_memory.h"
#include "cli/path.h"
#include "material/form.h"
#include "report/report.h"
#include "study/csv.h"
#include "study/database.h"
#include "study/embedded.h"
#include "study/results.h"

int flesh_report_no_memory(void) { return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a report"); }

const char *flesh_report_path(const char *folder, const char *name)
{
  return flesh_path("%s%s%s", folder, *folder ? "/" : "", name);
}

/* Returns the column's values in every k-th row and the last one: as numbers if all are numbers, else as texts. */
static json_t *values_of(const flesh_csv *csv, int column, int every)
{
  json_t *texts = json_array(), *numbers = json_array();
  int found = 0, good = 1;
  for (int row = 0; row < csv->rows; row++) {
    double value;
    if (row % every && row < csv->rows - 1) continue;
    const char *cell = flesh_csv_cell(csv, row, column);
    good &= flesh_csv_number(csv, row, column, &value);
    found |= isfinite(value);
    json_array_append_new(texts, flesh_json_bytes(cell, strlen(cell)));
    json_array_append_new(numbers, flesh_json_number(value));
  }
  good = good && (found || !csv->rows);
  json_decref(good ? texts : numbers);
  return good ? numbers : texts;
}

static void add_column(json_t *columns, const char *name, json_t *values)
{
  json_array_append_new(columns, json_pack("{soso}", "name", flesh_json_text(name), "values", values));
}

/* Reads the CSV file folder/name (study/csv.h), whose first row names its columns, into a new list of {"name",
 * "values"}. The values of a column are numbers or null if every cell is a number or empty, else texts. If there are
 * more than `most` rows (0: no limit), takes every k-th and the last one; *step (may be NULL) is that k. Torn rows are
 * left out. *columns is NULL if there is no such file, or no table in it. FLESH_ERR_FILE if it is not a file in the
 * result's folder (confine.h), FLESH_ERR_MEMORY. */
static int read_csv(const char *folder, const char *name, int most, json_t **columns, int *step)
{
  const char *path = flesh_report_path(folder, name);
  flesh_csv csv = {0};
  int status = flesh_path_check(path);
  if (!status && flesh_path_is_file(path)) status = flesh_csv_read(path, FLESH_CSV_TORN, &csv);
  const int every = most && csv.rows > most ? (csv.rows + most - 1) / most : 1;
  if (step) *step = every;
  *columns = csv.columns ? json_array() : NULL;
  for (int c = 0; c < csv.columns; c++) add_column(*columns, csv.names[c], values_of(&csv, c, every));
  if (csv.columns && !*columns) status = flesh_report_no_memory();
  flesh_csv_clear(&csv);
  return status;
}

static json_t *cell(sqlite3_stmt *query, int column)
{
  const int type = sqlite3_column_type(query, column);
  if (type == SQLITE_INTEGER) return json_integer(sqlite3_column_int64(query, column));
  if (type == SQLITE_FLOAT) return flesh_json_number(sqlite3_column_double(query, column));
  const char *text = (const char *)sqlite3_column_text(query, column);
  return type == SQLITE_NULL ? json_null() : flesh_json_text(text ? text : "");
}

/* Returns the rows of a query, from column `first` on, as a new list like that; NULL if SQLite fails. */
static json_t *rows_of(sqlite3_stmt *query, int first)
{
  int code;
  json_t *made = json_array();
  for (int c = first; c < sqlite3_column_count(query); c++) {
    const char *name = sqlite3_column_name(query, c);
    add_column(made, name ? name : "", json_array());
  }
  while ((code = sqlite3_step(query)) == SQLITE_ROW)
    for (int c = first; c < sqlite3_column_count(query); c++)
      json_array_append_new(json_object_get(json_array_get(made, (size_t)(c - first)), "values"), cell(query, c));
  if (code == SQLITE_DONE) return made;
  json_decref(made);
  return NULL;
}

const json_t *flesh_report_column(const json_t *columns, const char *name)
{
  size_t k;
  const json_t *column;
  json_array_foreach(columns, k, column)
  {
    const char *own = json_string_value(json_object_get(column, "name"));
    if (own && !strcmp(own, name)) return json_object_get(column, "values");
  }
  return NULL;
}

int flesh_report_file(const char *folder, const char *name, int is_json, json_t **value)
{
  size_t size;
  const char *path = flesh_report_path(folder, name);
  char *data = NULL;
  int status = flesh_path_check(path);
  if (!status && flesh_path_is_file(path)) status = flesh_file_load(path, &data, &size);
  *value = !data     ? NULL
           : is_json ? json_loadb(data, size, JSON_ALLOW_NUL | JSON_REJECT_DUPLICATES, NULL)
                     : flesh_json_bytes(data, size);
  free(data);
  return status;
}

int flesh_report_has(const char *folder, const char *name)
{
  return flesh_path_is_there(flesh_report_path(folder, name));
}

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
  const size_t count_of_rows = json_array_size(json_object_get(json_array_get(columns, 0), "values"));
  for (size_t row = 0; row < count_of_rows && !bad; row++) {
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
  int status = read_csv(m->folder, name, 0, &columns, NULL);
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
  const int status = flesh_report_file(m->folder, name, 0, &text);
  if (text) add(m->part, "verdict", text);
  else if (!status) flesh_report_note(m->part, "There is no %s: the command did not end.", name);
  return status;
}

/* Adds a file as a folded text or, with a key, as JSON: the key's value, or all of it for "". */
static int add_source(const maker *m, const char *title, const char *name, const char *key)
{
  json_t *value;
  const int status = flesh_report_file(m->folder, name, key != NULL, &value);
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
  const int status = read_csv(flesh_report_path(m->folder, name), file, MOST_ROWS, &columns, &step);
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
  json_t *columns = title ? rows_of(query, 1) : NULL;
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
