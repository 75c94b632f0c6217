/* box.h: the grid of boxes of flesh_mesh_box. */
#ifndef FLESH_MESH_BOX_H
#define FLESH_MESH_BOX_H

/* Corners of a box's six tets, as bits: 1 along x, 2 along y, 4 along z. All have positive volume. */
extern const int flesh_box_tets[6][4];

/* Checks the arguments of flesh_mesh_box. FLESH_ERR_ARGUMENT. */
int flesh_box_check(const int cells[3], const double size[3], const double origin[3]);

/* Returns the coordinate of node i of the n + 1 along an axis, with the same bits for every caller. */
double flesh_box_place(double origin, double size, int i, int n);

#endif
