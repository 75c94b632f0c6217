/* picture_panel.h: the content of a picture and how it is drawn: panels, options and limits. */
#ifndef FLESH_PICTURE_PICTURE_PANEL_H
#define FLESH_PICTURE_PICTURE_PANEL_H

#include "flesh/skin.h"
#include "picture/render.h"

/* The quantity that is shown by colours. */
typedef enum flesh_picture_field {
  FLESH_PICTURE_PLAIN, /* colour of flesh, a shade for each region */
  FLESH_PICTURE_J,     /* the mean of J = det F in a tet */
  FLESH_PICTURE_STRESS, /* von Mises stress, Pa */
  FLESH_PICTURE_SPEED, /* m/s */
  FLESH_PICTURE_YOUNG, /* Young's modulus of a tet's material at small strains, Pa */
  FLESH_PICTURE_ERROR, /* size of a tet's contribution to the mesh's error of a position, m */
  FLESH_PICTURE_FIELDS
} flesh_picture_field;

/* A body in a picture; everything is borrowed. */
typedef struct flesh_picture_panel {
  const char *title, *subtitle; /* may be NULL */
  const flesh_body *body;
  const double *x; /* [3*nodes], m; NULL: the panel says `subtitle` instead of showing a body */
  const double *v; /* [3*nodes], m/s; only for FLESH_PICTURE_SPEED */
  const double *J; /* [2*tets] used instead of flesh_picture_jacobians of x, as when x is scaled; NULL: those of x */
  /* Surface and skin that are drawn instead of the body's boundary; NULL: none. */
  const flesh_surface *surface;
  const flesh_skin *skin;
  /* The obstacles of this system's contacts at `t` are drawn, too, and the stress of its effects is part of the stress;
   * NULL: none. */
  const flesh_system *system;
  double t;
  /* Only for FLESH_PICTURE_ERROR: the scene whose equilibrium x is, and the column of its probes. */
  const flesh_scene *scene;
  const char *column;
} flesh_picture_panel;

typedef struct flesh_picture_options {
  flesh_picture_field field;
  double low, high; /* range of colours; NaN: fitted to the panels' values except 1 % at either end. J's range is centred on 1 */
  flesh_camera camera;
  int columns;           /* panels per row; 0: chosen */
  int width, height;     /* of a panel, pixels; height 0: fitted to the bodies */
  int edges;             /* draw the edges of the body's triangles */
  flesh_render_style style;
} flesh_picture_options;

/* Limits shared by the pictures of a series. */
typedef struct flesh_picture_frame {
  flesh_view view;
  double low, high;   /* range of the colours */
  double least, most; /* extremes of the values (of tets; of nodes for the speed); NaN: there are none */
  int inverted;       /* whether there are inverted tets, which are drawn black */
} flesh_picture_frame;

#endif
