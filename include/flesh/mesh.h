/* mesh.h: tetrahedral meshes: reading, writing, making, inspecting.
 *
 * A mesh is const once made and can serve any number of systems and threads. Nodes and tets are numbered from 0 in the
 * file's order; every tet is stored with positive volume.
 *
 * The tets of a mesh of order 1 have four nodes, those of order 2 ten: corners and one node on each edge, through which
 * the edge bends. Edges are in VTK's order: 01, 12, 02, 03, 13, 23. The corners alone are the tets with straight edges.
 * In a mesh of order 2 some tets may have four nodes, if they share no edge with a tet of ten: bodies of different
 * elements side by side.
 *
 * Functions that return no status cannot fail. */
#ifndef FLESH_MESH_H
#define FLESH_MESH_H

#include <stdint.h>

#include "flesh/status.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct flesh_mesh flesh_mesh;

/* Information about a mesh: findings from its making, and measures of its shape. Lengths m, volumes m^3. */
typedef struct flesh_mesh_info {
  int nodes, tets, triangles; /* triangles: those of the surface */
  int flipped;                /* tets whose winding was inverted and has been flipped */
  int unused_nodes;           /* nodes that no tet uses */
  int regions;                /* distinct region tags */
  double volume;
  double low[3], high[3]; /* bounding box of the nodes that tets use */
  double edge_min, edge_mean, edge_max; /* lengths of edges between corners */
  double radius_ratio_min; /* 3 * inradius / circumradius of the corners, 1 for a regular tet */
  double radius_ratio_mean;
  int worst_tet; /* index of the tet with radius_ratio_min */
  int order;     /* 1, or 2 where tets have ten nodes */
  int quadratic; /* number of ten-node tets */
  int curved;    /* tets with a curved edge */
  /* Smallest scaled Jacobian: the smallest over the largest Jacobian of the map from the straight reference tet, 1 if
   * all edges are straight; and the first tet that has it. */
  double scaled_jacobian_min;
  int most_bent_tet;
} flesh_mesh_info;

/* Makes a mesh from copies of `positions` [3*nodes] (m), `tet_nodes` [4*tets], `regions` [tets] or NULL (all 0).
 * Inverted tets are flipped (their last two nodes swapped) and counted. FLESH_ERR_ARGUMENT, with the index, for a
 * flat tet (6 |V| <= 1e-14 (longest edge)^3, where rounding hides the sign of V), a node out of range or repeated in
 * a tet, a tet given twice, a face of more than two tets, a non-finite coordinate, or an empty mesh. Positions are
 * compared without tolerance. Returns new. Further errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_mesh_create(int nodes, const double *positions, int tets, const int *tet_nodes,
                                const int *regions, flesh_mesh **mesh);

/* Like flesh_mesh_create, for a mesh of order 2: `tet_nodes` [10*tets] are four corners and six nodes on edges for
 * each tet. If the last two corners are swapped, the edges' nodes are swapped with them. A tet with six times -1 on
 * its edges has four nodes; if all have, the mesh has order 1. FLESH_ERR_ARGUMENT also if tets that share an edge
 * disagree about its node, if two edges have the same node, if a corner is on an edge, and if the Jacobian of a tet's
 * map is not positive everywhere (decided by Bernstein bounds; Johnen, Remacle & Geuzaine 2013). Returns new. Further
 * errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_mesh_create_quadratic(int nodes, const double *positions, int tets,
                                          const int *tet_nodes, const int *regions,
                                          flesh_mesh **mesh);

/* Makes the mesh of order 2 that has a node in the middle of each edge of `mesh`, which must have order 1 (else
 * FLESH_ERR_ARGUMENT). Nodes and tets keep their numbers; the nodes on edges follow, ordered by the edge's lower
 * node, then by its higher. Returns new. Further errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_mesh_raise_order(const flesh_mesh *mesh, flesh_mesh **raised);

/* Makes the mesh of order 1 that has the corners of `mesh`, which must have order 2 (else FLESH_ERR_ARGUMENT). The
 * nodes that are not on edges keep their order, and so do the tets. Returns new. Further errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_mesh_lower_order(const flesh_mesh *mesh, flesh_mesh **lowered);

/* Makes a mesh by cutting each tet of `mesh`, all of four nodes or all of ten, into eight: four at the corners and
 * four from the octahedron between them, around the diagonal that gives the least stretched tets (red refinement; Bey
 * 1995). The nodes keep their numbers; the new ones follow, ordered by their edge's lower node, then by its higher.
 * Tet t becomes tets 8t to 8t + 7, which have its region. At order 2 the nodes on edges become corners, and the
 * curved shape does not change. Returns new. FLESH_ERR_ARGUMENT if some tets have four nodes and some ten, or if
 * there would be too many nodes or tets. Further errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_mesh_refine(const flesh_mesh *mesh, flesh_mesh **refined);

/* Places of a refined mesh's tets and nodes in the mesh from which it was made. */
typedef struct flesh_mesh_parents {
  int nodes, tets; /* counts of the refined mesh */
  int *tet;        /* [tets] the coarser mesh's tet of which each is a part, ascending */
  int *node_tet;   /* [nodes] a tet of the coarser mesh that contains the node; -1: none does */
  double *place;   /* [4*nodes] the node's barycentric coordinates in that tet */
} flesh_mesh_parents;

