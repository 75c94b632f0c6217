/* tables.h: the tables and views of a study's database, within the modules that write it. */
#ifndef FLESH_STUDY_TABLES_H
#define FLESH_STUDY_TABLES_H

#include "study/study.h"

/* Makes the tables, within a transaction. Refuses columns named as others are. */
int flesh_study_tables_create(flesh_study_store *store, const flesh_study *study);

/* Writes the derived columns in place of those that are there, within a transaction. */
int flesh_study_derived_write(flesh_study_store *store, const flesh_study *study);

/* Makes the views, within a transaction. *bad is the derived column that is not valid, -1 if none; the views are then
 * made without it and those after it. */
int flesh_study_views_write(flesh_study_store *store, int *bad);

/* FLESH_ERR_FILE with SQLite's words when the statement is not valid. */
int flesh_study_store_prepare(flesh_study_store *store, const char *sql, sqlite3_stmt **statement);

/* Ends the transaction that has begun: commits, or rolls back and keeps the error `status`. */
int flesh_study_store_end(flesh_study_store *store, int status);
/* Path of the file of that name beside the database. New text. */
const char *flesh_study_store_beside(const flesh_study_store *store, const char *name);

/* Adds the cases of the store's shard that the database has not, within a transaction, and notes in the table `wanted` of
 * this connection which ids this study's cases have (store_plan.c). */
int flesh_study_store_plan(flesh_study_store *store, const flesh_study *study);

#endif
