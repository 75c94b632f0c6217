/* picture_legend.h: the scale of a picture's colours: its range, its marks, and how it is drawn. */
#ifndef FLESH_PICTURE_PICTURE_LEGEND_H
#define FLESH_PICTURE_PICTURE_LEGEND_H

#include <cairo.h>

#include "picture/picture_panel.h"

/* Pixels: what it takes beside the panels, and the least height that holds it. */
enum { FLESH_LEGEND_WIDTH = 104, FLESH_LEGEND_HEIGHT = 176, FLESH_LEGEND_TICKS = 16 };

/* Round ends for values from `least` to `most`: of J about 1, of all else from 0. */
void flesh_picture_range(flesh_picture_field field, double least, double most, double *low, double *high);

/* Up to `room` (2 ... FLESH_LEGEND_TICKS) multiples of 1, 2, 2.5 or 5 times a power of ten within [low, high], with
 * both ends among them where that can be. Returns their number; *decimals: how many they need. */
int flesh_picture_ticks(double low, double high, int room, double *ticks, int *decimals);

/* The quantity with its unit on one line, for a report: "von Mises stress [kPa]"; values are divided by *unit. */
void flesh_picture_quantity(flesh_picture_field field, const flesh_picture_frame *frame, char text[64], double *unit);

/* Draws it from x on, its middle at y, at most `height` high. */
void flesh_picture_legend(cairo_t *c, double x, double y, double height, flesh_picture_field field,
                          const flesh_picture_frame *frame);

/* Text whose part `align` (0: all, 1/2: half) is right of x. */
void flesh_picture_text(cairo_t *c, double x, double y, double align, double size, double grey, const char *text);
double flesh_picture_text_width(cairo_t *c, double size, const char *text);

#endif
