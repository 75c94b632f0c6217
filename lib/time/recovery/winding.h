/* winding.h: finds where a deformed mesh is tangled.
 *
 * A tangle is an inverted tet, or an edge around which the body winds once more than at rest: the
 * dihedral angles of the edge's tets then sum to 2 pi more, though every J may be positive. No
 * continuous motion without inversion undoes it, so it is a local minimum that an elastic solver
 * does not leave by itself. A tet that has collapsed counts too (extents below a tenth in the mean,
 * tr(F^T F) < 0.03): in a point, F = 0, some energies have a local minimum and others none of the
 * forces that would lead out. */
#ifndef FLESH_TIME_RECOVERY_WINDING_H
#define FLESH_TIME_RECOVERY_WINDING_H

#include <stddef.h>

#include "base/team.h"
#include "flesh/mesh.h"

typedef struct flesh_winding flesh_winding;

/* Creates the search; borrows the mesh and the team that shares out its body (NULL: no ranks), with which windings are
 * those of the whole body, and creating and finding are collective. Returns new. FLESH_ERR_MEMORY, on all ranks or
 * none. */
int flesh_winding_create(const flesh_mesh *mesh, const flesh_team *team, flesh_winding **winding);
void flesh_winding_destroy(flesh_winding **winding);
/* Returns the bytes that a winding of the mesh, with all that it requests in its life, takes in a reserve at most.
 * `work` [nodes] is room, with a team. Collective. */
size_t flesh_winding_room(const flesh_mesh *mesh, const flesh_team *team, double *work);

/* Returns whether x [3*nodes] can hold a tangle at all: 0 if no tet is inverted, collapsed, or stretched twice as much
 * one way as another, without which no edge can wind once more. Needs no flesh_winding. */
int flesh_mesh_may_be_tangled(const flesh_mesh *mesh, const double *x);
/* Returns whether the body of any rank can. Collective. */
int flesh_body_may_be_tangled(const flesh_mesh *mesh, const flesh_team *team, const double *x);

/* Returns whether every tet lies (to rounding) on a line or in a point. */
int flesh_mesh_is_flat(const flesh_mesh *mesh, const double *x);

/* Finds the tangled tets at x: inverted, collapsed or at an overwound edge. Returns their number on this rank, and
 * marks them in `tangled` [pieces]: eight flat pieces stand for each tet of ten nodes (mesh/pieces.h), and all eight
 * are marked if Bernstein bounds find J <= 0 in it. */
int flesh_winding_find(flesh_winding *winding, const double *x, const uint8_t **tangled);

/* Finds the dofs [3*nodes] that are far from tangled tets: those of nodes that belong to none of these tets nor of the
 * two layers of tets around them, on any rank. Returns the number of such nodes that this rank owns. `work` [nodes] is
 * room. Collective. */
int flesh_winding_find_far(const flesh_mesh *mesh, const flesh_team *team, const uint8_t *tangled, double *work,
                           uint8_t *far);

#endif
