/* scan.h: a text file in memory, and a scanner of its numbers that knows the current line. */
#ifndef FLESH_BASE_SCAN_H
#define FLESH_BASE_SCAN_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "base/plain_locale.h"

/* Opens a regular file to read; the caller closes *stream, which is NULL on failure. FLESH_ERR_FILE if the file is
 * missing, a directory, a pipe or a device; never waits. */
int flesh_regular_open(const char *path, FILE **stream);
/* Checks that a regular file of that name can be opened; fails as flesh_regular_open. */
int flesh_regular_check(const char *path);

/* Reads a regular file whole into *data (new; a 0 byte follows its *size bytes). FLESH_ERR_FILE, FLESH_ERR_MEMORY. */
int flesh_file_load(const char *path, char **data, size_t *size);

typedef struct flesh_scanner {
  const char *path;
  const char *begin, *at, *end; /* the text, the current place, and the end, where *end is 0 */
  int64_t line;
  /* Names of the item being read and of its form, for messages: "node 5", a row of the form "x y z". */
  const char *item, *form;
  int64_t index;
  int free_rows; /* 1: a row may continue on later lines */
  int commas;    /* 1: a comma separates tokens, as a blank does */
  char comment;  /* character that begins a comment up to the end of the line, '#' by default; 0: none */
  char *data;    /* the text, owned */
  flesh_plain_locale locale;
} flesh_scanner;

/* Loads the file and starts at its beginning, in the "C" locale until flesh_scan_close. FLESH_ERR_FILE,
 * FLESH_ERR_MEMORY. */
int flesh_scan_open(flesh_scanner *s, const char *path);
/* Closes the scanner, also one whose flesh_scan_open failed. */
void flesh_scan_close(flesh_scanner *s);

/* Moves to the next token, over blanks, line ends and comments; returns 0 at the end. */
int flesh_scan_next(flesh_scanner *s);
/* Like flesh_scan_next, but stays in the line. */
int flesh_scan_next_in_line(flesh_scanner *s);
/* Moves to the beginning of the next line. */
void flesh_scan_skip_line(flesh_scanner *s);

/* Reads the word at the current place if it equals `word`; returns whether it did. */
int flesh_scan_word(flesh_scanner *s, const char *word);
/* Reads the token at the current place, whatever it is. Returns its length; *token points to its beginning in the
 * text. */
size_t flesh_scan_token(flesh_scanner *s, const char **token);

/* Read the next number of the current row. FLESH_ERR_FILE when the row ends, for anything but a number, for an integer
 * beyond 64 bits, for a real that is not finite. */
int flesh_scan_integer(flesh_scanner *s, int64_t *value);
int flesh_scan_real(flesh_scanner *s, double *value);
/* Fails with FLESH_ERR_FILE when something is left in the line. */
int flesh_scan_row_end(flesh_scanner *s);

/* Reads a count of `item`s, at least `least` and at most INT_MAX/4. Each takes at least `bytes` bytes in the rest of
 * the file, so that a wrong count cannot cause a huge allocation. FLESH_ERR_FILE. */
int flesh_scan_count(flesh_scanner *s, const char *item, int least, int bytes, int *count);

/* Fails with FLESH_ERR_FILE and "path:line: " before the sentence. */
int flesh_scan_fail(const flesh_scanner *s, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* Returns the token at the current place, shortened, printable and in quotes; valid until the next call in this
 * thread. */
const char *flesh_scan_show(const flesh_scanner *s);

#endif
