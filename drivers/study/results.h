/* results.h: makes the results of a study, tables and texts, from its cases by SQL. */
#ifndef FLESH_STUDY_RESULTS_H
#define FLESH_STUDY_RESULTS_H

#include <sqlite3.h>

/* Destinations of the results. */
typedef struct flesh_results {
  const char *out; /* folder */
  int words;       /* 1: the text is written, too */
  int quiet;       /* 1: no lines that only stdout would get */
  const char *picture; /* name that replaces * in a NAME; NULL: the statements have no * */
  void (*draw)(void *data, const char *folder, const char *name); /* called for a finished script; NULL: there are no pictures */
  void *data;
} flesh_results;

/* Executes the statements of the texts `sql`, which NULL ends, in order. A line `-- to NAME` above a SELECT says what becomes
 * of its rows:
 *   NAME.csv   a table in the folder `out`
 *   NAME.txt   the first column gives the lines of a text, of which there is one; when it is written, also of stdout
 *   stdout     the first column gives lines that only stdout gets; stderr: only stderr
 *   error      a row is a sentence why there can be no results: FLESH_ERR_ARGUMENT
 *   NAME.gp    the first column gives the lines of a gnuplot script, which is drawn; without rows, an earlier script and its
 *              picture are removed. NAME.dat has its data
 *   each.gp    the first column names a script, and the second is the script, which is drawn
 *   NAME.json  the one row is the JSON of that file
 * Beside SQLite's functions there are
 *   number(format, x)           x by printf's format for one double; "-" for NULL; a zero has no sign
 *   number(x)                   x in as few digits as read back as x
 *   cell(format, width, x)      a blank and number(format, x) at the right of `width` letters, by %.0e from 1e5 on
 *   status_name(code)           the name of a flesh_status
 *   path()                      the path of the database
 *   shell_word(text)            the text as a word of a shell
 *   sign_test(wins, losses)     the two-sided probability that at least as many of that many fair coins fall to one side
 *   plot(name, width, height, title, x, y)  the beginning of a picture's script; title and labels may be NULL. A seventh
 *                               argument of_csv is 0 for data other than CSV, NULL for a picture with its own look; an eighth
 *                               is a suffix
 *   quoted(text), quoted_tick(text), quoted_file(name, suffix), log_ticks(axis, low, high), colour(k)  as in plot.h
 * `path` names the database in error messages. FLESH_ERR_FILE, FLESH_ERR_MEMORY. */
int flesh_results_make(sqlite3 *database, const char *path, const char *const *sql, const flesh_results *to);

/* Passes each statement of a text to `execute`, with the NAME of its line `-- to NAME`, "" without one, until a call
 * fails. */
typedef int flesh_results_execute(void *data, sqlite3_stmt *query, const char *name);
int flesh_results_each(sqlite3 *database, const char *path, const char *sql, flesh_results_execute *execute, void *data);

#endif
