/* contact_find.c: finds the pairs of features nearer than the thickness, with the weights by which a signed sum over
 * triangles, edges and nodes counts the nearest point once. */
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "geometry/contact_parts.h"
#include "geometry/contact_set.h"

/* A key with the sum of the values added to it. Entries stay in the order in which their keys were first added. */
typedef struct entry {
  int key, value;
} entry;

typedef struct entries {
  int count;
  entry *list;
  int *table; /* [mask+1] hash table of indices into the list; -1: empty */
} entries;

/* Lists of one point: sides and corners of the triangles near it, and the features that bear their nearest points. */
enum { SIDES, CORNERS, FEATURES, LISTS };

typedef struct gathered {
  entries of[LISTS];
  unsigned mask; /* size of the hash tables minus 1 */
} gathered;

/* Room for each candidate of a point: list entries (at most 3 sides, 3 corners and 7 features) and slots of a hash
 * table. */
enum { KEYS = 13, PLACES = 16 };

/* Kind of feature, encoded in its key. */
enum { NODE, EDGE, FACE, TYPES };

typedef struct job {
  flesh_contact_set *set;
  const flesh_contact_candidates *candidates;
  const double *x;
  int point_parts, edge_parts, most; /* `most`: largest number of candidates of one point */
  struct {
    int count, wanted, undefined;
    double squared; /* squared distance of the nearest features */
  } found[2 * FLESH_CONTACT_PARTS];
} job;

static int key_of(int type, int number) { return TYPES * number + type; }

static void add(gathered *g, int list, int key, int value)
{
  entries *e = &g->of[list];
  unsigned at = ((unsigned)key * 2654435769u >> 7) & g->mask;
  for (; e->table[at] >= 0; at = (at + 1) & g->mask)
    if (e->list[e->table[at]].key == key) {
      e->list[e->table[at]].value += value;
      return;
    }
  e->table[at] = e->count;
  e->list[e->count++] = (entry){key, value};
}

/* Sets up the three lists for this number of candidates, at most `most`, in the scratch memory. */
static void open_lists(int candidates, int most, void *scratch, gathered *g)
{
  entry *list = scratch;
  int *table = (int *)(list + KEYS * (size_t)most);
  for (g->mask = 8; g->mask < 8 * (unsigned)candidates; g->mask *= 2) continue;
  for (int k = 0; k < LISTS; k++) {
    g->of[k] = (entries){0, list, table};
    list += (k < FEATURES ? 3 : 7) * (size_t)most;
    table += PLACES * (size_t)most;
  }
  g->mask--;
}

static void empty_lists(gathered *g)
{
  for (int k = 0; k < LISTS; k++) {
    g->of[k].count = 0;
    for (unsigned at = 0; at <= g->mask; at++) g->of[k].table[at] = -1;
  }
}

/* Whether the boxes around two groups of nodes are at least `reach` apart; false for NaN. */
static int is_far(const double *x, int count, const int *nodes, int others, const int *other, double reach)
{
  for (int c = 0; c < 3; c++) {
    double low = INFINITY, high = -INFINITY, other_low = INFINITY, other_high = -INFINITY, zero = 0;
    for (int a = 0; a < count; a++) {
      const double place = x[3 * (size_t)nodes[a] + c];
      low = place < low ? place : low, high = place > high ? place : high, zero += place * 0;
    }
    for (int a = 0; a < others; a++) {
      const double place = x[3 * (size_t)other[a] + c];
      other_low = place < other_low ? place : other_low, other_high = place > other_high ? place : other_high;
      zero += place * 0;
    }
    if (zero != 0) return 0;
    if (other_low - high >= reach || low - other_high >= reach) return 1;
  }
  return 0;
}

/* Index of the first pair of a part; the pairs of edges come after those of points. */
static size_t place_of_part(const job *j, int part)
{
  const size_t points = (size_t)(part < j->point_parts ? part : j->point_parts), edges = (size_t)part - points;
  return points * (size_t)j->set->room[0] + edges * (size_t)j->set->room[1];
}

/* Stores a pair; pairs beyond the room are only counted. */
static void emit(job *j, int part, const flesh_contact_pair *pair)
{
  const int at = j->found[part].wanted++;
  if (at >= j->set->room[part >= j->point_parts]) return;
  j->set->pairs[place_of_part(j, part) + (size_t)at] = *pair;
  j->found[part].count = at + 1;
}

/* Whether features at this squared distance are within the thickness. Records the least distance, and contact at
 * distance 0 as undefined. */
