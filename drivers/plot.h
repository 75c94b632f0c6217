/* plot.h: plots by gnuplot. Every plot is a script and its data, kept beside it so that users can
 * restyle it: `gnuplot NAME.gp` draws NAME.png again. */
#ifndef FLESH_DRIVERS_PLOT_H
#define FLESH_DRIVERS_PLOT_H

#include <stdio.h>

#include "flesh/status.h"

/* Runs `gnuplot NAME.gp` in `folder`. FLESH_ERR_FILE with one sentence when gnuplot is not
 * installed or fails; the script stays. */
int flesh_plot_draw(const char *folder, const char *name);

typedef struct flesh_plot_series {
  const char *title;
  const char *file;   /* CSV with a header, relative to the folder */
  const char *x, *y;  /* names of its columns */
  const char *colour; /* "#rrggbb"; NULL: a default one */
  int dashed;
} flesh_plot_series;

/* Lines over one abscissa. */
typedef struct flesh_plot_lines {
  const char *title, *x_label, *y_label;
  const char *extra; /* further gnuplot lines before the plot ("set yrange [0:2]\n"), may be NULL */
  int count;
  const flesh_plot_series *series;
} flesh_plot_lines;

/* Writes NAME.gp into `folder` and draws NAME.png. */
int flesh_plot_lines_draw(const char *folder, const char *name, const flesh_plot_lines *lines);

#endif
