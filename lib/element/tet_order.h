/* tet_order.h: the order in which tets are processed: near ones together, and in pieces that several threads can
 * process without conflict. */
#ifndef FLESH_ELEMENT_TET_ORDER_H
#define FLESH_ELEMENT_TET_ORDER_H

#include "flesh/mesh.h"

/* Pieces are runs of tets. Pieces of one colour share no node, so that they can add to the nodes (or to the blocks
 * between them) at the same time. As colours are processed one after the other, the order of additions at every node
 * does not depend on the number of threads. */
typedef struct flesh_tet_order {
  int *tet;         /* [tets] number of each in the mesh */
  int pieces;       /* of nearly equal size */
  int *piece_first; /* [pieces+1] first tet of each, in the new order */
  int colours;
  int *colour_first; /* [colours+1] first piece of each */
} flesh_tet_order;

/* Orders the tets `chosen` [tets] (NULL: all) along a space-filling curve, and within a piece by `group` [the mesh's
 * tets] (NULL: all the same). FLESH_ERR_MEMORY. */
int flesh_tet_order_create(const flesh_mesh *mesh, int tets, const int *chosen, const int *group,
                           flesh_tet_order *order);
void flesh_tet_order_clear(flesh_tet_order *order);

#endif
