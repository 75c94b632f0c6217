/* part.h: a part of a report: {"title", "path", "verdict", "text", "notes", "tables", "plots",
 * "grids", "sources"}. */
#ifndef FLESH_REPORT_PART_H
#define FLESH_REPORT_PART_H

#include <jansson.h>
#include <sqlite3.h>

#include "report/report.h"

/* A new part, which the report then holds; borrowed. NULL where memory is lacking, which the other
 * calls bear. */
json_t *flesh_report_part(flesh_report *report, const char *title, const char *path);

/* A sentence of the verdict, and one of what is missing or left out. */
void flesh_report_say(json_t *part, const char *format, ...) __attribute__((format(printf, 2, 3)));
void flesh_report_note(json_t *part, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Takes the columns; returns the table's number. Tables that are not open are folded. */
int flesh_report_table(json_t *part, const char *title, json_t *columns, int open);

/* A text that is folded, as a scene, or provenance as JSON; takes the value, NULL is left out. */
void flesh_report_source(json_t *part, const char *title, json_t *value);

/* A plot of columns x and y; series are added, or come from one table's column `group`. */
typedef struct flesh_report_plot {
  const char *title, *x, *y;
  int log_x, log_y;
  int lines;              /* points are joined */
  int choose;             /* the reader may take other columns */
  int table;              /* -1: series */
  const char *group;      /* NULL: one series */
  const char *where, *is; /* only rows whose column `where` is that text; NULL: all */
} flesh_report_plot;
/* Returns the plot (borrowed), for series. */
json_t *flesh_report_add_plot(json_t *part, const flesh_report_plot *plot);
void flesh_report_add_series(json_t *plot, int table, const char *name, const char *colour);

/* folder/file as a folded table and a series of the plot; a note where it cannot be read. */
int flesh_report_add_history(json_t *part, json_t *plot, const char *folder, const char *file,
                             const char *name, const char *colour);

/* Tells the part of a folder, empty where paths are whole, by the text `sql` of data/studies, on that database. */
int flesh_report_tell_of(flesh_report *report, json_t *part, const char *folder, const char *sql, sqlite3 *database);
/* On one in memory that `fill_database` (NULL: nobody) has filled. */
int flesh_report_tell(flesh_report *report, json_t *part, const char *folder, const char *sql,
                      int (*fill_database)(sqlite3 *database, const void *data), const void *data);

/* The colour of an energy by its letter; NULL for another name. */
const char *flesh_report_energy_colour(const char *letter);

#endif
