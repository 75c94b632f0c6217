/* scan.h: a text file read whole, and a scanner of its numbers that knows where it stands. */
#ifndef FLESH_BASE_SCAN_H
#define FLESH_BASE_SCAN_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "base/plain_locale.h"

/* Opens a regular file to read: *stream, which the caller closes; NULL where it fails. FLESH_ERR_FILE for what is missing,
 * a directory, a pipe or a device; nothing is waited for. */
int flesh_regular_open(const char *path, FILE **stream);
/* Whether there is a regular file of that name: FLESH_ERR_FILE with the same sentences. */
int flesh_regular_check(const char *path);

/* Reads a regular file whole into *data (new; one 0 byte beyond `size`). FLESH_ERR_FILE otherwise.
 */
int flesh_file_load(const char *path, char **data, size_t *size);

typedef struct flesh_scanner {
  const char *path;
  const char *begin, *at, *end; /* *end is 0 */
  int64_t line;
  /* The names of the item being read and of its form, for messages: "node 5", a row of the form "x y z". */
  const char *item, *form;
  int64_t index;
  int free_rows; /* numbers may stand on later lines than the row's first */
  int commas;    /* a comma separates, as a blank does */
  char comment;  /* begins a comment, which goes to the line's end: '#' by default; 0: nothing does */
  char *data;    /* the text, owned */
  flesh_plain_locale locale;
} flesh_scanner;

/* Loads the file and stands at its begin, in the "C" locale until it is closed. FLESH_ERR_FILE,
 * FLESH_ERR_MEMORY. */
int flesh_scan_open(flesh_scanner *s, const char *path);
/* Also after it could not be opened. */
void flesh_scan_close(flesh_scanner *s);

/* Goes to the next token, over blanks, line ends and comments; returns 0 at the end. */
int flesh_scan_next(flesh_scanner *s);
/* Like flesh_scan_next, without leaving the line. */
int flesh_scan_next_in_line(flesh_scanner *s);
/* Goes behind the end of the present line. */
void flesh_scan_skip_line(flesh_scanner *s);

/* Reads the word at the present place if it equals `word`; returns whether it did. */
int flesh_scan_word(flesh_scanner *s, const char *word);
/* Reads the token at the present place, whatever it is. Returns its length, and its begin in the text in *token. */
size_t flesh_scan_token(flesh_scanner *s, const char **token);

/* Next number of the present row. FLESH_ERR_FILE when the row ends, for anything but a number, for
 * an integer outside 64 bits, for a real that is not finite. */
int flesh_scan_integer(flesh_scanner *s, int64_t *value);
int flesh_scan_real(flesh_scanner *s, double *value);
/* FLESH_ERR_FILE when something is left in the line. */
int flesh_scan_row_end(flesh_scanner *s);

/* Reads a count of `item`s of which each takes at least `bytes` bytes in the rest of the file, so
 * that a count can be trusted with memory. At least `least`, at most INT_MAX/4. */
int flesh_scan_count(flesh_scanner *s, const char *item, int least, int bytes, int *count);

/* Fails with "path:line: " before the sentence. */
int flesh_scan_fail(const flesh_scanner *s, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* The token at the present place, cut and made printable, in quotes; valid until the next call in
 * this thread. */
const char *flesh_scan_show(const flesh_scanner *s);

#endif
