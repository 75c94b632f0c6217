/* plot.h: plots by gnuplot. Every plot is a script and its data, kept beside it so that users can
 * restyle it: `gnuplot NAME.gp` draws NAME.png again. */
#ifndef FLESH_PICTURE_PLOT_H
#define FLESH_PICTURE_PLOT_H

#include <stdio.h>

#include "flesh/status.h"

/* Runs `gnuplot NAME.gp` in `folder`. FLESH_ERR_FILE with one sentence when gnuplot is not
 * installed or fails; the script stays. */
int flesh_plot_draw(const char *folder, const char *name);
/* Draws NAME.svg, .pdf or .png by the script that flesh_plot_begin_as has made for it. */
int flesh_plot_draw_as(const char *folder, const char *name, const char *suffix);

/* A command's status after its pictures: if gnuplot is not installed the figures still stand, which is said on stderr,
 * and FLESH_OK is returned; any other failure is the command's. */
int flesh_plot_accept(const char *command, int drawn);

typedef struct flesh_plot_series {
  const char *title;
  const char *file;   /* CSV with a header, relative to the folder */
  const char *x, *y;  /* names of its columns */
  const char *colour; /* "#rrggbb"; NULL: a default one */
  int dashed;
  int stops; /* 1: a cross marks that it ends at stop_x, stop_y */
  double stop_x, stop_y;
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

/* The outcome of several pictures: a failure does not keep the others from being drawn, and the first one is
 * reported. */
typedef struct flesh_plot_outcome {
  int status;
  char words[1024];
} flesh_plot_outcome;
void flesh_plot_note(flesh_plot_outcome *outcome, int status);
/* The status of the first failure, whose words are the last error's again. */
int flesh_plot_ended(const flesh_plot_outcome *outcome);

#endif
