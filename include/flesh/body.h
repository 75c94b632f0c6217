/* body.h: a body's mesh, densities and materials, and the groups of nodes that an effect couples.
 * Functions that return no status cannot fail. */
#ifndef FLESH_BODY_H
#define FLESH_BODY_H

#include "flesh/instructions.h"
#include "flesh/material.h"
#include "flesh/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Finite element: how displacements vary within a tet, and at which points the energy is evaluated.
 *
 *   TET4        linear displacements, for meshes of order 1
 *   TET10       quadratic displacements, for meshes of order 2; psi is evaluated at four points
 *   TET10_MEAN  TET10 with mean dilatation (Nagtegaal, Parks & Rice 1974), so that nearly incompressible bodies do not
 *               lock: of a form's volume term lambda U(J), U = (J-1)^2/2 (or (log J)^2/2), the part m U is evaluated at
 *               the mean of J over the tet. The energy is sum of w (psi - m U(J)) + V m U(mean J), with
 *               m = lambda - 2 mu_L where lambda >= 3 mu_L, m = 0 where lambda <= mu_L, and between them
 *               m = mu_L (x+1)^3 (3-x)/16, x = lambda/mu_L - 2, which joins both with two continuous derivatives;
 *               mu_L = 2 psi_I at F = I, the small-strain shear modulus of forms without stress at rest. It is the
 *               same as TET10 where lambda <= mu_L, or where the form has no term of J alone (C, M, CR, StVK)
 *   AUTO        TET4 at order 1, TET10_MEAN at order 2 */
typedef enum flesh_element {
  FLESH_ELEMENT_AUTO,
  FLESH_ELEMENT_TET4,
  FLESH_ELEMENT_TET10,
  FLESH_ELEMENT_TET10_MEAN,
  FLESH_ELEMENT_COUNT
} flesh_element;

/* Returns "auto", "tet4", "tet10" or "tet10-mean"; "unknown" for anything else. */
FLESH_API const char *flesh_element_name(flesh_element element);

/* Mass matrix: lumped or consistent. The lumped one gives a quarter of a four-node tet's mass to each node; of a
 * ten-node tet's mass, 1/36 to each corner and 4/27 to each node on an edge (Hinton, Rock & Zienkiewicz 1976). */
typedef enum flesh_mass { FLESH_MASS_LUMPED, FLESH_MASS_CONSISTENT } flesh_mass;

/* One of several bodies that share a mesh: a contiguous range of its tets. */
typedef struct flesh_body_part {
  const char *name;
  int first_tet, tets;
} flesh_body_part;

/* A body: its mesh, densities and materials. All pointers are borrowed and must outlive the effects made from it. */
typedef struct flesh_body {
  const flesh_mesh *mesh;
  const double *density;           /* [tets] kg/m^3, > 0 */
  const flesh_material *materials; /* the distinct materials; NULL for a body without elasticity */
  const int *tet_material;         /* [tets] index into materials; NULL: all tets have materials[0] */
  flesh_mass mass;
  int part_count;               /* 0: one body without a name */
  const flesh_body_part *parts; /* [part_count] */
  /* Vector instructions of effects that are computed tet by tet, and of linear solvers (see
   * flesh_system_instructions). If the machine lacks them, creating these effects fails with FLESH_ERR_ARGUMENT. */
  flesh_instructions instructions;
  /* If the element does not fit the mesh's order, creating effects fails with FLESH_ERR_ARGUMENT. In a mesh that
   * has both four-node and ten-node tets it applies to the tets that it fits; the others have AUTO. */
  flesh_element element;
  /* An element for each material; NULL: all have `element`. It is TET4 for a material of four-node tets, TET10 or
   * TET10_MEAN for a material of ten-node tets, or AUTO: `element`. Otherwise creating effects fails with
   * FLESH_ERR_ARGUMENT. */
  const flesh_element *material_elements;
} flesh_body;

/* Groups of nodes that an effect couples, the cells. Node numbers ascend within a cell (with `padded`, a cell of
 * fewer nodes repeats its last one), so that every pair a <= b of local indices is a block of the upper triangle. A
 * cell has m = nodes_per_cell * (nodes_per_cell + 1) / 2 pairs, in the order (0,0) (0,1) ... (1,1) .... */
typedef struct flesh_cells {
  int count, nodes_per_cell;
  const int *nodes; /* [count * nodes_per_cell] */
  /* Pairs whose blocks the effect needs, pair p of cell c being numbered c*m + p; NULL: all pairs, in order. */
  int pair_count;
  const int *pairs; /* [pair_count] */
  int padded;
} flesh_cells;

/* Fills *cells with a cell for each tet of the mesh: its 4 or 10 nodes ascending, padded where the mesh has both
 * kinds. For operations->cells. Free it with flesh_cells_clear. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_cells_of_tets(const flesh_mesh *mesh, flesh_cells *cells);
/* Frees the arrays of *cells, which is then all zeros. */
FLESH_API void flesh_cells_clear(flesh_cells *cells);

#ifdef __cplusplus
}
#endif
#endif