static int is_within_reach(job *j, int part, double squared)
{
  const double w = j->set->law.thickness;
  if (squared >= w * w) return 0;
  if (!(squared > 0)) j->found[part].undefined = 1;
  if (squared < j->found[part].squared) j->found[part].squared = squared;
  return 1;
}

/* Returns the key of the triangle's feature that bears its nearest point, given that point's weights. */
static int bearer_of(const flesh_contact_surface *s, int face, const double weights[3])
{
  int borne = 0, last = 0, empty = 0;
  for (int k = 0; k < 3; k++) {
    if (weights[k] != 0) borne++, last = k;
    else empty = k;
  }
  if (borne == 3) return key_of(FACE, face);
  if (borne == 2) return key_of(EDGE, s->face_edges[3 * face + (empty + 1) % 3]);
  return key_of(NODE, s->node_place[s->faces[3 * face + last]]);
}

/* Lists the triangles within the thickness of p, with their sides and corners. Returns the least squared distance. */
static double list_faces(job *j, int part, int node, int begin, int end, const double p[3],
                         gathered *g)
{
  const flesh_contact_surface *s = j->set->surface;
  double least = INFINITY;
  empty_lists(g);
  for (int k = begin; k < end; k++) {
    double weights[3];
    const int face = j->candidates->point_faces[2 * k + 1], *nodes = s->faces + 3 * face;
    if (is_far(j->x, 1, &node, 3, nodes, j->set->law.thickness)) continue;
    const double squared = flesh_contact_nearest_of_triangle(p, nodes, j->x, weights);
    if (!is_within_reach(j, part, squared)) continue;
    least = squared < least ? squared : least;
    add(g, FEATURES, bearer_of(s, face, weights), 1);
    for (int c = 0; c < 3; c++) {
      add(g, SIDES, s->face_edges[3 * face + c], 1);
      add(g, CORNERS, s->node_place[nodes[c]], -1);
    }
  }
  return least;
}

/* A node's neighbours are computed from a position displaced by `beside` times the thickness. This breaks ties (for
 * example the sides of an edge exactly below the node) in the same way for all features; distances change only by about
 * the square of that ratio. If a feature is nearer than `far_nearer` times the thickness, the displacement shrinks with
 * its distance. */
static const double beside = 1e-9, far_nearer = 1e-3;

static void find_place(const double *x, double off, double p[3])
{
  static const double aside[3] = {0.5377, 0.7251, -0.4309};
  for (int c = 0; c < 3; c++) p[c] = x[c] + off * aside[c];
}

static void look(job *j, int part, int node, int begin, int end, double p[3], gathered *g)
{
  const double *x = j->x + 3 * (size_t)node, w = j->set->law.thickness;
  find_place(x, beside * w, p);
  if (!(list_faces(j, part, node, begin, end, p, g) < far_nearer * far_nearer * w * w)) return;
  const double least = list_faces(j, part, node, begin, end, x, g);
  find_place(x, beside / far_nearer * sqrt(least), p);
  list_faces(j, part, node, begin, end, p, g);
}

/* Subtracts edges and adds nodes as often as the listed triangles share them. */
static void add_edges_and_nodes(const job *j, const double p[3], gathered *g)
{
  const flesh_contact_surface *s = j->set->surface;
  const double w = j->set->law.thickness;
  const entries *sides = &g->of[SIDES], *corners = &g->of[CORNERS];
  for (int k = 0; k < sides->count; k++) {
    const int edge = sides->list[k].key, again = sides->list[k].value - 1, *ends = s->edges + 2 * edge;
    double weights[2];
    if (again == 0) continue;
    for (int c = 0; c < 2; c++) add(g, CORNERS, s->node_place[ends[c]], again);
    if (flesh_contact_nearest_of_edge(p, ends, j->x, weights) >= w * w) continue;
    const int bearer = weights[0] == 0   ? key_of(NODE, s->node_place[ends[1]])
                       : weights[1] == 0 ? key_of(NODE, s->node_place[ends[0]])
                                         : key_of(EDGE, edge);
    add(g, FEATURES, bearer, -again);
  }
  for (int k = 0; k < corners->count; k++) {
    const int place = corners->list[k].key, times = 1 + corners->list[k].value;
    double squared = 0;
    if (times == 0) continue;
    for (int c = 0; c < 3; c++) {
      const double d = p[c] - j->x[3 * (size_t)s->nodes[place] + c];
      squared += d * d;
    }
    if (squared < w * w) add(g, FEATURES, key_of(NODE, place), times);
  }
}

