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

/* How rows are written. */
typedef struct flesh_format {
  const char *begin, *between, *end; /* around and between the cells of a row */
  void (*text)(FILE *stream, const char *text); /* prints a text */
  const char *missing; /* stands for what has no number; "null" also for infinite ones */
  const char *rule[2]; /* below the names: for each column, and behind the last one; NULL: nothing */
  int is_named;        /* 1: each cell begins with the name of its column; else the first row has the names */
} flesh_format;

/* Prints the rows of a query of a database; `path` names the database in error messages. FLESH_ERR_FILE,
 * FLESH_ERR_MEMORY. */
int flesh_format_print(const char *path, sqlite3_stmt *query, const flesh_format *format, FILE *stream);

#define FLESH_FORMAT_DECLARE(name, doc) extern const flesh_format flesh_format_##name;
FLESH_FORMAT_LIST(FLESH_FORMAT_DECLARE)

#endif
