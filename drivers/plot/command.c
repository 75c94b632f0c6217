/* command.c: `flesh plot`: curves of the columns that runs have written. */
#include "commands.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/file.h"
#include "base/text.h"
#include "plot/curves.h"
#include "cli/options.h"
#include "cli/output.h"
#include "picture/plot.h"
#include "picture/plot_text.h"
#include "study/embedded.h"

typedef struct picture {
  const char *title;
  char *folder, *name; /* where it goes, without the suffix */
  const char *suffix;
  int width, height, points;
  int log[2];
} picture;

/* Up to this many points of a curve each has a mark of its own. */
enum { FEW_POINTS = 40, LONG_TITLE = 28 };

/* The data stand in the script, so that it can be restyled and drawn again wherever it is. */
static void write_data(FILE *stream, const flesh_curves *curves)
{
  char x[FLESH_NUMBER_SIZE], y[FLESH_NUMBER_SIZE];
  for (int k = 0; k < curves->count; k++) {
    const flesh_curve *curve = &curves->curves[k];
    fprintf(stream, "$curve_%d << END\n", k + 1);
    for (int i = 0; i < curve->count; i++)
      fprintf(stream, "%s %s\n", isfinite(curve->x[i]) ? flesh_number_text(curve->x[i], x) : "NaN",
              isfinite(curve->y[i]) ? flesh_number_text(curve->y[i], y) : "NaN");
    fputs("END\n", stream);
  }
}

static void write_axes(FILE *stream, const picture *p, const flesh_curves *curves)
{
  static const char *const axes[2] = {"x", "y"};
  flesh_plot_style(stream, 0);
  fputs("set autoscale xfix\nset offsets 0, 0, graph 0.04, graph 0.04\n", stream);
  for (int d = 0; d < 2; d++) {
    flesh_plot_label(stream, axes[d], d ? curves->y_label : curves->x_label);
    if (!p->log[d]) continue;
    fprintf(stream, "set logscale %s\n", axes[d]);
    const double wider = fmax(pow(curves->high[d] / curves->low[d], 0.04), 1.02);
    if (d) fprintf(stream, "set yrange [%.6g:%.6g]\n", curves->low[d] / wider, curves->high[d] * wider);
    if (curves->high[d] / curves->low[d] > 1e3) fprintf(stream, "set format %s '10^{%%L}'\n", axes[d]);
    else flesh_plot_log_ticks(stream, axes[d], curves->low[d], curves->high[d]);
  }
  if (p->log[1]) fputs("unset offsets\n", stream);
  if (p->title) flesh_plot_title(stream, p->title);
}

/* Beside the curves where its words are short, else below. */
static void write_key(FILE *stream, const flesh_curves *curves)
{
  size_t longest = 0;
  for (int k = 0; k < curves->count; k++)
    if (strlen(curves->curves[k].title) > longest) longest = strlen(curves->curves[k].title);
  if (!longest) fputs("unset key\n", stream);
  else
    fprintf(stream, "set key outside %s Left reverse noenhanced spacing 1.2\n",
            longest > LONG_TITLE ? "bottom center vertical" : "right top");
}

static void write_curves(FILE *stream, const picture *p, const flesh_curves *curves)
{
  fputs("plot ", stream);
  for (int k = 0, listed = 0; k < curves->count; k++) {
    const flesh_curve *curve = &curves->curves[k];
    if (!curve->drawn) continue;
    if (listed++) fputs(", \\\n     ", stream);
    /* Lines beneath are wider, so that they show beside the lines that cover them. */
    fprintf(stream, "$curve_%d using 1:2 with %s lw %.3g%s lc rgb '%s'", k + 1,
            p->points || curve->count <= FEW_POINTS ? "linespoints pt 7 ps 0.6" : "lines",
            curves->count > 1 ? 3.4 - 1.8 * k / (curves->count - 1) : 2, k / 8 % 2 ? " dt 2" : "", flesh_plot_colour(k));
    fputs(" title ", stream);
    flesh_plot_quote(stream, curve->title);
  }
  putc('\n', stream);
}

static int draw(const picture *p, const flesh_curves *curves)
{
  flesh_file file;
  int status = flesh_plot_open(p->folder, p->name, ".gp", &file);
  if (status) return status;
  write_data(file.stream, curves);
  flesh_plot_begin_as(file.stream, p->name, p->suffix, p->width, p->height);
  write_axes(file.stream, p, curves);
  write_key(file.stream, curves);
  write_curves(file.stream, p, curves);
  status = flesh_file_commit(&file);
  return status ? status : flesh_plot_draw_as(p->folder, p->name, p->suffix);
}

