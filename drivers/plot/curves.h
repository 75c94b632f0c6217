/* curves.h: the tables of runs that `flesh plot` draws. */
#ifndef FLESH_PLOT_CURVES_H
#define FLESH_PLOT_CURVES_H

#include "study/csv.h"
#include "study/results.h"

enum { FLESH_CSV_NAME = 96 }; /* room of a column's name, and of its unit */
/* A column's name without its unit, and its unit: of a header like "t [s]", else what history.csv has for that name; ""
 * where there is none or it is 1. */
void flesh_csv_label(const flesh_csv *csv, int column, char name[FLESH_CSV_NAME], char unit[FLESH_CSV_NAME]);
/* The column of that name without its unit, which `unit` is then; -1: none. */
int flesh_csv_find_label(const flesh_csv *csv, const char *wanted, char unit[FLESH_CSV_NAME]);

/* Tells SQL of the tables in `paths` [count], folders of results or CSV files: `columns` is executed on their headers
 * (plot_columns.sql) and says in a view `needed` which cells `rest` needs. What both make goes to `to`. FLESH_ERR_FILE,
 * FLESH_ERR_MEMORY, and what the statements refuse. */
int flesh_curves_make(sqlite3 *database, int count, char *const *paths, const char *columns, const char *rest,
                      const flesh_results *to);

#endif
