/* mesh.h: the members of a mesh, and how readers build one with errors that name file and place. */
#ifndef FLESH_MESH_MESH_H
#define FLESH_MESH_MESH_H

#include <limits.h>
#include <stddef.h>

#include "flesh/mesh.h"
#include "mesh/bisect_marks.h"
#include "mesh/sets.h"

struct flesh_mesh {
  int nodes, tets, triangles;
  double *positions;  /* [3*nodes] */
  int *tet_nodes;     /* [4*tets], positive winding */
  int *regions;       /* [tets] */
  double *volumes;    /* [tets] */
  int *ends;          /* [2*nodes] the two earlier nodes between which each lies, or itself twice; NULL: all are given */
  int *edge_nodes;    /* [6*tets] at order 2, in VTK's order, -1 for tets of four nodes; NULL at order 1 */
  int linear;         /* at order 2: number of tets with four nodes */
  double *jacobians;  /* [20*tets] at order 2: Jacobian of the rest shape, in Bernstein form */
  uint8_t *curved;    /* [tets] 1: some edge is not straight */
  int *surface;       /* [3*triangles] */
  int *surface_tets;  /* [triangles] */
  int *pieces;        /* in meshes with both kinds of tets: 8 * tet + place of each piece (pieces.h); else NULL */
  int piece_count;
  uint8_t *node_used; /* [nodes] */
  int flipped, unused_nodes;
  flesh_mesh_sets sets; /* settled (sets.h): members rise, without repeats */
  flesh_tet_marks *marks; /* [tets] if bisection made the mesh; NULL: bisection begins with the longest edges */
  struct flesh_split_part *split; /* for a part of a split mesh (split.h); NULL: this is a whole mesh */
};

/* Returns whether the tet has ten nodes. */
static inline int flesh_mesh_is_quadratic(const flesh_mesh *mesh, int tet)
{
  return mesh->edge_nodes && mesh->edge_nodes[6 * (size_t)tet] >= 0;
}

/* Returns the most tets that a mesh may have; of order 2 such that triangle numbers fit when no two tets share a
 * face. */
static inline int flesh_mesh_most_tets(int order) { return order == 2 ? INT_MAX / 16 : INT_MAX / 4; }

/* Returns the least bytes for each tet while a mesh is refined: numbers of nodes, regions, volumes, the share of
 * positions, at order 2 the nodes on edges and the Jacobian's coefficients. */
static inline double flesh_mesh_bytes_of_tet(int order) { return order == 2 ? 250 : 50; }

/* Returns how many consecutive triangles of mesh->surface make a face of the tet. */
static inline int flesh_mesh_face_parts(const flesh_mesh *mesh, int tet)
{
  return flesh_mesh_is_quadratic(mesh, tet) ? 4 : 1;
}

/* Places of the tets in a file, so that an error can name the line. */
typedef struct flesh_mesh_origin {
  const char *path;
  int binary;               /* 1: `where` counts bytes, not lines */
  const int64_t *tet_where; /* [tets] */
  const int64_t *tet_tag;   /* [tets] number of each tet in the file */
  const int64_t *node_tag;  /* [nodes] number of each node, or NULL: the index plus `node_base` */
  int node_base;
} flesh_mesh_origin;

/* Arrays of a mesh: positions [3*nodes], tet_nodes [4*tets]; optional, else NULL: edge_nodes [6*tets], which make order
 * 2 unless all are -1, regions [tets] and ends [2*nodes]. */
typedef struct flesh_mesh_lists {
  int nodes, tets;
  const double *positions;
  const int *tet_nodes, *edge_nodes, *regions, *ends;
  const flesh_mesh_sets *sets; /* settled (sets.h), copied; NULL: none */
} flesh_mesh_lists;

/* Like flesh_mesh_create, but errors name the place in `origin`'s file (NULL: indices only). */
int flesh_mesh_build(const flesh_mesh_lists *lists, const flesh_mesh_origin *origin, flesh_mesh **mesh);

