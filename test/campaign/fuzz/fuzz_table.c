/* fuzz_table.c: the tables that drift, accuracy and hardcases leave to a sweep. Its reader is private to sweep/case.c. */
#define _GNU_SOURCE
#include "fuzz.h"

#include "sweep/case.c" /* NOLINT: for read_table */

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
  (void)argc, (void)argv;
  fuzz_start();
  return 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
  fuzz_write("table.csv", data, size);
  json_t *rows = read_table("table.csv");
  if (!rows) return 0;
  char *text = json_dumps(rows, JSON_COMPACT);
  fuzz_expect(text != NULL, "rows that cannot be written");
  free(text);
  json_decref(rows);
  return 0;
}
