// TEST quick needs=drivers
/* test_csv.c: CSV is read completely or refused, truncated tables are read as far as possible, and what is written is
 * read back. */
#include "temporary.h"

#include "base/error.h"
#include "study/csv.h"
#include "test.h"

static char folder[200];

static int read_text(const char *text, size_t size, flesh_csv_rows rows, flesh_csv *csv)
{
  char path[220];
  snprintf(path, sizeof path, "%s/table.csv", folder);
  FILE *file = fopen(path, "w");
  CHECK(file && fwrite(text, 1, size, file) == size && !fclose(file));
  return flesh_csv_read(path, rows, csv);
}

/* The cells, separated by |, rows by /. */
static void check_cells(const flesh_csv *csv, const char *expected)
{
  char cells[200] = "";
  size_t used = 0;
  for (int k = 0; k < csv->rows; k++)
    for (int c = 0; c < csv->columns && used < sizeof cells - 20; c++)
      used += (size_t)sprintf(cells + used, "%.16s%c", flesh_csv_cell(csv, k, c), c + 1 < csv->columns ? '|' : '/');
  CHECK_TEXT(cells, expected);
  CHECK(strlen(cells) == strlen(expected));
}

static void tables_are_read(void)
{
  static const char text[] = "\xef\xbb\xbf# by flesh\r\nname,\"t [s]\"\r\n\n\"a,\"\"b\"\"\n#c\",1/2\r\n# 2\nx,\n\"#y\",3";
  flesh_csv csv;
  double value;
  CHECK_OK(read_text(text, strlen(text), FLESH_CSV_WHOLE, &csv));
  CHECK(csv.columns == 2 && csv.rows == 3 && !strcmp(csv.names[1], "t [s]"));
  check_cells(&csv, "a,\"b\"\n#c|1/2/x|/#y|3/");
  CHECK(!flesh_csv_number(&csv, 0, 1, &value));
  CHECK(flesh_csv_number(&csv, 1, 1, &value) && isnan(value));
  CHECK(flesh_csv_number(&csv, 2, 1, &value) && value == 3);
  flesh_csv_clear(&csv);
  static const char spaced[] = " name ,\t t [s]\n a b , 1.5 \r\n\" c \" ,\n";
  CHECK_OK(read_text(spaced, strlen(spaced), FLESH_CSV_WHOLE, &csv));
  CHECK(csv.columns == 2 && !strcmp(csv.names[0], "name") && !strcmp(csv.names[1], "t [s]"));
  check_cells(&csv, "a b|1.5/ c |/");
  CHECK(flesh_csv_number(&csv, 0, 1, &value) && value == 1.5);
  flesh_csv_clear(&csv);
}

static void bad_tables_are_refused(void)
{
  static const struct {
    const char *text, *words, *torn; /* the cells of the same text, truncated */
  } bad[] = {{"", "table.csv: the file is empty; CSV is text with a header row", ""},
             {"# only\n", "table.csv: there is no table", ""},
             {"# by hand\nt [s];x\n1;2\n", "table.csv:2: the header has semicolons and no comma", "1;2/"},
             {"t [s]\tx\n1\t2\n", "table.csv:1: the header has tabs and no comma", "1\t2/"},
             {"a,b\n1,2\n\"x\ny\",2\n3\n4,5\n", "table.csv:5: there are 1 fields, but the header names 2", "1|2/x\ny|2/4|5/"},
             {"a,b\n1,2\n3,\"4\n", "table.csv:3: a quote has no end", "1|2/"},
             {"a,b\n1,2,3\n4,5\n", "table.csv:2: there are 3 fields", "4|5/"}};
  flesh_csv csv;
  for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
    CHECK(read_text(bad[k].text, strlen(bad[k].text), FLESH_CSV_WHOLE, &csv) == FLESH_ERR_FILE);
    CHECK_TEXT(flesh_error_text(), bad[k].words);
    CHECK_OK(read_text(bad[k].text, strlen(bad[k].text), FLESH_CSV_TORN, &csv));
    check_cells(&csv, bad[k].torn);
    flesh_csv_clear(&csv);
  }
  CHECK(read_text("a\n1\0002\n", 6, FLESH_CSV_WHOLE, &csv) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "table.csv: there is a zero byte in it");
  CHECK_OK(read_text("a\n1\0002\n", 6, FLESH_CSV_TORN, &csv));
  check_cells(&csv, "1 2/");
  flesh_csv_clear(&csv);
  /* The last row of a killed run may be truncated. */
  CHECK_OK(read_text("t,x\n1,2\n3,4", 11, FLESH_CSV_TORN, &csv));
  check_cells(&csv, "1|2/");
  flesh_csv_clear(&csv);
  CHECK(flesh_csv_read(folder, FLESH_CSV_TORN, &csv) == FLESH_ERR_FILE && !csv.text);
}

static void fields_are_read_back(void)
{
  static const char *const texts[] = {"plain", "a,b", "say \"no\"", "two\nlines", "#5", "", " x "};
  char text[200] = {0};
  flesh_csv csv;
  FILE *stream = fmemopen(text, sizeof text, "w");
  for (int k = 0; k < 7; k++) flesh_csv_print(stream, texts[k]), putc(k < 6 ? ',' : '\n', stream);
  fclose(stream);
  CHECK(!strcmp(text, "plain,\"a,b\",\"say \"\"no\"\"\",\"two\nlines\",\"#5\",,\" x \"\n"));
  CHECK_OK(read_text(text, strlen(text), FLESH_CSV_WHOLE, &csv));
  for (int k = 0; k < 7 && csv.columns == 7; k++) CHECK(!strcmp(csv.names[k], texts[k]));
  flesh_csv_clear(&csv);
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  const int code = RUN_TESTS(argc, argv, TEST(tables_are_read), TEST(bad_tables_are_refused), TEST(fields_are_read_back));
  test_folder_remove(folder);
  return code;
}
