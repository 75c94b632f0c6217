// TEST quick needs=drivers
/* test_plot.c: plots are drawn, or refused with a message. */
#include "temporary.h"

#include "picture/plot.h"
#include "study/csv.h"
#include "test.h"

static char folder[256];

static const char *in_folder(const char *name)
{
  static char path[512];
  snprintf(path, sizeof path, "%s/%.200s", folder, name);
  return path;
}

static int is_png(const char *path)
{
  static const unsigned char signature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  unsigned char start[8] = {0};
  FILE *stream = fopen(path, "rb");
  if (!stream) return 0;
  int whole = fread(start, 1, 8, stream) == 8;
  fclose(stream);
  return whole && !memcmp(start, signature, 8);
}

/* Draws a curve of the CSV file, with the text wherever a script contains text, and `extra` before the plot. */
static int draw(const char *name, const char *text, const char *csv, const char *extra)
{
  flesh_file file;
  const int status = flesh_plot_open(folder, name, ".gp", &file);
  if (status) return status;
  flesh_plot_begin(file.stream, name, ".png", 960, 600);
  flesh_plot_style(file.stream, 1);
  flesh_plot_title(file.stream, text);
  flesh_plot_label(file.stream, "x", text);
  flesh_plot_label(file.stream, "y", text);
  fprintf(file.stream, "%splot ", extra);
  flesh_plot_quote_file(file.stream, csv, "");
  fprintf(file.stream, " using \"t\":\"volume_ratio\" with lines lc rgb '%s' title ", flesh_plot_colour(0));
  flesh_plot_quote(file.stream, text);
  putc('\n', file.stream);
  CHECK_OK(flesh_file_commit(&file));
  return flesh_plot_draw(folder, name, ".png");
}

static void lines_are_drawn(void)
{
  FILE *stream = fopen(in_folder("table.csv"), "w");
  fputs("t,volume_ratio\n0,1\n1,1.1\n2,nan\n3,0.9\n", stream);
  fclose(stream);
  CHECK_OK(draw("lines", "Volume_it's", "table.csv", "set yrange [0:2]\n"));
  CHECK(is_png(in_folder("lines.png")));
  CHECK(draw("wrong", "S", "table.csv", "nonsense\n") == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "gnuplot failed");
  CHECK(access(in_folder("wrong.log"), R_OK) == 0);
}

/* Names come from users' scenes. */
static void odd_names_are_drawn(void)
{
  CHECK_OK(draw("it's", "it's", "table.csv", ""));
  CHECK(is_png(in_folder("it's.png")));
  static const char *const refused[] = {"it's \"a\" % #1\nexit gnuplot status 1\n", "a\tb", "|a", "<a", "a/b", ""};
  for (size_t k = 0; k < sizeof refused / sizeof refused[0]; k++)
    CHECK(draw(refused[k], "it's", "table.csv", "") == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "must be that of a file");
}

/* Texts and names with every special character of gnuplot's language: a script's strings end where they should, and the
 * file read is the one with that name. */
static void any_text_is_a_text(void)
{
  static const char *const parts[] = {"'",
                                      "\"",
                                      "`touch proof`",
                                      "system('touch proof')",
                                      "\\",
                                      "\n",
                                      "$(touch proof)",
                                      "%d",
                                      "%",
                                      "@x",
                                      "#",
                                      ";",
                                      "''",
                                      "<touch proof",
                                      "|",
                                      "{",
                                      "}",
                                      "\\047",
                                      "\xff",
                                      "ü",
                                      "end_of_data"};
  enum { PARTS = sizeof parts / sizeof parts[0] };
  unsigned state = 16;
  for (int round = 0; round < 6; round++) {
    char text[400] = "", file[420] = "";
    for (int n = 0; n < 12; n++) {
      state = 1664525 * state + 1013904223;
      strcat(text, parts[(state >> 16) % PARTS]);
    }
    int length = 0;
    for (const char *c = text; *c && length < 200; c++)
      if (*c != '/' && (unsigned char)*c >= 0x20) file[length++] = *c;
    char path[800];
    snprintf(path, sizeof path, "%s/%s", folder, file);
    FILE *stream = fopen(path, "w");
    fprintf(stream, "t,volume_ratio\n0,1\n1,1.1\n");
    fclose(stream);
    remove(in_folder("any.png"));
    CHECK_OK(draw("any", text, file, ""));
    CHECK(is_png(in_folder("any.png")));
    CHECK(access(in_folder("proof"), F_OK) != 0);
  }
}

