/* csv.c: reads and writes CSV; writes texts in a folder of results. */
#include "study/csv.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/file.h"
#include "base/scan.h"

/* A place in the text, its line, and whether the field before it lacks its closing quote. */
typedef struct cursor {
  char *at;
  int line, open;
} cursor;

static int is_blank(char c) { return c == ' ' || c == '\t'; }

/* Ends the field at the cursor in place, without quotes and surrounding blanks, and moves behind it; returns the
 * character that ended it: ',', '\n' or 0. */
static char end_field(cursor *c, char **field)
{
  char *from = c->at + strspn(c->at, " \t"), *to = from, *kept = from;
  int quoted = *from == '"';
  *field = from;
  for (from += quoted; *from; from++) {
    if (quoted && *from == '"') {
      if (from[1] != '"') {
        quoted = 0;
        kept = to;
        continue;
      }
      from++;
    } else if (!quoted && (*from == ',' || *from == '\n')) break;
    else if (!quoted && *from == '\r' && from[1] == '\n') continue;
    c->line += *from == '\n';
    *to++ = *from;
  }
  const char end = *from;
  c->at = from + (end != 0);
  c->line += end == '\n';
  c->open = quoted;
  while (to > kept && !quoted && is_blank(to[-1])) to--;
  *to = 0;
  return end;
}

/* Moves to the next row; returns whether there is one. */
static int find_row(cursor *c)
{
  while (*c->at == '#' || *c->at == '\n' || (*c->at == '\r' && c->at[1] == '\n')) {
    c->at += strcspn(c->at, "\n");
    if (*c->at) c->at++, c->line++;
  }
  return *c->at != 0;
}

/* Splits the text into fields; names and cells have room for all of them. */
static int cut(flesh_csv *csv, flesh_csv_rows rows)
{
  static const char mark[] = "\xef\xbb\xbf"; /* byte order mark of UTF-8, which spreadsheets write */
  cursor c = {.at = csv->text + (strncmp(csv->text, mark, 3) ? 0 : 3), .line = 1};
  while (find_row(&c)) {
    const int header = !csv->columns, line = c.line;
    char **to = header ? csv->names : csv->cells + (size_t)csv->rows * (size_t)csv->columns, *field, end;
    int fields = 0;
    do {
      end = end_field(&c, &field);
      if (header || fields < csv->columns) to[fields] = field;
      fields++;
    } while (end == ',');
    if (rows == FLESH_CSV_WHOLE && c.open)
      return flesh_fail(FLESH_ERR_FILE, "%s:%d: a quote has no end; it must be closed", csv->path, line);
    if (rows == FLESH_CSV_WHOLE && header && fields == 1 && strpbrk(*to, ";\t"))
      return flesh_fail(FLESH_ERR_FILE, "%s:%d: the header has %s and no comma; commas separate the columns of CSV", csv->path, line,
                        strchr(*to, ';') ? "semicolons" : "tabs");
    if (rows == FLESH_CSV_WHOLE && !header && fields != csv->columns)
      return flesh_fail(FLESH_ERR_FILE, "%s:%d: there are %d fields, but the header names %d; every row must have as many",
                        csv->path, line, fields, csv->columns);
    const int whole = !c.open && (end || rows == FLESH_CSV_WHOLE);
    if (header && whole) csv->columns = fields;
    else csv->rows += whole && fields == csv->columns;
  }
  return csv->columns || rows == FLESH_CSV_TORN
             ? FLESH_OK
             : flesh_fail(FLESH_ERR_FILE, "%s: %s; CSV is text with a header row", csv->path,
                          *csv->text ? "there is no table" : "the file is empty");
}

int flesh_csv_read(const char *path, flesh_csv_rows rows, flesh_csv *csv)
{
  size_t size, fields = 2;
  *csv = (flesh_csv){0};
  int status = flesh_file_load(path, &csv->text, &size);
  if (status) return status;
  if (rows == FLESH_CSV_WHOLE && strlen(csv->text) != size)
    status = flesh_fail(FLESH_ERR_FILE, "%s: there is a zero byte in it; CSV is text with a header row", path);
  for (char *at = csv->text; at < csv->text + size; at++) {
    if (!*at) *at = ' ';
    fields += *at == ',' || *at == '\n';
  }
  csv->path = strdup(path);
  csv->names = calloc(2 * fields, sizeof *csv->names);
  if (!status && (!csv->path || !csv->names)) status = flesh_no_memory_for(path);
  csv->cells = csv->names + fields;
  if (!status) status = cut(csv, rows);
  if (status) flesh_csv_clear(csv);
  return status;
}

void flesh_csv_clear(flesh_csv *csv)
{
  free(csv->path);
  free(csv->text);
  free(csv->names);
  *csv = (flesh_csv){0};
}

const char *flesh_csv_cell(const flesh_csv *csv, int row, int column)
{
  return csv->cells[(size_t)row * (size_t)csv->columns + (size_t)column];
}

int flesh_csv_number(const flesh_csv *csv, int row, int column, double *value)
{
  const char *cell = flesh_csv_cell(csv, row, column);
  char *end;
  *value = NAN;
  if (!*cell) return 1;
  *value = strtod(cell, &end);
  return end != cell && !*end;
}

void flesh_csv_print(FILE *stream, const char *text)
{
  const size_t size = strlen(text);
  if (*text != '#' && !strpbrk(text, ",\"\r\n") && !is_blank(*text) && !is_blank(text[size ? size - 1 : 0])) {
    fputs(text, stream);
    return;
  }
  putc('"', stream);
  for (; *text; text++) {
    if (*text == '"') putc('"', stream);
    putc(*text, stream);
  }
  putc('"', stream);
}

void flesh_table_field(FILE *stream, double value)
{
  putc(',', stream);
  if (!isnan(value)) flesh_number_print(stream, value);
}

const char *flesh_table_text(char text[FLESH_TABLE_TEXT], const char *format, double value)
{
  snprintf(text, FLESH_TABLE_TEXT, format, value);
  char *sign = text + strspn(text, " ");
  if ((*sign == '-' || *sign == '+') && !sign[1 + strspn(sign + 1, "0.")]) memmove(sign, sign + 1, strlen(sign));
  return text;
}
