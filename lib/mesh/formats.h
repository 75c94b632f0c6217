/* formats.h: readers and writers of the file formats. */
#ifndef FLESH_MESH_FORMATS_H
#define FLESH_MESH_FORMATS_H

#include <stdio.h>

#include "mesh/draft.h"
#include "base/scan.h"
#include "mesh/pieces.h"

/* Index in VTK's order of each of the ten nodes as TetGen 1.5 writes them (23, 03, 01, 12, 13, 02) and as Gmsh does
 * (01, 12, 02, 03, 23, 13). */
static const int flesh_tetgen_order[10] = {0, 1, 2, 3, 9, 7, 4, 5, 8, 6};
static const int flesh_gmsh_order[10] = {0, 1, 2, 3, 4, 5, 6, 7, 9, 8};

/* Read a mesh from the beginning of the text or bytes of `s` into an empty draft. */
int flesh_plain_read(flesh_scanner *s, flesh_draft *draft);
int flesh_medit_read(flesh_scanner *s, flesh_draft *draft);
int flesh_gmsh_read(flesh_scanner *s, flesh_draft *draft);
int flesh_abaqus_read(flesh_scanner *s, flesh_draft *draft);
int flesh_vtk_read(flesh_scanner *s, flesh_draft *draft);
int flesh_vega_read(flesh_scanner *s, flesh_draft *draft);

/* Gives the nodes of a tet, numbered from 0, in the order of a format; `order` has their indices in VTK's order.
 * Returns their number, 4 or 10. */
static inline int flesh_mesh_nodes_in_order(const flesh_mesh *mesh, int tet, const int order[10], int nodes[10])
{
  int vtk[10], size = flesh_mesh_tet_nodes(mesh, tet, vtk);
  for (int i = 0; i < size; i++) nodes[i] = vtk[order[i]];
  return size;
}

/* Writes Gmsh 4.1 in this machine's byte order, with named sets as physical groups. FLESH_ERR_MEMORY;
 * FLESH_ERR_ARGUMENT for a set whose name the format cannot hold. */
int flesh_gmsh_write(FILE *file, const flesh_mesh *mesh);

/* Reads a pair of files: `s` is one of the two, `s->path`; its partner beside it is opened. */
int flesh_tetgen_read(flesh_scanner *s, flesh_draft *draft);

#endif
