/* obstacle_mesh.h: a surface of triangles as an obstacle, with a tree of boxes around them. */
#ifndef FLESH_GEOMETRY_OBSTACLE_MESH_H
#define FLESH_GEOMETRY_OBSTACLE_MESH_H

#include <stddef.h>

#include "geometry/barrier.h"

typedef struct flesh_obstacle_tree flesh_obstacle_tree;

int flesh_obstacle_tree_create(int nodes, const double *positions, int triangles,
                               const int *triangle_nodes, flesh_obstacle_tree **tree);
void flesh_obstacle_tree_destroy(flesh_obstacle_tree **tree);
/* Returns the bytes of memory that the tree uses. */
size_t flesh_obstacle_tree_memory(const flesh_obstacle_tree *tree);

/* Adds the barriers of all features nearer to y than w. */
void flesh_obstacle_tree_barrier(const flesh_obstacle_tree *tree, const double y[3], double w,
                                 flesh_barrier *barrier);
double flesh_obstacle_tree_max_feasible_step(const flesh_obstacle_tree *tree, const double y0[3],
                               const double y1[3]);
/* Returns a lower bound of the distance from the box [low, high] to the triangles: the distance to the leaves' boxes.
 * INFINITY: more than `reach`; NaN if the box has NaN. */
double flesh_obstacle_tree_clearance(const flesh_obstacle_tree *tree, const double low[3], const double high[3], double reach);
/* Gives the triangles (borrowed); nodes at the same position are merged. */
void flesh_obstacle_tree_surface(const flesh_obstacle_tree *tree, int *nodes,
                                 const double **positions, int *triangles, const int **corners);

/* Computes the weights with which a sum over triangles [3*triangles], edges and vertices counts everything once: new
 * arrays [3*triangles] for the edge from corner k to the next and for the vertex at corner k; 0 if another triangle
 * carries the weight. FLESH_ERR_MEMORY. */
int flesh_surface_weights(int nodes, int triangles, const int *corners, double **edge_weight,
                          double **vertex_weight);

#endif
