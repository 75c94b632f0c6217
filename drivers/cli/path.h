/* path.h: paths for the next call or the next few; texts from outside (names of files, values of databases) as parts of names and
 * commands. */
#ifndef FLESH_CLI_PATH_H
#define FLESH_CLI_PATH_H

#include <stdio.h>

/* A path as printf prints it, in one of this thread's rooms, which the FLESH_PATHS-th path after it takes: what is to last
 * longer is copied. One that is longer than the system takes is cut where the system refuses it still. */
enum { FLESH_PATHS = 16 };
const char *flesh_path(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* Bytes of the UTF-8 letter that `text` starts with, 1 to 4; 0 when it starts with none (or ends). */
int flesh_text_letter(const char *text);

/* Whether the byte is a control character of ASCII. */
int flesh_text_is_control(char byte);

/* Makes `name` part of a file's name, a field of CSV and a word of a plot, in place: control characters, bytes that
 * are not UTF-8, and / \ , " become _. */
void flesh_safe_name(char *name);

/* Prints `word` so that a shell reads it back as one word. */
void flesh_shell_word_print(FILE *stream, const char *word);

#endif
