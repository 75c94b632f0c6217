/* column.h: what the columns of tables are called. */
#ifndef FLESH_PLOT_COLUMN_H
#define FLESH_PLOT_COLUMN_H

#include "study/csv.h"

/* A column's name without its unit, and its unit: of a header like "t [s]", else what history.csv has for that name; ""
 * where there is none or it is 1. */
enum { FLESH_CSV_NAME = 96 };
void flesh_csv_label(const flesh_csv *csv, int column, char name[FLESH_CSV_NAME], char unit[FLESH_CSV_NAME]);

/* Whether `word` means the column: its header, its header without the unit, either with "probe." before it,
 * NAME.x of NAME.position_x; * stands for any letters. */
int flesh_csv_matches(const flesh_csv *csv, int column, const char *word);

#endif
