/* results.h: runs a study's SQL on tables that a test makes up. */
#ifndef FLESH_TEST_RESULTS_H
#define FLESH_TEST_RESULTS_H

#include "temporary.h"

#include <sqlite3.h>
#include <stdlib.h>
#include <unistd.h>

#include "study/embedded.h"
#include "study/results.h"
#include "test.h"

static inline sqlite3 *results_open(const char *tables)
{
  sqlite3 *database = NULL;
  CHECK(!sqlite3_open(":memory:", &database) && !sqlite3_exec(database, tables, NULL, NULL, NULL));
  return database;
}

/* Returns the text of the file in the folder, allocated. */
static inline char *results_take(const char *folder, const char *name)
{
  char path[200], *text = calloc(1, 200000);
  snprintf(path, sizeof path, "%s/%s", folder, name);
  FILE *file = fopen(path, "r");
  CHECK(text && file);
  if (text && file) text[fread(text, 1, 199999, file)] = 0;
  if (file) fclose(file);
  return text;
}

/* Runs the SQL, returns its text and table (allocated), and closes the database. */
static inline char *results_make_of(sqlite3 *database, const char *const *sql, const char *table, char **csv, const char *name)
{
  char folder[] = "results_XXXXXX";
  CHECK(mkdtemp(folder) != NULL);
  fflush(stdout);
  const int out = dup(1); /* discard words on stdout, which would be no TAP */
  CHECK(freopen("/dev/null", "w", stdout) != NULL);
  const int status = flesh_results_make(database, "made up", sql, &(flesh_results){.out = folder, .words = 1});
  fflush(stdout);
  dup2(out, 1), close(out);
  CHECK_OK(status);
  sqlite3_close(database);
  char *rows = table ? results_take(folder, table) : NULL, *text = results_take(folder, name);
  test_folder_remove(folder); /* remove tables that were not asked for */
  if (csv) *csv = rows;
  else free(rows);
  return text;
}

/* Runs the SQL of that name in data/studies, or `sql` itself, and verdict.txt in the same way. */
static inline char *results_make(sqlite3 *database, const char *name, const char *sql, const char *table, char **csv)
{
  const char *const all[] = {name ? flesh_own_text(name) : sql, NULL};
  return results_make_of(database, all, table, csv, "verdict.txt");
}

#endif
