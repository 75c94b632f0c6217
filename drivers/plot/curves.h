/* curves.h: the curves that `flesh plot` draws: columns of the tables of runs. */
#ifndef FLESH_PLOT_CURVES_H
#define FLESH_PLOT_CURVES_H

#include "study/csv.h"

enum { FLESH_CSV_NAME = 96 }; /* room of a column's name, and of its unit */
/* A column's name without its unit, and its unit: of a header like "t [s]", else what history.csv has for that name; ""
 * where there is none or it is 1. */
void flesh_csv_label(const flesh_csv *csv, int column, char name[FLESH_CSV_NAME], char unit[FLESH_CSV_NAME]);

typedef struct flesh_curve {
  char *title;
  int count, drawn; /* drawn: points that can be: finite, and positive where the axis is logarithmic */
  double *x, *y;    /* [count] */
} flesh_curve;

typedef struct flesh_curves {
  int count;
  flesh_curve *curves;
  char x_label[2 * FLESH_CSV_NAME + 8], y_label[2 * FLESH_CSV_NAME + 8]; /* with units */
  double low[2], high[2]; /* of what can be drawn, of x and y */
} flesh_curves;

/* The options of the command line. */
typedef struct flesh_curves_wanted {
  int path_count, y_count;
  char *const *paths; /* folders of results, or CSV files */
  char *const *y;
  const char *x, *by; /* NULL: time, else the first column; no groups */
  int log[2];         /* of x and y */
} flesh_curves_wanted;

/* Errors: FLESH_ERR_ARGUMENT with a sentence for columns that are not there, have words or other units, and where
 * nothing can be drawn; FLESH_ERR_FILE, FLESH_ERR_MEMORY. Cleared then. */
int flesh_curves_read(const flesh_curves_wanted *wanted, flesh_curves *curves);
void flesh_curves_clear(flesh_curves *curves);

#endif
