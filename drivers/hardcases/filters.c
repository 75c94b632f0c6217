/* filters.c: performance profiles of eigenvalue filters (--filters) as a picture of the table profiles.csv. */
#include <stdio.h>
#include <string.h>

#include "hardcases/hardcases.h"
#include "picture/plot.h"
#include "picture/plot_text.h"

enum { MEASURES = 3, OCTAVES = 5 }; /* as in data/studies/profiles.sql */
static const char *const measures[MEASURES][2] = {
    {"newton", "Newton iterations"}, {"linear", "linear iterations"}, {"cpu", "CPU time"}};
static const char *const colours[] = {"#1b6ca8", "#d1602f", "#3a8f4d", "#8c6bb1", "#111111", "#c2185b",
                                      "#8a7a2b", "#5f9ea0", "#777777", "#e0a030", "#2e3f8f", "#9acd32"};
enum { COLOURS = sizeof colours / sizeof *colours };

/* Whether no setting before has this solver. */
static int is_new(const flesh_hardcases_plan *plan, int setting)
{
  for (int s = 0; s < setting; s++)
    if (plan->settings[s].solver == plan->settings[setting].solver) return 0;
  return 1;
}

static void draw_panel(const flesh_hardcases_plan *plan, const char *element, const char *const measure[2], int has_key,
                       FILE *stream)
{
  char title[96];
  int lines = 0;
  snprintf(title, sizeof title, "%s: %s", element, measure[1]);
  fputs("set title ", stream);
  flesh_plot_quote(stream, title);
  fprintf(stream, "\n%s\nplot ", has_key ? "set key right bottom noenhanced font ',8' spacing 0.9" : "unset key");
  for (int s = 0; s < plan->setting_count; s++) {
    const char *name = flesh_hardcases_solver_name(plan->settings[s].solver);
    if (!is_new(plan, s)) continue;
    fprintf(stream,
            "%s'profiles.csv' using (strcol('element') eq '%s' && strcol('measure') eq '%s' && strcol('filter') eq '%s' "
            "? column('tau') : NaN):(100*column('share')) with steps lw 2%s lc rgb '%s' title ",
            lines ? ", \\\n  " : "", element, measure[0], name, strstr(name, "always") ? " dt 2" : "",
            colours[lines % COLOURS]);
    flesh_plot_quote(stream, name);
    lines++;
  }
  putc('\n', stream);
}

int flesh_hardcases_draw_filters(const void *data)
{
  const flesh_hardcases_plan *plan = data;
  flesh_file file;
  int elements = 0, status = flesh_plot_open(plan->out, "profiles", ".gp", &file);
  if (status) return status;
  for (int s = 0; s < plan->setting_count; s++) /* settings go element by element */
    elements += s == 0 || plan->settings[s].element != plan->settings[s - 1].element;
  flesh_plot_begin(file.stream, "profiles", 1200, 40 + 330 * elements);
  flesh_plot_style(file.stream, 1);
  fprintf(file.stream,
          "set key default\nset title noenhanced font ',11'\nset logscale x 2\nset xrange [1:%d]\nset yrange [0:102]\n"
          "set xlabel 'times the least cost' font ',9'\nset ylabel 'problems solved [%%]' font ',9'\n"
          "set multiplot layout %d,%d\n",
          1 << OCTAVES, elements, (int)MEASURES);
  for (int s = 0; s < plan->setting_count; s++)
    for (int m = 0; m < MEASURES && (s == 0 || plan->settings[s].element != plan->settings[s - 1].element); m++)
      draw_panel(plan, flesh_element_name(plan->settings[s].element), measures[m], s == 0 && m == 0, file.stream);
  fputs("unset multiplot\n", file.stream);
  status = flesh_file_commit(&file);
  return status ? status : flesh_plot_draw(plan->out, "profiles");
}
