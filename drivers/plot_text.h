/* plot_text.h: what the writers of gnuplot scripts share. */
#ifndef FLESH_DRIVERS_PLOT_TEXT_H
#define FLESH_DRIVERS_PLOT_TEXT_H

#include "io/file.h"

/* Opens folder/name+suffix. */
int flesh_plot_open(const char *folder, const char *name, const char *suffix, flesh_file *file);

/* Terminal and output of NAME.png in pixels. */
void flesh_plot_begin(FILE *stream, const char *name, int width, int height);

/* Prints the text as a gnuplot string. */
void flesh_plot_quote(FILE *stream, const char *text);

#endif
