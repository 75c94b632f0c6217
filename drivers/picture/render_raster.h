/* render_raster.h: triangles as a camera or a light sees them, in a depth buffer that keeps which one is seen where. */
#ifndef FLESH_PICTURE_RENDER_RASTER_H
#define FLESH_PICTURE_RENDER_RASTER_H


#include "picture/view.h"

/* A projected corner: pixels from the upper left, 1 over the depth (1 for parallel rays). */
typedef struct flesh_render_point {
  double x, y, w;
  double depth; /* grows away from the eye; linear in the picture */
} flesh_render_point;

/* Depth and triangle of every sample, INFINITY and -1 where there is none. */
typedef struct flesh_raster {
  int width, height;
  float *depth;
  int *triangle;
} flesh_raster;

/* FLESH_ERR_MEMORY. */
int flesh_raster_open(flesh_raster *raster, int width, int height);
void flesh_raster_clear(flesh_raster *raster);
void flesh_raster_close(flesh_raster *raster);

flesh_render_point flesh_project_point(const flesh_view *view, const double p[3]);

/* Twice a triangle's area in the picture, positive when it is seen from behind, as y points down. */
static inline double flesh_projected_area(const flesh_render_point c[3])
{
  return (c[1].x - c[0].x) * (c[2].y - c[0].y) - (c[1].y - c[0].y) * (c[2].x - c[0].x);
}

/* Barycentric weights of (x, y) in the picture of a triangle; 0 when it is seen edge on. */
int flesh_projected_weights(const flesh_render_point c[3], double x, double y, double b[3]);

/* Draws a triangle under a number. What is but a line or a point, as those of collapsed bodies, is drawn three samples
 * wide. */
void flesh_raster_fill(flesh_raster *raster, const flesh_render_point c[3], int number);

#endif
