/* smooth.c: moves corners one by one to improve the tets around them. */
#include "mesh/smooth.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/stop.h"
#include "math/area.h"
#include "math/mat3.h"
#include "mesh/edges.h"
#include "mesh/inspect.h"

/* Most passes over all bad tets. A node's steps, in units of the cube root of the mean volume around it, begin with
 * first_step and are halved, if none improves, down to last_step; an improvement must exceed the fraction `gain`. */
enum { PASSES = 8 };
static const double first_step = 0.4, last_step = 0.02, gain = 1e-3;
/* Sine of the angle up to which triangles lie in one plane. */
static const double plane = 1e-9;

typedef struct smoothing {
  const flesh_mesh *mesh;
  double *x;         /* [3*nodes] */
  uint8_t *held;     /* [nodes] 1: the node stays in place */
  uint8_t *settled;  /* [nodes] 1: no better place was found since a tet around the node changed */
  double *normals;   /* [nodes][2][3] normals, orthogonal or 0, of the planes in which a node of the surface slides */
  int *first, *star; /* the tets of corner n are star[k] for first[n] <= k < first[n + 1] */
} smoothing;

static double ratio_of(const smoothing *s, int tet) { return flesh_radius_ratio(s->x, s->mesh->tet_nodes + 4 * (size_t)tet); }

/* Returns the least radius ratio around a node, or the first that is below the bound. */
static double worst_around(const smoothing *s, int n, double bound)
{
  double worst = INFINITY;
  for (int k = s->first[n]; k < s->first[n + 1] && !(worst < bound); k++) worst = fmin(worst, ratio_of(s, s->star[k]));
  return worst;
}

/* Removes the components along the node's normals from a vector. */
static void project(const smoothing *s, int n, double vector[3])
{
  for (int k = 0; k < 2; k++) {
    const double *normal = s->normals + 6 * (size_t)n + 3 * (size_t)k, along = flesh_vec3_dot(normal, vector);
    for (int d = 0; d < 3; d++) vector[d] -= along * normal[d];
  }
}

/* Gives one of 27 directions, projected to the node's plane or edge if it is on the surface, with length 1 or 0. */
static void find_way(const smoothing *s, int n, int number, double way[3])
{
  for (int d = 0, power = 1; d < 3; d++, power *= 3) way[d] = number / power % 3 - 1;
  project(s, n, way);
  const double length = sqrt(flesh_vec3_dot(way, way));
  for (int d = 0; d < 3; d++) way[d] = length > plane ? way[d] / length : 0;
}

/* Searches around the node for a better place. Returns whether the node has moved. */
static int move(smoothing *s, int n, double least)
{
  double *at = s->x + 3 * (size_t)n, best = worst_around(s, n, -INFINITY), size = 0;
  const double given = best;
  for (int k = s->first[n]; k < s->first[n + 1]; k++) size += s->mesh->volumes[s->star[k]];
  size = cbrt(6 * size / (s->first[n + 1] - s->first[n]));
  for (double step = first_step; step >= last_step && best < least;) {
    double from[3], to[3], found = best;
    memcpy(from, at, sizeof from);
    for (int number = 0; number < 27; number++) {
      double way[3];
      find_way(s, n, number, way);
      for (int d = 0; d < 3; d++) at[d] = from[d] + step * size * way[d];
      const double wanted = found + gain * fabs(found), worst = worst_around(s, n, wanted);
      if (worst > wanted) found = worst, memcpy(to, at, sizeof to);
    }
    memcpy(at, found > best ? to : from, sizeof from);
    if (found > best) best = found;
    else step /= 2;
  }
  for (int k = s->first[n]; k < s->first[n + 1] && best > given; k++)
    for (int a = 0; a < 4; a++) s->settled[s->mesh->tet_nodes[4 * (size_t)s->star[k] + (size_t)a]] = 0;
  s->settled[n] = 1;
  return best > given;
}

/* Holds corners between tets of different kinds. */
static void hold_between(smoothing *s, const int *kinds)
{
  for (int n = 0; n < s->mesh->nodes; n++)
    for (int k = s->first[n] + 1; k < s->first[n + 1]; k++)
      s->held[n] |= kinds[s->star[k]] != kinds[s->star[s->first[n]]];
}

static int is_outer(const smoothing *s, int n)
{
  const double *normal = s->normals + 6 * (size_t)n;
  return flesh_vec3_dot(normal, normal) > 0;
}

