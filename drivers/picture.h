/* picture.h: pictures of bodies side by side, all seen by one camera and coloured on one scale, as
 * PNG files. */
#ifndef FLESH_DRIVERS_PICTURE_H
#define FLESH_DRIVERS_PICTURE_H

#include "flesh/skin.h"
#include "render.h"

/* What the colours show. */
typedef enum flesh_picture_field {
  FLESH_PICTURE_PLAIN, /* the colour of flesh, a shade per region */
  FLESH_PICTURE_J,     /* det F */
  FLESH_PICTURE_STRESS, /* von Mises stress, Pa */
  FLESH_PICTURE_SPEED  /* m/s */
} flesh_picture_field;

/* A body in a picture; everything borrowed. */
typedef struct flesh_picture_panel {
  const char *title, *subtitle; /* may be NULL */
  const flesh_body *body;
  const double *x; /* [3*nodes], m; NULL: the panel says `subtitle` instead of showing a body */
  const double *v; /* [3*nodes], m/s; only for FLESH_PICTURE_SPEED */
  const double *J; /* [tets] instead of what x has, as where x is scaled; NULL: of x */
  /* Drawn instead of the body's boundary; NULL: none. */
  const flesh_surface *surface;
  const flesh_skin *skin;
  /* Obstacles of this system's contacts at `t` are drawn too; NULL: none. */
  const flesh_system *system;
  double t;
} flesh_picture_panel;

typedef struct flesh_picture_options {
  flesh_picture_field field;
  double low, high; /* of the colours; NaN: fitted to the panels. J's colours are centred on 1 */
  flesh_camera camera;
  int columns;           /* panels per row; 0: as many as look well */
  int width, height;     /* of a panel, pixels; height 0: fitted to the bodies */
  int edges;             /* draw the edges of the body's triangles */
  int samples;           /* squared, per pixel */
} flesh_picture_options;

/* J fitted, the default camera, 480 pixels wide, no edges, 3 samples. */
void flesh_picture_options_default(flesh_picture_options *options);

/* The limits that a series of pictures shares. */
typedef struct flesh_picture_frame {
  flesh_view view;
  double low, high;
} flesh_picture_frame;

/* Gathers them: begin, add every panel that will be drawn, end. The view is fitted for several
 * shapes of a picture at once, of which the end takes one. */
enum { FLESH_PICTURE_SHAPES = 12 };
typedef struct flesh_picture_fit {
  const flesh_picture_options *options;
  int shapes;
  flesh_view_fit bodies[FLESH_PICTURE_SHAPES];
  double low, high;
} flesh_picture_fit;
void flesh_picture_fit_begin(const flesh_picture_options *options, flesh_picture_fit *fit);
int flesh_picture_fit_add(flesh_picture_fit *fit, const flesh_picture_panel *panel);
void flesh_picture_fit_end(flesh_picture_fit *fit, flesh_picture_frame *frame);

/* Draws the panels side by side into `path` (PNG), whole or not at all. */
int flesh_picture_draw(const char *path, int count, const flesh_picture_panel *panels,
                       const flesh_picture_options *options, const flesh_picture_frame *frame);

/* Fits and draws. */
int flesh_picture(const char *path, int count, const flesh_picture_panel *panels,
                  const flesh_picture_options *options);

/* "none", "J", "stress", "speed". FLESH_ERR_ARGUMENT for another name. */
int flesh_picture_field_from_name(const char *name, flesh_picture_field *field);

#endif
