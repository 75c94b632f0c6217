/* plot.h: plots by gnuplot. Every plot is a script and its data, kept beside it so that users can
 * restyle it: `gnuplot NAME.gp` draws NAME.png again. */
#ifndef FLESH_PICTURE_PLOT_H
#define FLESH_PICTURE_PLOT_H

#include "flesh/status.h"

/* Runs `gnuplot NAME.gp` in `folder`. FLESH_ERR_FILE with one sentence when gnuplot is not
 * installed or fails; the script stays. */
int flesh_plot_draw(const char *folder, const char *name);
/* Draws NAME.svg, .pdf or .png by the script that flesh_plot_begin has made for it. */
int flesh_plot_draw_as(const char *folder, const char *name, const char *suffix);

/* A command's status after its pictures: if gnuplot is not installed the figures still stand, which is said on stderr,
 * and FLESH_OK is returned; any other failure is the command's. */
int flesh_plot_accept(const char *command, int drawn);

/* The outcome of several pictures: a failure does not keep the others from being drawn, and the first one is
 * reported. */
typedef struct flesh_plot_outcome {
  int count, status; /* count: of those that flesh_plot_draw_noted draws */
  char words[1024];
} flesh_plot_outcome;
void flesh_plot_note(flesh_plot_outcome *outcome, int status);
/* Draws a picture of several (flesh_plot_draw), whose outcome is `outcome`. */
void flesh_plot_draw_noted(void *outcome, const char *folder, const char *name);
/* The status of the first failure, whose words are the last error's again. */
int flesh_plot_ended(const flesh_plot_outcome *outcome);

#endif
