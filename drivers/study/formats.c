/* formats.c: prints the rows of a query as a table. */
#include "study/formats.h"

#include <stdlib.h>

#include "base/error.h"
#include "base/file.h"
#include "study/database.h"

void flesh_format_number(FILE *stream, const flesh_format_cell *cell)
{
  if (cell->kind == FLESH_CELL_WHOLE) fprintf(stream, "%lld", cell->whole);
  if (cell->kind == FLESH_CELL_NUMBER) flesh_number_print(stream, cell->number);
}

static flesh_format_cell cell_of(sqlite3_stmt *query, int column)
{
  switch (sqlite3_column_type(query, column)) {
  case SQLITE_INTEGER: return (flesh_format_cell){.kind = FLESH_CELL_WHOLE, .whole = sqlite3_column_int64(query, column)};
  case SQLITE_FLOAT: return (flesh_format_cell){.kind = FLESH_CELL_NUMBER, .number = sqlite3_column_double(query, column)};
  case SQLITE_NULL: return (flesh_format_cell){.kind = FLESH_CELL_NONE};
  default: {
    const char *text = (const char *)sqlite3_column_text(query, column);
    return (flesh_format_cell){.kind = FLESH_CELL_TEXT, .text = text ? text : ""};
  }
  }
}

int flesh_format_print(const char *path, sqlite3_stmt *query, const flesh_format *format, FILE *stream)
{
  const int count = sqlite3_column_count(query);
  const char **names = calloc((size_t)count + 1, sizeof *names);
  flesh_format_cell *cells = calloc((size_t)count + 1, sizeof *cells);
  int code = SQLITE_DONE, status = names && cells ? FLESH_OK : flesh_no_memory();
  for (int c = 0; c < count && !status; c++)
    cells[c] = (flesh_format_cell){.kind = FLESH_CELL_TEXT, .text = names[c] = sqlite3_column_name(query, c)};
  if (!status && format->has_names) format->row(stream, count, names, cells);
  if (!status && format->rule) format->rule(stream, count);
  while (!status && (code = sqlite3_step(query)) == SQLITE_ROW) {
    for (int c = 0; c < count; c++) cells[c] = cell_of(query, c);
    format->row(stream, count, names, cells);
  }
  if (!status && code != SQLITE_DONE) status = flesh_database_fail(sqlite3_db_handle(query), path, "cannot be read");
  free(names), free(cells);
  return status;
}
