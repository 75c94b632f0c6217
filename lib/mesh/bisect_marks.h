/* bisect_marks.h: which edges of a tet bisection cuts, now and later (Arnold, Mukherjee & Pouly, SIAM J. Sci. Comput. 22,
 * 2000). */
#ifndef FLESH_MESH_BISECT_MARKS_H
#define FLESH_MESH_BISECT_MARKS_H

/* A marked tet; edges are numbered in VTK's order. */
typedef struct flesh_tet_marks {
  signed char edge;    /* the next to be cut */
  signed char face[4]; /* the marked edge of the face opposite to each corner; `edge` in the two faces that have it */
  signed char flag;    /* tells two kinds of tets with coplanar marks apart */
} flesh_tet_marks;

/* The marks of the tets [4*tets] of a mesh at `positions` that has not been bisected yet: the longest edges of tets and
 * faces, equal ones by their nodes, so that all tets of a face agree. */
void flesh_tet_marks_begin(const double *positions, int tets, const int *tet_nodes, flesh_tet_marks *marks);

/* The marks of a tet's half in which the middle of the cut edge takes the place of corner `gone`, one end of that edge. */
flesh_tet_marks flesh_tet_marks_half(const flesh_tet_marks *marks, int gone);

#endif
