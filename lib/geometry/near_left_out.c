/* near_left_out.c: distinguishes neighbours in a surface from faces across a gap by path lengths along edges. */
#include "geometry/near_left_out.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "geometry/continuous_collision.h"
#include "math/area.h"
#include "math/mat3.h"
#include "math/nearest.h"

/* Least cosine between the connecting line and the normals of the face and of one of the node's faces for the two to
 * face each other. */
static const double facing = 0.5;

typedef struct ways {
  const flesh_contact_surface *s;
  const double *X;
  int *start, *edges; /* edges of surface node n: edges[start[n]] to before edges[start[n + 1]] */
  int *first, *faces; /* faces of surface node n: faces[first[n]] to before faces[first[n + 1]] */
  double *length;     /* [nodes] length of the path from the start node; INFINITY: not reached */
  int *queue, count;  /* nodes reached */
} ways;

static double span(const ways *w, int node, int other)
{
  return flesh_distance(w->X + 3 * (size_t)node, w->X + 3 * (size_t)other);
}

static void close_ways(ways *w)
{
  free(w->start);
  free(w->edges);
  free(w->first);
  free(w->faces);
  free(w->length);
  free(w->queue);
}

/* Whether the face's normal points along the unit vector, or against it if sign is -1. */
static int looks(const ways *w, int face, const double unit[3], int sign)
{
  double n[3];
  flesh_area_vector_at(w->X, w->s->faces + 3 * (size_t)face, n);
  return sign * flesh_vec3_dot(unit, n) > facing * sqrt(flesh_vec3_dot(n, n));
}

static int open_ways(const flesh_contact_surface *s, const double *X, ways *w)
{
  const size_t nodes = (size_t)s->node_count;
  *w = (ways){.s = s, .X = X};
  w->length = malloc((nodes + 1) * sizeof *w->length);
  w->queue = malloc((nodes + 1) * sizeof *w->queue);
  if (!w->length || !w->queue)
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for ways along a surface of %d nodes", s->node_count);
  for (size_t n = 0; n < nodes; n++) w->length[n] = INFINITY;
  const int status = flesh_contact_surface_around(s, 2, &w->start, &w->edges);
  return status ? status : flesh_contact_surface_around(s, 3, &w->first, &w->faces);
}

/* Finds the lengths of paths from a node, up to the limit, after resetting those of the last call. */
static void walk(ways *w, int place, double limit)
{
  const flesh_contact_surface *s = w->s;
  for (int k = 0; k < w->count; k++) w->length[w->queue[k]] = INFINITY;
  w->length[place] = 0;
  w->queue[0] = place;
  w->count = 1;
  for (int changed = 1; changed;) { /* few nodes are reached, in few passes */
    changed = 0;
    for (int k = 0; k < w->count; k++)
      for (int j = w->start[w->queue[k]]; j < w->start[w->queue[k] + 1]; j++) {
        const int *end = s->edges + 2 * (size_t)w->edges[j];
        const int next = s->node_place[s->node_place[end[0]] == w->queue[k] ? end[1] : end[0]];
        const double length = w->length[w->queue[k]] + span(w, end[0], end[1]);
        if (length > limit || length >= w->length[next]) continue;
        if (w->length[next] == INFINITY) w->queue[w->count++] = next;
        w->length[next] = length;
        changed = 1;
      }
  }
}

static double longest_edge(const ways *w, int place)
{
  double longest = 0;
  for (int j = w->start[place]; j < w->start[place + 1]; j++)
    longest = fmax(longest, span(w, w->s->edges[2 * w->edges[j]], w->s->edges[2 * w->edges[j] + 1]));
  return longest;
}

/* Whether the node and the face face each other; *gap is their distance. */
static int look_at_each_other(const ways *w, int place, int face, double *gap)
{
  const int *corner = w->s->faces + 3 * (size_t)face;
  const double *p[4] = {w->X + 3 * (size_t)w->s->nodes[place]};
  double unit[3];
  int some = 0;
  for (int k = 0; k < 3; k++) p[1 + k] = w->X + 3 * (size_t)corner[k];
  *gap = flesh_hull_distance(1, 3, p, unit);
  for (int k = w->first[place]; k < w->first[place + 1]; k++) some |= looks(w, w->faces[k], unit, -1);
  return some && looks(w, face, unit, 1);
}

/* Examines the excluded faces that one node faces and is far from. */
static void try_node(ways *w, const flesh_near_rows *rows, int place, double rest_distance, flesh_left_out *found)
{
  const flesh_contact_surface *s = w->s;
  double gap, limit = 0;
  int some = 0;
  for (int k = rows->start[place]; k < rows->start[place + 1]; k++) {
    if (!look_at_each_other(w, place, rows->second[k], &gap)) continue;
    const double around = fmax(longest_edge(w, s->node_place[s->faces[3 * rows->second[k]]]), longest_edge(w, place));
    limit = fmax(limit, 2 * (rest_distance + around));
  }
  if (limit == 0) return;
  walk(w, place, limit);
  for (int k = rows->start[place]; k < rows->start[place + 1]; k++) {
    const int face = rows->second[k], *corner = s->faces + 3 * (size_t)face;
    int reached = 0;
    for (int c = 0; c < 3; c++) reached |= w->length[s->node_place[corner[c]]] < INFINITY;
    if (reached || !look_at_each_other(w, place, face, &gap)) continue;
    some = 1;
    if (gap >= found->gap) continue;
    *found = (flesh_left_out){found->nodes, s->nodes[place], face, gap};
  }
  found->nodes += some;
}

int flesh_near_finder_left_out(const flesh_near_finder *finder, const double *X, double rest_distance,
                               flesh_left_out *found)
{
  const flesh_near_rows *rows = &finder->excluded[0];
  ways w;
  *found = (flesh_left_out){0, -1, -1, INFINITY};
  if (!rows->start) return FLESH_OK;
  const int status = open_ways(finder->surface, X, &w);
  for (int n = 0; n < finder->surface->node_count && !status; n++) try_node(&w, rows, n, rest_distance, found);
  close_ways(&w);
  return status;
}
