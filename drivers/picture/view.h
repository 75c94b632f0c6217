/* view.h: a camera with all its values set, fitted to what it will show. */
#ifndef FLESH_PICTURE_VIEW_H
#define FLESH_PICTURE_VIEW_H

#include "flesh/scene.h"

/* Scales a vector to the length 1; the zero vector stays 0. */
void flesh_view_normalise(double a[3]);

/* A camera with all its values set, and the size of its picture. */
typedef struct flesh_view {
  double right[3], up[3], back[3]; /* orthonormal; back points from the target to the eye */
  double zenith[3];                /* upward direction of the scene */
  double target[3];
  double height;   /* height that is seen at the target, m */
  double distance; /* from the eye to the target, m; 0: parallel rays */
  int width_px, height_px;
  int misses_all; /* none of the points added can be seen: all are outside the picture, behind the eye or smaller than a pixel */
} flesh_view;

/* The smallest box around all points in the camera's axes, and the extremes for the four sides of a perspective
 * picture, collected point by point. */
typedef struct flesh_view_fit {
  flesh_view view; /* axes only */
  double slope[2]; /* tangents of half the field of view, across and up; 0: parallel */
  double sides[4]; /* right, left, top, bottom */
  double low[3], high[3];
} flesh_view_fit;

/* Returns a fit without points in the axes of a view, for parallel rays. */
flesh_view_fit flesh_view_fit_along(const flesh_view *axes);
/* Begins a fit for a camera and a picture of this size. */
void flesh_view_fit_begin(const flesh_camera *camera, int width_px, int height_px, flesh_view_fit *fit);
/* Adds points [3*count]; those that are not finite are left out. */
void flesh_view_fit_add(flesh_view_fit *fit, int count, const double *points);
/* Makes the view that shows all points, with a margin, except where the camera's values say otherwise. */
void flesh_view_fit_end(const flesh_view_fit *fit, const flesh_camera *camera, flesh_view *view);
/* Returns width over height of the points added, as the camera sees them. */
double flesh_view_fit_shape(const flesh_view_fit *fit);

#endif
