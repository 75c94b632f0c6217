/* surface.h: the inside of a surface, and how readers build one. */
#ifndef FLESH_SURFACE_SURFACE_H
#define FLESH_SURFACE_SURFACE_H

#include <stddef.h>

#include "flesh/surface.h"
#include "base/scan.h"

enum { FLESH_SURFACE_MAX_CORNERS = 10000 };

struct flesh_surface {
  int vertices, faces, triangle_count;
  double *positions; /* [3*vertices] */
  int *starts;       /* [faces+1] */
  int *corners;      /* [starts[faces]] */
  int *triangles;    /* [3*triangle_count] */
  /* The texture of an OBJ, to be written with it again: [2*texture_count], and the index of every corner or -1
   * [starts[faces]]; NULL without. */
  int texture_count;
  double *texture;
  int *texture_corners;
};

/* A surface while it is being read. Zero-initialise; arrays grow as they are filled, so that a file's statements are
 * never trusted with memory. */
typedef struct flesh_surface_draft {
  int vertices, faces, corners, textures;
  int vertex_room, face_room, corner_room, texture_room;
  double *positions, *texture;
  int *ends; /* [faces] corners up to and with this face's */
  int *vertex_of, *texture_of; /* [corners] */
} flesh_surface_draft;

int flesh_surface_draft_vertex(flesh_surface_draft *draft, const double position[3]);
int flesh_surface_draft_texture(flesh_surface_draft *draft, const double uv[2]);
/* A corner of the face that flesh_surface_draft_face ends; texture -1: none. */
int flesh_surface_draft_corner(flesh_surface_draft *draft, int vertex, int texture);
int flesh_surface_draft_face(flesh_surface_draft *draft);
/* Corners since the last face's end. */
int flesh_surface_draft_open_corners(const flesh_surface_draft *draft);
/* Makes the surface of it, whose indices the reader has checked; the draft is empty afterwards. */
int flesh_surface_draft_finish(flesh_surface_draft *draft, flesh_surface **surface);
void flesh_surface_draft_clear(flesh_surface_draft *draft);

/* The first of the vertices at the place of each [count]. FLESH_ERR_MEMORY. */
int flesh_surface_first_vertices(int count, const double *positions, int *first);

/* Readers of one format each; s stands at the beginning. OBJ's reader changes the text. */
int flesh_surface_read_obj(flesh_scanner *s, char *text, flesh_surface_draft *draft);
int flesh_surface_read_ply(flesh_scanner *s, flesh_surface_draft *draft);
int flesh_surface_read_stl(flesh_scanner *s, flesh_surface_draft *draft);
/* Whether the file is named or begins as an STL, or has a binary one's length. */
int flesh_surface_is_stl(const flesh_scanner *s);

/* Cuts a face of `count` corners into count-2 triangles of places in it [3*(count-2)]; `room`
 * [4*count] ints. */
void flesh_surface_cut(int count, const int *corners, const double *positions, int *room,
                       int *triangles);

#endif