/* Cuts the path of the picture into folder, name and suffix; 0 where it has none of the suffixes. */
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

/* Neither the picture nor its script may replace what is read. */
static int prepare(const char *out, const picture *p, int count, char *const *paths)
{
  char *script = p->folder && p->name ? flesh_text_new("%s/%s.gp", p->folder, p->name) : NULL;
  if (!script) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  int status = flesh_output_prepare_from(out, count, paths, NULL);
  if (!status) status = flesh_output_prepare_from(script, count, paths, NULL);
  free(script);
  return status;
}

/* The words of a list with commas, in `text`; returns new pointers, *count of them. */
static char **split(char *text, int *count)
{
  char **words = calloc(strlen(text) / 2 + 2, sizeof *words);
  *count = 0;
  for (char *word = strtok(text, ","); words && word; word = strtok(NULL, ",")) words[(*count)++] = word;
  return words;
}

static int plot(const char *out, const char *y, flesh_curves_wanted *wanted, picture *p)
{
  flesh_curves curves = {0};
  char *list = strdup(y), **words = list ? split(list, &wanted->y_count) : NULL;
  int status = words ? prepare(out, p, wanted->path_count, wanted->paths)
                     : flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  wanted->y = words;
  if (!status) status = flesh_curves_read(wanted, &curves);
  if (!status) status = draw(p, &curves);
  for (int k = 0; k < curves.count && !status; k++)
    if (!curves.curves[k].drawn)
      fprintf(stderr, "flesh plot: %s has no point that can be drawn\n", curves.curves[k].title);
  if (!status) printf("picture: %s\n", out);
  flesh_curves_clear(&curves);
  free(words);
  free(list);
  return status;
}

int flesh_command_plot(int argc, char **argv)
{
  const char *y = NULL, *out = "plot.svg", *log = NULL;
  flesh_curves_wanted wanted = {0};
  picture p = {.width = 960, .height = 600};
  const flesh_option options[] = {
      {"y", "COLUMN[,COLUMN]...", FLESH_OPTION_TEXT, &y, "what is drawn"},
      {"x", "COLUMN", FLESH_OPTION_TEXT, &wanted.x, "over what (default t, else the first column)"},
      {"by", "COLUMN", FLESH_OPTION_TEXT, &wanted.by, "a curve for each value of this column"},
      {"log", "x|y|xy", FLESH_OPTION_TEXT, &log, "logarithmic axes; values that are not positive are left out"},
      {"out", "FILE", FLESH_OPTION_TEXT, &out, "picture to write, .svg, .png or .pdf (default plot.svg)"},
      {"title", "TEXT", FLESH_OPTION_TEXT, &p.title, "above the picture"},
      {"points", NULL, FLESH_OPTION_SWITCH, &p.points, "mark every row (default: up to 40 of them)"},
      {"width", "N", FLESH_OPTION_COUNT, &p.width, "pixels (default 960)"},
      {"height", "N", FLESH_OPTION_COUNT, &p.height, "pixels (default 600)"},
      {.name = NULL}};
  const flesh_usage usage = {.command = "plot",
                             .positionals = "RUN... --y COLUMN",
                             .summary = "Draws curves of what runs have written, over time or each other.",
                             .details = flesh_own_text("plot_help"),
                             .positional_min = 1,
                             .positional_max = INT_MAX,
                             .options = options};
  int code = flesh_options_read(&usage, argc, argv, &wanted.path_count);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  if (!y || !y[strspn(y, ",")]) return flesh_option_refuse(usage.command, "y", y, "the name of a column");
  if (log && strcmp(log, "x") && strcmp(log, "y") && strcmp(log, "xy"))
    return flesh_option_refuse(usage.command, "log", log, "x, y or xy");
  const int *sides[2] = {&p.width, &p.height};
  for (int d = 0; d < 2; d++)
    if (*sides[d] < 100 || *sides[d] > 10000)
      return flesh_command_refuse(usage.command, "--%s is %d; it must be 100 to 10000 pixels", d ? "height" : "width",
                                  *sides[d]);
  if (!cut_path(out, &p))
    return flesh_option_refuse(usage.command, "out", out, "a file whose name ends in .svg, .png or .pdf");
  for (int d = 0; d < 2; d++) wanted.log[d] = p.log[d] = log && strchr(log, d ? 'y' : 'x');
  wanted.paths = argv + 1;
  int status = plot(out, y, &wanted, &p);
  free(p.folder);
  free(p.name);
  return status ? flesh_command_fail(usage.command, status) : 0;
}