/* Computes the unit normal of a triangle of the surface. */
static void find_normal(const smoothing *s, int triangle, double normal[3])
{
  flesh_area_vector_at(s->mesh->positions, s->mesh->surface + 3 * (size_t)triangle, normal);
  const double length = sqrt(flesh_vec3_dot(normal, normal));
  for (int d = 0; d < 3; d++) normal[d] /= length;
}

/* Bits of a node: IN, it is in the set; WHOLE and PART, some triangle around it in its first plane has all its nodes in
 * the set, or not all. Bits of the second plane are SECOND times those. */
enum { IN = 1, WHOLE = 2, PART = 4, SECOND = 4 };

static void note_triangle(const smoothing *s, int triangle, int *known)
{
  const int *nodes = s->mesh->surface + 3 * (size_t)triangle;
  const int kind = known[nodes[0]] & known[nodes[1]] & known[nodes[2]] & IN ? WHOLE : PART;
  double normal[3];
  find_normal(s, triangle, normal);
  for (int a = 0; a < 3; a++)
    known[nodes[a]] |= fabs(flesh_vec3_dot(s->normals + 6 * (size_t)nodes[a] + 3, normal)) > plane ? SECOND * kind : kind;
}

/* Holds the inner nodes of a tet that are in a set, unless the set has all corners of the tet. */
static void hold_in_tet(smoothing *s, const int *known, const int *nodes)
{
  const int all = known[nodes[0]] & known[nodes[1]] & known[nodes[2]] & known[nodes[3]] & IN;
  for (int a = 0; a < 4 && !all; a++) s->held[nodes[a]] |= known[nodes[a]] & IN && !is_outer(s, nodes[a]);
}

/* Holds nodes whose motion would change the region of a set. An inner node may move if all tets around it are in the
 * set; a node of the surface if in each of its planes all triangles around it are, or none, as at a straight edge where
 * the set ends. */
static void hold_set(smoothing *s, const flesh_mesh_set *set, int *known)
{
  const flesh_mesh *mesh = s->mesh;
  const size_t most = (size_t)(mesh->nodes > mesh->tets ? mesh->nodes : mesh->tets);
  memset(known, 0, most * sizeof *known);
  for (int k = 0; k < set->nodes.count; k++) known[set->nodes.values[k]] = IN;
  for (int k = 0; k < mesh->triangles && set->nodes.count; k++) note_triangle(s, k, known);
  for (int k = 0; k < set->nodes.count; k++) {
    const int n = set->nodes.values[k], first = known[n] & (WHOLE | PART), second = known[n] / SECOND & (WHOLE | PART);
    const int mixed = first == (WHOLE | PART) || second == (WHOLE | PART);
    s->held[n] |= is_outer(s, n) && (mixed || !((first | second) & WHOLE));
  }
  for (int t = 0; t < mesh->tets && set->nodes.count; t++) hold_in_tet(s, known, mesh->tet_nodes + 4 * (size_t)t);
  memset(known, 0, most * sizeof *known);
  for (int k = 0; k < set->tets.count; k++) known[set->tets.values[k]] = 1;
  if (set->tets.count) hold_between(s, known);
}

/* Adds the plane of a triangle to those of a node; a third plane holds the node. */
static void add_plane(smoothing *s, int n, const double normal[3])
{
  double own[3];
  memcpy(own, normal, sizeof own);
  project(s, n, own);
  const double length = sqrt(flesh_vec3_dot(own, own));
  double *first = s->normals + 6 * (size_t)n, *to = is_outer(s, n) ? first + 3 : first;
  if (length <= plane) return;
  if (flesh_vec3_dot(to, to) > 0) s->held[n] = 1;
  else for (int d = 0; d < 3; d++) to[d] = own[d] / length;
}

/* Lets nodes of the surface slide in a plane, or along the edge between two. */
static void hold_surface(smoothing *s)
{
  for (int k = 0; k < s->mesh->triangles; k++) {
    double normal[3];
    find_normal(s, k, normal);
    for (int a = 0; a < 3; a++) add_plane(s, s->mesh->surface[3 * (size_t)k + (size_t)a], normal);
  }
}

