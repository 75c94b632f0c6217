/* contact_core.h: keeps the core of a spherical or capsule obstacle out of the body's faces.
 *
 * A barrier on nodes alone does not: a body that is stretched enough lets a ball slip between its
 * nodes. So there is a second barrier on the faces, around a core of half the obstacle's radius. In
 * ordinary contact, where nodes bear the load, no face is near the core. The barrier is summed over
 * faces, edges and vertices as that of triangle meshes is. */
#ifndef FLESH_GEOMETRY_CONTACT_CORE_H
#define FLESH_GEOMETRY_CONTACT_CORE_H

#include "flesh/block_matrix.h"
#include "flesh/body.h"
#include "geometry/obstacle.h"

typedef struct flesh_contact_core {
  int points;       /* 0: the obstacle has none, and nothing else is there */
  double *centres;  /* [3*points] in the obstacle's frame */
  double radius, thickness;
  double weight;    /* N */
  flesh_cells faces; /* of the body's surface, nodes ascending */
  int node_count, *nodes; /* [node_count] of the faces */
  double *edge_weight, *vertex_weight; /* [3*faces] */
} flesh_contact_core;

/* `weight`: stiffness times an area. */
int flesh_contact_core_create(const flesh_mesh *mesh, const flesh_obstacle *obstacle, double weight,
                              double thickness, flesh_contact_core *core);
/* Makes the same core for `count` of the faces alone, 1 or more: `kept` [count] of the whole's, with corners in another
 * numbering, corners [3*count], that of `mesh`. FLESH_ERR_MEMORY; to be cleared also then. */
int flesh_contact_core_restrict(const flesh_contact_core *whole, int count, const int *kept, const int *corners,
                                const flesh_mesh *mesh, flesh_contact_core *core);
void flesh_contact_core_clear(flesh_contact_core *core);

/* Each adds to what is not NULL: the energy [J], the residual r [3*n], and scale times the Jacobian
 * to K. FLESH_UNDEFINED where a face is within a ball. */
int flesh_contact_core_add(const flesh_contact_core *core, const flesh_frame *frame,
                           const double *x, double *energy, double *r);
void flesh_contact_core_jacobian(const flesh_contact_core *core, const flesh_frame *frame,
                                 const double *x, double scale, int project, flesh_block_matrix *K,
                                 const int *slots);

/* The fraction of the step from x0 to x1 that is feasible for the faces. */
double flesh_contact_core_max_feasible_step(const flesh_contact_core *core, const flesh_frame *from,
                              const double *x0, const flesh_frame *to, const double *x1);

#endif
