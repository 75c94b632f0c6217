/* obstacle.h: obstacles that a body cannot enter. Functions that return no status cannot fail. */
#ifndef FLESH_OBSTACLE_H
#define FLESH_OBSTACLE_H

#include "flesh/motion.h"
#include "flesh/surface.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct flesh_obstacle flesh_obstacle;

/* Constructors of obstacles in their rest position; lengths in m. Each returns new. FLESH_ERR_ARGUMENT if a number is
 * not finite, a radius not positive, or a normal zero. Further errors: FLESH_ERR_MEMORY. */

/* Creates the half-space below a plane through `point`; `normal` points towards the body. Errors: FLESH_ERR_ARGUMENT,
 * FLESH_ERR_MEMORY. */
FLESH_API int flesh_obstacle_plane(const double point[3], const double normal[3],
                                   flesh_obstacle **obstacle);
FLESH_API int flesh_obstacle_sphere(const double centre[3], double radius,
                                    flesh_obstacle **obstacle);
/* Creates the set of all points closer than `radius` to the segment from a to b. Errors: FLESH_ERR_ARGUMENT,
 * FLESH_ERR_MEMORY. */
FLESH_API int flesh_obstacle_capsule(const double a[3], const double b[3], double radius,
                                     flesh_obstacle **obstacle);
/* Creates a surface of triangles [3*triangles] with corners at `positions` [3*nodes], closed or open, with any
 * winding: both sides are obstacles. Triangles without area are ignored. Copies. Errors: FLESH_ERR_ARGUMENT,
 * FLESH_ERR_MEMORY. */
FLESH_API int flesh_obstacle_mesh(int nodes, const double *positions, int triangles,
                                  const int *triangle_nodes, flesh_obstacle **obstacle);

/* Makes the obstacle follow x(t) = centre + R(t)(X - centre) + translation(t). Copies. Errors: FLESH_ERR_ARGUMENT,
 * FLESH_ERR_MEMORY. */
FLESH_API int flesh_obstacle_move(flesh_obstacle *obstacle, const flesh_motion *motion);
/* NULL-safe; sets *obstacle to NULL. */
FLESH_API void flesh_obstacle_destroy(flesh_obstacle **obstacle);

/* Computes triangles of the obstacle's surface at time t, for pictures, outward by the right-hand rule. A plane is
 * drawn as a square of side 2*extent around the projection of `centre` [3] onto it; otherwise both are not read.
 * Returns new. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_obstacle_surface(const flesh_obstacle *obstacle, double t,
                                     const double centre[3], double extent,
                                     flesh_surface **surface);

#ifdef __cplusplus
}
#endif
#endif
