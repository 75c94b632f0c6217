/* text.c: appends to a text in a buffer of fixed size, and prints new ones. */
#include "base/text.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/letter.h"

/* Cuts off the last letter if some of its bytes are missing. */
static void drop_half_letter(char *text, size_t length)
{
  unsigned code;
  size_t begin = length;
  while (begin > 0 && length - begin < 3 && ((unsigned char)text[begin - 1] & 0xc0) == 0x80) begin--;
  if (begin == 0 || (unsigned char)text[begin - 1] < 0xc0) return;
  begin--;
  if (!flesh_letter_at((const unsigned char *)text + begin, length - begin, &code)) text[begin] = 0;
}

int flesh_text_add(char *text, size_t size, const char *format, ...)
{
  const size_t length = strnlen(text, size);
  va_list values;
  if (length >= size) return 0;
  va_start(values, format);
  const int wanted = vsnprintf(text + length, size - length, format, values);
  va_end(values);
  if (wanted < 0) text[length] = 0;
  if (wanted >= 0 && (size_t)wanted < size - length) return 1;
  drop_half_letter(text, strlen(text));
  return 0;
}

char *flesh_text_new(const char *format, ...)
{
  va_list values, again;
  va_start(values, format);
  va_copy(again, values);
  const int length = vsnprintf(NULL, 0, format, values);
  char *text = length < 0 ? NULL : malloc((size_t)length + 1);
  if (text) vsnprintf(text, (size_t)length + 1, format, again);
  va_end(again);
  va_end(values);
  return text;
}
