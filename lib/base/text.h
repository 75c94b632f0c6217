/* text.h: texts that grow in a buffer of fixed size, and new ones. */
#ifndef FLESH_BASE_TEXT_H
#define FLESH_BASE_TEXT_H

#include <stddef.h>

/* Appends to `text` (a string in `size` bytes) as printf prints. A text that does not fit ends with the last whole UTF-8
 * letter that does. Returns whether everything fits. snprintf's result is the length that it wanted to write, which is no
 * place in the buffer; nothing else adds such results up. */
int flesh_text_add(char *text, size_t size, const char *format, ...) __attribute__((format(printf, 3, 4)));

/* New text as printf prints it; NULL without memory. */
char *flesh_text_new(const char *format, ...) __attribute__((format(printf, 1, 2)));

#endif