/* Makes a nested, conforming refinement of `mesh`: tet t is bisected at least halvings[t] times in a row, and other
 * tets are bisected where faces would not fit. The edges to cut are chosen, the longest first, by the rule of Arnold,
 * Mukherjee & Pouly (SIAM J. Sci. Comput. 22, 2000): however often a mesh is refined in this way, the parts of a tet
 * have a fixed number of shapes. The mesh remembers the edges that come next; a mesh that is read from a file begins
 * anew. The nodes keep their numbers. Parts of a tet have its region and are in its sets; a new node is in a set of
 * nodes if all nodes of the edge, face or tet of `mesh` in which it lies are. At order 2 the curved shape does not
 * change. `parents` may be NULL; clear it with flesh_mesh_parents_clear. Returns new. FLESH_ERR_ARGUMENT if there
 * would be too many tets or nodes; FLESH_ERR_FILE if an edge bends so much that a half is inverted. Further errors:
 * FLESH_ERR_MEMORY. */
FLESH_API int flesh_mesh_refine_marked(const flesh_mesh *mesh, const uint8_t *halvings, flesh_mesh **refined,
                                       flesh_mesh_parents *parents);

/* Transfers a field with `components` numbers per node, `field` [components*nodes of mesh], to the refined mesh:
 * `finer` [components*parents->nodes], by the shape functions of `mesh`, so that it remains the same function.
 * FLESH_ERR_ARGUMENT for parents in another mesh, and components below 1. */
FLESH_API int flesh_mesh_transfer(const flesh_mesh *mesh, const flesh_mesh_parents *parents, int components,
                                  const double *field, double *finer);
/* NULL-safe; leaves zeros. */
FLESH_API void flesh_mesh_parents_clear(flesh_mesh_parents *parents);

