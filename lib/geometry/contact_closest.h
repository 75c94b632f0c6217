/* contact_closest.h: the points of two features of surfaces that are nearest to each other, and how they move.
 *
 * Features are segments and triangles, not their lines and planes; those without length or area count as their ends or
 * edges. An edge is looked at from its lower node, so that all its triangles agree on it to the last bit. */
#ifndef FLESH_GEOMETRY_CONTACT_CLOSEST_H
#define FLESH_GEOMETRY_CONTACT_CLOSEST_H

typedef enum flesh_contact_kind {
  FLESH_CONTACT_POINT_POINT,
  FLESH_CONTACT_POINT_EDGE,
  FLESH_CONTACT_POINT_TRIANGLE,
  FLESH_CONTACT_EDGE_EDGE
} flesh_contact_kind;

/* 2, 3, 4, 4. */
int flesh_contact_kind_nodes(flesh_contact_kind kind);

/* With D, from the nearest point of the second feature to that of the first. */
typedef struct flesh_contact_closest {
  double distance;     /* |D|, m */
  double normal[3];    /* D/|D|; 0 where two points coincide */
  int count, dimension; /* nodes that bear the nearest points: 2 to 4; tangents: count-2 */
  int corner[4];       /* [count] their places among the nodes of the two features */
  double share[4];     /* [count] D is the sum of share * place; the shares sum to 0 */
  double tangent[2][3]; /* [count-2] unit vectors that span the bearing edges or triangle, orthogonal */
  double turn[2][4];   /* [count-2][count] 1/m, by which shares change where the nearest points move along a tangent:
                        * tangent i is the sum of turn[i] * place; sums to 0 */
} flesh_contact_closest;

/* Finds the nearest points of the features of the nodes [2 to 4] at x [3*n]: a point and the other feature, or two
 * edges. Finite where x is. `within`: the point's foot is known to be within the edge or triangle, but for rounding, so
 * that their line or plane will do. */
void flesh_contact_find_closest(flesh_contact_kind kind, int within, const int *nodes, const double *x,
                                flesh_contact_closest *closest);

/* Nearest to p [3] of an edge and of a triangle: their nodes' weights, which are exactly 0 for those that do not bear
 * the nearest point. Return the distance squared. */
double flesh_contact_nearest_of_edge(const double *p, const int nodes[2], const double *x, double weights[2]);
double flesh_contact_nearest_of_triangle(const double *p, const int nodes[3], const double *x, double weights[3]);

#endif
