/* format_markdown.c: writes tables in Markdown, whose cells have no line breaks and no unescaped bars. */
#include "study/formats.h"

static void print_text(FILE *stream, const char *text)
{
  for (; *text; text++) {
    if (*text == '|') putc('\\', stream);
    putc(*text == '\n' || *text == '\r' ? ' ' : *text, stream);
  }
}

static void print_rule(FILE *stream, int count)
{
  for (int c = 0; c < count; c++) fputs("|---", stream);
  fputs("|\n", stream);
}

static void print_row(FILE *stream, int count, const char *const *names, const flesh_format_cell *cells)
{
  (void)names;
  for (int c = 0; c < count; c++) {
    fputs("| ", stream);
    if (cells[c].kind == FLESH_CELL_TEXT) print_text(stream, cells[c].text);
    flesh_format_number(stream, &cells[c]);
    putc(' ', stream);
  }
  fputs("|\n", stream);
}

const flesh_format flesh_format_markdown = {1, print_row, print_rule};
