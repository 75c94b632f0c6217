/* body.h: what a body is made of, and the groups of nodes that its elements couple.
 * Functions that return no status cannot fail. */
#ifndef FLESH_BODY_H
#define FLESH_BODY_H

#include "flesh/instructions.h"
#include "flesh/material.h"
#include "flesh/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* How displacements vary within a tet, and where the energy is taken.
 *
 *   TET4        linear, of meshes of order 1
 *   TET10       quadratic, of meshes of order 2: psi at four points
 *   TET10_MEAN  the same, but of a form's volume term lambda U(J), U = (J-1)^2/2 (or (log J)^2/2),
 *               the part m U is taken at the mean of J over the tet, so that nearly incompressible bodies
 *               do not lock: the energy is sum of w (psi - m U(J)) + V m U(mean J), with m = lambda - 2 mu_L where
 *               lambda >= 3 mu_L, m = 0 where lambda <= mu_L, and between them m = mu_L (x+1)^3 (3-x)/16,
 *               x = lambda/mu_L - 2, which joins both with two continuous derivatives; mu_L = 2 psi_I at F = I, the
 *               small-strain shear modulus of forms without stress at rest. As TET10 where lambda <= mu_L, or where the
 *               form has no term of J alone (C, M, CR, StVK). Mean dilatation: Nagtegaal, Parks & Rice 1974
 *   AUTO        TET4 at order 1, TET10_MEAN at order 2 */
typedef enum flesh_element {
  FLESH_ELEMENT_AUTO,
  FLESH_ELEMENT_TET4,
  FLESH_ELEMENT_TET10,
  FLESH_ELEMENT_TET10_MEAN,
  FLESH_ELEMENT_COUNT
} flesh_element;

/* "auto", "tet4", "tet10", "tet10-mean"; "unknown" for anything else. */
FLESH_API const char *flesh_element_name(flesh_element element);

/* How a lumped mass is made: of a tet of four nodes a quarter to each; of ten nodes 1/36 to each
 * corner and 4/27 to each node on an edge (Hinton, Rock & Zienkiewicz 1976). */
typedef enum flesh_mass { FLESH_MASS_LUMPED, FLESH_MASS_CONSISTENT } flesh_mass;

/* One of several bodies that share a mesh: a run of its tets. */
typedef struct flesh_body_part {
  const char *name;
  int first_tet, tets;
} flesh_body_part;

/* A body: its mesh, densities and materials. All pointers are borrowed and must outlive the effects made from it. */
typedef struct flesh_body {
  const flesh_mesh *mesh;
  const double *density;           /* [tets] kg/m^3, > 0 */
  const flesh_material *materials; /* the different ones; NULL for a body without elasticity */
  const int *tet_material;         /* [tets] index into materials; NULL: all are materials[0] */
  flesh_mass mass;
  int part_count;               /* 0: one body without a name */
  const flesh_body_part *parts; /* [part_count] */
  flesh_instructions instructions; /* of effects that are computed tet by tet, and of linear solvers
                                      (see flesh_system_instructions); where the machine lacks them,
                                      creating these effects fails with FLESH_ERR_ARGUMENT */
  flesh_element element; /* where the mesh's order does not fit it, creating effects fails with
                            FLESH_ERR_ARGUMENT. In a mesh with tets of four nodes and of ten it is
                            that of the tets that it fits, and AUTO for the others */
  /* An element for each material; NULL: all have `element`. TET4 for tets of four nodes, TET10 or TET10_MEAN for tets
   * of ten, of one material; AUTO: `element`. Otherwise creating effects fails as above. */
  const flesh_element *material_elements;
} flesh_body;

/* Groups of nodes that an effect couples. Nodes within a cell ascend (where `padded`, cells of fewer nodes repeat their
 * last one), so that every pair a <= b of
 * local indices is a block of the upper triangle: pairs (0,0) (0,1) ... (1,1) ..., of which a cell
 * has m = nodes_per_cell * (nodes_per_cell + 1) / 2. */
typedef struct flesh_cells {
  int count, nodes_per_cell;
  const int *nodes; /* [count * nodes_per_cell] */
  /* Pairs whose blocks the effect asks for, pair p of cell c as c*m + p; NULL: all in order. */
  int pair_count;
  const int *pairs; /* [pair_count] */
  int padded;
} flesh_cells;

/* Cells of every tet of the mesh with its 4 or 10 nodes ascending, padded where the mesh has both, for
 * operations->cells. Freed with flesh_cells_clear. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_cells_of_tets(const flesh_mesh *mesh, flesh_cells *cells);
FLESH_API void flesh_cells_clear(flesh_cells *cells);

#ifdef __cplusplus
}
#endif
#endif
