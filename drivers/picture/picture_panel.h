/* picture_panel.h: what a picture shows and how: its panels, options and limits. */
#ifndef FLESH_PICTURE_PICTURE_PANEL_H
#define FLESH_PICTURE_PICTURE_PANEL_H

#include "flesh/skin.h"
#include "picture/render.h"

/* The quantity that colours show. */
typedef enum flesh_picture_field {
  FLESH_PICTURE_PLAIN, /* the colour of flesh, a shade per region */
  FLESH_PICTURE_J,     /* the mean of J = det F in a tet */
  FLESH_PICTURE_STRESS, /* von Mises stress, Pa */
  FLESH_PICTURE_SPEED, /* m/s */
  FLESH_PICTURE_YOUNG, /* Young's modulus of a tet's material at small strains, Pa */
  FLESH_PICTURE_ERROR, /* the size of a tet's share of the mesh's error of a position, m */
  FLESH_PICTURE_FIELDS
} flesh_picture_field;

/* A body in a picture; everything borrowed. */
typedef struct flesh_picture_panel {
  const char *title, *subtitle; /* may be NULL */
  const flesh_body *body;
  const double *x; /* [3*nodes], m; NULL: the panel says `subtitle` instead of showing a body */
  const double *v; /* [3*nodes], m/s; only for FLESH_PICTURE_SPEED */
  const double *J; /* [2*tets] flesh_picture_jacobians instead of those of x, as where x is scaled; NULL: of x */
  /* Drawn instead of the body's boundary; NULL: none. */
  const flesh_surface *surface;
  const flesh_skin *skin;
  /* Obstacles of this system's contacts at `t` are drawn too, and the stress of its effects then is part of the
   * stress; NULL: none. */
  const flesh_system *system;
  double t;
  /* Only for FLESH_PICTURE_ERROR: whose equilibrium x is, and the column of its probes. */
  const flesh_scene *scene;
  const char *column;
} flesh_picture_panel;

typedef struct flesh_picture_options {
  flesh_picture_field field;
  double low, high; /* of the colours; NaN: fitted to all but a hundredth of the panels' values at either end. J's
                     * colours are centred on 1 */
  flesh_camera camera;
  int columns;           /* panels per row; 0: as many as look well */
  int width, height;     /* of a panel, pixels; height 0: fitted to the bodies */
  int edges;             /* draw the edges of the body's triangles */
  flesh_render_style style;
} flesh_picture_options;

/* The limits that a series of pictures shares. */
typedef struct flesh_picture_frame {
  flesh_view view;
  double low, high;   /* of the colours */
  double least, most; /* values there are: of tets, for the speed of nodes; NaN: none */
  int inverted;       /* there are inverted tets, which are drawn black */
} flesh_picture_frame;

#endif