/* Completes the nodes of an edge or a node by those of its first triangle among the point's candidates. */
static void add_other_nodes(const job *j, int begin, int end, flesh_contact_pair *pair)
{
  const int bearing = flesh_contact_kind_nodes(pair->kind);
  for (int k = begin, count = bearing; k < end && count < 4; k++) {
    const int *face = j->set->surface->faces + 3 * j->candidates->point_faces[2 * k + 1];
    int others[3], other = 0;
    for (int c = 0; c < 3; c++) {
      int bears = 0;
      for (int a = 1; a < bearing; a++) bears |= face[c] == pair->nodes[a];
      if (!bears) others[other++] = face[c];
    }
    if (other > 4 - bearing) continue;
    for (; count < 4; count++) pair->nodes[count] = others[count - bearing];
  }
}

static void pairs_of_point(job *j, int part, int begin, int end, void *scratch)
{
  const flesh_contact_set *set = j->set;
  const flesh_contact_surface *s = set->surface;
  const int place = j->candidates->point_faces[2 * begin], node = s->nodes[place];
  gathered g;
  double p[3];
  open_lists(end - begin, j->most, scratch, &g);
  look(j, part, node, begin, end, p, &g);
  const entries *features = &g.of[FEATURES];
  if (features->count > 0) add_edges_and_nodes(j, p, &g);
  for (int k = 0; k < features->count; k++) {
    const int type = features->list[k].key % TYPES, number = features->list[k].key / TYPES;
    flesh_contact_pair pair = {.nodes = {node, -1, -1, -1}, .owner = place, .within = 1};
    if (features->list[k].value == 0) continue;
    pair.thickness = set->law.thickness;
    pair.weight = features->list[k].value * (set->law.stiffness * s->node_area[place] / 2);
    pair.kind = type == NODE ? FLESH_CONTACT_POINT_POINT
                             : type == EDGE ? FLESH_CONTACT_POINT_EDGE : FLESH_CONTACT_POINT_TRIANGLE;
    if (type == NODE) pair.nodes[1] = s->nodes[number];
    else memcpy(pair.nodes + 1, type == EDGE ? s->edges + 2 * number : s->faces + 3 * number,
                (size_t)(type + 1) * sizeof *pair.nodes);
    add_other_nodes(j, begin, end, &pair);
    emit(j, part, &pair);
  }
}

/* Returns the first candidate of a part; all candidates of a point are in one part. */
static int first_of_points(const job *j, int part)
{
  const int count = j->candidates->point_count, *list = j->candidates->point_faces;
  int k = flesh_contact_part(count, j->point_parts, part);
  while (k > 0 && k < count && list[2 * k] == list[2 * k - 2]) k++;
  return k;
}

/* Returns the bytes of scratch of one part. */
static size_t scratch_of(int most)
{
  return (size_t)most * (KEYS * sizeof(entry) + LISTS * PLACES * sizeof(int));
}

static void points_of_part(job *j, int part)
{
  const int *list = j->candidates->point_faces, end = first_of_points(j, part + 1);
  char *scratch = (char *)j->set->scratch + (size_t)part * scratch_of(j->most);
  for (int k = first_of_points(j, part), next; k < end; k = next) {
    for (next = k + 1; next < end && list[2 * next] == list[2 * k];) next++;
    pairs_of_point(j, part, k, next, scratch);
  }
}

static void edges_of_part(job *j, int part)
{
  const flesh_contact_set *set = j->set;
  const flesh_contact_surface *s = set->surface;
  const int count = j->candidates->edge_count, end = flesh_contact_part(count, j->edge_parts, part + 1),
            found = j->point_parts + part;
  const double w = set->law.edge_thickness;
  for (int k = flesh_contact_part(count, j->edge_parts, part); k < end; k++) {
    const int a = j->candidates->edge_pairs[2 * k], b = j->candidates->edge_pairs[2 * k + 1];
    const int *first = s->edges + 2 * a, *second = s->edges + 2 * b;
    flesh_contact_closest at;
    if (is_far(j->x, 2, first, 2, second, w)) continue;
    flesh_contact_pair pair = {.nodes = {first[0], first[1], second[0], second[1]}, .owner = -1, .thickness = w};
    pair.kind = FLESH_CONTACT_EDGE_EDGE;
    flesh_contact_find_closest(pair.kind, 0, pair.nodes, j->x, &at);
    if (at.distance >= w || !is_within_reach(j, found, at.distance * at.distance)) continue;
    pair.weight = set->law.stiffness * (s->edge_area[a] + s->edge_area[b]) / 4;
    pair.parallel = flesh_contact_parallel(set->edge_squared[a], set->edge_squared[b]);
    emit(j, found, &pair);
  }
}

static void find_part(void *data, int task)
{
  job *j = data;
  j->found[task].count = j->found[task].wanted = j->found[task].undefined = 0;
  j->found[task].squared = INFINITY;
  if (task < j->point_parts) points_of_part(j, task);
  else edges_of_part(j, task - j->point_parts);
}

