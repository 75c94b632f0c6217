/* contact_patches_find.c: finds the patches of surfaces that intersect: faces that meet, parts of a surface inside a
 * body, ignored pairs that have not come apart yet, and the surroundings of all these. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "base/memory.h"
#include "base/sort.h"
#include "geometry/contact_patches.h"
#include "geometry/continuous_collision.h"
#include "geometry/near_pairs.h"
#include "geometry/surface_intersections.h"
#include "geometry/surface_winding.h"
#include "math/area.h"
#include "math/mat3.h"

/* Two faces that intersect, or of which one lies inside the other's body. */
typedef struct link {
  int faces[2];
  double place[3];
} link;

typedef struct work {
  const flesh_near_finder *finder;
  const flesh_contact_surface *s;
  const double *x;
  int *start, *around; /* faces of surface node n: around[start[n]] to before around[start[n + 1]] */
  int *set, *region, *whole; /* [nodes] disjoint sets of nodes: patches (-1: in no patch), regions that intersect
                              * nothing, and whole surfaces */
  double *boxes;             /* [6*bodies] bounding boxes */
  unsigned char *flagged;    /* [faces] 1: the face is in a patch */
  int link_count, link_room;
  link *links;
  int key_count, *keys; /* [2*...] pairs of node sets whose patches ignore each other, ascending */
} work;

static int node_of(const work *w, int face, int corner) { return w->s->node_place[w->s->faces[3 * face + corner]]; }

/* Unites the corners of a face in `set`. */
static void join_face(const work *w, int *set, int face)
{
  for (int k = 0; k < 3; k++) {
    const int node = node_of(w, face, k);
    if (set[node] < 0) set[node] = node;
    flesh_sets_join(set, node_of(w, face, 0), node);
  }
}

/* Puts a face into a patch. Returns whether it was in none. */
static int flag(work *w, int face)
{
  if (w->flagged[face]) return 0;
  w->flagged[face] = 1;
  join_face(w, w->set, face);
  return 1;
}

static int flag_around(work *w, int node)
{
  int some = 0;
  for (int k = w->start[node]; k < w->start[node + 1]; k++) some |= flag(w, w->around[k]);
  return some;
}

static int has_corner(const work *w, int face, int mesh_node)
{
  const int *corner = w->s->faces + 3 * (size_t)face;
  return corner[0] == mesh_node || corner[1] == mesh_node || corner[2] == mesh_node;
}

static int flag_edge(work *w, int edge)
{
  const int *end = w->s->edges + 2 * (size_t)edge, node = w->s->node_place[end[0]];
  int some = 0;
  for (int k = w->start[node]; k < w->start[node + 1]; k++)
    if (has_corner(w, w->around[k], end[1])) some |= flag(w, w->around[k]);
  return some;
}

static int add_link(work *w, int a, int b, const double place[3])
{
  if (!flesh_grow(&w->links, sizeof *w->links, w->link_count, &w->link_room))
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d places where surfaces meet", w->link_count + 1);
  w->links[w->link_count++] = (link){{a, b}, {place[0], place[1], place[2]}};
  return FLESH_OK;
}

static void close_work(work *w)
{
  void *const owned[] = {w->start, w->around, w->set, w->boxes, w->flagged, w->links, w->keys};
  for (size_t k = 0; k < sizeof owned / sizeof *owned; k++) flesh_free(owned[k]);
}

static int open_work(const flesh_near_finder *finder, const double *x, work *w)
{
  const flesh_contact_surface *s = finder->surface;
  const size_t nodes = (size_t)s->node_count, faces = (size_t)s->face_count;
  *w = (work){.finder = finder, .s = s, .x = x};
  w->set = malloc((3 * nodes + 1) * sizeof *w->set);
  w->boxes = malloc((6 * (size_t)s->body_count + 1) * sizeof *w->boxes);
  w->flagged = calloc(faces + 1, 1);
  if (!w->set || !w->boxes || !w->flagged)
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for patches of %d faces", s->face_count);
  w->region = w->set + nodes;
  w->whole = w->region + nodes;
  for (size_t k = 0; k < 3 * nodes; k++) w->set[k] = -1;
  for (int f = 0; f < s->face_count; f++) join_face(w, w->whole, f);
  return flesh_contact_surface_around(s, 3, &w->start, &w->around);
}

/* Puts the faces of intersections into patches and links them. */
static int link_crossings(work *w, const flesh_surface_intersections *found)
{
  int status = FLESH_OK;
  for (int k = 0; k < found->count && !status; k++) {
    const flesh_surface_intersection *at = &found->items[k];
    flag(w, at->face);
    flag_edge(w, at->edge);
    status = add_link(w, at->edge_faces[0], at->face, at->place);
  }
  return status;
}

