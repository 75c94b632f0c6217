/* database.c: opens databases, and bounds what their queries may cost. */
#include "study/database.h"

#include <sys/stat.h>

#include "base/confine.h"
#include "base/error.h"
#include "base/scan.h"
#include "cli/interrupt.h"

enum { OPERATIONS_A_LOOK = 100000 };
static const double OPERATIONS = 1e7, OPERATIONS_PER_BYTE = 1000;

static double looks_left; /* of all databases that are read */

/* 1 ends the query. */
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
  return flesh_fail(code == SQLITE_NOMEM ? FLESH_ERR_MEMORY : FLESH_ERR_FILE, "%s: %s: %s", path, doing,
                    sqlite3_errmsg(database));
}
