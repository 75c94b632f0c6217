// TEST quick needs=drivers
/* test_accuracy_mesh.c: what is reported of the errors of mesh and step (data/studies/mesh.sql, mesh_words.sql):
 * choices and words, on made-up figures. */
#include "results.h"

#include <math.h>
#include <string.h>

/* The tables of runs.sql and of the database, with default figures unless others are given. */
static const char tables[] =
    "CREATE TABLE results (id INTEGER PRIMARY KEY, status DEFAULT 'complete', status_code DEFAULT 0, tet_count, node_count, "
    "largest_poisson DEFAULT 0.49, cpu_s);"
    "CREATE TABLE table_rows (case_id INTEGER, data TEXT, number INTEGER PRIMARY KEY);"
    "CREATE TEMP TABLE wanted (id INTEGER PRIMARY KEY, number INTEGER);"
    "CREATE TEMP TABLE facts (number INTEGER PRIMARY KEY, data TEXT);"
    "CREATE TEMP TABLE runs (number INTEGER PRIMARY KEY, value);"
    "CREATE TEMP TABLE steps (number INTEGER PRIMARY KEY, method DEFAULT 'newmark', setting, step_text, tolerance, own DEFAULT 0, below "
    "DEFAULT 0, cpu_s, step_error);"
    "INSERT INTO steps (number, step_text, cpu_s) VALUES (0, '1/30', 0.005), (1, '1/60', 0.01), (2, '1/120', 0.02);"
    "UPDATE steps SET own = 1 WHERE number = 1;"
    "INSERT INTO facts VALUES (10, json_object('shared', 1, 'shared_method', 'newmark', 'shared_step', '1/60', 'point_load', ''));"
    "INSERT INTO wanted VALUES (10, 10);";

enum { ROWS = 4, STEPS = 3 };

static void execute(sqlite3 *database, const char *sql) { CHECK(!sqlite3_exec(database, sql, NULL, NULL, NULL)); }

/* Returns the words on a scene of 5000 tets whose motion is 2 m, given the errors of meshes and steps relative to the
 * motion, and CPU times; `more` is SQL that changes them. */
static char *words(const double mesh_errors[ROWS], const double step_errors[STEPS], double uncertainty, const char *more)
{
  static const struct {
    const char *element;
    int kind, refine, tets, own;
    double cpu_s;
  } rows[ROWS] = {{"tet4", 1, 0, 5000, 1, 0.01}, {"tet10-mean", 3, 0, 600, 0, 0.02}, {"tet10-mean", 3, 0, 5000, 0, 0.3},
                  {"tet4", 1, 1, 40000, 0, 0.1}};
  char sql[1000];
  sqlite3 *database = results_open(tables);
  for (int s = 0; s < STEPS; s++) {
    sqlite3_snprintf(sizeof sql, sql, "UPDATE steps SET step_error = %!.17g WHERE number = %d", step_errors[s], s);
    execute(database, sql);
  }
  for (int r = 0; r < ROWS; r++) {
    sqlite3_snprintf(sizeof sql, sql,
                     "INSERT INTO facts VALUES (%d, json_object('mesh', %d, 'element', %Q, 'kind', %d, 'refine', %d, 'source', 'a.yaml', "
                     "'own', %d)); INSERT INTO wanted VALUES (%d, %d); INSERT INTO results (id, tet_count, node_count, cpu_s) VALUES "
                     "(%d, %d, %d, %!.17g); INSERT INTO table_rows (case_id, data) VALUES (10, json_object('mesh', %d, 'error', %!.17g, 'below', %d))",
                     20 + r, r, rows[r].element, rows[r].kind, rows[r].refine, rows[r].own, 20 + r, 20 + r, 20 + r, rows[r].tets,
                     rows[r].tets / 5, rows[r].cpu_s, r, mesh_errors[r], mesh_errors[r] <= uncertainty);
    execute(database, sql);
  }
  sqlite3_snprintf(sizeof sql, sql,
                   "INSERT INTO table_rows (case_id, data) VALUES (10, json_object('first', 'tet10-mean', 'second', 'tet10', 'apart', %!.17g, "
                   "'uncertainty', %!.17g, 'motion', 2.0)), (10, json_object('element', 'tet10-mean', 'levels', 3, 'order', 1.5, "
                   "'coarse', 600, 'fine', 5000)), (10, json_object('element', 'tet10', 'levels', 3, 'order', 1.5, 'coarse', 600, "
                   "'fine', 5000))", 2 * uncertainty, 2 * uncertainty);
  execute(database, sql);
  execute(database, more ? more : "");
  execute(database, "CREATE TEMP TABLE shared AS SELECT number, step_error, cpu_s FROM steps WHERE number = 1");
  return results_make_of(database, (const char *const[]){flesh_own_text("mesh"),
                                                         flesh_own_text("mesh_words"), NULL}, NULL, NULL, "mesh.txt");
}

static void lacks(const char *text, const char *what)
{
  CHECK(!strstr(text, what));
  if (strstr(text, what)) printf("# it says: %s\n", what);
}

