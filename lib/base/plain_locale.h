/* plain_locale.h: sets the "C" locale for this thread while numbers are read or written as text, so that a decimal
 * comma of the caller's locale affects neither the numbers nor error messages about them. */
#ifndef FLESH_BASE_PLAIN_LOCALE_H
#define FLESH_BASE_PLAIN_LOCALE_H

#include <locale.h>

typedef struct flesh_plain_locale {
  locale_t plain, before;
} flesh_plain_locale;

/* Begins the "C" locale. FLESH_ERR_MEMORY: it has not begun, and flesh_plain_locale_end must not be called. */
int flesh_plain_locale_begin(flesh_plain_locale *locale);
void flesh_plain_locale_end(flesh_plain_locale *locale);

#endif
