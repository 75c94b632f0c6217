/* tables.h: the tables and views of a study's database, for the modules that write it. */
#ifndef FLESH_STUDY_TABLES_H
#define FLESH_STUDY_TABLES_H

#include "study/study.h"

/* Creates the tables, within a transaction. Fails if a column has the name of another. */
int flesh_study_tables_create(flesh_study_store *store, const flesh_study *study);

/* Replaces the derived columns, within a transaction. */
int flesh_study_derived_write(flesh_study_store *store, const flesh_study *study);

/* Makes the views, within a transaction. *bad is the number of an invalid derived column, -1 if there is none; the
 * views are then made without it and those after it. */
int flesh_study_views_write(flesh_study_store *store, int *bad);

/* Begins a statement that plans cases again. */
#define FLESH_STUDY_PLAN_AGAIN "UPDATE cases SET status = 'planned', worker = NULL, started = NULL WHERE "

/* Prepares a statement; FLESH_ERR_FILE with SQLite's message if it is invalid. */
int flesh_study_store_prepare(flesh_study_store *store, const char *sql, sqlite3_stmt **statement);

/* Ends the transaction: commits, or on an error rolls back and returns `status`. */
int flesh_study_store_end(flesh_study_store *store, int status);
/* Returns the path of a file beside the database, valid for the next few calls (cli/path.h). */
const char *flesh_study_store_beside(const flesh_study_store *store, const char *name);

/* Adds the cases of the store's shard that the database lacks, within a transaction, and writes the ids of this study's
 * cases to the connection's table `wanted` (store_cases.c). */
int flesh_study_store_plan(flesh_study_store *store, const flesh_study *study);

#endif