/* Ensures room for `capacity` pairs and for `scratch` bytes. */
static int make_room(flesh_contact_set *set, size_t capacity, size_t scratch)
{
  if (capacity > set->capacity) {
    flesh_free(set->pairs);
    set->capacity = 0;
    set->pairs = flesh_malloc(capacity * sizeof *set->pairs);
    if (set->pairs) set->capacity = capacity;
  }
  if (scratch > set->scratch_size) {
    flesh_free(set->scratch);
    set->scratch_size = 0;
    set->scratch = flesh_malloc(scratch);
    if (set->scratch) set->scratch_size = scratch;
  }
  if (capacity <= set->capacity && scratch <= set->scratch_size) return FLESH_OK;
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for the contact of %zu pairs", capacity);
}

/* Moves the pairs of all parts together and makes room for their values. */
static int gather(job *j)
{
  flesh_contact_set *set = j->set;
  for (int part = 0; part < j->point_parts + j->edge_parts; part++) {
    const size_t own = (size_t)j->found[part].count * sizeof *set->pairs;
    memmove(set->pairs + set->count, set->pairs + place_of_part(j, part), own);
    set->count += j->found[part].count;
    set->distance = fmin(set->distance, sqrt(j->found[part].squared));
  }
  if (set->count <= set->value_room) return FLESH_OK;
  const int room = set->count + set->count / 2;
  flesh_free(set->closest);
  flesh_free(set->values);
  flesh_free(set->gradients);
  set->value_room = 0;
  set->closest = flesh_malloc((size_t)room * sizeof *set->closest);
  set->values = flesh_malloc((size_t)room * sizeof *set->values);
  set->gradients = flesh_malloc(12 * (size_t)room * sizeof *set->gradients);
  if (set->closest && set->values && set->gradients) set->value_room = room;
  else set->count = 0;
  return set->value_room ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for the contact of %d pairs", room);
}

static void closest_of_part(void *data, int task)
{
  const job *j = data;
  const int count = j->set->count, parts = flesh_contact_parts(count, 32), end = flesh_contact_part(count, parts, task + 1);
  for (int k = flesh_contact_part(count, parts, task); k < end; k++) {
    const flesh_contact_pair *pair = &j->set->pairs[k];
    flesh_contact_find_closest(pair->kind, pair->within, pair->nodes, j->x, &j->set->closest[k]);
  }
}

/* Whether all parts had room for their pairs; if not, enlarges the room. */
static int had_room(const job *j)
{
  int *room = j->set->room, enough = 1;
  for (int part = 0; part < j->point_parts + j->edge_parts; part++) {
    const int edges = part >= j->point_parts, wanted = j->found[part].wanted;
    if (wanted <= room[edges]) continue;
    room[edges] = wanted + wanted / 4;
    enough = 0;
  }
  return enough;
}

/* Returns the largest number of candidates of one point. */
static int most_of_points(const flesh_contact_candidates *candidates)
{
  const int *list = candidates->point_faces;
  int most = 1;
  for (int k = 1, run = 1; k < candidates->point_count; k++) {
    run = list[2 * k] == list[2 * k - 2] ? run + 1 : 1;
    if (run > most) most = run;
  }
  return most;
}

int flesh_contact_set_update(flesh_contact_set *set, const flesh_contact_candidates *candidates, const double *x,
                             flesh_threads *threads)
{
  job j = {.set = set, .candidates = candidates, .x = x, .most = most_of_points(candidates)};
  j.point_parts = flesh_contact_parts(candidates->point_count, 64);
  j.edge_parts = flesh_contact_parts(candidates->edge_count, 64);
  set->count = 0;
  set->distance = INFINITY;
  if (!candidates->point_count && !candidates->edge_count) return FLESH_OK;
  if (!set->room[0]) set->room[0] = set->room[1] = 16;
  for (int enough = 0; !enough;) {
    const size_t scratch = (size_t)j.point_parts * scratch_of(j.most);
    const int status = make_room(set, place_of_part(&j, j.point_parts + j.edge_parts), scratch);
    if (status) return status;
    flesh_threads_run(threads, j.point_parts + j.edge_parts, find_part, &j);
    for (int part = 0; part < j.point_parts + j.edge_parts; part++)
      if (j.found[part].undefined) return FLESH_UNDEFINED;
    enough = had_room(&j);
  }
  const int status = gather(&j);
  if (!status) flesh_threads_run(threads, flesh_contact_parts(set->count, 32), closest_of_part, &j);
  return status;
}
