/* plot.h: pictures by gnuplot. Every picture is a script and its data, kept beside it so that users
 * can restyle it: `gnuplot NAME.gp` draws NAME.png again. */
#ifndef FLESH_DRIVERS_PLOT_H
#define FLESH_DRIVERS_PLOT_H

#include <stdio.h>

#include "flesh/mesh.h"

/* Runs `gnuplot NAME.gp` in `folder`. FLESH_ERR_FILE with one sentence when gnuplot is not
 * installed or fails; the script stays. */
int flesh_plot_draw(const char *folder, const char *name);

typedef struct flesh_plot_series {
  const char *title;
  const char *file;   /* CSV with a header, relative to the folder */
  const char *x, *y;  /* names of its columns */
  const char *colour; /* "#rrggbb"; NULL: a default one */
  int dashed;
} flesh_plot_series;

/* Lines over one abscissa. */
typedef struct flesh_plot_lines {
  const char *title, *x_label, *y_label;
  const char *extra; /* further gnuplot lines before the plot ("set yrange [0:2]\n"), may be NULL */
  int count;
  const flesh_plot_series *series;
} flesh_plot_lines;

/* Writes NAME.gp into `folder` and draws NAME.png. */
int flesh_plot_lines_draw(const char *folder, const char *name, const flesh_plot_lines *lines);

/* A deformed body in a picture. Everything borrowed. */
typedef struct flesh_plot_panel {
  const char *title, *subtitle; /* subtitle may be NULL */
  const flesh_mesh *mesh;
  const double *x;     /* [3*nodes], m; NULL: the panel says `subtitle` instead of showing a body */
  const double *value; /* [tets], as J; NULL: plain */
} flesh_plot_panel;

typedef struct flesh_plot_surface_options {
  int columns;       /* panels per row; 0: as many as look well */
  double azimuth;    /* degrees the camera stands turned about z from -y (0: looks along +y) */
  double elevation;  /* degrees it stands above the horizon */
  double low, high;  /* of the colours, which are centred on 1: low < 1 < high */
  const char *label; /* of the colours */
  int panel_width, panel_height; /* pixels; height 0: fitted to the bodies */
  int edges;                     /* draw the triangles' edges */
  double window[4]; /* the part of the picture plane shown, m: left, right, bottom, top; all 0: fits
                       all panels. Same for all panels, so that they can be compared */
} flesh_plot_surface_options;

/* azimuth 30, elevation 20, colours 0.5 to 1.5 labelled J, 480 pixels wide, edges. */
void flesh_plot_surface_options_default(flesh_plot_surface_options *options);

/* Draws the surfaces of the panels side by side, seen by a parallel projection in equal scales,
 * shaded, each triangle in the colour of its tet's value; values <= 0 (inverted) are black-violet.
 * Writes NAME.gp and NAME.dat into `folder` and draws NAME.png. */
int flesh_plot_surface(const char *folder, const char *name, int count,
                       const flesh_plot_panel *panels, const flesh_plot_surface_options *options);

#endif
