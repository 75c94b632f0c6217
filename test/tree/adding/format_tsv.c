/* format_tsv.c: tables with tabs between their columns, in which tabs and line breaks become spaces. */
#include <string.h>

#include "study/formats.h"

static void print_text(FILE *stream, const char *text)
{
  for (; *text; text++) putc(strchr("\t\r\n", *text) ? ' ' : *text, stream);
}

const flesh_format flesh_format_tsv = {.begin = "", .between = "\t", .end = "\n", .text = print_text, .missing = ""};
