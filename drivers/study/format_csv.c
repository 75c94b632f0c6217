/* format_csv.c: writes tables as CSV. */
#include "study/csv.h"
#include "study/formats.h"

static void print_row(FILE *stream, int count, const char *const *names, const flesh_format_cell *cells)
{
  (void)names;
  for (int c = 0; c < count; c++) {
    if (c) putc(',', stream);
    if (cells[c].kind == FLESH_CELL_TEXT) flesh_csv_print(stream, cells[c].text);
    flesh_format_number(stream, &cells[c]);
  }
  putc('\n', stream);
}

const flesh_format flesh_format_csv = {1, print_row, NULL};
