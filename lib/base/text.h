/* text.h: texts that grow in a buffer of fixed size, and new texts. */
#ifndef FLESH_BASE_TEXT_H
#define FLESH_BASE_TEXT_H

#include <stddef.h>

/* Appends to `text` (a string in `size` bytes) as printf prints. A text that does not fit ends with the last whole
 * UTF-8 letter that does. Returns whether everything fits. Use this in place of adding up results of snprintf, which
 * may exceed the buffer's size. */
int flesh_text_add(char *text, size_t size, const char *format, ...) __attribute__((format(printf, 3, 4)));

/* Returns a new text as printf prints it; NULL without memory. The caller frees it. */
char *flesh_text_new(const char *format, ...) __attribute__((format(printf, 1, 2)));

#endif
