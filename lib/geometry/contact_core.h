/* contact_core.h: keeps the core of a spherical or capsule obstacle out of the body's faces.
 *
 * A barrier on nodes alone does not do so: if the body is stretched enough, a ball slips between its nodes. So there is
 * a second barrier between the faces and a core of half the obstacle's radius. In ordinary contact the nodes bear the
 * load and no face is near the core. The barrier is summed over faces, edges and vertices with the weights used for
 * obstacle meshes (obstacle_mesh.h). */
#ifndef FLESH_GEOMETRY_CONTACT_CORE_H
#define FLESH_GEOMETRY_CONTACT_CORE_H

#include "flesh/block_matrix.h"
#include "flesh/body.h"
#include "geometry/obstacle.h"

typedef struct flesh_contact_core {
  int points;       /* number of balls of the core; 0: the obstacle has no core; all arrays below are then NULL */
  double *centres;  /* [3*points] centres of the balls in the obstacle's frame */
  double radius, thickness;
  double weight;    /* N, stiffness times an area */
  flesh_cells faces; /* faces of the body's surface, each with ascending nodes */
  int node_count, *nodes; /* [node_count] nodes of the faces */
  double *edge_weight, *vertex_weight; /* [3*faces] */
} flesh_contact_core;

/* Creates the core. `weight` [N] is a stiffness times an area. Without a core (plane, mesh) core->points is 0.
 * FLESH_ERR_MEMORY; call clear also after an error. */
int flesh_contact_core_create(const flesh_mesh *mesh, const flesh_obstacle *obstacle, double weight,
                              double thickness, flesh_contact_core *core);
/* Makes the same core for `count` >= 1 of the faces only. `kept` [count] are their indices in `whole`; `corners`
 * [3*count] are their nodes in the numbering of `mesh`. FLESH_ERR_MEMORY; call clear also after an error. */
int flesh_contact_core_restrict(const flesh_contact_core *whole, int count, const int *kept, const int *corners,
                                const flesh_mesh *mesh, flesh_contact_core *core);
void flesh_contact_core_clear(flesh_contact_core *core);

/* The first adds the energy [J] and the residual r [3*n] (either may be NULL), the second adds scale times the Jacobian
 * to K. The first returns FLESH_UNDEFINED if a face is within a ball. */
int flesh_contact_core_add(const flesh_contact_core *core, const flesh_frame *frame,
                           const double *x, double *energy, double *r);
void flesh_contact_core_jacobian(const flesh_contact_core *core, const flesh_frame *frame,
                                 const double *x, double scale, int project, flesh_block_matrix *K,
                                 const int *slots);

/* Returns the fraction of the step from x0 to x1 that is feasible for the faces. */
double flesh_contact_core_max_feasible_step(const flesh_contact_core *core, const flesh_frame *from,
                              const double *x0, const flesh_frame *to, const double *x1);

#endif
