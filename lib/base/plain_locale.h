/* plain_locale.h: the "C" locale for this thread while numbers are read or written as text, so that
 * a decimal comma of the caller's locale reaches neither them nor the sentences about them. */
#ifndef FLESH_BASE_PLAIN_LOCALE_H
#define FLESH_BASE_PLAIN_LOCALE_H

#include <locale.h>

typedef struct flesh_plain_locale {
  locale_t plain, before;
} flesh_plain_locale;

/* FLESH_ERR_MEMORY when there is none; end only what began. */
int flesh_plain_locale_begin(flesh_plain_locale *locale);
void flesh_plain_locale_end(flesh_plain_locale *locale);

#endif