static void widen(double *box, const double *p)
{
  for (int c = 0; c < 3; c++) box[c] = fmin(box[c], p[c]), box[3 + c] = fmax(box[3 + c], p[c]);
}

static void empty(double *box)
{
  for (int c = 0; c < 3; c++) box[c] = INFINITY, box[3 + c] = -INFINITY;
}

static int is_within(const double *box, const double *other)
{
  for (int c = 0; c < 3; c++)
    if (box[c] < other[c] || box[3 + c] > other[3 + c]) return 0;
  return 1;
}

/* A connected part of a surface that intersects nothing, so that all of it or nothing is inside a body. */
typedef struct region {
  int face; /* its largest face, which represents it; -1: there is no region with this number */
  double area, box[6];
} region;

static void measure(const work *w, region *regions)
{
  const flesh_contact_surface *s = w->s;
  for (int n = 0; n < s->node_count; n++) {
    regions[n].face = -1;
    regions[n].area = -1;
    empty(regions[n].box);
  }
  for (int f = 0; f < s->face_count; f++) {
    if (w->flagged[f]) continue;
    region *of = &regions[flesh_set_of(w->region, node_of(w, f, 0))];
    double n[3];
    for (int k = 0; k < 3; k++) widen(of->box, w->x + 3 * (size_t)s->faces[3 * f + k]);
    flesh_area_vector_at(w->x, s->faces + 3 * (size_t)f, n);
    const double area = flesh_vec3_dot(n, n);
    if (area > of->area) of->area = area, of->face = f;
  }
}

/* Whether the whole surface that contains the face intersects the body. */
static int meets(const work *w, int crossings, int face, int body)
{
  const int whole = flesh_set_of(w->whole, node_of(w, face, 0)), *face_body = w->finder->face_body;
  for (int k = 0; k < crossings; k++)
    for (int end = 0; end < 2; end++)
      if (flesh_set_of(w->whole, node_of(w, w->links[k].faces[end], 0)) == whole &&
          face_body[w->links[k].faces[1 - end]] == body)
        return 1;
  return 0;
}

/* Records that a region is inside the body: puts its faces into a patch and, if its surface does not intersect the
 * body, all faces of the body as well. */
static int flag_region(work *w, int crossings, int root, const region *of, int body)
{
  const flesh_contact_surface *s = w->s;
  const int swallowed = !meets(w, crossings, of->face, body), whole = flesh_set_of(w->whole, node_of(w, of->face, 0));
  const double *place = w->x + 3 * (size_t)s->faces[3 * of->face];
  int status = FLESH_OK;
  for (int f = 0; f < s->face_count && !status; f++) {
    const int node = node_of(w, f, 0);
    if (w->region[node] >= 0 && flesh_set_of(w->region, node) == root && !w->flagged[f]) flag(w, f);
    if (!swallowed || w->finder->face_body[f] != body || flesh_set_of(w->whole, node) == whole) continue;
    flag(w, f);
    if (flesh_set_of(w->whole, node) == node) status = add_link(w, of->face, f, place);
  }
  return status;
}

/* Whether a region can be inside a body: it is within the body's box or, for its own body, that body overlaps
 * itself. */
static int may_be_inside(const work *w, const unsigned char *overlaps, const region *of, int body)
{
  const int own = w->finder->face_body[of->face];
  if (!flesh_near_may_meet(w->finder, own, body)) return 0;
  return own == body ? overlaps[body] : is_within(of->box, w->boxes + 6 * (size_t)body);
}

/* Finds the bodies' boxes, and which bodies may overlap themselves: those of several surfaces or with
 * self-intersections. */
static void find_overlaps(const work *w, unsigned char *overlaps)
{
  const flesh_contact_surface *s = w->s;
  const int *face_body = w->finder->face_body;
  for (int b = 0; b < s->body_count; b++) empty(w->boxes + 6 * (size_t)b);
  for (int k = 0; k < 3 * s->face_count; k++)
    widen(w->boxes + 6 * (size_t)face_body[k / 3], w->x + 3 * (size_t)s->faces[k]);
  for (int k = 0; k < w->link_count; k++)
    overlaps[face_body[w->links[k].faces[0]]] |= face_body[w->links[k].faces[0]] == face_body[w->links[k].faces[1]];
  unsigned char *seen = overlaps + s->body_count;
  for (int f = 0; f < s->face_count; f++) {
    const int node = node_of(w, f, 0);
    if (flesh_set_of(w->whole, node) != node) continue;
    overlaps[face_body[f]] |= seen[face_body[f]];
    seen[face_body[f]] = 1;
  }
}

