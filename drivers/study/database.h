/* database.h: reads databases of sweeps, which may come from anyone: a view in one may never end. */
#ifndef FLESH_STUDY_DATABASE_H
#define FLESH_STUDY_DATABASE_H

#include <sqlite3.h>

/* Opens a regular file (SQLITE_OPEN_READONLY or _READWRITE) to read it. All queries together may take 1e7 operations of
 * SQLite's machine and 1000 for each byte of the file, far more than the views of a sweep need; beyond that, and on a
 * signal that was asked for (interrupt.h), they end with SQLITE_INTERRUPT. FLESH_ERR_FILE, FLESH_ERR_MEMORY; the caller
 * closes *database by sqlite3_close in any case. */
int flesh_database_read(const char *path, int flags, sqlite3 **database);
/* Allows the operations for one more file, which is then attached. FLESH_ERR_FILE if it is not a regular file. */
int flesh_database_allow(const char *path);

/* Fails with SQLite's message on the last call: FLESH_ERR_MEMORY, FLESH_ERR_INTERRUPTED or FLESH_ERR_FILE. `doing`:
 * what failed, as "cannot be opened". */
int flesh_database_fail(sqlite3 *database, const char *path, const char *doing);

/* Executes a statement without results, with a value for each parameter; a letter of `kinds` gives its type: i an int,
 * d a double, with NaN as NULL, t a text or NULL. Returns SQLite's code, SQLITE_DONE on success. */
int flesh_database_put(sqlite3_stmt *statement, const char *kinds, ...);

#endif
