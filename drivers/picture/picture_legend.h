/* picture_legend.h: the scale of a picture's colours (its legend): its range and its marks, and drawing it. */
#ifndef FLESH_PICTURE_PICTURE_LEGEND_H
#define FLESH_PICTURE_PICTURE_LEGEND_H

#include <cairo.h>

#include "picture/picture_panel.h"

/* Pixels: the width that the legend takes beside the panels, and the least height that holds it; largest number of
 * marks. */
enum { FLESH_LEGEND_WIDTH = 104, FLESH_LEGEND_HEIGHT = 176, FLESH_LEGEND_TICKS = 16 };

/* Finds a range with round ends for values from `least` to `most`: about 1 for J, from 0 for other fields. */
void flesh_picture_range(flesh_picture_field field, double least, double most, double *low, double *high);

/* Finds up to `room` (2 ... FLESH_LEGEND_TICKS) multiples of 1, 2, 2.5 or 5 times a power of ten within [low, high],
 * with both ends among them if possible. Returns their number; *decimals: number of decimals that they need. */
int flesh_picture_ticks(double low, double high, int room, double *ticks, int *decimals);

/* Writes the quantity and its unit on one line, for a report: "von Mises stress [kPa]"; values are to be divided by
 * *unit. */
void flesh_picture_quantity(flesh_picture_field field, const flesh_picture_frame *frame, char text[64], double *unit);

/* Draws the legend from x on, with its middle at y, at most `height` high. */
void flesh_picture_legend(cairo_t *c, double x, double y, double height, flesh_picture_field field,
                          const flesh_picture_frame *frame);

/* Draws text, of which the fraction `align` is left of x (0: none, 1/2: half). flesh_picture_text_width returns its
 * width. */
void flesh_picture_text(cairo_t *c, double x, double y, double align, double size, double grey, const char *text);
double flesh_picture_text_width(cairo_t *c, double size, const char *text);

#endif
