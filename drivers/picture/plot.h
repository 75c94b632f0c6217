/* plot.h: plots by gnuplot. Every plot is a script and its data, kept beside it so that users can
 * restyle it: `gnuplot NAME.gp` draws NAME.png again.
 *
 * gnuplot runs commands from file names ("|command", "<command"), from backquotes, and from whatever follows a string
 * that has ended. Every text that is not this program's own goes through flesh_plot_quote or flesh_plot_quote_file. */
#ifndef FLESH_PICTURE_PLOT_H
#define FLESH_PICTURE_PLOT_H

#include "base/file.h"
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

/* Opens folder/name+suffix. FLESH_ERR_ARGUMENT when `name` is no plain file name: empty, with a slash or a control
 * character, or beginning with | or <. */
int flesh_plot_open(const char *folder, const char *name, const char *suffix, flesh_file *file);

/* Terminal of width x height pixels, and the output NAME.svg, .pdf (of 96 pixels an inch) or .png (elsewhere when gnuplot has
 * `picture`). */
void flesh_plot_begin(FILE *stream, const char *name, const char *suffix, int width, int height);

/* The look of all plots: border, tics, grid; a legend outside at the right. With `of_csv` data are columns of CSV, in which
 * empty cells are left out. */
void flesh_plot_style(FILE *stream, int of_csv);
/* Title; label of the axis "x" or "y". */
void flesh_plot_title(FILE *stream, const char *text);
void flesh_plot_label(FILE *stream, const char *axis, const char *text);
/* The colour of the k-th of several curves. */
const char *flesh_plot_colour(int k);

/* Prints the text as a gnuplot string, for scripts and for data. Only letters, digits and harmless signs stand as they
 * are; the rest is written in octal. Control characters become spaces, what is not UTF-8 becomes '?'. */
void flesh_plot_quote(FILE *stream, const char *text);
/* Prints the text as a string for a tick's label, in which gnuplot would take % for a format. */
void flesh_plot_quote_tick(FILE *stream, const char *text);
/* Prints name+suffix, a file of the script's folder, byte by byte as it is. */
void flesh_plot_quote_file(FILE *stream, const char *name, const char *suffix);

/* Ticks of a logarithmic axis ("x", "cb") over low to high: at decades, at 1, 2 and 5 of each where there are few. Of
 * less than a factor 2.5: none, gnuplot's own serve. */
void flesh_plot_log_ticks(FILE *stream, const char *axis, double low, double high);

#endif
