/* tables.h: the tables and views of a sweep's database, within the modules that write it. */
#ifndef FLESH_SWEEP_TABLES_H
#define FLESH_SWEEP_TABLES_H

#include "sweep/sweep.h"

/* Makes the tables, within a transaction. Refuses columns named as others are. */
int flesh_sweep_tables_create(flesh_sweep_store *store, const flesh_sweep *sweep);

/* Name and expression of the columns of `results` that are there whatever varies: before and behind the figures. */
extern const char *const flesh_sweep_case_columns[][2];
extern const char *const flesh_sweep_last_columns[][2];

/* Makes the views, within a transaction. *bad is the derived column that is not valid, -1 if none; the views are then
 * made without it and those after it. */
int flesh_sweep_views_write(flesh_sweep_store *store, int *bad);

/* FLESH_ERR_FILE with SQLite's words when the statement is not valid. */
int flesh_sweep_store_prepare(flesh_sweep_store *store, const char *sql, sqlite3_stmt **statement);

/* Ends the transaction that has begun: commits, or rolls back and keeps the error `status`. */
int flesh_sweep_store_end(flesh_sweep_store *store, int status);
/* Path of the file of that name beside the database. New text. */
char *flesh_sweep_store_beside(const flesh_sweep_store *store, const char *name);

#endif
