/* file.h: files that are written whole or not at all, and numbers as text that reads back exactly.
 */
#ifndef FLESH_BASE_FILE_H
#define FLESH_BASE_FILE_H

#include <stdint.h>
#include <stdio.h>

#include "base/folder.h"

/* A file being written: print to `stream`, then commit or abandon. The text goes to a temporary
 * file beside the target, which commit renames over it; until then the target stays as it was. A
 * target that exists and is no regular file (a device, a pipe) is written directly. */
typedef struct flesh_file {
  FILE *stream;
  char *path;      /* the target, links resolved */
  char *temporary; /* NULL when the target is written directly */
} flesh_file;

/* FLESH_ERR_FILE, with the path and the system's reason, when it cannot be written. */
int flesh_file_open(const char *path, flesh_file *file);
/* Closes and renames; FLESH_ERR_FILE when anything was not written (disk full, ...): the temporary
 * file is then gone and the target untouched. */
int flesh_file_commit(flesh_file *file);
/* Closes and drops what was written; harmless after commit or a failed open. */
void flesh_file_abandon(flesh_file *file);
/* Removes the temporary files of the first 16 that are being written. May be called by a handler of signals, which is to
 * end the process. */
void flesh_file_drop_all(void);

/* The shortest of 15, 16 or 17 significant digits that reads back as the same double, with a point
 * in any locale; "nan", "inf", "-inf". Returns `text`. */
enum { FLESH_NUMBER_SIZE = 40 };
const char *flesh_number_text(double value, char text[FLESH_NUMBER_SIZE]);
/* Prints it. */
void flesh_number_print(FILE *stream, double value);

/* Writes four bytes, the low one first on any machine: of a word, or of a number in single precision. */
void flesh_word_write(FILE *stream, uint32_t word);
void flesh_single_write(FILE *stream, double value);

#endif
