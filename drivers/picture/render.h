/* render.h: draws shaded pictures of triangles, by a depth buffer and a shadow map in memory; needs no display. Colours
 * are linear light in [0, 1] (see flesh_srgb_encode). */
#ifndef FLESH_PICTURE_RENDER_H
#define FLESH_PICTURE_RENDER_H

#include "picture/render_raster.h"
#include "picture/view.h"

/* Colour of inverted tets, linear light. */
extern const float flesh_render_inverted[3];

typedef struct flesh_render_style {
  int samples;   /* per pixel in each direction */
  int flat;      /* draw colours as they are, without light and shadow */
  int no_shadow; /* draw with light, but without shadows */
} flesh_render_style;

/* Renders into pixels [width_px*height_px of the view], opaque, 0x00RRGGBB in rows from the top. Surfaces that are
 * coloured by values are lit softly and do not shine, so that their colours can be compared with the scale.
 * FLESH_ERR_MEMORY. */
int flesh_render(const flesh_view *view, int count, const flesh_render_surface *surfaces,
                 const flesh_render_style *style, uint32_t *pixels);

/* Convert between linear light and its sRGB encoding (IEC 61966-2-1), both in [0, 1]. */
double flesh_srgb_encode(double linear);
double flesh_srgb_decode(double encoded);

#endif
