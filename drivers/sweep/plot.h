/* plot.h: what the pictures of a sweep share. */
#ifndef FLESH_SWEEP_PLOT_H
#define FLESH_SWEEP_PLOT_H

#include "sweep/sweep.h"
#include "study/tables.h"

enum { FLESH_SWEEP_TICKS = 2000, FLESH_SWEEP_NAME = 120, FLESH_SWEEP_LABEL = 48 };

/* The options of `flesh sweep plot`; x, y, z and by are columns or SQLite's expressions. */
typedef struct flesh_sweep_picture {
  flesh_study_store store;
  const char *x, *y, *z, *by, *where, *table, *log, *title;
  char folder[1024], name[FLESH_SWEEP_NAME];
} flesh_sweep_picture;

/* The condition of queries; `where` is NULL where none was given. */
static inline const char *flesh_sweep_condition(const flesh_sweep_picture *p) { return p->where ? p->where : "1"; }

/* Distinct values of a column in SQLite's order: what stands along an axis, or distinguishes series. */
typedef struct flesh_sweep_ticks {
  int count, words; /* words: some are no numbers */
  char label[FLESH_SWEEP_TICKS][FLESH_SWEEP_LABEL], is_number[FLESH_SWEEP_TICKS];
  double value[FLESH_SWEEP_TICKS];
} flesh_sweep_ticks;

/* Prepares the query and frees `sql`; FLESH_ERR_ARGUMENT with SQLite's words. */
int flesh_sweep_plot_prepare(flesh_sweep_picture *p, sqlite3_stmt **query, char *sql);
/* Whether the query has one more row; *status where it cannot be read. */
int flesh_sweep_plot_next(const flesh_sweep_picture *p, sqlite3_stmt *query, int *status);

/* Reads the ticks of a column; one for all cases when it is NULL. */
int flesh_sweep_ticks_read(flesh_sweep_picture *p, const char *column, flesh_sweep_ticks *t);
void flesh_sweep_ticks_write(FILE *stream, char axis, const flesh_sweep_ticks *t);

/* The expression of a figure's value, NULL for cases that have none; to be freed by sqlite3_free. */
char *flesh_sweep_plot_value(const flesh_sweep_picture *p, const char *figure);

int flesh_sweep_plot_heat(flesh_sweep_picture *p);

#endif
