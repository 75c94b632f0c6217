/* obstacle_mesh.h: a surface of triangles as an obstacle, with a tree of boxes around them. */
#ifndef FLESH_EFFECT_OBSTACLE_MESH_H
#define FLESH_EFFECT_OBSTACLE_MESH_H

#include "effect/obstacle.h"

typedef struct flesh_obstacle_tree flesh_obstacle_tree;

int flesh_obstacle_tree_create(int nodes, const double *positions, int triangles,
                               const int *triangle_nodes, flesh_obstacle_tree **tree);
void flesh_obstacle_tree_destroy(flesh_obstacle_tree **tree);
/* Bytes it holds. */
size_t flesh_obstacle_tree_memory(const flesh_obstacle_tree *tree);

/* Adds the barriers of what is nearer to y than w. */
void flesh_obstacle_tree_barrier(const flesh_obstacle_tree *tree, const double y[3], double w,
                                 flesh_barrier *barrier);
double flesh_obstacle_tree_way(const flesh_obstacle_tree *tree, const double y0[3],
                               const double y1[3]);
/* Borrowed; nodes at the same place are one. */
void flesh_obstacle_tree_surface(const flesh_obstacle_tree *tree, int *nodes,
                                 const double **positions, int *triangles, const int **corners);

/* The weights with which a sum over triangles [3*triangles], their edges and vertices counts
 * everything once: new [3*triangles] each, of the edge from corner k to the next and of the vertex
 * at corner k; 0 where another triangle keeps it. */
int flesh_surface_weights(int nodes, int triangles, const int *corners, double **edge_weight,
                          double **vertex_weight);

/* B(s) = (1-s)^3/s for 0 < s < 1, and its derivatives. */
static inline void flesh_barrier_law(double s, double *value, double *first, double *second)
{
  const double rest = 1 - s, part = rest / s;
  *value = rest * rest * part;
  *first = -part * rest * (3 + part);
  *second = part * (6 + 6 * part + 2 * part * part);
}

/* Adds `weight` times the barrier at distance `to_core` - `radius`; `direction` leads from the core
 * to the point. `flat` is the core's dimension there: 0 a point, 1 a line along the unit vector
 * `axis`, 2 a plane. */
void flesh_barrier_add(flesh_barrier *barrier, double w, double weight, double to_core,
                       double radius, const double direction[3], int flat, const double axis[3]);

#endif
