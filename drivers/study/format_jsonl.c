/* format_jsonl.c: writes tables as JSON Lines: an object for each row. JSON has no infinities. */
#include <math.h>
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

static void print_row(FILE *stream, int count, const char *const *names, const flesh_format_cell *cells)
{
  for (int c = 0; c < count; c++) {
    const flesh_format_cell *cell = &cells[c];
    fputs(c ? ", " : "{", stream);
    print_text(stream, names[c]);
    fputs(": ", stream);
    if (cell->kind == FLESH_CELL_TEXT) print_text(stream, cell->text);
    else if (cell->kind == FLESH_CELL_NONE || (cell->kind == FLESH_CELL_NUMBER && !isfinite(cell->number)))
      fputs("null", stream);
    else flesh_format_number(stream, cell);
  }
  fputs("}\n", stream);
}

const flesh_format flesh_format_jsonl = {0, print_row, NULL};
