/* render_surface.h: what is rendered. */
#ifndef FLESH_PICTURE_RENDER_SURFACE_H
#define FLESH_PICTURE_RENDER_SURFACE_H

#include <stdint.h>

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
  const uint8_t *hidden; /* [triangles] bit k: but not the one opposite to corner k; NULL: all */
  int glass;     /* transparent where it is seen from behind; else darker there */
  int ground;    /* receives shadows; what it casts is of no account */
  double fade;   /* m from the view's target where it has faded away; 0: nowhere */
} flesh_render_surface;

#endif
