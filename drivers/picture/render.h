/* render.h: draws shaded pictures of triangles, by a depth buffer and a shadow map in memory; needs no display. Colours
 * are linear light in [0, 1] (see flesh_srgb_encode). A depth buffer, as a camera or a light sees triangles, also keeps
 * which triangle is seen; what shades points from a distant lamp is found by a depth buffer of the lamp's own (Williams
 * 1978) whose comparisons are averaged (Reeves, Salesin & Cook 1987). */
#ifndef FLESH_PICTURE_RENDER_H
#define FLESH_PICTURE_RENDER_H

#include <stdint.h>

#include "picture/view.h"

/* A surface in a picture; everything is borrowed. */
typedef struct flesh_render_surface {
  int vertices, triangles;
  const double *x;    /* [3*vertices], m */
  const double *rest; /* [3*vertices] shape in which its edges are judged sharp or round; NULL: x */
  const int *corners; /* [3*triangles] */
  const float *colours;  /* [3*vertices]; NULL: `plain` */
  const float *triangle_colours; /* [3*triangles]; NULL: `colours` */
  const uint8_t *marked; /* [triangles] 1: drawn in the colour of inverted tets; NULL: none */
  float plain[3];
  int edges;    /* draw the triangles' edges */
  const uint8_t *hidden; /* [triangles] bit k: the edge opposite to corner k is not drawn; NULL: all are drawn */
  int glass;     /* transparent if seen from behind; otherwise darker there */
  int ground;    /* receives shadows, but casts none */
  double fade;   /* distance from the view's target at which it has faded away, m; 0: it does not fade */
} flesh_render_surface;

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

/* A projected corner: pixels from the upper left; w is 1 over the depth (1 for parallel rays). */
typedef struct flesh_render_point {
  double x, y, w;
  double depth; /* increases away from the eye; linear in the picture */
} flesh_render_point;

/* Depth and triangle at every sample; INFINITY and -1 if there is none. */
typedef struct flesh_raster {
  int width, height;
  float *depth;
  int *triangle;
} flesh_raster;

/* Fails with FLESH_ERR_MEMORY, as flesh_raster_open and the functions that draw do when memory runs out. */
int flesh_picture_no_memory(void);
int flesh_raster_open(flesh_raster *raster, int width, int height);
void flesh_raster_clear(flesh_raster *raster);
void flesh_raster_close(flesh_raster *raster);

flesh_render_point flesh_project_point(const flesh_view *view, const double p[3]);

/* Returns twice a triangle's area in the picture, positive if it is seen from behind, as y points down. */
static inline double flesh_projected_area(const flesh_render_point c[3])
{
  return (c[1].x - c[0].x) * (c[2].y - c[0].y) - (c[1].y - c[0].y) * (c[2].x - c[0].x);
}

/* Computes the barycentric weights of (x, y) in the picture of a triangle. Returns 0 if it is seen edge-on. */
int flesh_projected_weights(const flesh_render_point c[3], double x, double y, double b[3]);

/* Draws a triangle with its number. A triangle that is only a line or a point, as in collapsed bodies, is drawn three
 * samples wide. */
void flesh_raster_fill(flesh_raster *raster, const flesh_render_point c[3], int number);

typedef struct flesh_shadow {
  flesh_view view;   /* back points towards the lamp; its rays are parallel */
  flesh_raster map;  /* without samples if nothing casts a shadow into the picture */
} flesh_shadow;

/* Places the lamp over the camera's left shoulder. */
void flesh_shadow_begin(const flesh_view *camera, flesh_shadow *shadow);

/* Draws the surfaces that cast shadows into a new map of at most `size` samples each way that covers the places `seen`, a
 * fit along the lamp's view. FLESH_ERR_MEMORY. */
int flesh_shadow_cast(flesh_shadow *shadow, const flesh_view_fit *seen, int size, int count,
                      const flesh_render_surface *surfaces);

/* Returns the part of the light that reaches p on a flat surface, the cosine of whose normal with the light is
 * `facing`. */
double flesh_shadow_lit(const flesh_shadow *shadow, const double p[3], double facing);

#endif
