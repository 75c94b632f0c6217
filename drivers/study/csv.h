/* csv.h: reads tables in CSV (RFC 4180) with a header row into memory; prints texts as fields; writes CSV and texts in
 * a folder of results. */
#ifndef FLESH_STUDY_CSV_H
#define FLESH_STUDY_CSV_H

#include <stdio.h>

typedef struct flesh_csv {
  char *path, *text;
  int columns, rows;
  char **names; /* [columns] as in the header */
  char **cells; /* [rows*columns], which point into `text`; stand behind the names */
} flesh_csv;

typedef enum flesh_csv_rows {
  FLESH_CSV_WHOLE, /* the table must be complete */
  FLESH_CSV_TORN   /* rows without an end, as of a killed run, and rows of other lengths are left out */
} flesh_csv_rows;

/* Reads a file. Empty lines, lines that begin with # and blanks around a field are left out. FLESH_ERR_FILE if it is
 * not a regular file; for FLESH_CSV_WHOLE also, with path and line, if there is no table, or one separated by
 * semicolons or tabs, a zero byte, an unclosed quote or a row with another number of fields than the header.
 * FLESH_ERR_MEMORY. *csv is then cleared. */
int flesh_csv_read(const char *path, flesh_csv_rows rows, flesh_csv *csv);
void flesh_csv_clear(flesh_csv *csv); /* also for a zeroed one */

/* Returns a cell; row and column must be in range. */
const char *flesh_csv_cell(const flesh_csv *csv, int row, int column);
/* Reads the number in a cell; NaN if it is empty. Returns 0 if it is a word. */
int flesh_csv_number(const flesh_csv *csv, int row, int column, double *value);

/* Prints a text as a field, in quotes if necessary. */
void flesh_csv_print(FILE *stream, const char *text);

/* Prints a comma and the number so that it reads back bit for bit; only the comma for NaN. */
void flesh_table_field(FILE *stream, double value);

/* Prints the value by a printf format for one double; a value that is shown as zero has no sign. Returns `text`. */
enum { FLESH_TABLE_TEXT = 48 };
const char *flesh_table_text(char text[FLESH_TABLE_TEXT], const char *format, double value);

#endif