/* gnuplot accepts a script that plots nothing. */
static void no_picture_is_no_success(void)
{
  FILE *stream = fopen(in_folder("empty.gp"), "w");
  fputs("set terminal pngcairo\n", stream);
  fclose(stream);
  CHECK(flesh_plot_draw(folder, "empty", ".png") == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "is not drawn");
}

/* Returns whether a script has these words. */
static int script_has(const char *name, const char *words)
{
  char text[8000];
  FILE *stream = fopen(in_folder(name), "r");
  if (!stream) return 0;
  text[fread(text, 1, sizeof text - 1, stream)] = 0;
  fclose(stream);
  return strstr(text, words) != NULL;
}

static void logarithmic_ticks_are_round(void)
{
  static const struct {
    double low, high;
    const char *ticks;
  } all[] = {{300, 4000, "set xtics ('500' 500, '1000' 1000, '2000' 2000)\n"},
             {0.02, 0.5, "set xtics ('0.02' 0.02"},
             {1, 2, ""},    /* gnuplot's own */
             {1, 1e5, ""}}; /* decades */
  for (size_t k = 0; k < sizeof all / sizeof all[0]; k++) {
    FILE *stream = fopen(in_folder("ticks.txt"), "w");
    flesh_plot_log_ticks(stream, "x", all[k].low, all[k].high);
    fclose(stream);
    CHECK(script_has("ticks.txt", all[k].ticks) && script_has("ticks.txt", "set") == (*all[k].ticks != 0));
  }
}

static void zeros_have_no_sign(void)
{
  char text[FLESH_TABLE_TEXT];
  CHECK(!strcmp(flesh_table_text(text, "%.3f", -4e-4), "0.000") &&
        !strcmp(flesh_table_text(text, "%+.2f", 1e-3), "0.00"));
  CHECK(!strcmp(flesh_table_text(text, "%.3g", -0.0), "0") && !strcmp(flesh_table_text(text, "%.3f", -6e-4), "-0.001"));
  CHECK(!strcmp(flesh_table_text(text, "%+.1f", 2), "+2.0") &&
        !strcmp(flesh_table_text(text, "%.0e", -1e-9), "-1e-09"));
}

/* The first of several failures is reported. */
static void the_first_failure_is_told(void)
{
  flesh_plot_outcome outcome = {0};
  flesh_plot_note(&outcome, FLESH_OK);
  CHECK_OK(flesh_plot_ended(&outcome));
  flesh_plot_note(&outcome, flesh_plot_draw(folder, "nowhere", ".png"));
  flesh_plot_note(&outcome, flesh_plot_draw(folder, "elsewhere", ".png"));
  CHECK(flesh_plot_ended(&outcome) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "nowhere.png");
}

static void a_missing_gnuplot_is_said(void)
{
  char *path = strdup(getenv("PATH"));
  setenv("PATH", folder, 1);
  int status = flesh_plot_draw(folder, "lines", ".png");
  setenv("PATH", path, 1);
  free(path);
  CHECK(status == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "gnuplot is not installed");
  CHECK(access(in_folder("lines.gp"), R_OK) == 0);
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  int result = RUN_TESTS(argc, argv, TEST(lines_are_drawn), TEST(odd_names_are_drawn), TEST(any_text_is_a_text),
                         TEST(no_picture_is_no_success),
                         TEST(logarithmic_ticks_are_round), TEST(zeros_have_no_sign), TEST(the_first_failure_is_told),
                         TEST(a_missing_gnuplot_is_said));
  test_folder_remove(folder);
  return result;
}
