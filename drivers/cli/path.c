/* path.c: paths in buffers that are used again, and texts from outside as parts of names and commands. */
#include "cli/path.h"
#include "base/letter.h"

#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

const char *flesh_path(const char *format, ...)
{
  static _Thread_local char rooms[FLESH_PATHS][PATH_MAX + 1];
  static _Thread_local int next;
  char *room = rooms[next++ % FLESH_PATHS];
  va_list values;
  va_start(values, format);
  vsnprintf(room, sizeof *rooms, format, values);
  va_end(values);
  return room;
}

int flesh_text_is_control(char byte) { return (unsigned char)byte < 0x20 || byte == 0x7f; }

int flesh_text_letter(const char *text)
{
  unsigned code;
  return (int)flesh_letter_at((const unsigned char *)text, strnlen(text, 4), &code);
}

void flesh_text_mend(char *text, size_t size)
{
  for (size_t k = 0; k < size;) {
    const int length = flesh_text_letter(text + k);
    if (!length) text[k] = text[k] ? '?' : ' ';
    k += length ? (size_t)length : 1;
  }
}

void flesh_safe_name(char *name)
{
  while (*name) {
    int size = flesh_text_letter(name);
    if (!size || flesh_text_is_control(*name) || strchr("/\\,\"", *name)) *name = '_', size = 1;
    name += size;
  }
}

void flesh_shell_word_print(FILE *stream, const char *word)
{
  static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./=+-:,@%";
  if (*word && strspn(word, plain) == strlen(word)) {
    fputs(word, stream);
    return;
  }
  putc('\'', stream);
  for (; *word; word++) {
    if (*word == '\'') fputs("'\\'", stream); /* ends the quoted text; an escaped quote and a new beginning follow */
    putc(*word, stream);
  }
  putc('\'', stream);
}
