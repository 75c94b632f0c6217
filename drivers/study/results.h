/* results.h: what a study's SQL makes of its cases: tables and words. */
#ifndef FLESH_STUDY_RESULTS_H
#define FLESH_STUDY_RESULTS_H

#include <sqlite3.h>

/* Executes the statements of the texts `sql`, which a NULL ends, in their order. The rows of a SELECT whose first line is `-- to NAME.csv` become that
 * table in the folder `out`; the first column of one with `-- to NAME.txt` becomes lines of that text, of which there is
 * one, and of stdout when it is written; with `-- to stdout` lines of stdout alone. Without `words` there is no text.
 * Beside SQLite's functions there are number(format, x), x by printf's format for one double, "-" for NULL, without the
 * sign of a zero; cell(format, width, x), a blank and that at the right of `width` letters, by %.0e from 1e5 on;
 * status_name(code) of a flesh_status; and sign_test(wins, losses), the two-sided probability that of so many fair coins so
 * many or more fall to one side. `path` names the database in sentences. FLESH_ERR_FILE, FLESH_ERR_MEMORY. */
int flesh_results_make(sqlite3 *database, const char *path, const char *const *sql, const char *out, int words);

#endif
