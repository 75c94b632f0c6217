/* contact_closest.h: nearest points of two features of surfaces, and how they move.
 *
 * Features are segments and triangles, not their lines and planes; those without length or area count as their ends or
 * edges. Edges are computed from their lower node, so that all triangles of an edge agree to the last bit. */
#ifndef FLESH_GEOMETRY_CONTACT_CLOSEST_H
#define FLESH_GEOMETRY_CONTACT_CLOSEST_H

typedef enum flesh_contact_kind {
  FLESH_CONTACT_POINT_POINT,
  FLESH_CONTACT_POINT_EDGE,
  FLESH_CONTACT_POINT_TRIANGLE,
  FLESH_CONTACT_EDGE_EDGE
} flesh_contact_kind;

/* Returns the number of nodes of a pair of this kind: 2, 3, 4 or 4. */
int flesh_contact_kind_nodes(flesh_contact_kind kind);

/* Nearest points of two features. D is the vector from the nearest point of the second feature to that of the first. */
typedef struct flesh_contact_closest {
  double distance;     /* |D|, m */
  double normal[3];    /* D/|D|; 0 if the points coincide */
  int count, dimension; /* number of bearing nodes, those with a weight in the nearest points: 2 to 4; number of
                         * tangents: count-2 */
  int corner[4];       /* [count] indices of the bearing nodes among the nodes of the pair */
  double share[4];     /* [count] D is the sum of share * position over the bearing nodes; the shares sum to 0 */
  double tangent[2][3]; /* [count-2] orthonormal vectors that span the bearing edges or triangle */
  double turn[2][4];   /* [count-2][count] 1/m, derivatives of the shares as the nearest points move along a tangent:
                        * tangent i is the sum of turn[i] * position; each row sums to 0 */
} flesh_contact_closest;

/* Finds the nearest points of a pair's features, a point and another feature or two edges, for the nodes [2 to 4] at x
 * [3*n]. The result is finite if x is. `within`: the point's foot is known to lie within the edge or triangle up to
 * rounding, so it is computed on the line or in the plane. */
void flesh_contact_find_closest(flesh_contact_kind kind, int within, const int *nodes, const double *x,
                                flesh_contact_closest *closest);

/* Find the point of an edge or of a triangle nearest to p [3]. The nodes' weights are exactly 0 for nodes that do not
 * bear it. Return the squared distance. */
double flesh_contact_nearest_of_edge(const double *p, const int nodes[2], const double *x, double weights[2]);
double flesh_contact_nearest_of_triangle(const double *p, const int nodes[3], const double *x, double weights[3]);

#endif
