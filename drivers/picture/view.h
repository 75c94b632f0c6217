/* view.h: a camera without anything left open, fitted to what it is to show. */
#ifndef FLESH_PICTURE_VIEW_H
#define FLESH_PICTURE_VIEW_H

#include "flesh/scene.h"

/* Gives a vector the length 1; of no length it stays 0. */
void flesh_view_normalise(double a[3]);

/* A camera without anything left open, and the picture it fills. */
typedef struct flesh_view {
  double right[3], up[3], back[3]; /* orthonormal; back looks from the target to the eye */
  double zenith[3];                /* upwards in the scene */
  double target[3];
  double height;   /* seen at the target, m */
  double distance; /* of the eye from the target, m; 0: parallel rays */
  int width_px, height_px;
  int misses_all; /* nothing that it was fitted to can be seen: all is beside it, behind the eye or below a pixel */
} flesh_view;

/* The smallest box about all points in the camera's axes, and what the four sides of a perspective
 * picture must hold, gathered point by point. */
typedef struct flesh_view_fit {
  flesh_view view; /* axes only */
  double slope[2]; /* tangents of half the field of view, across and up; 0: parallel */
  double sides[4]; /* right, left, top, bottom */
  double low[3], high[3];
} flesh_view_fit;

/* Begins a fit for a camera and a picture of that shape. */
void flesh_view_fit_begin(const flesh_camera *camera, int width_px, int height_px,
                          flesh_view_fit *fit);
/* Points [3*count]; those that are not finite are left out. */
void flesh_view_fit_add(flesh_view_fit *fit, int count, const double *points);
/* The view that shows all of them, with a margin, unless the camera says more. */
void flesh_view_fit_end(const flesh_view_fit *fit, const flesh_camera *camera, flesh_view *view);
/* Width over height of what was added, as the camera sees it. */
double flesh_view_fit_shape(const flesh_view_fit *fit);

#endif
