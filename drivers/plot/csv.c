/* csv.c: CSV files with a header, as flesh writes them, in memory. */
#include "plot/csv.h"

#include <fnmatch.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/scan.h"

/* Ends the field at `at` in place, quotes taken off; returns what ended it: ',', '\n' or 0. *next is behind that. */
static char end_field(char *at, char **next)
{
  char *to = at;
  int quoted = *at == '"';
  if (quoted) at++;
  for (; *at; at++) {
    if (quoted && *at == '"') {
      if (at[1] != '"') {
        quoted = 0;
        continue;
      }
      at++;
    } else if (!quoted && (*at == ',' || *at == '\n')) break;
    else if (!quoted && *at == '\r' && at[1] == '\n') continue;
    *to++ = *at;
  }
  const char end = *at;
  *next = at + (end != 0);
  *to = 0;
  return end;
}

static size_t count_of(const char *text, char c)
{
  size_t count = 0;
  for (; *text; text++) count += *text == c;
  return count;
}

/* Cuts the text into fields; names and cells have room for all of them. */
static int cut(flesh_csv *csv)
{
  char *at = csv->text, end = ',';
  for (; end == ','; csv->columns++) {
    csv->names[csv->columns] = at;
    end = end_field(at, &at);
  }
  for (int line = 2; *at; line++) {
    int fields = 0;
    for (end = ','; end == ','; fields++) {
      if (fields < csv->columns) csv->cells[(size_t)csv->rows * (size_t)csv->columns + (size_t)fields] = at;
      end = end_field(at, &at);
    }
    if (fields != csv->columns)
      return flesh_fail(FLESH_ERR_FILE, "%s:%d: there are %d fields, but the header names %d; all rows have as many",
                        csv->path, line, fields, csv->columns);
    csv->rows++;
  }
  return FLESH_OK;
}

int flesh_csv_read(const char *path, flesh_csv *csv)
{
  size_t size;
  *csv = (flesh_csv){0};
  int status = flesh_file_load(path, &csv->text, &size);
  if (status) return status;
  if (strlen(csv->text) != size || !size)
    status = flesh_fail(FLESH_ERR_FILE, "%s: %s; CSV is text with a header row", path,
                        size ? "there is a zero byte in it" : "the file is empty");
  const size_t lines = count_of(csv->text, '\n') + 1, fields = lines + count_of(csv->text, ',');
  csv->path = strdup(path);
  csv->names = calloc(fields + 1, sizeof *csv->names);
  csv->cells = calloc(fields + 1, sizeof *csv->cells);
  if (!status && (!csv->path || !csv->names || !csv->cells))
    status = flesh_fail(FLESH_ERR_MEMORY, "%s: out of memory", path);
  if (!status) status = cut(csv);
  if (status) flesh_csv_clear(csv);
  return status;
}

void flesh_csv_clear(flesh_csv *csv)
{
  free(csv->path);
  free(csv->text);
  free(csv->names);
  free(csv->cells);
  *csv = (flesh_csv){0};
}

/* The units of history.csv's columns (observer.h), whose header has none. */
static const char *history_unit(const char *name)
{
  static const char *const units[][2] = {
      {"t", "s"},        {"h", "s"},           {"residual", "N"},     {"residual_target", "N"},
      {"volume", "m^3"}, {"contact_gap", "m"}, {"contact_force", "N"}};
  for (size_t k = 0; k < sizeof units / sizeof *units; k++)
    if (!strcmp(name, units[k][0])) return units[k][1];
  return strncmp(name, "energy_", 7) ? "" : "J";
}

void flesh_csv_label(const flesh_csv *csv, int column, char name[FLESH_CSV_NAME], char unit[FLESH_CSV_NAME])
{
  const char *header = csv->names[column], *bracket = strrchr(header, '['), *slash = strrchr(csv->path, '/');
  size_t length = strlen(header);
  *unit = 0;
  if (bracket && bracket > header && header[length - 1] == ']') {
    snprintf(unit, FLESH_CSV_NAME, "%.*s", (int)(header + length - 1 - bracket - 1), bracket + 1);
    length = (size_t)(bracket - header);
    while (length && header[length - 1] == ' ') length--;
  }
  snprintf(name, FLESH_CSV_NAME, "%.*s", (int)length, header);
  if (!*unit && !strcmp(slash ? slash + 1 : csv->path, "history.csv"))
    snprintf(unit, FLESH_CSV_NAME, "%s", history_unit(name));
  if (!strcmp(unit, "1")) *unit = 0;
}

int flesh_csv_matches(const flesh_csv *csv, int column, const char *word)
{
  char name[FLESH_CSV_NAME], unit[FLESH_CSV_NAME], longer[FLESH_CSV_NAME + 16];
  flesh_csv_label(csv, column, name, unit);
  if (!strcmp(word, csv->names[column])) return 1;
  if (!strncmp(word, "probe.", 6) && strcmp(word, "probe.")) word += 6;
  if (!strcmp(word, csv->names[column]) || !fnmatch(word, name, 0)) return 1;
  const char *dot = strrchr(word, '.');
  if (!dot || !dot[1] || dot[2] || !strchr("xyz", dot[1])) return 0;
  snprintf(longer, sizeof longer, "%.*s.position_%c", (int)(dot - word < FLESH_CSV_NAME ? dot - word : 0), word, dot[1]);
  return !strcmp(longer, name);
}

int flesh_csv_number(const flesh_csv *csv, int row, int column, double *value)
{
  const char *cell = csv->cells[(size_t)row * (size_t)csv->columns + (size_t)column];
  char *end;
  *value = NAN;
  if (!*cell) return 1;
  *value = strtod(cell, &end);
  return end != cell && !*end;
}
