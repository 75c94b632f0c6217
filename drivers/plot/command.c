/* command.c: `flesh plot`: draws curves of the columns that runs have written. */
#include "commands.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "plot/curves.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/path.h"
#include "picture/plot.h"
#include "study/embedded.h"

/* The options, and the outcome. */
typedef struct picture {
  const char *x, *y, *by, *log, *title;
  char *folder, *name; /* path of the picture, without the suffix */
  const char *suffix;
  int width, height, points;
  flesh_plot_outcome outcome;
} picture;

/* Splits the picture's path into folder, name and suffix. Returns 0 if it ends in none of the suffixes. */
static int cut_path(const char *out, picture *p)
{
  static const char *const suffixes[] = {".svg", ".png", ".pdf"};
  const char *slash = strrchr(out, '/'), *base = slash ? slash + 1 : out, *dot = strrchr(base, '.');
  for (size_t k = 0; k < 3 && dot && dot > base; k++)
    if (!strcmp(dot, suffixes[k])) p->suffix = suffixes[k];
  if (!p->suffix) return 0;
  p->folder = slash ? strndup(out, (size_t)(slash + 1 - out)) : strdup(".");
  p->name = strndup(base, (size_t)(dot - base));
  return 1;
}

/* Prepares the picture and its script to be written; neither may replace a file that is read. */
static int prepare(const char *out, const picture *p, int count, char *const *paths)
{
  if (!p->folder || !p->name) return flesh_no_memory();
  const int status = flesh_output_prepare_from(out, count, paths, NULL);
  return status ? status : flesh_output_prepare_from(flesh_path("%s/%s.gp", p->folder, p->name), count, paths, NULL);
}

static void draw(void *data, const char *folder, const char *name)
{
  picture *p = data;
  flesh_plot_note(&p->outcome, flesh_plot_draw(folder, name, p->suffix));
}

static int plot(picture *p, int count, char *const *paths)
{
  const flesh_results to = {.out = p->folder, .picture = p->name, .draw = draw, .data = p};
  sqlite3 *database = NULL;
  char *sql = sqlite3_mprintf(
      "CREATE TABLE asked AS SELECT %Q AS x, %Q AS y, %Q AS \"by\", %Q AS log, %Q AS title, %Q AS picture, %Q AS suffix, "
      "%d AS width, %d AS height, %d AS points", p->x, p->y, p->by, p->log, p->title, p->name, p->suffix, p->width, p->height,
      p->points);
  int status = !sql || sqlite3_open(":memory:", &database) || sqlite3_exec(database, sql, NULL, NULL, NULL)
                   ? flesh_no_memory()
                   : flesh_curves_make(database, count, paths, flesh_own_text("plot_columns"), flesh_own_text("plot_curves"), &to);
  sqlite3_close(database);
  sqlite3_free(sql);
  return status ? status : flesh_plot_ended(&p->outcome);
}

int flesh_command_plot(int argc, char **argv)
{
  static const char *const logs[] = {"", "x", "y", "xy"};
  const char *out = "plot.svg";
  int log = -1;
  picture p = {.width = 960, .height = 600};
  const flesh_option options[] = {
      {"y", "COLUMN[,COLUMN]...", FLESH_OPTION_TEXT, &p.y, "columns to draw"},
      {"x", "COLUMN", FLESH_OPTION_TEXT, &p.x, "column of the horizontal axis (default t, else the first column)"},
      {"by", "COLUMN", FLESH_OPTION_TEXT, &p.by, "a curve for each value of this column"},
      {"log", "x|y|xy", FLESH_OPTION_CHOICE, &log, "logarithmic axes; values that are not positive are left out"},
      {"out", "FILE", FLESH_OPTION_TEXT, &out, "picture to write, .svg, .png or .pdf (default plot.svg)"},
      {"title", "TEXT", FLESH_OPTION_TEXT, &p.title, "title of the picture"},
      {"points", NULL, FLESH_OPTION_SWITCH, &p.points, "mark every row (default: up to 40 of them)"},
      {"width", "N", FLESH_OPTION_COUNT, &p.width, "width of the picture, pixels (default 960)"},
      {"height", "N", FLESH_OPTION_COUNT, &p.height, "height of the picture, pixels (default 600)"},
      {.name = NULL}};
  const flesh_usage usage = {"plot", "RUN... --y COLUMN", "Draws curves of what runs have written, over time or each other.",
                             flesh_own_text("plot_help"), 1, INT_MAX, options, NULL, 0};
  int count, code = flesh_options_read(&usage, argc, argv, &count);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  if (!p.y || !p.y[strspn(p.y, ",")]) return flesh_option_refuse(usage.command, "y", p.y, "the name of a column");
  p.log = logs[1 + log];
  const int *sides[2] = {&p.width, &p.height};
  for (int d = 0; d < 2; d++)
    if (*sides[d] < 100 || *sides[d] > 10000)
      return flesh_command_refuse(usage.command, "--%s is %d; it must be 100 to 10000 pixels", d ? "height" : "width",
                                  *sides[d]);
  if (!cut_path(out, &p))
    return flesh_option_refuse(usage.command, "out", out, "a file whose name ends in .svg, .png or .pdf");
  int status = prepare(out, &p, count, argv + 1);
  if (!status) status = plot(&p, count, argv + 1);
  if (!status) printf("picture: %s\n", out);
  free(p.folder);
  free(p.name);
  return status ? flesh_command_fail(usage.command, status) : 0;
}
