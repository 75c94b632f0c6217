/* path.h: paths for the next few calls; texts from outside (names of files, values of databases) as parts of names and
 * commands. */
#ifndef FLESH_CLI_PATH_H
#define FLESH_CLI_PATH_H

#include <stdio.h>

/* Returns a path, formatted as by printf, in a buffer of this thread that the FLESH_PATHS-th path after it overwrites:
 * a path that is needed longer must be copied. A path that is longer than the system allows is cut to a length that the
 * system still refuses. */
enum { FLESH_PATHS = 16 };
const char *flesh_path(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* Returns the number of bytes, 1 to 4, of the UTF-8 character at the start of `text`; 0 if there is none (or the text
 * ends). */
int flesh_text_letter(const char *text);

/* Returns whether the byte is a control character of ASCII. */
int flesh_text_is_control(char byte);

/* Replaces bytes of a text that are not UTF-8 by '?' and zero bytes by blanks. */
void flesh_text_mend(char *text, size_t size);

/* Makes `name` safe in place, as a part of a file's name, a field of CSV and a word of a plot: control characters,
 * bytes that are not UTF-8, and / \ , " become _. */
void flesh_safe_name(char *name);

/* Prints `word` so that a shell reads it back as one word. */
void flesh_shell_word_print(FILE *stream, const char *word);

#endif
