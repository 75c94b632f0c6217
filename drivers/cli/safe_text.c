/* safe_text.c: texts from outside as parts of names and commands. */
#include "cli/safe_text.h"

#include <string.h>

#include "base/letter.h"

int flesh_text_is_control(char byte) { return (unsigned char)byte < 0x20 || byte == 0x7f; }

int flesh_text_letter(const char *text)
{
  unsigned code;
  return (int)flesh_letter_at((const unsigned char *)text, strnlen(text, 4), &code);
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
    if (*word == '\'') fputs("'\\'", stream); /* ends the quotes, an escaped one, and begins them again */
    putc(*word, stream);
  }
  putc('\'', stream);
}
