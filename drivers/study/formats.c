/* formats.c: prints the rows of a query as a table. */
#include "study/formats.h"

#include <math.h>

#include "base/error.h"
#include "base/file.h"
#include "study/database.h"

static void print_cell(FILE *stream, sqlite3_stmt *query, int column, const flesh_format *format)
{
  const double number = sqlite3_column_double(query, column);
  switch (sqlite3_column_type(query, column)) {
  case SQLITE_INTEGER: fprintf(stream, "%lld", (long long)sqlite3_column_int64(query, column)); break;
  case SQLITE_FLOAT:
    if (*format->missing && !isfinite(number)) fputs(format->missing, stream);
    else flesh_number_print(stream, number);
    break;
  case SQLITE_NULL: fputs(format->missing, stream); break;
  default: {
    const char *text = (const char *)sqlite3_column_text(query, column);
    format->text(stream, text ? text : "");
  }
  }
}

/* Prints the names of the columns, or the row that the query has reached. */
static void print_row(FILE *stream, sqlite3_stmt *query, const flesh_format *format, int names)
{
  for (int c = 0; c < sqlite3_column_count(query); c++) {
    fputs(c ? format->between : format->begin, stream);
    if (names || format->is_named) format->text(stream, sqlite3_column_name(query, c));
    if (format->is_named) fputs(": ", stream);
    if (!names) print_cell(stream, query, c, format);
  }
  fputs(format->end, stream);
}

int flesh_format_print(const char *path, sqlite3_stmt *query, const flesh_format *format, FILE *stream)
{
  int code;
  if (!format->is_named) print_row(stream, query, format, 1);
  for (int c = 0; c < sqlite3_column_count(query) && *format->rule; c++) fputs(format->rule[0], stream);
  if (*format->rule) fputs(format->rule[1], stream);
  while ((code = sqlite3_step(query)) == SQLITE_ROW) print_row(stream, query, format, 0);
  return code == SQLITE_DONE ? FLESH_OK : flesh_database_fail(sqlite3_db_handle(query), path, "cannot be read");
}
