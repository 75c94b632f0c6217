/* plot.h: plots by gnuplot. Every plot is a script and its data, kept beside it so that users can restyle it: `gnuplot
 * NAME.gp` draws NAME.png again.
 *
 * gnuplot runs commands from file names ("|command", "<command"), from backquotes, and from anything that follows the
 * end of a string. Every text that is not this program's own goes through flesh_plot_quote or flesh_plot_quote_file. */
#ifndef FLESH_PICTURE_PLOT_H
#define FLESH_PICTURE_PLOT_H

#include "base/file.h"
#include "flesh/status.h"

/* Exit code if a program is not installed; a shell returns the same. */
enum { FLESH_PROGRAM_MISSING = 127 };
/* Runs words[0] with the other words (NULL ends them) in the folder; its stderr goes into the file `log`. Returns its
 * exit code, or -1 if it could not be started or a signal ended it. */
int flesh_program_run(const char *folder, const char *log, const char *const *words);

/* Draws NAME.svg, .pdf or .png by `gnuplot NAME.gp` in `folder`; flesh_plot_begin has begun that script with the suffix.
 * FLESH_ERR_FILE with a sentence if gnuplot is not installed or fails; the script is kept. */
int flesh_plot_draw(const char *folder, const char *name, const char *suffix);

/* Returns the status of a command after its pictures, `drawn`. If gnuplot is not installed, prints that to stderr and
 * returns FLESH_OK, as the figures are valid without pictures; any other status is returned as it is. */
int flesh_plot_accept(const char *command, int drawn);

/* The outcome of several pictures: after a failure the others are still drawn, and the first failure is reported. */
typedef struct flesh_plot_outcome {
  int count, status; /* count: pictures drawn by flesh_plot_draw_noted */
  char words[1024];
} flesh_plot_outcome;
void flesh_plot_note(flesh_plot_outcome *outcome, int status);
/* Draws one of several pictures, a PNG, and notes its status in `outcome`. */
void flesh_plot_draw_noted(void *outcome, const char *folder, const char *name);
/* Returns the status of the first failure, after making its message the last error. */
int flesh_plot_ended(const flesh_plot_outcome *outcome);

/* Opens folder/name+suffix. FLESH_ERR_ARGUMENT if `name` is not a plain file name: empty, with a slash or a control
 * character, or beginning with | or <. */
int flesh_plot_open(const char *folder, const char *name, const char *suffix, flesh_file *file);

/* Sets a terminal of width x height pixels and the output NAME.svg, .pdf (with 96 pixels per inch) or .png; gnuplot's
 * variable `picture`, if it is set, names another output. */
void flesh_plot_begin(FILE *stream, const char *name, const char *suffix, int width, int height);

/* Sets the look of all plots: border, tics, grid, a legend outside at the right. With `of_csv` the data are columns of
 * CSV, in which empty cells are skipped. */
void flesh_plot_style(FILE *stream, int of_csv);
/* Set the title, and the label of the axis "x" or "y". */
void flesh_plot_title(FILE *stream, const char *text);
void flesh_plot_label(FILE *stream, const char *axis, const char *text);
/* Returns the colour of the k-th of several curves. */
const char *flesh_plot_colour(int k);

/* Prints the text as a gnuplot string, for scripts and for data. Only letters, digits and harmless signs are printed as
 * they are; others are written in octal. Control characters become spaces, bytes that are not UTF-8 become '?'. */
void flesh_plot_quote(FILE *stream, const char *text);
/* Prints the text as a string for a tick's label, where % begins a format and is doubled. */
void flesh_plot_quote_tick(FILE *stream, const char *text);
/* Prints name+suffix, a file in the script's folder, with every byte kept. */
void flesh_plot_quote_file(FILE *stream, const char *name, const char *suffix);

/* Sets the ticks of a logarithmic axis ("x", "cb") over low to high: 1, 2 and 5 of each decade. Over less than a factor
 * of 2.5 or more than three decades it sets none, and gnuplot's own are used. */
void flesh_plot_log_ticks(FILE *stream, const char *axis, double low, double high);

#endif