/* Makes a regular grid of cells[0] x cells[1] x cells[2] boxes, 6 Kuhn tets each, filling `size` from `origin`. Node
 * (i,j,k) has the number (k*(ny+1)+j)*(nx+1)+i, and cell (i,j,k) has the six tets from 6*((k*ny+j)*nx+i), around its
 * diagonal from the low to the high corner. FLESH_ERR_ARGUMENT for cells below 1, sizes that are not positive, or a
 * grid that is too large. Returns new. Further errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_mesh_box(const int cells[3], const double size[3], const double origin[3],
                             flesh_mesh **mesh);

/* Reads a mesh. These formats are recognised by the file's name: Abaqus's and CalculiX's .inp, VTK's .vtu (one piece;
 * ASCII, base 64 or raw, also deflated by zlib), VegaFEM's .veg (text). Others are recognised by their content: TetGen
 * .node or .ele (its partner is found beside it), Gmsh .msh 2.2 and 4.1 (ASCII, or binary in either byte order), Medit
 * .mesh (ASCII), a plain list (`nodes N`, rows `x y z`, `tets T`, rows `a b c d` from 0, or `tets10 T`, rows of ten),
 * and the index of a split mesh (`flesh mesh split`), whose parts are joined. Tets have 4 nodes, or all 10: C3D10,
 * VTK_QUADRATIC_TETRA, Gmsh's type 11, TetGen's -o2, Medit's TetrahedraP2. Points, lines and faces are ignored; other
 * solids, and tets of order 3 and above, are refused. The regions are: in .inp the number of the *SOLID SECTION, from
 * 1, or else of the ELSET that the *ELEMENT names; in .vtu the cell array `region`, `regions`, `MaterialIds`,
 * `gmsh:physical` or `medit:ref`, or else the only cell array of integers with one component; the number of VegaFEM's
 * *REGION; TetGen's first attribute; Gmsh's physical tag or else the tag of the volume; Medit's reference; else 0. The
 * mesh keeps named sets, by which scenes select (flesh_mesh_set_at): *NSET, *ELSET and *SURFACE (the nodes of its
 * faces), *SET, Gmsh's physical groups that have names. FLESH_ERR_FILE with file and line (byte in binary parts)
 * otherwise. Independent of the locale. Returns new. Further errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_mesh_read(const char *path, flesh_mesh **mesh);

/* Writes a mesh in the format of the suffix: .node or .ele (TetGen, both files), .msh (Gmsh 4.1 binary) or .mesh
 * (Medit). A .msh has the named sets as physical groups of points and volumes; the other formats have no sets. A
 * partial file is never left. Numbers have 17 significant digits, so that reading gives the same mesh.
 * FLESH_ERR_ARGUMENT for another suffix, for a mesh with tets of four nodes and of ten, and in a .msh for a set whose
 * name has a quotation mark; FLESH_ERR_FILE when writing fails. Further errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_mesh_write(const flesh_mesh *mesh, const char *path);

/* NULL-safe; sets *mesh to NULL. */
FLESH_API void flesh_mesh_destroy(flesh_mesh **mesh);

/* Return the number of nodes, and of tets. Cannot fail. */
FLESH_API int flesh_mesh_node_count(const flesh_mesh *mesh);
FLESH_API int flesh_mesh_tet_count(const flesh_mesh *mesh);
/* The arrays below belong to the mesh. */
/* [3*nodes] rest positions, m. */
FLESH_API const double *flesh_mesh_positions(const flesh_mesh *mesh);
/* Returns the order, 1 or 2. Cannot fail. */
FLESH_API int flesh_mesh_order(const flesh_mesh *mesh);
/* [4*tets] node indices: the corners. */
FLESH_API const int *flesh_mesh_tets(const flesh_mesh *mesh);
/* [6*tets] nodes on the edges 01, 12, 02, 03, 13, 23 of every tet, -1 for four-node tets; NULL at order 1. */
FLESH_API const int *flesh_mesh_tet_edges(const flesh_mesh *mesh);
/* [tets] 1 if the node on one of the tet's edges is off its middle by more than 1e-12 of the edge and rounding. */
FLESH_API const uint8_t *flesh_mesh_tet_curved(const flesh_mesh *mesh);
/* [tets] region tags. */
FLESH_API const int *flesh_mesh_regions(const flesh_mesh *mesh);
/* [tets] rest volumes, m^3, all positive. */
FLESH_API const double *flesh_mesh_tet_volumes(const flesh_mesh *mesh);
/* Returns the boundary triangles, outward by the right-hand rule: [3*count] node indices. The face of a ten-node tet
 * is four flat triangles in a row: (a,p,r), (p,b,q), (r,q,c) at its corners a, b, c, then (p,q,r), with p, q, r on
 * the edges ab, bc, ca. */
