/* report.h: the content of a report: words, tables and plots as JSON, and bodies in motion as packed numbers.
 *
 * The page's element `payload` has the data, deflated (zlib) and in base 64. Unpacked they are twelve decimal digits
 * (the length of the JSON), the JSON, and numbers as bytes. In the JSON, `parts` has words, tables and plots, `view`
 * has the runs, with their places in the bytes, and `start`, the time that is shown first. The element `still` is the
 * still picture. A list [at, count] has its numbers at that place, in the form of add_list of view.c.
 *
 * A run's frames follow each other from `at`. A frame has x of all nodes, then y, then z, as multiples of `quantum`;
 * the same for the obstacles' vertices; then J_mean, stress and speed at all nodes, which are a number times `step`
 * plus `low`, from the field's [low, step]. Each number n is stored as its difference from the extrapolation of the two
 * frames before, n - (2 a - b); in the second frame as n - a, and in the first as n less the number before it in the
 * frame. A bit per tet follows, the lowest first, which is set when the tet begins or ceases to be inverted.
 *
 * `quantum` is 1/65536 of the body's diagonal at rest, so positions are off by at most half of that; fields are off by
 * at most 1/2048 of the range of their colours. Numbers are clipped at 2^30. */
#ifndef FLESH_REPORT_H
#define FLESH_REPORT_H

#include <jansson.h>
#include <sqlite3.h>
#include <stdio.h>

#include "scene/arena.h"

/* The page itself, made at build time from page/ and three/: HTML with the marks @TITLE@, @LEAD@, @STILL@ and
 * @PAYLOAD@. */
extern const char flesh_report_page[];

/* Text or numbers in memory, printed to `stream`; `data` is what was printed up to the last flush. */
typedef struct flesh_report_bytes {
  FILE *stream;
  char *data;
  size_t size;
} flesh_report_bytes;

/* Fails with FLESH_ERR_MEMORY and a sentence. */
int flesh_report_no_memory(void);

/* Updates data and size. FLESH_ERR_MEMORY if not all that was printed could be kept. */
int flesh_report_bytes_flush(flesh_report_bytes *bytes);

/* Returns the values of a column, borrowed; NULL if there is no such column. */
const json_t *flesh_report_column(const json_t *columns, const char *name);
/* Returns folder/name, or only the name if `folder` is empty, for the next few calls (cli/path.h). */
const char *flesh_report_path(const char *folder, const char *name);
/* Reads a text file into a new string, or JSON into a new value; NULL if there is no such file, or no JSON in it.
 * FLESH_ERR_FILE if it is not a file in the folder. */
int flesh_report_file(const char *folder, const char *name, int is_json, json_t **value);
/* Returns whether there is anything of that name; reading it may still be refused. */
int flesh_report_has(const char *folder, const char *name);

/* A run whose bodies are shown. */
typedef struct flesh_report_shown {
  const char *folder, *name;
  int optional; /* left out, with a note, if it cannot be opened */
  int frames;   /* number of frames that the run has; once it is opened */
} flesh_report_shown;

typedef struct flesh_report {
  json_t *parts;            /* parts of the page, from top to bottom */
  json_t *view;             /* the bodies; null: there are none */
  flesh_report_bytes still;   /* a PNG of the bodies as they are shown first; empty: none */
  flesh_report_bytes numbers; /* numbers to which `view` refers */
  flesh_arena arena; /* memory of the texts of `shown`, and of the making of the view */
  flesh_report_shown *shown;
  int shown_count;
  int most_frames; /* limit for each run; 0: none */
} flesh_report;

/* Adds a new part {"title", "path", "verdict", "notes", "tables", "plots", "grids", "sources"} to the report, which
 * owns it; returns it. NULL if memory runs out, which the other functions accept. */
json_t *flesh_report_part(flesh_report *report, const char *title, const char *path);
/* Adds a sentence on what is missing or was left out. */
void flesh_report_note(json_t *part, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* Fills the part by the SQL text `sql` of data/studies on a database. `folder` is that of its files, or empty if paths
 * are complete. */
int flesh_report_tell(flesh_report *report, json_t *part, const char *folder, const char *sql, sqlite3 *database);

/* Fills report->view, report->still and report->numbers from the runs in `shown`. */
int flesh_report_make_view(flesh_report *report);

#endif
