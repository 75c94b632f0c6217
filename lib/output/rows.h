/* rows.h: a file that grows by whole rows: whatever ends the program, it can be read up to the last of them. */
#ifndef FLESH_OUTPUT_ROWS_H
#define FLESH_OUTPUT_ROWS_H

#include <stdio.h>

typedef struct flesh_rows {
  FILE *stream; /* where rows are printed; NULL: not open */
  char *path;
  long whole; /* bytes up to the end of the last complete row */
} flesh_rows;

/* A fresh file in the place of an older one. FLESH_ERR_MEMORY, FLESH_ERR_FILE; closed then. */
int flesh_rows_open(const char *path, flesh_rows *rows);
/* The file as it was when its whole rows were so many bytes. FLESH_ERR_FILE where it has fewer; closed then. */
int flesh_rows_resume(const char *path, long whole, flesh_rows *rows);
/* After each row: hands it to the system. FLESH_ERR_FILE, the part of a row that was written taken away. */
int flesh_rows_flush(flesh_rows *rows);
/* FLESH_ERR_FILE as above. What is not open stays so. */
int flesh_rows_close(flesh_rows *rows);

#endif