static void a_mesh_that_dominates_is_reported(void)
{
  const double meshes[] = {0.51, 0.004, 0.002, 0.2}, steps[] = {0.02, 0.0001, 0.00003};
  char *text = words(meshes, steps, 0.001, NULL);
  CHECK_TEXT(text, "At a Poisson's ratio of 0.49 your 5000 tets (tet4) are 51 % off; the step (newmark at 1/60 s) adds 0.01 %.");
  CHECK_TEXT(text, "The mesh makes the error: a shorter step gains nothing");
  lacks(text, "The step makes");
  CHECK_TEXT(text, "For 1 % in all: tet10-mean, 600 tets, newmark at 1/60 s, 0.02 s (mesh 0.4 %, step 0.01 %).");
  /* At 10 % the long step suffices, at half the time measured with the other. */
  CHECK_TEXT(text, "For 10 % in all: tet10-mean, 600 tets, newmark at 1/30 s, about 0.01 s (mesh 0.4 %, step 2 %).");
  CHECK_TEXT(text, "For 0.1 % in all: no run reaches it.");
  free(text);
  /* A measured time is no estimate. */
  text = words(meshes, steps, 0.001, "INSERT INTO facts VALUES (40, json_object('timed_mesh', 1, 'timed_by', 0)); INSERT INTO wanted "
                                     "VALUES (40, 40); INSERT INTO results (id, cpu_s) VALUES (40, 0.013)");
  CHECK_TEXT(text, "For 10 % in all: tet10-mean, 600 tets, newmark at 1/30 s, 0.013 s (mesh 0.4 %, step 2 %).");
  free(text);
  /* A run with another step, or a failed one, is not offered. */
  text = words(meshes, steps, 0.001, "UPDATE results SET status_code = -6, status = 'failed' WHERE id = 21; DELETE FROM table_rows WHERE "
                                     "data ->> 'mesh' = 1");
  CHECK_TEXT(text, "For 1 % in all: tet10-mean, 5000 tets, newmark at 1/60 s, 0.3 s");
  CHECK_TEXT(text, "  tet10-mean       600      120            -         0.01   failed");
  free(text);
}

static void a_step_that_dominates_is_reported(void)
{
  char *text = words((const double[]){0.01, 0.004, 0.0005, 0.002}, (const double[]){0.4, 0.2, 0.1}, 0.001, NULL);
  CHECK_TEXT(text, "are 1 % off; the step (newmark at 1/60 s) adds 20 %.");
  CHECK_TEXT(text, "The step makes the error: a finer mesh gains nothing");
  lacks(text, "The mesh makes");
  CHECK_TEXT(text, "For 10 % in all: no run reaches it."); /* 10 % from the step leaves nothing for the mesh */
  free(text);
  text = words((const double[]){0.05, 0.004, 0.0005, 0.002}, (const double[]){0.4, 0.04, 0.01}, 0.001, NULL);
  CHECK_TEXT(text, "Mesh and step make errors of like size.");
  /* 5 + 4 % make 9 %. */
  CHECK_TEXT(text, "For 10 % in all: tet4, 5000 tets, newmark at 1/60 s, 0.01 s (mesh 5 %, step 4 %).");
  free(text);
}

/* Between runs errors are interpolated as a power of the time. Beyond the finest, which is 20 times too inaccurate for
 * tet4, they are assumed to fall with order 2 at best, so 20^(3/2) times the tets are needed. */
static void times_to_an_error_are_interpolated(void)
{
  const double steps[] = {0.02, 0.0001, 0.00003};
  /* tet10-mean is interpolated half-way, in logarithms, from 2 to 0.5 %: sqrt(0.02 * 0.3) s. */
  char *text = words((const double[]){0.51, 0.02, 0.005, 0.2}, steps, 0.001, NULL);
  CHECK_TEXT(text, "To a mesh error of 1 %: tet10-mean 0.077 s, tet4 at least 8.9 s, at least 115 times as much.");
  CHECK_TEXT(text, "Order of convergence in the size of the cells: tet10 1.5, tet10-mean 1.5 (");
  free(text);
  /* The coarsest mesh of tet10-mean already suffices; tet4 passes 1 % at 0.01 s * 10^(ln 51 / ln 102). */
  text = words((const double[]){0.51, 0.009, 0.005, 0.005}, steps, 0.001, NULL);
  CHECK_TEXT(text, "To a mesh error of 1 %: tet10-mean 0.02 s, tet4 0.071 s, 3.5 times as much.");
  free(text);
}

static void what_the_reference_leaves_open_is_not_reported(void)
{
  const double meshes[] = {0.51, 0.01, 0.01, 0.2}, steps[] = {0.02, 0.0001, 0.00003};
  char *text = words(meshes, steps, 0.02, NULL);
  CHECK_TEXT(text, "errors below 2 % are not reported");
  CHECK_TEXT(text, "For 1 % in all: the reference is less accurate than that");
  CHECK_TEXT(text, "For 10 % in all: tet10-mean, 600 tets");
  CHECK_TEXT(text, "(mesh under 2 %, step");
  lacks(text, "To a mesh error");
  free(text);
  text = words(meshes, steps, 0.02, "UPDATE table_rows SET data = json_replace(data, '$.second', '') WHERE data ->> 'first' IS NOT NULL; "
                                    "UPDATE facts SET data = json_replace(data, '$.point_load', 'spring') WHERE number = 10");
  CHECK_TEXT(text, "no other element checks the reference");
  CHECK_TEXT(text, "warning: spring acts at single nodes");
  free(text);
  text = words(meshes, steps, 0.02, "DELETE FROM table_rows WHERE data ->> 'mesh' IS NULL");
  CHECK_TEXT(text, "No reference");
  lacks(text, "in all");
  free(text);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(a_mesh_that_dominates_is_reported), TEST(a_step_that_dominates_is_reported),
                   TEST(times_to_an_error_are_interpolated), TEST(what_the_reference_leaves_open_is_not_reported));
}
