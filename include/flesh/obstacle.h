/* obstacle.h: obstacles that a body cannot enter. Functions that return no status cannot fail. */
#ifndef FLESH_OBSTACLE_H
#define FLESH_OBSTACLE_H

#include "flesh/motion.h"
#include "flesh/surface.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct flesh_obstacle flesh_obstacle;

/* Obstacles in their place at rest. Each returns new; FLESH_ERR_ARGUMENT where a number is not
 * finite, a radius not positive, a normal zero. */

/* The half-space below a plane through `point`, whose normal points to where the body is.
 * Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_obstacle_plane(const double point[3], const double normal[3],
                                   flesh_obstacle **obstacle);
FLESH_API int flesh_obstacle_sphere(const double centre[3], double radius,
                                    flesh_obstacle **obstacle);
/* All points nearer than `radius` to the segment from a to b.
 * Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_obstacle_capsule(const double a[3], const double b[3], double radius,
                                     flesh_obstacle **obstacle);
/* A surface of triangles [3*triangles] with corners at `positions` [3*nodes], closed or open, any
 * winding: it is met from both sides. Triangles without area are left out. Copies.
 * Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_obstacle_mesh(int nodes, const double *positions, int triangles,
                                  const int *triangle_nodes, flesh_obstacle **obstacle);

/* The obstacle follows x(t) = centre + R(t)(X - centre) + translation(t). Copies.
 * Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_obstacle_move(flesh_obstacle *obstacle, const flesh_motion *motion);
/* NULL-safe; sets *obstacle to NULL. */
FLESH_API void flesh_obstacle_destroy(flesh_obstacle **obstacle);

/* Triangles of the obstacle's surface at time t, for pictures, outward by the right-hand rule. A plane
 * is drawn as a square of side 2*extent around the foot of `centre` [3]; both are not read otherwise.
 * Returns new. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_obstacle_surface(const flesh_obstacle *obstacle, double t,
                                     const double centre[3], double extent,
                                     flesh_surface **surface);

#ifdef __cplusplus
}
#endif
#endif
