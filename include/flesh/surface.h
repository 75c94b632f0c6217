/* surface.h: surfaces of polygons, read from files, for a body's skin or an obstacle.
 *
 * A surface is const once made and can be used by any number of systems and threads. Vertices and faces are numbered
 * from 0 in the file's order. Functions that return no status cannot fail. */
#ifndef FLESH_SURFACE_H
#define FLESH_SURFACE_H

#include "flesh/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct flesh_surface flesh_surface;

/* Makes a surface from copies of `positions` [3*vertices] (m), `starts` [faces+1] and `corners`
 * [starts[faces]]: face f has the vertices corners[starts[f]] up to corners[starts[f+1]-1].
 * FLESH_ERR_FILE, with the index, for fewer than one vertex or face, a starts[0] that is not 0, a
 * face of fewer than 3 or more than 10000 corners, a vertex out of range, a coordinate that is not
 * finite. Returns new. Further errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_surface_create(int vertices, const double *positions, int faces,
                                   const int *starts, const int *corners, flesh_surface **surface);

/* Reads Wavefront .obj, Stanford .ply (1.0: ASCII, or binary in either byte order) or .stl (text or binary),
 * recognised by content. OBJ: v, f with polygons, v/vt/vn forms and indices that count back (negative); texture
 * coordinates are kept for flesh_surface_write; normals, groups, materials, lines and free-form curves are ignored.
 * PLY: x, y, z of `vertex` and the list `vertex_indices` or `vertex_index` of `face`; everything else is ignored.
 * STL: triangles, whose corners at exactly the same place become one vertex; normals and attributes are ignored.
 * FLESH_ERR_FILE with file and line (byte in binary parts) otherwise. Independent of the locale. Returns new. Further
 * errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_surface_read(const char *path, flesh_surface **surface);

/* Writes .obj or .ply (binary, little endian) by the suffix, with the vertices at `x` [3*vertices] (NULL: at the
 * surface's own positions). A partial file is never left. Numbers have 9 digits in OBJ and are floats in PLY.
 * FLESH_ERR_ARGUMENT for another suffix, FLESH_ERR_FILE when writing fails. Further errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_surface_write(const flesh_surface *surface, const double *x, const char *path);

/* Makes the surface of a mesh: its boundary triangles and the nodes that they use, in the mesh's order. Returns new.
 * Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_surface_of_mesh(const flesh_mesh *mesh, flesh_surface **surface);

/* NULL-safe; sets *surface to NULL. */
FLESH_API void flesh_surface_destroy(flesh_surface **surface);

/* Return the number of vertices, and of faces. Cannot fail. */
FLESH_API int flesh_surface_vertex_count(const flesh_surface *surface);
FLESH_API int flesh_surface_face_count(const flesh_surface *surface);
/* The arrays below belong to the surface. */
/* [3*vertices], m. */
FLESH_API const double *flesh_surface_positions(const flesh_surface *surface);
/* [faces+1] and [starts[faces]], as in flesh_surface_create. */
FLESH_API const int *flesh_surface_starts(const flesh_surface *surface);
FLESH_API const int *flesh_surface_corners(const flesh_surface *surface);
/* Returns the faces divided into triangles with the winding of the faces: [3*count] vertices. Ears are cut off, so
 * that triangles of concave polygons do not overlap. A triangle that names a vertex twice is left out. */
FLESH_API const int *flesh_surface_triangles(const flesh_surface *surface, int *count);

#ifdef __cplusplus
}
#endif
#endif
