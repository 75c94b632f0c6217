/* surface.h: the members of a surface, and how readers build one. */
#ifndef FLESH_SURFACE_SURFACE_H
#define FLESH_SURFACE_SURFACE_H

#include "flesh/surface.h"
#include "base/scan.h"

enum { FLESH_SURFACE_MAX_CORNERS = 10000 };

struct flesh_surface {
  int vertices, faces, triangle_count;
  double *positions; /* [3*vertices] */
  int *starts;       /* [faces+1] */
  int *corners;      /* [starts[faces]] */
  int *triangles;    /* [3*triangle_count] */
  /* Texture of an OBJ, written with it again: coordinates [2*texture_count], and the index at every corner or -1
   * [starts[faces]]; NULL: none. */
  int texture_count;
  double *texture;
  int *texture_corners;
};

/* A surface while it is read. Zero-initialise it; arrays grow as they are filled, so that a count in a file cannot
 * cause a huge allocation. */
typedef struct flesh_surface_draft {
  int vertices, faces, corners, textures;
  int vertex_room, face_room, corner_room, texture_room;
  double *positions, *texture;
  int *ends; /* [faces] number of corners up to the end of each face */
  int *vertex_of, *texture_of; /* [corners] */
} flesh_surface_draft;

int flesh_surface_draft_vertex(flesh_surface_draft *draft, const double position[3]);
int flesh_surface_draft_texture(flesh_surface_draft *draft, const double uv[2]);
/* Adds a corner to the face that flesh_surface_draft_face ends; texture -1: none. FLESH_ERR_MEMORY. */
int flesh_surface_draft_corner(flesh_surface_draft *draft, int vertex, int texture);
int flesh_surface_draft_face(flesh_surface_draft *draft);
/* Returns the number of corners since the end of the last face. */
int flesh_surface_draft_open_corners(const flesh_surface_draft *draft);
/* Makes the surface of a draft whose indices the reader has checked; the draft is empty afterwards.
 * FLESH_ERR_MEMORY. */
int flesh_surface_draft_finish(flesh_surface_draft *draft, flesh_surface **surface);
void flesh_surface_draft_clear(flesh_surface_draft *draft);

/* Finds for each vertex [count] the first vertex at the same place. FLESH_ERR_MEMORY. */
int flesh_surface_first_vertices(int count, const double *positions, int *first);

/* Read one format each, from the beginning of s. The reader of OBJ changes the text. */
int flesh_surface_read_obj(flesh_scanner *s, char *text, flesh_surface_draft *draft);
int flesh_surface_read_ply(flesh_scanner *s, flesh_surface_draft *draft);
int flesh_surface_read_stl(flesh_scanner *s, flesh_surface_draft *draft);
/* Returns whether the file is an STL, by its name, its beginning, or its length as a binary one. */
int flesh_surface_is_stl(const flesh_scanner *s);

/* Cuts a face of `count` corners into count-2 triangles, given as indices of its corners [3*(count-2)]; `room`
 * [4*count] ints is work space. */
void flesh_surface_cut(int count, const int *corners, const double *positions, int *room,
                       int *triangles);

#endif