static int hold(smoothing *s)
{
  const flesh_mesh *mesh = s->mesh;
  int *known = flesh_malloc((size_t)(mesh->nodes + mesh->tets) * sizeof *known);
  if (!known) return flesh_fail(FLESH_ERR_MEMORY, "out of memory to smooth a mesh of %d tets", mesh->tets);
  hold_surface(s);
  for (int k = 0; k < 4 * mesh->tets; k++) s->held[mesh->tet_nodes[k]] |= mesh->curved[k / 4];
  hold_between(s, mesh->regions);
  for (int c = 0; c < mesh->sets.count; c++) hold_set(s, &mesh->sets.sets[c], known);
  flesh_free(known);
  return FLESH_OK;
}

static void find_stars(smoothing *s)
{
  const flesh_mesh *mesh = s->mesh;
  const int *nodes = mesh->tet_nodes, all = 4 * mesh->tets;
  for (int k = 0; k < all; k++) s->first[nodes[k] + 2]++;
  for (int n = 0; n < mesh->nodes; n++) s->first[n + 2] += s->first[n + 1];
  for (int k = 0; k < all; k++) s->star[s->first[nodes[k] + 1]++] = k / 4;
}

static int move_all(smoothing *s, double least)
{
  const flesh_mesh *mesh = s->mesh;
  int status = FLESH_OK;
  for (int pass = 0, moved = 1; pass < PASSES && moved && !status; pass++) {
    moved = 0;
    for (int t = 0; t < mesh->tets && !status; t++) {
      status = flesh_stop_ask_at((size_t)t);
      for (int a = 0; a < 4 && ratio_of(s, t) < least; a++) {
        const int n = mesh->tet_nodes[4 * (size_t)t + (size_t)a];
        if (!s->held[n] && !s->settled[n]) moved |= move(s, n, least);
      }
    }
  }
  /* Nodes on edges whose ends have moved; these edges are straight. */
  for (int k = 0; mesh->edge_nodes && k < 6 * mesh->tets; k++) {
    const int *corners = mesh->tet_nodes + 4 * (size_t)(k / 6), *ends = flesh_edge_corners[k % 6];
    const int a = corners[ends[0]], b = corners[ends[1]], middle = mesh->edge_nodes[k];
    for (int d = 0; d < 3 && middle >= 0 && !(s->held[a] && s->held[b]); d++)
      s->x[3 * (size_t)middle + (size_t)d] = s->x[3 * (size_t)a + (size_t)d] / 2 + s->x[3 * (size_t)b + (size_t)d] / 2;
  }
  return status;
}

int flesh_mesh_smooth(const flesh_mesh *mesh, double least, flesh_mesh **smoothed)
{
  const size_t nodes = (size_t)mesh->nodes, tets = (size_t)mesh->tets, marks = mesh->marks ? tets * sizeof *mesh->marks : 0;
  smoothing s = {.mesh = mesh, .x = flesh_malloc(3 * nodes * sizeof(double)), .held = flesh_calloc(nodes, 1),
                 .settled = flesh_calloc(nodes, 1),
                 .normals = flesh_calloc(6 * nodes, sizeof(double)),
                 .first = flesh_calloc(nodes + 2, sizeof(int)), .star = flesh_malloc(4 * tets * sizeof(int))};
  int status = s.x && s.held && s.settled && s.normals && s.first && s.star ? FLESH_OK
               : flesh_fail(FLESH_ERR_MEMORY, "out of memory to smooth a mesh of %d tets", mesh->tets);
  *smoothed = NULL;
  if (!status) {
    memcpy(s.x, mesh->positions, 3 * nodes * sizeof *s.x);
    find_stars(&s);
    status = hold(&s);
  }
  if (!status) status = move_all(&s, least);
  if (!status)
    status = flesh_mesh_build(&(flesh_mesh_lists){.nodes = mesh->nodes, .tets = mesh->tets, .positions = s.x,
                                                  .tet_nodes = mesh->tet_nodes, .edge_nodes = mesh->edge_nodes,
                                                  .regions = mesh->regions, .sets = &mesh->sets}, NULL, smoothed);
  if (!status && marks) {
    (*smoothed)->marks = flesh_malloc(marks);
    if ((*smoothed)->marks) memcpy((*smoothed)->marks, mesh->marks, marks);
    else status = flesh_fail(FLESH_ERR_MEMORY, "out of memory to smooth a mesh of %d tets", mesh->tets);
  }
  if (status) flesh_mesh_destroy(smoothed);
  flesh_free(s.x);
  flesh_free(s.held);
  flesh_free(s.settled);
  flesh_free(s.normals);
  flesh_free(s.first);
  flesh_free(s.star);
  return status;
}
