/* report.h: what a report is made of: words, tables and plots as JSON, and bodies in motion as packed numbers.
 *
 * The element `payload` of the page has the data, deflated (zlib) and in base 64. Unpacked they are twelve decimal digits
 * (the length of the JSON that follows), the JSON, and bytes of numbers. `parts` of the JSON has words, tables and plots,
 * `view` the runs, with places in the bytes, and `start`, the time that is shown first. The element `still` is the still
 * picture. A list [at, count] stores numbers by add_list of body.c.
 *
 * A run's frames follow each other from `at`. Each has x of all nodes, then y, then z, in multiples of `quantum`, the same
 * of the obstacles' vertices, and J_mean, stress and speed of all nodes, each [low, step] times its number plus low. Each
 * number n is stored as its difference from the line through the two frames before, n - (2 a - b); in the second frame as
 * n - a, in the first as n less the number before it in the frame. A bit per tet follows, the lowest first, that changes
 * when the tet begins or ceases to be inverted.
 *
 * `quantum` is 1/65536 of the body's diagonal at rest, so a position is off by half of that at most; a field by 1/2048 of
 * the range of its colours. Larger values than 2^30 of these are clipped. */
#ifndef FLESH_REPORT_H
#define FLESH_REPORT_H

#include <jansson.h>
#include <sqlite3.h>
#include <stdio.h>

#include "scene/arena.h"

/* The page itself, made at build time of page/ and three/: HTML with the marks @TITLE@ and
 * @LEAD@, @STILL@, @PAYLOAD@. */
extern const char flesh_report_page[];

/* Text or numbers in memory, printed to `stream`; the data are those up to the last flush. */
typedef struct flesh_report_bytes {
  FILE *stream;
  char *data;
  size_t size;
} flesh_report_bytes;

/* Reports a lack of memory: FLESH_ERR_MEMORY. */
int flesh_report_no_memory(void);

/* FLESH_ERR_MEMORY. */
int flesh_report_bytes_open(flesh_report_bytes *bytes);
/* Brings data and size up to date. FLESH_ERR_MEMORY where what was printed is not all there. */
int flesh_report_bytes_flush(flesh_report_bytes *bytes);
void flesh_report_bytes_close(flesh_report_bytes *bytes); /* a zeroed one too */

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

/* A run whose bodies are to be seen. */
typedef struct flesh_report_shown {
  const char *folder, *name;
  int optional; /* left out, with a note, where it cannot be opened */
} flesh_report_shown;

typedef struct flesh_report {
  json_t *parts;            /* what is read from top to bottom */
  json_t *view;             /* the bodies; null: none */
  flesh_report_bytes still;   /* a PNG of them as they are first seen; empty: none */
  flesh_report_bytes numbers; /* that `view` speaks of */
  flesh_arena arena; /* of the texts of the next, and of what the view is made of */
  flesh_report_shown *shown;
  int shown_count;
  int most_frames; /* of a run */
} flesh_report;

/* A new part {"title", "path", "verdict", "notes", "tables", "plots", "grids", "sources"}, which the report then holds;
 * borrowed. NULL where memory is lacking, which the other calls bear. */
json_t *flesh_report_part(flesh_report *report, const char *title, const char *path);
/* Adds a sentence on what is missing or left out. */
void flesh_report_note(json_t *part, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* Tells the part of a folder, empty where paths are whole, by the text `sql` of data/studies, on that database. */
int flesh_report_tell_of(flesh_report *report, json_t *part, const char *folder, const char *sql, sqlite3 *database);
/* Tells the part on a database in memory that `fill_database` (NULL: nobody) has filled. */
int flesh_report_tell(flesh_report *report, json_t *part, const char *folder, const char *sql,
                      int (*fill_database)(sqlite3 *database, const void *data), const void *data);

/* Appends a part about the folder of a study, told by the text `sql` with the table of report_runs.sql. */
int flesh_report_add_study(flesh_report *report, const char *title, const char *sql, const char *folder);
/* Appends a part about all runs, or about one sweep, which is named by its folder or its database. */
int flesh_report_add_runs(flesh_report *report, int count, char *const *folders);
int flesh_report_add_sweep(flesh_report *report, const char *path);
/* Whether it is named as a database is. */
int flesh_report_is_database(const char *path);

/* Fills report->view, report->still and report->numbers from the runs noted. */
int flesh_report_make_view(flesh_report *report);

/* Writes the page, whole or not at all; *size: of the file, *packed: of the payload in it, bytes.
 */
int flesh_report_write(const flesh_report *report, const char *title, json_t *head, const char *path, size_t *size,
                       size_t *packed);

#endif
