/* database.c: opens databases, limits the cost of their queries, and reports errors in SQLite's words. */
#include "study/database.h"

#include <stdarg.h>
#include <string.h>
#include <sys/stat.h>

#include "base/confine.h"
#include "base/error.h"
#include "base/scan.h"
#include "cli/interrupt.h"
#include "cli/path.h"
#include "scene/words.h"
#include "study/tables.h"

enum { OPERATIONS_A_LOOK = 100000 };
static const double OPERATIONS = 1e7, OPERATIONS_PER_BYTE = 1000;

static double looks_left; /* for all databases that are read, together */

/* Returns 1 to end the query. */
static int look(void *data)
{
  (void)data;
  return flesh_interrupt_signal() || --looks_left < 0;
}

int flesh_database_allow(const char *path)
{
  struct stat info = {0};
  const int status = flesh_regular_check(path);
  if (status) return status;
  flesh_path_stat(path, &info);
  looks_left += (OPERATIONS + OPERATIONS_PER_BYTE * (double)info.st_size) / OPERATIONS_A_LOOK;
  return FLESH_OK;
}

int flesh_database_read(const char *path, int flags, sqlite3 **database)
{
  *database = NULL;
  const int status = flesh_database_allow(path);
  if (status) return status;
  if (sqlite3_open_v2(path, database, flags, NULL)) return flesh_database_fail(*database, path, "cannot be opened");
  sqlite3_progress_handler(*database, OPERATIONS_A_LOOK, look, NULL);
  return FLESH_OK;
}

int flesh_database_fail(sqlite3 *database, const char *path, const char *doing)
{
  const int code = sqlite3_errcode(database);
  if (code == SQLITE_INTERRUPT && flesh_interrupt_signal())
    return flesh_fail(FLESH_ERR_INTERRUPTED, "%s: interrupted by %s", path, flesh_interrupt_name());
  if (code == SQLITE_INTERRUPT)
    return flesh_fail(FLESH_ERR_FILE,
                      "%s: %s: its queries take more operations than those of any sweep with a file of this size; one of its "
                      "views may never end",
                      path, doing);
  if (code == SQLITE_CORRUPT) doing = "is damaged";
  return flesh_fail(code == SQLITE_NOMEM ? FLESH_ERR_MEMORY : FLESH_ERR_FILE, "%s: %s: %s", path, doing,
                    sqlite3_errmsg(database));
}

int flesh_database_put(sqlite3_stmt *statement, const char *kinds, ...)
{
  int code = SQLITE_OK;
  va_list values;
  va_start(values, kinds);
  for (int at = 1; kinds[at - 1] && !code; at++) switch (kinds[at - 1]) {
    case 'i': code = sqlite3_bind_int(statement, at, va_arg(values, int)); break;
    case 'd': code = sqlite3_bind_double(statement, at, va_arg(values, double)); break;
    default: code = sqlite3_bind_text(statement, at, va_arg(values, const char *), -1, SQLITE_TRANSIENT);
    }
  va_end(values);
  if (!code) code = sqlite3_step(statement);
  sqlite3_reset(statement);
  return code;
}

int flesh_study_store_fail(const flesh_study_store *store, const char *doing)
{
  return flesh_database_fail(store->database, store->path, doing);
}

const char *flesh_study_store_words(const flesh_study_store *store, const char *table, char text[FLESH_STUDY_WORDS])
{
  static const char unknown[] = "no such column: ";
  const size_t begin = sizeof unknown - 1;
  char ending[512];
  snprintf(text, FLESH_STUDY_WORDS - sizeof ending - strlen("; "), "%s", sqlite3_errmsg(store->database));
  char *sql = strncmp(text, unknown, begin) ? NULL : sqlite3_mprintf("SELECT * FROM %s", table);
  sqlite3_stmt *query = NULL;
  if (sql && !sqlite3_prepare_v2(store->database, sql, -1, &query, NULL)) {
    flesh_suggestion suggestion = {.word = text + begin};
    for (int c = 0; c < sqlite3_column_count(query); c++) flesh_suggestion_offer(&suggestion, sqlite3_column_name(query, c));
    flesh_suggestion_text(&suggestion, ending);
    strcat(strcat(text, "; "), *ending ? ending : "`flesh schema results` lists the figures of a run");
  }
  sqlite3_finalize(query);
  sqlite3_free(sql);
  return text;
}

int flesh_study_store_execute(flesh_study_store *store, const char *format, ...)
{
  va_list arguments;
  va_start(arguments, format);
  char *sql = sqlite3_vmprintf(format, arguments);
  va_end(arguments);
  if (!sql) return flesh_no_memory();
  const int code = sqlite3_exec(store->database, sql, NULL, NULL, NULL);
  sqlite3_free(sql);
  return code ? flesh_study_store_fail(store, "cannot be written") : FLESH_OK;
}

int flesh_study_store_number(flesh_study_store *store, const char *format, ...)
{
  sqlite3_stmt *query = NULL;
  va_list arguments;
  va_start(arguments, format);
  char *sql = sqlite3_vmprintf(format, arguments);
  va_end(arguments);
  const int found = sql && !sqlite3_prepare_v2(store->database, sql, -1, &query, NULL) && sqlite3_step(query) == SQLITE_ROW;
  const int number = found ? sqlite3_column_int(query, 0) : 0;
  sqlite3_finalize(query);
  sqlite3_free(sql);
  return number;
}

const char *flesh_study_store_beside(const flesh_study_store *store, const char *name)
{
  const char *slash = strrchr(store->path, '/');
  return flesh_path("%.*s%s", slash ? (int)(slash + 1 - store->path) : 0, store->path, name);
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
