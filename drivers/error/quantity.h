/* quantity.h: the columns of a run's tables that can have bars, and the bars. */
#ifndef FLESH_ERROR_QUANTITY_H
#define FLESH_ERROR_QUANTITY_H

#include "error/companion.h"
#include "plot/curves.h"

/* A table with its times. */
typedef struct flesh_error_table {
  flesh_csv csv;
  double *t; /* [rows], s */
} flesh_error_table;

/* Reads folder/name; without such a file the table has no columns. FLESH_ERR_FILE, FLESH_ERR_MEMORY. */
int flesh_error_table_read(const char *folder, const char *name, flesh_error_table *table);
void flesh_error_table_clear(flesh_error_table *table);

typedef struct flesh_error_quantity {
  int column; /* of the run's table */
  char name[FLESH_CSV_NAME], unit[FLESH_CSV_NAME];
  int kind;   /* the first quantity of its kind, as components of a vector are; energies are one kind */
  double range; /* of the kind over time */
  double *values; /* [rows] */
  double *bars[FLESH_ERROR_KINDS]; /* [rows]; NULL: none */
  char why[FLESH_ERROR_KINDS][FLESH_ERROR_WORDS]; /* there is no bar although there are companions; empty: there is */
  double better; /* the last value of a better companion; NaN: none */
} flesh_error_quantity;

typedef struct flesh_error_quantities {
  flesh_error_table table;
  int count;
  flesh_error_quantity *list;
} flesh_error_quantities;

/* The quantities of folder/name, history.csv or probes.csv, without bars. */
int flesh_error_quantities_read(const char *folder, const char *name, const flesh_scene *scene,
                                flesh_error_quantities *quantities);
void flesh_error_quantities_clear(flesh_error_quantities *quantities);

/* Adds the bars of a kind by its judge from the tables of all judges' companions. FLESH_ERR_MEMORY. */
int flesh_error_quantities_judge(flesh_error_quantities *quantities, flesh_error_kind kind, const flesh_error_judge *judge,
                                 flesh_error_table (*tables)[FLESH_ERROR_COMPANIONS]);
/* Writes the table with its bars as further columns to folder/name. */
int flesh_error_quantities_write(const flesh_error_quantities *quantities, const char *folder, const char *name);

extern const char *const flesh_error_kind_names[FLESH_ERROR_KINDS];

#endif
