/* safe_text.c: texts from outside as parts of names and commands. */
#include "cli/safe_text.h"

#include <string.h>

int flesh_text_is_control(char byte) { return (unsigned char)byte < 0x20 || byte == 0x7f; }

int flesh_text_letter(const char *text)
{
  const unsigned char *t = (const unsigned char *)text;
  if (t[0] < 0x80) return t[0] != 0;
  int size = t[0] >= 0xf0 ? 4 : t[0] >= 0xe0 ? 3 : 2;
  if (t[0] < 0xc2 || t[0] > 0xf4) return 0;
  for (int k = 1; k < size; k++)
    if ((t[k] & 0xc0) != 0x80) return 0;
  /* Overlong forms, surrogates, and what lies beyond Unicode. */
  if ((t[0] == 0xe0 && t[1] < 0xa0) || (t[0] == 0xed && t[1] > 0x9f)) return 0;
  if ((t[0] == 0xf0 && t[1] < 0x90) || (t[0] == 0xf4 && t[1] > 0x8f)) return 0;
  return size;
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
