/* fuzz_table.c: tables as CSV: those that commands leave for a sweep, and those of a killed run. */
#define _GNU_SOURCE
#include "fuzz.h"

#include "study/csv.h"

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
  (void)argc, (void)argv;
  fuzz_start();
  return 0;
}

/* Checks that a table written again is the same table. */
static void write_again(const flesh_csv *csv)
{
  flesh_csv again;
  FILE *stream = fopen("again.csv", "w");
  fuzz_expect(stream != NULL, "again.csv");
  for (int k = -1; k < csv->rows; k++)
    for (int c = 0; c < csv->columns; c++) {
      flesh_csv_print(stream, k < 0 ? csv->names[c] : flesh_csv_cell(csv, k, c));
      putc(c + 1 < csv->columns ? ',' : '\n', stream);
    }
  fclose(stream);
  fuzz_expect(!flesh_csv_read("again.csv", FLESH_CSV_WHOLE, &again), "a table that is not read again");
  fuzz_expect(again.columns == csv->columns && again.rows == csv->rows, "another number of rows or columns");
  for (int k = 0; k < csv->rows; k++)
    for (int c = 0; c < csv->columns; c++)
      fuzz_expect(!strcmp(flesh_csv_cell(csv, k, c), flesh_csv_cell(&again, k, c)), "another cell");
  flesh_csv_clear(&again);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
  fuzz_write("table.csv", data, size);
  for (int torn = 0; torn < 2; torn++) {
    flesh_csv csv;
    const int status = flesh_csv_read("table.csv", torn ? FLESH_CSV_TORN : FLESH_CSV_WHOLE, &csv);
    fuzz_status(status);
    if (!status && csv.columns > 1) write_again(&csv); /* a single empty cell is an empty line */
    flesh_csv_clear(&csv);
  }
  return 0;
}
