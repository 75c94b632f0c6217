/* file.h: writes files whole or not at all, and numbers as text that reads back exactly. */
#ifndef FLESH_BASE_FILE_H
#define FLESH_BASE_FILE_H

#include <stdint.h>
#include <stdio.h>

#include "base/folder.h"

/* A file being written: print to `stream`, then commit or abandon. The text goes to a temporary file beside the target,
 * which commit renames over it; until then the target stays as it was. If the target exists and is not a regular file
 * (a device, a pipe), it is written directly. */
typedef struct flesh_file {
  FILE *stream;
  char *path;      /* the target, with links resolved */
  char *temporary; /* NULL when the target is written directly */
} flesh_file;

/* Opens a file to write. FLESH_ERR_FILE, with the path and the system's reason, when it cannot be written. */
int flesh_file_open(const char *path, flesh_file *file);
/* Closes and renames. FLESH_ERR_FILE when anything was not written (disk full, ...): the temporary file is then removed
 * and the target untouched. */
int flesh_file_commit(flesh_file *file);
/* Closes and discards what was written; harmless after commit or a failed open. */
void flesh_file_abandon(flesh_file *file);
/* Removes the temporary files of the first 16 files being written. A signal handler may call it if it then ends the
 * process. */
void flesh_file_drop_all(void);

/* Writes the shortest of 15, 16 or 17 significant digits that reads back as the same double, with a decimal point in
 * any locale; "nan", "inf", "-inf". Returns `text`. */
enum { FLESH_NUMBER_SIZE = 40 };
const char *flesh_number_text(double value, char text[FLESH_NUMBER_SIZE]);
/* Prints the text of flesh_number_text. */
void flesh_number_print(FILE *stream, double value);

/* Write four bytes, the low one first on any machine: a word, or `value` in single precision. */
void flesh_word_write(FILE *stream, uint32_t word);
void flesh_single_write(FILE *stream, double value);

#endif
