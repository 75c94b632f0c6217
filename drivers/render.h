/* render.h: shaded pictures of triangles, by a depth buffer and a shadow map in memory; no display
 * is needed. Colours are linear light in [0, 1] (see flesh_render_srgb). */
#ifndef FLESH_DRIVERS_RENDER_H
#define FLESH_DRIVERS_RENDER_H

#include <stdint.h>

#include "flesh/scene.h"

/* A camera without anything left open, and the picture it fills. */
typedef struct flesh_view {
  double right[3], up[3], back[3]; /* orthonormal; back looks from the target to the eye */
  double target[3];
  double height;   /* seen at the target, m */
  double distance; /* of the eye from the target, m; 0: parallel rays */
  int width_px, height_px;
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

/* A surface in a picture; everything borrowed. */
typedef struct flesh_render_surface {
  int vertices, triangles;
  const double *x;    /* [3*vertices], m */
  const double *rest; /* [3*vertices] where its edges are judged sharp or round; NULL: x */
  const int *corners; /* [3*triangles] */
  const float *colours;  /* [3*vertices]; NULL: `plain` */
  const float *triangle_colours; /* [3*triangles]; NULL: `colours` */
  const uint8_t *marked; /* [triangles] 1: in the colour of what is inverted; NULL: none */
  float plain[3];
  int edges;    /* draw the triangles' edges */
  int two_sided; /* the inside looks like the outside; else it is darker */
  int ground;    /* receives shadows; what it casts is of no account */
} flesh_render_surface;

/* Opaque pixels 0x00RRGGBB, rows from the top. */
typedef struct flesh_image {
  int width, height;
  uint32_t *pixels;
} flesh_image;

/* Renders into a new image, with `samples`^2 samples per pixel. FLESH_ERR_MEMORY. */
int flesh_render(const flesh_view *view, int count, const flesh_render_surface *surfaces,
                 int samples, flesh_image *image);
void flesh_image_free(flesh_image *image);

/* Between linear light and sRGB's encoding (IEC 61966-2-1), both in [0, 1]. */
double flesh_srgb_encode(double linear);
double flesh_srgb_decode(double encoded);

#endif
