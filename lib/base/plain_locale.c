/* plain_locale.c: see the header. */
#include "base/plain_locale.h"

#include "base/error.h"

int flesh_plain_locale_begin(flesh_plain_locale *locale)
{
  locale->plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
  if (!locale->plain) return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a locale");
  locale->before = uselocale(locale->plain);
  return FLESH_OK;
}

void flesh_plain_locale_end(flesh_plain_locale *locale)
{
  uselocale(locale->before);
  freelocale(locale->plain);
}
