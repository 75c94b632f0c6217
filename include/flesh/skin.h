/* skin.h: a fine surface that follows a body's coarse tets.
 *
 * * Every vertex of the surface is bound to the tet that contains it in the rest shape, or to the nearest one, by four
 * weights w of sum one with X = sum w_i X_i. In a deformed state it is at x = sum w_i x_i, so that the skin follows any
 * affine motion of the body exactly. Outside the tets the same weights extrapolate.
 *
 * * In a tet of ten nodes the weights are barycentric coordinates L, and the vertex is at x = sum N_a(L) x_a with the
 * quadratic shape functions N_a, so that the skin bends with the body's edges, which may be curved at rest, too. Outside
 * the tets the map is continued linearly.
 *
 * Functions that return no status cannot fail. */
#ifndef FLESH_SKIN_H
#define FLESH_SKIN_H

#include "flesh/mesh.h"
#include "flesh/surface.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct flesh_skin flesh_skin;

/* Binds the surface's vertices to the mesh at rest; both are only read. FLESH_ERR_MEMORY; FLESH_ERR_FILE for a vertex
 * so far outside curved tets that none of them can be continued to it. Returns new. Further errors:
 * FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_skin_bind(const flesh_mesh *mesh, const flesh_surface *surface,
                              flesh_skin **skin);
/* NULL-safe; sets *skin to NULL. */
FLESH_API void flesh_skin_destroy(flesh_skin **skin);

/* Statistics of a binding. A vertex farther from every tet than a millionth of the body's diagonal counts as outside. */
typedef struct flesh_skin_info {
  int vertices, outside;
  double distance_max; /* m, largest distance of a vertex from the tets; 0 when all lie inside */
  int farthest;        /* the vertex with distance_max; -1 when all lie inside */
  double weight_min;   /* smallest weight: far below 0 the extrapolation is rough */
} flesh_skin_info;
/* Fills in *info. */
FLESH_API void flesh_skin_inspect(const flesh_skin *skin, flesh_skin_info *info);

/* The arrays below belong to the skin. */
/* [vertices] the tet of each vertex. */
FLESH_API const int *flesh_skin_tets(const flesh_skin *skin);
/* [4*vertices] weights of the tet's corners in their order, or the barycentric coordinates. */
FLESH_API const double *flesh_skin_weights(const flesh_skin *skin);

/* Computes values at the skin's vertices from those at the mesh's nodes: positions or velocities with `components` 3,
 * a scalar field with 1. nodal [components*nodes], skinned [components*vertices]. If `clamp` is not 0 nothing is
 * extrapolated: weights of vertices outside are clamped to [0, 1], so that a field never leaves its range. */
FLESH_API void flesh_skin_apply(const flesh_skin *skin, int components, int clamp,
                                const double *nodal, double *skinned);

/* Writes a binding as text that reads back bitwise the same: `flesh skin 1`, the mesh and surface that it belongs to
 * (`mesh NODES TETS HASH`, `surface VERTICES FACES HASH`: FNV-1a of the numbers, 64 bits), then a row `tet w0 w1 w2
 * w3 distance` per vertex. A partial file is never left. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY,
 * FLESH_ERR_FILE. */
FLESH_API int flesh_skin_write(const flesh_skin *skin, const char *path);
/* Reads a binding for this mesh and surface. FLESH_ERR_FILE, with file and line, for anything else:
 * another mesh or surface, a tet out of range, weights that are not finite or do not sum to one.
 * Returns new. Further errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_skin_read(const char *path, const flesh_mesh *mesh,
                              const flesh_surface *surface, flesh_skin **skin);

#ifdef __cplusplus
}
#endif
#endif