/* Finds the regions that are inside bodies and links them. */
static int link_insides(work *w)
{
  const flesh_contact_surface *s = w->s;
  region *regions = malloc(((size_t)s->node_count + 1) * sizeof *regions);
  unsigned char *overlaps = calloc(2 * (size_t)s->body_count + 1, 1);
  const int crossings = w->link_count;
  int status = regions && overlaps ? FLESH_OK
                                   : flesh_fail(FLESH_ERR_MEMORY, "no memory for regions of %d nodes", s->node_count);
  if (!status) {
    for (int f = 0; f < s->face_count; f++)
      if (!w->flagged[f]) join_face(w, w->region, f);
    measure(w, regions);
    find_overlaps(w, overlaps);
  }
  for (int n = 0; n < s->node_count && !status; n++)
    for (int body = 0; body < s->body_count && regions[n].face >= 0 && !status; body++)
      if (may_be_inside(w, overlaps, &regions[n], body) &&
          flesh_surface_winding(s, w->finder->face_body, body, regions[n].face, w->x))
        status = flag_region(w, crossings, n, &regions[n], body);
  free(regions);
  free(overlaps);
  return status;
}

/* Lists the pairs of node sets that are linked, sorted and without duplicates. */
static void list_keys(work *w)
{
  w->key_count = 0;
  for (int k = 0; k < w->link_count; k++) {
    const int a = flesh_set_of(w->set, node_of(w, w->links[k].faces[0], 0)),
              b = flesh_set_of(w->set, node_of(w, w->links[k].faces[1], 0));
    w->keys[2 * k] = a < b ? a : b;
    w->keys[2 * k + 1] = a < b ? b : a;
  }
  flesh_sort(w->keys, (size_t)w->link_count, 2 * sizeof *w->keys, flesh_compare_two_ints);
  for (int k = 0; k < w->link_count; k++) {
    if (k && !flesh_compare_two_ints(w->keys + 2 * k, w->keys + 2 * k - 2)) continue;
    memmove(w->keys + 2 * w->key_count++, w->keys + 2 * k, 2 * sizeof *w->keys);
  }
}

/* Whether the patches of two surface nodes are linked. */
static int are_linked(const work *w, int node, int other)
{
  if (w->set[node] < 0 || w->set[other] < 0) return 0;
  const int a = flesh_set_of(w->set, node), b = flesh_set_of(w->set, other), key[2] = {a < b ? a : b, a < b ? b : a};
  return bsearch(key, w->keys, (size_t)w->key_count, sizeof key, flesh_compare_two_ints) != NULL;
}

/* Whether the hulls of the first nodes and of the others are nearer than `distance`. */
static int is_near(const work *w, int first, const int nodes[4], double distance)
{
  const double *places[4];
  double unit[3];
  for (int k = 0; k < 4; k++) places[k] = w->x + 3 * (size_t)nodes[k];
  return flesh_hull_distance(first, 4 - first, places, unit) < distance;
}

/* Whether the two hulls have nodes of linked patches and are nearer than `reach`. */
static int joins_patches(const work *w, int first, const int nodes[4], double reach)
{
  int linked = 0;
  for (int a = 0; a < first; a++)
    for (int b = first; b < 4; b++)
      linked |= are_linked(w, w->s->node_place[nodes[a]], w->s->node_place[nodes[b]]);
  return linked && is_near(w, first, nodes, reach);
}

/* Lists the nodes of a near pair: those of the point or first edge, then the others. */
static void nodes_of(const flesh_contact_surface *s, int is_point, const int pair[2], int nodes[4])
{
  if (is_point) nodes[0] = s->nodes[pair[0]];
  else memcpy(nodes, s->edges + 2 * (size_t)pair[0], 2 * sizeof *nodes);
  if (is_point) memcpy(nodes + 1, s->faces + 3 * (size_t)pair[1], 3 * sizeof *nodes);
  else memcpy(nodes + 2, s->edges + 2 * (size_t)pair[1], 2 * sizeof *nodes);
}

/* Links pairs ignored so far that are still nearer than the thickness. */
static int link_ignored(work *w, const flesh_contact_patches *before, const flesh_near_pairs *near, double thickness)
{
  const flesh_contact_surface *s = w->s;
  int status = FLESH_OK, nodes[4];
  for (int k = 0; k < near->point_count + near->edge_count && before->pair_count && !status; k++) {
    const int is_point = k < near->point_count;
    const int *of = is_point ? near->point_faces + 2 * (size_t)k : near->edge_pairs + 2 * (size_t)(k - near->point_count);
    const int a = is_point ? before->node_patch[of[0]] : before->edge_patch[of[0]],
              b = is_point ? before->face_patch[of[1]] : before->edge_patch[of[1]];
    nodes_of(s, is_point, of, nodes);
    if (a < 0 || b < 0 || flesh_contact_patches_find(before, a, b) < 0) continue;
    if (!is_near(w, is_point ? 1 : 2, nodes, thickness)) continue;
    if (is_point) flag_around(w, of[0]);
    else flag_edge(w, of[0]);
    if (is_point) flag(w, of[1]);
    else flag_edge(w, of[1]);
    status = add_link(w, is_point ? w->around[w->start[of[0]]] : s->edge_faces[2 * of[0]],
                      is_point ? of[1] : s->edge_faces[2 * of[1]], w->x + 3 * (size_t)nodes[0]);
  }
  return status;
}

