/* format_markdown.c: writes tables in Markdown, whose cells have no line breaks and no unescaped bars. */
#include "study/formats.h"

static void print_text(FILE *stream, const char *text)
{
  for (; *text; text++) {
    if (*text == '|') putc('\\', stream);
    putc(*text == '\n' || *text == '\r' ? ' ' : *text, stream);
  }
}

const flesh_format flesh_format_markdown = {
    .begin = "| ", .between = " | ", .end = " |\n", .text = print_text, .missing = "", .rule = {"|---", "|\n"}};
