/* formats.h: the formats in which tables of databases are written. For each there is a file format_NAME.c, which
 * defines flesh_format_NAME, and a row here, which adds the file to the build and the name to --format. */
#ifndef FLESH_STUDY_FORMATS_H
#define FLESH_STUDY_FORMATS_H

#include <sqlite3.h>
#include <stdio.h>

/* ROW(name, description). */
#define FLESH_FORMAT_LIST(ROW) \
  ROW(csv, "CSV with a header (default)") \
  ROW(jsonl, "JSON Lines") \
  ROW(markdown, "a table of Markdown")

typedef struct flesh_format_cell {
  enum { FLESH_CELL_NONE, FLESH_CELL_WHOLE, FLESH_CELL_NUMBER, FLESH_CELL_TEXT } kind;
  long long whole;
  double number;
  const char *text; /* never NULL in a cell of text */
} flesh_format_cell;

typedef struct flesh_format {
  int has_names; /* 1: the names of the columns are printed as the first row */
  void (*row)(FILE *stream, int count, const char *const *names, const flesh_format_cell *cells);
  void (*rule)(FILE *stream, int count); /* prints what stands below the names; NULL: nothing does */
} flesh_format;

/* Prints the rows of a query of a database; `path` names the database in error messages. FLESH_ERR_FILE,
 * FLESH_ERR_MEMORY. */
int flesh_format_print(const char *path, sqlite3_stmt *query, const flesh_format *format, FILE *stream);

/* Prints a number so that it reads back bit for bit; prints nothing for a cell of another kind. */
void flesh_format_number(FILE *stream, const flesh_format_cell *cell);

#define FLESH_FORMAT_DECLARE(name, doc) extern const flesh_format flesh_format_##name;
FLESH_FORMAT_LIST(FLESH_FORMAT_DECLARE)

#endif
