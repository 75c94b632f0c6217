/* bisect_marks.h: which edges of a tet bisection cuts, first and in later halvings (Arnold, Mukherjee & Pouly, SIAM J.
 * Sci. Comput. 22, 2000). */
#ifndef FLESH_MESH_BISECT_MARKS_H
#define FLESH_MESH_BISECT_MARKS_H

/* Marks of a tet; edges are numbered in VTK's order. */
typedef struct flesh_tet_marks {
  signed char edge;    /* the next edge to cut */
  signed char face[4]; /* the marked edge of the face opposite to each corner; `edge` in the two faces that have it */
  signed char flag;    /* distinguishes the two kinds of tets with coplanar marks */
} flesh_tet_marks;

/* Marks the tets [4*tets] of a mesh at `positions` that has not been bisected yet: the longest edges of tets and faces;
 * of equal ones that with the lower nodes, so that both tets of a face agree. */
void flesh_tet_marks_begin(const double *positions, int tets, const int *tet_nodes, flesh_tet_marks *marks);

/* Returns the marks of the half of a tet in which the middle of the cut edge replaces corner `gone`, an end of that
 * edge. */
flesh_tet_marks flesh_tet_marks_half(const flesh_tet_marks *marks, int gone);

#endif
