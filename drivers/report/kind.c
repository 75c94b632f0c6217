/* kind.c: what a folder or file of results is, by what it holds. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/error.h"
#include "report/report.h"

/* Whether there is such a file; -1 where memory is wanting. */
static int holds(const char *folder, const char *name)
{
  struct stat info;
  char *path = malloc(strlen(folder) + strlen(name) + 2);
  if (!path) return -1;
  sprintf(path, "%s/%s", folder, name);
  const int found = !stat(path, &info) && S_ISREG(info.st_mode);
  free(path);
  return found;
}

int flesh_report_find_kind(const char *path, flesh_report_kind *kind)
{
  static const struct {
    const char *file;
    flesh_report_kind kind;
  } marks[] = {{"drift.csv", FLESH_REPORT_DRIFT},
               {"accuracy.json", FLESH_REPORT_ACCURACY},
               {"hardcases.csv", FLESH_REPORT_HARDCASES},
               {"sweep.db", FLESH_REPORT_SWEEP},
               {"scene.yaml", FLESH_REPORT_RUN}};
  struct stat info;
  const size_t length = strlen(path);
  if (stat(path, &info))
    return flesh_fail(FLESH_ERR_FILE, "%s: there is no such folder", *path ? path : "''");
  if (!S_ISDIR(info.st_mode)) {
    *kind = FLESH_REPORT_SWEEP;
    if (length > 3 && !strcmp(path + length - 3, ".db")) return FLESH_OK;
    return flesh_fail(FLESH_ERR_FILE,
                      "%s: this is a file; a report takes the folder of a result, or the database "
                      "(.db) of a sweep",
                      path);
  }
  for (size_t k = 0; k < sizeof marks / sizeof *marks; k++) {
    *kind = marks[k].kind;
    const int found = holds(path, marks[k].file);
    if (found < 0) return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a report");
    if (found) return FLESH_OK;
  }
  return flesh_fail(
      FLESH_ERR_FILE,
      "%s: this is no folder of a result: it has none of scene.yaml, drift.csv, accuracy.json, "
      "hardcases.csv and sweep.db",
      path);
}
