/* format_jsonl.c: writes tables as JSON Lines: an object for each row. JSON has no infinities. */
#include <stdlib.h>

#include "scene/arena.h"
#include "study/formats.h"

static void print_text(FILE *stream, const char *text)
{
  flesh_text quoted = {0};
  flesh_text_quote(&quoted, text);
  if (!quoted.failed) fwrite(quoted.data, 1, quoted.size, stream);
  free(quoted.data);
}

const flesh_format flesh_format_jsonl = {
    .begin = "{", .between = ", ", .end = "}\n", .text = print_text, .missing = "null", .is_named = 1};
