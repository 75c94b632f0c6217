/* sentences.c: sentences of what the measurements do not determine. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>

#include "base/text.h"
#include "fit/fit.h"

/* Equal shares may differ by this. */
static const double equal_share = 0.03;

void flesh_fit_say(flesh_fit_statistics *to, const char *format, ...)
{
  va_list values;
  va_start(values, format);
  if (to->sentence_count < FLESH_FIT_PARAMETERS)
    vsnprintf(to->sentences[to->sentence_count++], FLESH_FIT_SENTENCE, format, values);
  va_end(values);
}

void flesh_fit_tell_null(flesh_fit_statistics *to, int n, const char *const *names, const double *shares)
{
  char text[FLESH_FIT_SENTENCE] = "";
  int list[FLESH_FIT_PARAMETERS + 1], count = 0;
  for (int c = 0; c < n; c++)
    if (fabs(shares[c]) > flesh_fit_small_share) list[count++] = c;
  if (count == 1)
    flesh_text_add(text, sizeof text, "%s is not determined: it changes none of the measured numbers.", names[list[0]]);
  else if (count == 2 && fabs(fabs(shares[list[0]] / shares[list[1]]) - 1) < equal_share)
    flesh_text_add(text, sizeof text, "%s and %s are not determined apart: the measured numbers depend on their %s alone.",
                   names[list[0]], names[list[1]], shares[list[0]] * shares[list[1]] < 0 ? "product" : "ratio");
  else {
    flesh_text_add(text, sizeof text, "These parameters are determined only together, as their change by these shares at once "
                   "changes none of the measured numbers:");
    for (int k = 0; k < count; k++)
      flesh_text_add(text, sizeof text, "%s %s %+.3g %%", k ? "," : "", names[list[k]], shares[list[k]]);
    flesh_text_add(text, sizeof text, ".");
  }
  flesh_fit_say(to, "%s", text);
}
