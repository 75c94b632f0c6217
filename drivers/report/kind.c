/* kind.c: what a folder or file of results is, by what it holds. */
#include <string.h>
#include <sys/stat.h>

#include "base/confine.h"
#include "base/error.h"
#include "report/csv.h"
#include "report/report.h"

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
  if (flesh_path_stat(path, &info))
    return flesh_fail(FLESH_ERR_FILE, "%s: there is no such folder", *path ? path : "''");
  if (!S_ISDIR(info.st_mode)) {
    *kind = FLESH_REPORT_SWEEP;
    if (length > 3 && !strcmp(path + length - 3, ".db")) return FLESH_OK;
    return flesh_fail(FLESH_ERR_FILE,
                      "%s: this is a file; a report takes the folder of a result, or the database "
                      "(.db) of a sweep",
                      path);
  }
  const int status = flesh_confine(path);
  if (status) return status;
  for (size_t k = 0; k < sizeof marks / sizeof *marks; k++) {
    *kind = marks[k].kind;
    if (flesh_report_has(path, marks[k].file)) return FLESH_OK;
  }
  return flesh_fail(
      FLESH_ERR_FILE,
      "%s: this is no folder of a result: it has none of scene.yaml, drift.csv, accuracy.json, "
      "hardcases.csv and sweep.db",
      path);
}
