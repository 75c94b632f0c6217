/* rows.h: a file that grows by whole rows: however the program ends, the file is readable up to its last row. */
#ifndef FLESH_OUTPUT_ROWS_H
#define FLESH_OUTPUT_ROWS_H

#include <stdio.h>

typedef struct flesh_rows {
  FILE *stream; /* where rows are printed; NULL: not open */
  char *path;
  long whole; /* bytes up to the end of the last complete row */
} flesh_rows;

/* Makes a new file in the place of an older one. FLESH_ERR_MEMORY, FLESH_ERR_FILE; *rows is then closed. */
int flesh_rows_open(const char *path, flesh_rows *rows);
/* Opens the file and cuts it to its first `whole` bytes. FLESH_ERR_FILE if it has fewer; *rows is then closed. */
int flesh_rows_resume(const char *path, long whole, flesh_rows *rows);
/* Hands a row to the system; called after each row. FLESH_ERR_FILE: the part of the row that was written is removed. */
int flesh_rows_flush(flesh_rows *rows);
/* Closes the file; harmless if it is not open. Fails as flesh_rows_flush. */
int flesh_rows_close(flesh_rows *rows);

#endif
