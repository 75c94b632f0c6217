/* test_plot.c: plots are drawn, or refused in a sentence. */
#include "temporary.h"

#include "plot.h"
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

static void lines_are_drawn(void)
{
  FILE *stream = fopen(in_folder("table.csv"), "w");
  fputs("t,volume_ratio\n0,1\n1,1.1\n2,nan\n3,0.9\n", stream);
  fclose(stream);
  const flesh_plot_series series[] = {{"B's", "table.csv", "t", "volume_ratio", NULL, 0},
                                      {"S", "table.csv", "t", "volume_ratio", "#ff0000", 1}};
  flesh_plot_lines lines = {"Volume_it's", "t [s]", "V/V0", "set yrange [0:2]\n", 2, series};
  CHECK_OK(flesh_plot_lines_draw(folder, "lines", &lines));
  CHECK(is_png(in_folder("lines.png")));
  lines.extra = "nonsense\n";
  CHECK(flesh_plot_lines_draw(folder, "wrong", &lines) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "gnuplot failed");
  CHECK(access(in_folder("wrong.log"), R_OK) == 0);
}

/* Names come from the users' scenes. */
static void odd_names_are_drawn(void)
{
  static const char name[] = "it's \"a\" % #1\nexit gnuplot status 1\n";
  const flesh_plot_series series = {"B's", "table.csv", "t", "volume_ratio", NULL, 0};
  const flesh_plot_lines lines = {"it's", "t", "V", NULL, 1, &series};
  CHECK_OK(flesh_plot_lines_draw(folder, "it's", &lines));
  CHECK(is_png(in_folder("it's.png")));
  CHECK(flesh_plot_lines_draw(folder, name, &lines) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "line break");
}

static void a_missing_gnuplot_is_said(void)
{
  char *path = strdup(getenv("PATH"));
  setenv("PATH", folder, 1);
  int status = flesh_plot_draw(folder, "lines");
  setenv("PATH", path, 1);
  free(path);
  CHECK(status == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "gnuplot is not installed");
  CHECK(access(in_folder("lines.gp"), R_OK) == 0);
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  int result = RUN_TESTS(argc, argv, TEST(lines_are_drawn), TEST(odd_names_are_drawn),
                         TEST(a_missing_gnuplot_is_said));
  test_folder_remove(folder);
  return result;
}
