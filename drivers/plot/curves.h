/* curves.h: the tables of runs that `flesh plot` draws. */
#ifndef FLESH_PLOT_CURVES_H
#define FLESH_PLOT_CURVES_H

#include "study/csv.h"
#include "study/results.h"

enum { FLESH_CSV_NAME = 96 }; /* room for a column's name, and for its unit */
/* Splits a column's header into its name and its unit: from a header like "t [s]", else the unit that history.csv has
 * for that name; "" if there is none, or if it is 1. */
void flesh_csv_label(const flesh_csv *csv, int column, char name[FLESH_CSV_NAME], char unit[FLESH_CSV_NAME]);
/* Returns the column of that name (without unit) and sets `unit` to its unit; -1 if there is none. */
int flesh_csv_find_label(const flesh_csv *csv, const char *wanted, char unit[FLESH_CSV_NAME]);

/* Makes SQL tables of the files in `paths` [count], folders of results or CSV files. `columns` is executed on their
 * headers (plot_columns.sql) and makes a view `needed` of the columns whose cells `rest` needs. Results of both go to
 * `to`. FLESH_ERR_FILE, FLESH_ERR_MEMORY, and errors of the statements. */
int flesh_curves_make(sqlite3 *database, int count, char *const *paths, const char *columns, const char *rest,
                      const flesh_results *to);

#endif
