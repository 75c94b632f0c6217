/* obstacle_mesh.h: a surface of triangles as an obstacle, with a tree of boxes around them. */
#ifndef FLESH_GEOMETRY_OBSTACLE_MESH_H
#define FLESH_GEOMETRY_OBSTACLE_MESH_H

#include <stddef.h>

#include "geometry/barrier.h"

typedef struct flesh_obstacle_tree flesh_obstacle_tree;

int flesh_obstacle_tree_create(int nodes, const double *positions, int triangles,
                               const int *triangle_nodes, flesh_obstacle_tree **tree);
void flesh_obstacle_tree_destroy(flesh_obstacle_tree **tree);
/* Bytes it holds. */
size_t flesh_obstacle_tree_memory(const flesh_obstacle_tree *tree);

/* Adds the barriers of what is nearer to y than w. */
void flesh_obstacle_tree_barrier(const flesh_obstacle_tree *tree, const double y[3], double w,
                                 flesh_barrier *barrier);
double flesh_obstacle_tree_max_feasible_step(const flesh_obstacle_tree *tree, const double y0[3],
                               const double y1[3]);
/* How far the box from low to high is from the leaves' boxes, at least; INFINITY: farther than `reach`; NaN where it is. */
double flesh_obstacle_tree_clearance(const flesh_obstacle_tree *tree, const double low[3], const double high[3], double reach);
/* Borrowed; nodes at the same place are one. */
void flesh_obstacle_tree_surface(const flesh_obstacle_tree *tree, int *nodes,
                                 const double **positions, int *triangles, const int **corners);

/* The weights with which a sum over triangles [3*triangles], their edges and vertices counts
 * everything once: new [3*triangles] each, of the edge from corner k to the next and of the vertex
 * at corner k; 0 where another triangle keeps it. */
int flesh_surface_weights(int nodes, int triangles, const int *corners, double **edge_weight,
                          double **vertex_weight);

#endif
