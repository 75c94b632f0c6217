/* curves.h: the tables of runs that `flesh plot` draws. */
#ifndef FLESH_PLOT_CURVES_H
#define FLESH_PLOT_CURVES_H

#include "study/csv.h"
#include "study/results.h"

enum { FLESH_CSV_NAME = 96 }; /* room of a column's name, and of its unit */
/* A column's name without its unit, and its unit: of a header like "t [s]", else what history.csv has for that name; ""
 * where there is none or it is 1. */
void flesh_csv_label(const flesh_csv *csv, int column, char name[FLESH_CSV_NAME], char unit[FLESH_CSV_NAME]);

/* Draws what the database's table `asked` says (plot_columns.sql) of the tables in `paths` [count]: folders of results, or
 * CSV files. FLESH_ERR_ARGUMENT with a sentence for columns that are not there, have words or other units, and where
 * nothing can be drawn; FLESH_ERR_FILE, FLESH_ERR_MEMORY. */
int flesh_curves_make(sqlite3 *database, int count, char *const *paths, const flesh_results *to);

#endif
