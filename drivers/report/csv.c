/* csv.c: reads tables and texts for a report. */

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/confine.h"
#include "base/scan.h"
#include "cli/json_memory.h"
#include "cli/path.h"
#include "report/report.h"
#include "study/csv.h"

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

int flesh_report_csv(const char *folder, const char *name, int most, json_t **columns, int *step)
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

json_t *flesh_report_query(sqlite3_stmt *query, int first)
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

size_t flesh_report_rows(const json_t *columns)
{
  return json_array_size(json_object_get(json_array_get(columns, 0), "values"));
}

const char *flesh_report_path(const char *folder, const char *name)
{
  return flesh_path("%s%s%s", folder, *folder ? "/" : "", name);
}

/* Reads a file into a new value, if there is such a file. */
static int take_file(const char *folder, const char *name, int is_json, json_t **value)
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

int flesh_report_file(const char *folder, const char *name, json_t **text) { return take_file(folder, name, 0, text); }

int flesh_report_json(const char *folder, const char *name, json_t **value) { return take_file(folder, name, 1, value); }

int flesh_report_has(const char *folder, const char *name)
{
  return flesh_path_is_there(flesh_report_path(folder, name));
}
