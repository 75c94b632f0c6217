/* format_tsv.c: tables with tabs between their columns, in which tabs and line breaks become spaces. */
#include <string.h>

#include "study/formats.h"

static void print_text(FILE *stream, const char *text)
{
  for (; *text; text++) putc(strchr("\t\r\n", *text) ? ' ' : *text, stream);
}

static void print_row(FILE *stream, int count, const char *const *names, const flesh_format_cell *cells)
{
  (void)names;
  for (int c = 0; c < count; c++) {
    if (c) putc('\t', stream);
    if (cells[c].kind == FLESH_CELL_TEXT) print_text(stream, cells[c].text);
    flesh_format_number(stream, &cells[c]);
  }
  putc('\n', stream);
}

const flesh_format flesh_format_tsv = {1, print_row, NULL};
