/* csv.h: tables as CSV (RFC 4180) with a header row, read into memory, and texts as their fields; CSV and texts in a folder of
 * results. */
#ifndef FLESH_STUDY_CSV_H
#define FLESH_STUDY_CSV_H

#include <stdio.h>

#include "base/file.h"

typedef struct flesh_csv {
  char *path, *text;
  int columns, rows;
  char **names; /* [columns] as the header has them */
  char **cells; /* [rows*columns], into `text`; behind the names */
} flesh_csv;

typedef enum flesh_csv_rows {
  FLESH_CSV_WHOLE, /* the table is whole, or refused */
  FLESH_CSV_TORN   /* rows without an end, as of a run that was killed, are left out, and so are rows of other lengths */
} flesh_csv_rows;

/* Reads a file. Empty lines, lines that begin with # and blanks around a field are left out. FLESH_ERR_FILE for what is no
 * regular file; for FLESH_CSV_WHOLE also, with path and line, where there is no table or one separated by semicolons or tabs,
 * a zero byte, a quote without an end or a row that has not the header's number of fields. FLESH_ERR_MEMORY. Cleared then. */
int flesh_csv_read(const char *path, flesh_csv_rows rows, flesh_csv *csv);
void flesh_csv_clear(flesh_csv *csv); /* a zeroed one too */

/* The column of that name; -1: there is none. */
int flesh_csv_find(const flesh_csv *csv, const char *name);
/* A cell, in the range of rows and columns. */
const char *flesh_csv_cell(const flesh_csv *csv, int row, int column);
/* The number of a cell; NaN where it is empty. 0 where it is a word. */
int flesh_csv_number(const flesh_csv *csv, int row, int column, double *value);

/* Prints a text as a field, in quotes where it needs them. */
void flesh_csv_print(FILE *stream, const char *text);

/* Opens folder/name, whole or not at all. */
int flesh_table_open(const char *folder, const char *name, flesh_file *file);

/* Writes the text into folder/name and, once it stands there, to stdout. */
int flesh_table_say(const char *folder, const char *name, const char *text);

/* A comma and the number so that it reads back bit for bit; nothing behind the comma for NaN. */
void flesh_table_field(FILE *stream, double value);

/* Prints the value by a format of printf for one double; what shows as zero has no sign. Returns `text`. */
enum { FLESH_TABLE_TEXT = 48 };
const char *flesh_table_text(char text[FLESH_TABLE_TEXT], const char *format, double value);

#endif
