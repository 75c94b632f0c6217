/* csv.c: reads tables and texts. */
#include "report/csv.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/confine.h"
#include "base/error.h"
#include "base/scan.h"
#include "cli/json_memory.h"

/* The cell at *at of a line that ends at `end`, unquoted into `cell` (room for the line). Returns
 * whether it was one with an end. */
static int take_cell(const char **at, const char *end, char *cell, size_t *size)
{
  const char *c = *at;
  int quoted = c < end && *c == '"';
  *size = 0;
  for (c += quoted; c < end; c++) {
    if (quoted && *c == '"') {
      if (c + 1 < end && c[1] == '"') c++;
      else {
        quoted = 0;
        continue;
      }
    } else if (!quoted && (*c == ',' || *c == '\n')) {
      break;
    } else if (!quoted && *c == '\r') {
      continue;
    }
    cell[(*size)++] = *c;
  }
  cell[*size] = 0;
  *at = c;
  return c < end && !quoted;
}

/* Appends a row to the columns' texts; returns whether it was whole. */
static int take_row(const char **at, const char *end, json_t *columns, char *cell, int keep)
{
  size_t size, count = json_array_size(columns), k;
  const char *row = *at;
  for (k = 0;; k++, (*at)++) { /* first whether it is whole */
    if (!take_cell(at, end, cell, &size)) return 0;
    if (**at == '\n') break;
  }
  if (k + 1 != count) return 0;
  (*at)++;
  if (!keep) return 1;
  for (k = 0; k < count; k++, row++) {
    take_cell(&row, end, cell, &size);
    json_array_append_new(json_object_get(json_array_get(columns, k), "values"),
                          flesh_json_bytes(cell, size));
  }
  return 1;
}

/* Texts become numbers where all of them are some. */
static void make_numbers(json_t *column)
{
  json_t *texts = json_object_get(column, "values"), *numbers = json_array(), *text;
  size_t k, found = 0;
  int good = numbers != NULL;
  json_array_foreach(texts, k, text)
  {
    const char *s = json_string_value(text);
    char *end = NULL;
    const double value = s && *s ? strtod(s, &end) : NAN;
    if (end && *end) good = 0;
    if (!good) break;
    found += isfinite(value);
    json_array_append_new(numbers, isfinite(value) ? json_real(value) : json_null());
  }
  if (good && (found || !json_array_size(texts))) json_object_set(column, "values", numbers);
  json_decref(numbers);
}

static int count_rows(const char *at, const char *end)
{
  int rows = -1, quoted = 0;
  for (; at < end; at++) {
    quoted ^= *at == '"';
    rows += *at == '\n' && !quoted;
  }
  return rows;
}

int flesh_report_csv(const char *path, int most, json_t **columns, int *step)
{
  char *data, *cell;
  size_t size, name;
  *columns = NULL;
  int status = flesh_path_check(path);
  if (!status && !flesh_path_is_file(path)) return FLESH_OK;
  if (!status) status = flesh_file_load(path, &data, &size);
  if (status) return status;
  const char *at = data, *end = data + size;
  const int rows = count_rows(at, end), every = most && rows > most ? (rows + most - 1) / most : 1;
  if (step) *step = every;
  cell = malloc(size + 1);
  json_t *made = json_array();
  while (cell && take_cell(&at, end, cell, &name)) {
    json_array_append_new(
        made, json_pack("{soso}", "name", flesh_json_bytes(cell, name), "values", json_array()));
    if (*at++ == '\n') break;
  }
  for (int row = 0; cell && at < end; row++) {
    if (take_row(&at, end, made, cell, row % every == 0 || row == rows - 1)) continue;
    const char *next = at < end ? memchr(at, '\n', (size_t)(end - at)) : NULL;
    at = next ? next + 1 : end;
  }
  for (size_t k = 0; k < json_array_size(made); k++) make_numbers(json_array_get(made, k));
  if (!cell || !made) status = flesh_fail(FLESH_ERR_MEMORY, "%s: out of memory", path);
  free(cell);
  free(data);
  if (status || !json_array_size(made)) json_decref(made);
  else *columns = made;
  return status;
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

const char *flesh_report_text(const json_t *columns, const char *name, size_t row)
{
  const char *text = json_string_value(json_array_get(flesh_report_column(columns, name), row));
  return text ? text : "";
}

double flesh_report_number(const json_t *columns, const char *name, size_t row)
{
  const json_t *value = json_array_get(flesh_report_column(columns, name), row);
  return json_is_number(value) ? json_number_value(value) : NAN;
}

char *flesh_report_path(const char *folder, const char *name)
{
  char *path = malloc(strlen(folder) + strlen(name) + 2);
  if (path) sprintf(path, "%s/%s", folder, name);
  else flesh_json_note_lack(); /* what is there must not seem to be missing */
  return path;
}

/* folder/name whole (new); NULL where there is no such file. */
static int load(const char *folder, const char *name, char **data, size_t *size)
{
  char *path = flesh_report_path(folder, name);
  *data = NULL;
  int status = path ? flesh_path_check(path) : flesh_fail(FLESH_ERR_MEMORY, "out of memory for a report");
  if (!status && flesh_path_is_file(path)) status = flesh_file_load(path, data, size);
  free(path);
  return status;
}

int flesh_report_file(const char *folder, const char *name, json_t **text)
{
  size_t size;
  char *data;
  const int status = load(folder, name, &data, &size);
  *text = data ? flesh_json_bytes(data, size) : NULL;
  free(data);
  return status;
}

int flesh_report_json(const char *folder, const char *name, json_t **value)
{
  size_t size;
  char *data;
  const int status = load(folder, name, &data, &size);
  *value = data ? json_loadb(data, size, JSON_ALLOW_NUL | JSON_REJECT_DUPLICATES, NULL) : NULL;
  free(data);
  return status;
}

int flesh_report_has(const char *folder, const char *name)
{
  char *path = flesh_report_path(folder, name);
  const int found = path && flesh_path_is_there(path);
  free(path);
  return found;
}
