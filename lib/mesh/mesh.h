/* mesh.h: the inside of a mesh, and how readers build one with errors that name file and place. */
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
  int *ends;          /* [2*nodes] the two earlier nodes between which each was put, a given node itself twice; NULL: all are given */
  int *edge_nodes;    /* [6*tets] at order 2, in VTK's order, -1 of tets of four nodes; NULL at order 1 */
  int linear;         /* at order 2: how many tets have four nodes */
  double *jacobians;  /* [20*tets] at order 2: of the rest shape, in Bernstein form */
  uint8_t *curved;    /* [tets] */
  int *surface;       /* [3*triangles] */
  int *surface_tets;  /* [triangles] */
  int *pieces;        /* of meshes of both kinds of tets: 8 * tet + place of each piece (pieces.h); else NULL */
  int piece_count;
  uint8_t *node_used; /* [nodes] */
  int flipped, unused_nodes;
  flesh_mesh_sets sets; /* settled */
  flesh_tet_marks *marks; /* [tets] of a mesh that bisection made; NULL: the next begins with the longest edges */
  struct flesh_split_part *split; /* of a part of a split mesh (split.h); NULL: this is the whole */
};

/* Whether the tet has ten nodes. */
static inline int flesh_mesh_is_quadratic(const flesh_mesh *mesh, int tet)
{
  return mesh->edge_nodes && mesh->edge_nodes[6 * (size_t)tet] >= 0;
}

/* The most tets of a mesh: of ten nodes for the numbers of the triangles of four loose faces each. */
static inline int flesh_mesh_most_tets(int order) { return order == 2 ? INT_MAX / 16 : INT_MAX / 4; }

/* The least memory that a mesh takes for each tet while it is refined: numbers of nodes, regions, volumes, the share of
 * positions, at order 2 the nodes on edges and the Jacobian's coefficients. */
static inline double flesh_mesh_bytes_of_tet(int order) { return order == 2 ? 250 : 50; }

/* How many triangles in a row mesh->surface has of a face of the tet. */
static inline int flesh_mesh_face_parts(const flesh_mesh *mesh, int tet)
{
  return flesh_mesh_is_quadratic(mesh, tet) ? 4 : 1;
}

/* Places in a file at which its tets stand, so that an error can name the line. */
typedef struct flesh_mesh_origin {
  const char *path;
  int binary;               /* `where` counts bytes rather than lines */
  const int64_t *tet_where; /* [tets] */
  const int64_t *tet_tag;   /* [tets] the tet's number in the file */
  const int64_t *node_tag;  /* [nodes], or NULL: the index plus `node_base` */
  int node_base;
} flesh_mesh_origin;

/* The arrays that make a mesh: positions [3*nodes], tet_nodes [4*tets]; NULL where there are none: edge_nodes [6*tets],
 * of order 2 where not all of them are -1, regions [tets] and ends [2*nodes]. */
typedef struct flesh_mesh_lists {
  int nodes, tets;
  const double *positions;
  const int *tet_nodes, *edge_nodes, *regions, *ends;
  const flesh_mesh_sets *sets; /* settled, copied; NULL: none */
} flesh_mesh_lists;

/* flesh_mesh_create whose errors name the place in `origin`'s file (NULL: indices only). */
int flesh_mesh_build(const flesh_mesh_lists *lists, const flesh_mesh_origin *origin, flesh_mesh **mesh);

/* Whether flesh_mesh_write keeps named sets in a file of that name. */
int flesh_mesh_file_has_sets(const char *path);

/* Finds mesh->surface, of ten-node tets the faces' four triangles each. FLESH_ERR_FILE for a tet given twice or a face
 * of more than two tets. */
int flesh_mesh_find_surface(flesh_mesh *mesh, const flesh_mesh_origin *origin);

/* Checks mesh->edge_nodes: nodes in range, one node (or none) for each edge in all its tets and one edge for
 * each such node, no corner among them. FLESH_ERR_FILE. */
int flesh_mesh_check_edge_nodes(const flesh_mesh *mesh, const flesh_mesh_origin *origin);

/* Reorders a tet's edge nodes after a swap of its last two corners. */
void flesh_mesh_flip_edge_nodes(int edge_nodes[6]);

/* Fills mesh->jacobians, and mesh->volumes with the volumes of the curved tets. FLESH_ERR_FILE where
 * the Jacobian is not positive all over a tet. */
int flesh_mesh_find_jacobians(flesh_mesh *mesh, const flesh_mesh_origin *origin);

/* FLESH_ERR_ARGUMENT where what is named, whose arrays have the lengths of a mesh with these counts, meets another mesh:
 * `kind` is its kind, "the effect", and `name` its name or "". */
int flesh_mesh_check_counts(const flesh_mesh *mesh, const char *kind, const char *name, int nodes, int tets);

/* A node that other ranks' tets have counts as used. */
void flesh_mesh_use_node(flesh_mesh *mesh, int node);

/* Fills mesh->curved. */
void flesh_mesh_find_curved(flesh_mesh *mesh);

/* The ends of the nodes of a mesh that has, after those of this one, a node on each of `edges` edges with the ends
 * `on` [2*edges]. Returns new [2*(nodes+edges)], or NULL without memory. */
int *flesh_mesh_add_ends(const flesh_mesh *mesh, int edges, const int *on);

/* The integrals of N_a N_b over tet `tet` of ten nodes, m^3, nodes in VTK's order. */
void flesh_tet10_mass(const flesh_mesh *mesh, int tet, double M[10][10]);

/* Fails about tet `tet`: puts its place before the sentence. */
int flesh_mesh_fail_at(const flesh_mesh_origin *origin, int tet, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* The numbers of a tet and of a node in their file, for sentences. */
long long flesh_mesh_tet_label(const flesh_mesh_origin *origin, int tet);
long long flesh_mesh_node_label(const flesh_mesh_origin *origin, int node);

/* A bound of J in tet `tet` at x as flesh_mesh_jacobian_bounds has it. */
double flesh_mesh_tet_jacobian_bound(const flesh_mesh *mesh, const double *x, int tet);

/* Figures of a mesh at x: those of flesh_mesh_volume, flesh_mesh_jacobians and flesh_mesh_jacobian_bounds. */
typedef struct flesh_mesh_measures {
  double volume;  /* m^3 */
  double J_min;   /* least J at a point of quadrature */
  int J_min_tet;  /* its tet */
  int inverted;   /* tets that have a point without J > 0 */
  double J_bound; /* least bound of J in a tet; J_min where no bounds are asked for */
} flesh_mesh_measures;

/* Measures all tets in one pass: J_mean into `mean` and J_min into `least`, both [tets] (may be NULL). Bounds cost
 * several times the rest. */
void flesh_mesh_measure(const flesh_mesh *mesh, const double *x, int with_bound, double *mean, double *least,
                        flesh_mesh_measures *measures);

/* Signed volume of the tet with the four node indices `nodes`. One compiled body for all callers,
 * so that a body at rest has J = 1 to the last bit. */
double flesh_tet_volume(const double *x, const int nodes[4]);

/* Largest distance of a used node at `x` [3*nodes] from its place in the rest shape after the best
 * rigid fit (least squares over the nodes; Kabsch 1976), over the rest shape's longest side. */
double flesh_mesh_distance_from_rest(const flesh_mesh *mesh, const double *x);

#endif
