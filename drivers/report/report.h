/* report.h: what a report is made of: words, tables and plots as JSON, and bodies in motion as packed numbers.
 *
 * The element `payload` of the page has the data, deflated (zlib) and in base 64. Unpacked they are twelve decimal digits
 * (the length of the JSON that follows), the JSON, and bytes of numbers. `parts` of the JSON has words, tables and plots,
 * `view` the runs, with places in the bytes, and `start`, the time that is shown first. The element `still` is the still
 * picture. A list [at, count] stores numbers by flesh_report_bytes_add_list.
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
#include <stddef.h>
#include <stdint.h>

/* The page itself, made at build time of page/ and three/: HTML with the marks @TITLE@ and
 * @LEAD@, @STILL@, @PAYLOAD@. */
extern const char flesh_report_page[];

/* Bytes that grow; `failed` once memory ran out. Zero-initialise. */
typedef struct flesh_report_bytes {
  unsigned char *data;
  size_t size, room;
  int failed;
} flesh_report_bytes;

void flesh_report_bytes_add(flesh_report_bytes *bytes, const void *data, size_t size);
/* One number in as few bytes as it needs: 0, -1, 1, -2, ... become 0, 1, 2, 3, ..., seven bits a
 * byte, the lowest first, all but the last with the eighth bit set. */
void flesh_report_bytes_add_number(flesh_report_bytes *bytes, int64_t value);
/* Numbers as differences, each to the one before it, the first to 0. */
void flesh_report_bytes_add_list(flesh_report_bytes *bytes, size_t count, const int *values);
void flesh_report_bytes_free(flesh_report_bytes *bytes);

/* The command that a result's folder or file comes from. */
typedef enum flesh_report_kind {
  FLESH_REPORT_RUN,
  FLESH_REPORT_DRIFT,
  FLESH_REPORT_ACCURACY,
  FLESH_REPORT_HARDCASES,
  FLESH_REPORT_SWEEP
} flesh_report_kind;

/* A run whose bodies are to be seen; `states`: names of further states in its folder, NULL-ended.
 */
typedef struct flesh_report_shown {
  char *folder, *name;
  int optional; /* left out, with a note, where it cannot be opened */
} flesh_report_shown;

typedef struct flesh_report {
  json_t *parts;            /* what is read from top to bottom */
  json_t *view;             /* the bodies; null: none */
  flesh_report_bytes still; /* a PNG of them as they are first seen; empty: none */
  flesh_report_bytes bytes; /* the numbers that `view` speaks of */
  flesh_report_shown *shown;
  int shown_count;
  int most_frames; /* of a run */
} flesh_report;

/* FLESH_ERR_FILE, FLESH_ERR_ARGUMENT with one sentence. */
int flesh_report_find_kind(const char *path, flesh_report_kind *kind);

/* Appends a part about all runs, or about one folder. */
int flesh_report_add_runs(flesh_report *report, int count, char *const *folders);
int flesh_report_add_drift(flesh_report *report, const char *folder);
int flesh_report_add_accuracy(flesh_report *report, const char *folder);
int flesh_report_add_hardcases(flesh_report *report, const char *folder);
int flesh_report_add_sweep(flesh_report *report, const char *path);

/* Notes a run for the view (copies). */
int flesh_report_show(flesh_report *report, const char *folder, const char *name, int optional);
/* Fills report->view and report->bytes from the runs noted. */
int flesh_report_make_view(flesh_report *report);

/* Writes the page, whole or not at all; *size: of the file, *packed: of the payload in it, bytes.
 */
int flesh_report_write(const flesh_report *report, const char *title, json_t *head,
                       const char *path, size_t *size, size_t *packed);

#endif