/* Grows patches by the features nearer than `reach` to a patch linked with them, until nothing changes. */
static void grow(work *w, const flesh_near_pairs *near, double reach)
{
  int nodes[4];
  for (int some = 1; some;) {
    some = 0;
    list_keys(w);
    for (int k = 0; k < near->point_count; k++) {
      const int *of = near->point_faces + 2 * (size_t)k;
      nodes_of(w->s, 1, of, nodes);
      if (joins_patches(w, 1, nodes, reach)) some |= flag_around(w, of[0]) | flag(w, of[1]);
    }
    for (int k = 0; k < near->edge_count; k++) {
      const int *of = near->edge_pairs + 2 * (size_t)k;
      nodes_of(w->s, 0, of, nodes);
      if (joins_patches(w, 2, nodes, reach)) some |= flag_edge(w, of[0]) | flag_edge(w, of[1]);
    }
  }
}

/* Describes the pair of patches of these node sets, with the position of its first link. */
static flesh_patch_pair describe(const work *w, const flesh_contact_patches *self, const int key[2])
{
  flesh_patch_pair pair = {.faces = {0}};
  for (int k = w->link_count - 1; k >= 0; k--) {
    const int *faces = w->links[k].faces, a = flesh_set_of(w->set, node_of(w, faces[0], 0)),
              b = flesh_set_of(w->set, node_of(w, faces[1], 0));
    if ((a < b ? a : b) != key[0] || (a < b ? b : a) != key[1]) continue;
    for (int end = 0; end < 2; end++) {
      const int face = faces[(a > b) ^ end];
      pair.patches[end] = self->face_patch[face];
      pair.bodies[end] = w->finder->face_body[face];
    }
    memcpy(pair.place, w->links[k].place, sizeof pair.place);
  }
  for (int f = 0; f < w->s->face_count; f++)
    for (int end = 0; end < 2; end++) pair.faces[end] += self->face_patch[f] == pair.patches[end];
  return pair;
}

/* Numbers the patches by their least nodes, ascending, and lists their pairs. */
static int finish(work *w, flesh_contact_patches *self)
{
  const flesh_contact_surface *s = w->s;
  int *number = w->region;
  list_keys(w);
  const int status = flesh_contact_patches_reserve(self, w->key_count);
  if (status) return status;
  self->count = self->pair_count = 0;
  for (int n = 0; n < s->node_count; n++)
    if (w->set[n] >= 0) number[n] = flesh_set_of(w->set, n) == n ? self->count++ : number[flesh_set_of(w->set, n)];
  for (int f = 0; f < s->face_count; f++) self->face_patch[f] = w->flagged[f] ? number[node_of(w, f, 0)] : -1;
  flesh_contact_patches_label(self);
  for (int k = 0; k < w->key_count; k++) self->pairs[self->pair_count++] = describe(w, self, w->keys + 2 * k);
  return FLESH_OK;
}

int flesh_contact_patches_update(flesh_contact_patches *self, flesh_near_finder *finder, const double *x,
                                 double thickness, double reach, flesh_threads *threads)
{
  flesh_surface_intersections found = {0};
  flesh_near_pairs near = {0};
  work w;
  int status = open_work(finder, x, &w);
  if (!status) status = flesh_surface_intersections_find(finder, x, threads, &found);
  if (!status) status = link_crossings(&w, &found);
  if (!status) status = link_insides(&w);
  if (!status && (w.link_count || self->pair_count))
    status = flesh_near_pairs_find(finder, x, NULL, reach, threads, &near);
  if (!status) status = link_ignored(&w, self, &near, thickness);
  if (!status && w.link_count) {
    w.keys = malloc(2 * (size_t)w.link_count * sizeof *w.keys);
    if (!w.keys) status = flesh_fail(FLESH_ERR_MEMORY, "no memory for %d links of patches", w.link_count);
  }
  if (!status) grow(&w, &near, reach);
  if (!status) status = finish(&w, self);
  close_work(&w);
  flesh_surface_intersections_clear(&found);
  flesh_near_pairs_clear(&near);
  return status;
}
