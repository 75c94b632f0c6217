/* obstacle_shape.h: the contents of an obstacle. */
#ifndef FLESH_GEOMETRY_OBSTACLE_SHAPE_H
#define FLESH_GEOMETRY_OBSTACLE_SHAPE_H

#include "flesh/obstacle.h"
#include "geometry/obstacle_mesh.h"

typedef enum flesh_obstacle_shape {
  FLESH_OBSTACLE_PLANE,
  FLESH_OBSTACLE_SPHERE,
  FLESH_OBSTACLE_CAPSULE,
  FLESH_OBSTACLE_MESH
} flesh_obstacle_shape;

struct flesh_obstacle {
  flesh_obstacle_shape shape;
  double a[3];   /* plane: a point; sphere: centre; capsule: first end */
  double b[3];   /* plane: unit normal; capsule: second end */
  double radius; /* 0 for a plane */
  flesh_obstacle_tree *tree; /* only for a mesh */
  flesh_motion motion;       /* count 0: no motion */
};

#endif
