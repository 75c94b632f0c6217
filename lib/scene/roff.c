/* roff.c: escapes text for troff. */
#include "scene/roff.h"

void flesh_roff_print(flesh_text *text, const char *words)
{
  static const struct {
    char sign;
    const char *written;
  } escapes[] = {{'\\', "\\e"},   {'-', "\\-"},   {'`', "\\(ga"}, {'\'', "\\(aq"},
                 {'^', "\\(ha"}, {'~', "\\(ti"}, {'"', "\\(dq"}};
  int at_start = 1;
  for (; *words; words++) {
    const char *written = NULL;
    for (size_t e = 0; e < sizeof escapes / sizeof *escapes; e++)
      if (*words == escapes[e].sign) written = escapes[e].written;
    if (at_start && *words == '.') flesh_text_print(text, "\\&");
    if (written) flesh_text_print(text, "%s", written);
    else flesh_text_append(text, words, 1);
    at_start = *words == '\n';
  }
}
