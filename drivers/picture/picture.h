/* picture.h: pictures of bodies side by side, all seen by one camera and coloured on one scale, as
 * PNG files. */
#ifndef FLESH_PICTURE_PICTURE_H
#define FLESH_PICTURE_PICTURE_H

#include <stdio.h>

#include "picture/picture_panel.h"

/* Sets J with a fitted range, the default camera, 480 pixels wide, no edges, 3 samples. */
void flesh_picture_options_default(flesh_picture_options *options);

/* Fits the view and the range of colours: begin, add every panel that will be drawn, end. The view is fitted to
 * pictures of several heights at once, of which flesh_picture_fit_end chooses one. */
enum { FLESH_PICTURE_SHAPES = 12 };
typedef struct flesh_picture_fit {
  const flesh_picture_options *options;
  int shapes;
  flesh_view_fit bodies[FLESH_PICTURE_SHAPES];
  flesh_picture_frame frame; /* of the panels so far, without the view; its range is that of the values */
} flesh_picture_fit;
void flesh_picture_fit_begin(const flesh_picture_options *options, flesh_picture_fit *fit);
int flesh_picture_fit_add(flesh_picture_fit *fit, const flesh_picture_panel *panel);
void flesh_picture_fit_end(flesh_picture_fit *fit, flesh_picture_frame *frame);

/* Draws the panels side by side and writes a PNG to the stream. */
int flesh_picture_print(FILE *stream, int count, const flesh_picture_panel *panels,
                        const flesh_picture_options *options, const flesh_picture_frame *frame);
/* Draws the picture into the file `path`, completely or not at all. */
int flesh_picture_draw(const char *path, int count, const flesh_picture_panel *panels,
                       const flesh_picture_options *options, const flesh_picture_frame *frame);

/* Fits and draws; *frame (may be NULL) receives what was fitted. */
int flesh_picture(const char *path, int count, const flesh_picture_panel *panels,
                  const flesh_picture_options *options, flesh_picture_frame *frame);

#endif
