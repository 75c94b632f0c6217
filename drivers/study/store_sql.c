/* store_sql.c: statements to the database of a study, and SQLite's words where one fails. */
#include "base/error.h"
#include "study/database.h"
#include "study/tables.h"

int flesh_study_store_fail(const flesh_study_store *store, const char *doing)
{
  return flesh_database_fail(store->database, store->path, doing);
}

int flesh_study_store_execute(flesh_study_store *store, const char *sql)
{
  return sqlite3_exec(store->database, sql, NULL, NULL, NULL) ? flesh_study_store_fail(store, "cannot be written")
                                                              : FLESH_OK;
}

int flesh_study_store_end(flesh_study_store *store, int status)
{
  if (!status) status = flesh_study_store_execute(store, "COMMIT");
  if (status && !sqlite3_get_autocommit(store->database))
    sqlite3_exec(store->database, "ROLLBACK", NULL, NULL, NULL);
  return status;
}

int flesh_study_store_prepare(flesh_study_store *store, const char *sql, sqlite3_stmt **statement)
{
  return sqlite3_prepare_v2(store->database, sql, -1, statement, NULL) ? flesh_study_store_fail(store, "is no study")
                                                                        : FLESH_OK;
}