FLESH_API const int *flesh_mesh_surface(const flesh_mesh *mesh, int *count);
/* Returns the tet of each boundary triangle [count]. */
FLESH_API const int *flesh_mesh_surface_tets(const flesh_mesh *mesh);
/* [nodes] 1 if some tet uses the node, else 0. */
FLESH_API const uint8_t *flesh_mesh_node_used(const flesh_mesh *mesh);

/* A named set of a mesh: nodes, tets, or both, ascending. Scenes select by it (`set: NAME`): its nodes and those of
 * its tets. The arrays belong to the mesh. */
typedef struct flesh_named_set {
  const char *name;
  int node_count, tet_count;
  const int *nodes; /* [node_count]; may be NULL where that is 0 */
  const int *tets;  /* [tet_count]; likewise */
} flesh_named_set;
/* Returns the number of named sets. Cannot fail. */
FLESH_API int flesh_mesh_set_count(const flesh_mesh *mesh);
/* Returns the set with an index from 0 to the count - 1, in the order of the file. Cannot fail. */
FLESH_API flesh_named_set flesh_mesh_set_at(const flesh_mesh *mesh, int index);

/* Fills *info; every call measures the whole mesh. */
FLESH_API void flesh_mesh_inspect(const flesh_mesh *mesh, flesh_mesh_info *info);

/* Returns the sum of the signed volumes of all tets, curved ones at order 2, for nodes at `x` [3*nodes], in m^3. */
FLESH_API double flesh_mesh_volume(const flesh_mesh *mesh, const double *x);

/* J = det F in the tets with nodes at `x` [3*nodes], F the deformation gradient from the rest shape. In a four-node
 * tet J is one number. In a ten-node tet J varies, and there are three numbers: the smallest J at the four quadrature
 * points, which is all that the element sees; the mean of J over them, weighted by their rest volumes, which is the
 * deformed volume over the rest volume up to the error of the quadrature; and a lower bound of J anywhere in the tet.
 * At the rest positions each is 1 to the last bit. */

/* Writes the smallest J at a quadrature point of every tet into J [tets] (may be NULL). Returns the smallest of all
 * (NaN when one is NaN), and in *worst (may be NULL) its tet, in *inverted (may be NULL) the number of tets with J <=
 * 0 or NaN at some point. */
FLESH_API double flesh_mesh_jacobians(const flesh_mesh *mesh, const double *x, double *J,
                                      int *worst, int *inverted);
/* Writes the mean of J over the quadrature points of every tet into J [tets]. */
FLESH_API void flesh_mesh_mean_jacobians(const flesh_mesh *mesh, const double *x, double *J);
/* Writes a lower bound of J anywhere in every tet into J [tets] (may be NULL). Returns the smallest (NaN when one is
 * NaN), and in *worst (may be NULL) its tet, in *unsure (may be NULL) the number of tets whose bound is not positive.
 * The bound is below the smallest J in the tet by at most a hundredth of the tet's largest |J|, on the same side of
 * 0; it is not positive if the sign is still undecided after 400 cuts of the tet (Bernstein coefficients; Johnen,
 * Remacle & Geuzaine 2013). */
FLESH_API double flesh_mesh_jacobian_bounds(const flesh_mesh *mesh, const double *x, double *J, int *worst,
                                            int *unsure);

/* Computes the lumped mass [nodes], kg, from density [tets], kg/m^3: rho V/4 to each node of a four-node tet; of a
 * ten-node tet, in proportion to the diagonal of the consistent mass, rho V/36 at corners and 4 rho V/27 on edges if
 * these are straight (Hinton, Rock & Zienkiewicz 1976). */
FLESH_API void flesh_mesh_lumped_mass(const flesh_mesh *mesh, const double *density, double *mass);

/* Computes y = M x with the consistent mass, x and y [3*nodes]: rho V/20 (1 + delta_ij) for four-node tets; for
 * ten-node tets, curved ones included, the exact integrals of rho N_a N_b. */
FLESH_API void flesh_mesh_consistent_mass_times(const flesh_mesh *mesh, const double *density,
                                                const double *x, double *y);

#ifdef __cplusplus
}
#endif
#endif
