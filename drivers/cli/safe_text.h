/* safe_text.h: texts from outside (names of files, values of databases) as parts of names and commands. */
#ifndef FLESH_CLI_SAFE_TEXT_H
#define FLESH_CLI_SAFE_TEXT_H

#include <stdio.h>

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
