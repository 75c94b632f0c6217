/* database.h: databases of sweeps to be read, which may come from anyone: a view in one may never end. */
#ifndef FLESH_STUDY_DATABASE_H
#define FLESH_STUDY_DATABASE_H

#include <sqlite3.h>

/* Opens a regular file to read it (SQLITE_OPEN_READONLY or _READWRITE). All queries together then end after 1e7 operations
 * of SQLite's machine and 1000 for each byte of the file, far beyond what the views of a sweep need, and on a signal that
 * was asked for (interrupt.h): with SQLITE_INTERRUPT. FLESH_ERR_FILE, FLESH_ERR_MEMORY; *database is to be closed by
 * sqlite3_close in any case. */
int flesh_database_read(const char *path, int flags, sqlite3 **database);
/* Allows the operations for one more file, which is then attached. FLESH_ERR_FILE for what is no regular file. */
int flesh_database_allow(const char *path);

/* Fails with what SQLite says of the last call: FLESH_ERR_MEMORY, FLESH_ERR_INTERRUPTED or FLESH_ERR_FILE. `doing`: what
 * cannot be done. */
int flesh_database_fail(sqlite3 *database, const char *path, const char *doing);

/* Executes a statement that has no results with a value for each parameter, by a letter of `kinds`: i an int, l an
 * sqlite3_int64, d a double, NaN as NULL, t a text or NULL. Returns SQLite's code, SQLITE_DONE where that goes well. */
int flesh_database_put(sqlite3_stmt *statement, const char *kinds, ...);

#endif
