/* results.h: what a study's SQL makes of its cases: tables and words. */
#ifndef FLESH_STUDY_RESULTS_H
#define FLESH_STUDY_RESULTS_H

#include <sqlite3.h>

/* The places that results go to. */
typedef struct flesh_results {
  const char *out; /* folder */
  int words;       /* 1: the text is written, too */
  int quiet;       /* 1: no lines of stdout alone */
  const char *picture; /* the name for which * stands; NULL: the statements have none */
  void (*draw)(void *data, const char *folder, const char *name); /* of a script that stands; NULL: there are no pictures */
  void *data;
} flesh_results;

/* Executes the statements of the texts `sql`, which a NULL ends, in their order. What becomes of the rows of a SELECT says
 * the line `-- to NAME` above it:
 *   NAME.csv   they are that table in the folder `out`
 *   NAME.txt   the first column is lines of that text, of which there is one, and of stdout when it is written
 *   stdout     the first column is lines of stdout alone; stderr: of stderr
 *   error      a row is why there can be no results, a sentence: FLESH_ERR_ARGUMENT
 *   NAME.gp    the first column is lines of a script of gnuplot, which is drawn; without rows the script and picture of
 *              before go; NAME.dat has its data
 *   each.gp    the first column is the name of a script, and the second the script, which is drawn
 *   NAME.json  the one row is that file's JSON
 * Beside SQLite's functions there are number(format, x), x by printf's format for one double, "-" for NULL, without the
 * sign of a zero; number(x), in as few digits as read back as x; cell(format, width, x), a blank and that at the right
 * of `width` letters, by %.0e from 1e5 on; status_name(code) of a flesh_status; sign_test(wins, losses), the two-sided
 * probability that of so many fair coins so many or more fall to one side; plot(name, width, height, title, x, y), what
 * a script of a picture begins with (title and labels may be NULL; a further of_csv is 0 for other data than CSV, NULL
 * for a picture with a look of its own; then a suffix); and for scripts, by plot.h, quoted(text),
 * quoted_tick(text), quoted_file(name, suffix), log_ticks(axis, low, high) and colour(k). `path` names the database in
 * sentences. FLESH_ERR_FILE, FLESH_ERR_MEMORY. */
int flesh_results_make(sqlite3 *database, const char *path, const char *const *sql, const flesh_results *to);

/* Gives the statements of a text to `execute` with what their line `-- to NAME` names, empty where there is none, until one
 * fails. */
typedef int flesh_results_execute(void *data, sqlite3_stmt *query, const char *name);
int flesh_results_each(sqlite3 *database, const char *path, const char *sql, flesh_results_execute *execute, void *data);

#endif
