/* bisect_marks.c: marks the edges of tets and of their halves. */
#include <stddef.h>

#include "mesh/bisect_marks.h"
#include "mesh/edges.h"

/* Returns whether edge a comes before b: it is longer, or of equal length with lower nodes. Compared as floats, lengths
 * that differ only by rounding are nearly always equal; if they are not, any order will do. */
static int is_before(const double *positions, const int *nodes, int a, int b)
{
  float squares[2];
  int ends[2][2];
  for (int k = 0; k < 2; k++) {
    const int *corners = flesh_edge_corners[k ? b : a], p = nodes[corners[0]], q = nodes[corners[1]];
    double sum = 0;
    ends[k][0] = p < q ? p : q, ends[k][1] = p < q ? q : p;
    for (int d = 0; d < 3; d++) {
      const double along = positions[3 * (size_t)ends[k][1] + d] - positions[3 * (size_t)ends[k][0] + d];
      sum += along * along;
    }
    squares[k] = (float)sum;
  }
  if (squares[0] != squares[1]) return squares[0] > squares[1];
  return ends[0][0] != ends[1][0] ? ends[0][0] < ends[1][0] : ends[0][1] < ends[1][1];
}

void flesh_tet_marks_begin(const double *positions, int tets, const int *tet_nodes, flesh_tet_marks *marks)
{
  for (int t = 0; t < tets; t++) {
    const int *nodes = tet_nodes + 4 * (size_t)t;
    marks[t] = (flesh_tet_marks){.edge = 0, .face = {-1, -1, -1, -1}};
    for (int e = 0; e < 6; e++) {
      const int *ends = flesh_edge_corners[e];
      if (is_before(positions, nodes, e, marks[t].edge)) marks[t].edge = (signed char)e;
      for (int f = 0; f < 4; f++) {
        signed char *face = &marks[t].face[f];
        if (ends[0] != f && ends[1] != f && (*face < 0 || is_before(positions, nodes, e, *face))) *face = (signed char)e;
      }
    }
  }
}

/* Returns the other end of `edge`; `corner` is one of its two. */
static int other_end(int edge, int corner)
{
  return flesh_edge_corners[edge][flesh_edge_corners[edge][0] == corner];
}

/* Returns whether the edge has that corner. */
static int has(int edge, int corner)
{
  return flesh_edge_corners[edge][0] == corner || flesh_edge_corners[edge][1] == corner;
}

flesh_tet_marks flesh_tet_marks_half(const flesh_tet_marks *marks, int gone)
{
  const int kept = other_end(marks->edge, gone);
  const int of_gone = marks->face[kept], of_kept = marks->face[gone]; /* in the two faces without the cut edge */
  flesh_tet_marks half = {.edge = (signed char)of_kept};
  int planar = 0, apex = -1;
  if (has(of_gone, gone) && has(of_kept, kept)) {
    apex = other_end(of_kept, kept);
    planar = apex == other_end(of_gone, gone);
  }
  for (int f = 0; f < 4; f++) {
    int a = -1, b = -1; /* the two corners of face f that are not new */
    for (int c = 0; c < 4; c++)
      if (c != f && c != gone) b = a, a = c;
    half.face[f] = flesh_edge_between[a][b]; /* the edge opposite to the new corner */
  }
  half.face[gone] = (signed char)of_kept;                                               /* this face is a whole one */
  if (planar && marks->flag) half.face[kept] = (signed char)flesh_edge_between[gone][apex]; /* the cut */
  half.flag = (signed char)(planar && !marks->flag);
  return half;
}
