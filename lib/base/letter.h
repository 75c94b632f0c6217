/* letter.h: decodes the letters of a UTF-8 text (RFC 3629). */
#ifndef FLESH_BASE_LETTER_H
#define FLESH_BASE_LETTER_H

#include <stddef.h>

/* Returns the number of bytes of the letter at `text`, of which `left` bytes remain, and sets *code to its code point;
 * 0: no valid letter. */
static inline size_t flesh_letter_at(const unsigned char *text, size_t left, unsigned *code)
{
  static const unsigned least[] = {0, 0, 0x80, 0x800, 0x10000};
  if (!left) return 0;
  unsigned first = text[0];
  size_t size = first < 0x80             ? 1
                : (first & 0xe0) == 0xc0 ? 2
                : (first & 0xf0) == 0xe0 ? 3
                : (first & 0xf8) == 0xf0 ? 4
                                         : 0;
  if (!size || size > left) return 0;
  *code = size == 1 ? first : first & (0xffu >> (size + 1));
  for (size_t k = 1; k < size; k++) {
    if ((text[k] & 0xc0) != 0x80) return 0;
    *code = *code << 6 | (text[k] & 0x3f);
  }
  int surrogate = *code >= 0xd800 && *code < 0xe000;
  return *code < least[size] || *code > 0x10ffff || surrogate ? 0 : size;
}

#endif