/* Returns whether the format of a file of that name keeps named sets. */
int flesh_mesh_file_has_sets(const char *path);

/* Finds mesh->surface, with four triangles for each face of a ten-node tet. FLESH_ERR_FILE for a tet given twice or a
 * face of more than two tets. */
int flesh_mesh_find_surface(flesh_mesh *mesh, const flesh_mesh_origin *origin);

/* Checks mesh->edge_nodes: they are in range and no corners, all tets of an edge have the same node (or none) on it,
 * and each node is on one edge. FLESH_ERR_FILE. */
int flesh_mesh_check_edge_nodes(const flesh_mesh *mesh, const flesh_mesh_origin *origin);

/* Reorders the edge nodes of a tet after its last two corners were swapped. */
void flesh_mesh_flip_edge_nodes(int edge_nodes[6]);

/* Fills mesh->jacobians, and mesh->volumes of the curved tets. FLESH_ERR_FILE if the Jacobian is not positive all over
 * a tet. */
int flesh_mesh_find_jacobians(flesh_mesh *mesh, const flesh_mesh_origin *origin);

/* Fails with FLESH_ERR_ARGUMENT if an object made for a mesh of `nodes` and `tets` is used with another mesh. `kind` is
 * the kind of object, such as "the effect", and `name` its name or "". */
int flesh_mesh_check_counts(const flesh_mesh *mesh, const char *kind, const char *name, int nodes, int tets);

/* Marks the node as used, for a node that other ranks' tets have. */
void flesh_mesh_use_node(flesh_mesh *mesh, int node);

/* Fills mesh->curved. */
void flesh_mesh_find_curved(flesh_mesh *mesh);

/* Returns the ends of the nodes of a mesh that has, after the nodes of this one, a node on each of `edges` edges with
 * the ends `on` [2*edges]: new [2*(nodes+edges)], or NULL without memory. */
int *flesh_mesh_add_ends(const flesh_mesh *mesh, int edges, const int *on);

/* Integrates N_a N_b over tet `tet` of ten nodes, m^3, nodes in VTK's order. */
void flesh_tet10_mass(const flesh_mesh *mesh, int tet, double M[10][10]);

/* Fails with the place of tet `tet` before the sentence. */
int flesh_mesh_fail_at(const flesh_mesh_origin *origin, int tet, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Return the number of a tet or node in its file, for sentences. */
long long flesh_mesh_tet_label(const flesh_mesh_origin *origin, int tet);
long long flesh_mesh_node_label(const flesh_mesh_origin *origin, int node);

/* Returns the bound of J in tet `tet` at x that flesh_mesh_jacobian_bounds describes. */
double flesh_mesh_tet_jacobian_bound(const flesh_mesh *mesh, const double *x, int tet);

/* Measures of a mesh at x, as from flesh_mesh_volume, flesh_mesh_jacobians and flesh_mesh_jacobian_bounds. */
typedef struct flesh_mesh_measures {
  double volume;  /* m^3 */
  double J_min;   /* least J at a quadrature point */
  int J_min_tet;  /* its tet */
  int inverted;   /* number of tets in which J is not positive at some point */
  double J_bound; /* least bound of J in a tet; J_min if no bounds are asked for */
} flesh_mesh_measures;

/* Measures all tets in one pass: J_mean goes into `mean` and J_min into `least`, both [tets] or NULL. Bounds cost
 * several times the rest. */
void flesh_mesh_measure(const flesh_mesh *mesh, const double *x, int with_bound, double *mean, double *least,
                        flesh_mesh_measures *measures);

/* Returns the signed volume of the tet with the four nodes `nodes`. It is compiled once for all callers, so that a body
 * at rest has J = 1 to the last bit. */
double flesh_tet_volume(const double *x, const int nodes[4]);

/* Returns the largest distance of a used node at `x` [3*nodes] from the rest shape after the best rigid fit (least
 * squares over the nodes; Kabsch 1976), divided by the longest side of the rest shape's box. */
double flesh_mesh_distance_from_rest(const flesh_mesh *mesh, const double *x);

#endif
