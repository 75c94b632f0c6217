/* render_shadow.h: what keeps the light of a distant lamp from what a camera sees, by a depth buffer of the lamp's own
 * (Williams 1978) whose comparisons are averaged (Reeves, Salesin & Cook 1987). */
#ifndef FLESH_PICTURE_RENDER_SHADOW_H
#define FLESH_PICTURE_RENDER_SHADOW_H

#include "picture/render_raster.h"
#include "picture/render_surface.h"

typedef struct flesh_shadow {
  flesh_view view;   /* back: towards the lamp; parallel rays */
  flesh_raster map;  /* without samples where nothing casts a shadow into the picture */
} flesh_shadow;

/* A box in the lamp's axes, m: across and up its picture, and towards it. */
typedef struct flesh_shadow_window {
  double low[3], high[3];
} flesh_shadow_window;

/* The axes of a lamp over the camera's left shoulder. */
void flesh_shadow_begin(const flesh_view *camera, flesh_shadow *shadow);
void flesh_shadow_window_clear(flesh_shadow_window *window);
void flesh_shadow_window_add(const flesh_shadow *shadow, const double p[3], flesh_shadow_window *window);

/* Draws the surfaces that cast shadows into a map of at most `size` samples each way over the places that are `seen`.
 * FLESH_ERR_MEMORY. */
int flesh_shadow_cast(flesh_shadow *shadow, const flesh_shadow_window *seen, int size, int count,
                      const flesh_render_surface *surfaces);
void flesh_shadow_close(flesh_shadow *shadow);

/* The part of the light that reaches p, where a flat surface has the cosine `facing` to it. */
double flesh_shadow_lit(const flesh_shadow *shadow, const double p[3], double facing);

#endif
