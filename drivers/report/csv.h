/* csv.h: tables for a report: columns of numbers or texts as JSON. */
#ifndef FLESH_REPORT_CSV_H
#define FLESH_REPORT_CSV_H

#include <jansson.h>
#include <sqlite3.h>

/* Reads the CSV file folder/name (study/csv.h), whose first row names its columns, into a new list of {"name", "values"};
 * values are numbers or null where every cell is a number or empty, else texts. Of more than `most` rows (0: all of them)
 * it takes every k-th and the last one; *step (may be NULL) is that k. Torn rows are left out. *columns is NULL where
 * there is no such file, or no table in it. FLESH_ERR_FILE for what is no file of the result's folder (confine.h),
 * FLESH_ERR_MEMORY. */
int flesh_report_csv(const char *folder, const char *name, int most, json_t **columns, int *step);
/* The rows of a query, from the given column on, as such a list (new); NULL: SQLite has failed. */
json_t *flesh_report_query(sqlite3_stmt *query, int first);

/* The values of a column, borrowed; NULL without one. */
const json_t *flesh_report_column(const json_t *columns, const char *name);
/* How many rows there are. */
size_t flesh_report_rows(const json_t *columns);

/* folder/name, or in an empty folder the name, for the next few calls (cli/path.h). */
const char *flesh_report_path(const char *folder, const char *name);
/* A text file as a new string; NULL where there is none. FLESH_ERR_FILE for what is no file of the folder. */
int flesh_report_file(const char *folder, const char *name, json_t **text);
/* A JSON file as a new value; NULL where there is none, or no JSON in it. FLESH_ERR_FILE as before. */
int flesh_report_json(const char *folder, const char *name, json_t **value);
/* Whether there is anything of that name, which may be refused when it is read. */
int flesh_report_has(const char *folder, const char *name);

#endif
