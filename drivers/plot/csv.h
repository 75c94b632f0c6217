/* csv.h: CSV files with a header, as flesh writes them, in memory. */
#ifndef FLESH_PLOT_CSV_H
#define FLESH_PLOT_CSV_H

#include <stddef.h>

typedef struct flesh_csv {
  char *path, *text;
  int columns, rows;
  char **names; /* [columns] as the header has them */
  char **cells; /* [rows*columns], into `text` */
} flesh_csv;

/* Reads a file (RFC 4180). FLESH_ERR_FILE with path and line where rows have not the header's number of fields;
 * FLESH_ERR_MEMORY; cleared then. */
int flesh_csv_read(const char *path, flesh_csv *csv);
void flesh_csv_clear(flesh_csv *csv); /* a zeroed one too */

/* A column's name without its unit, and its unit: of a header like "t [s]", else what history.csv has for that name; ""
 * where there is none or it is 1. */
enum { FLESH_CSV_NAME = 96 };
void flesh_csv_label(const flesh_csv *csv, int column, char name[FLESH_CSV_NAME], char unit[FLESH_CSV_NAME]);

/* Whether `word` means the column: its header, its header without the unit, either with "probe." before it,
 * NAME.x of NAME.position_x; * stands for any letters. */
int flesh_csv_matches(const flesh_csv *csv, int column, const char *word);

/* The number of a cell; NaN where it is empty. 0 where it is a word. */
int flesh_csv_number(const flesh_csv *csv, int row, int column, double *value);

#endif
