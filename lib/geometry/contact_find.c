/* contact_find.c: finds the pairs of features that are nearer to each other than the thickness, with the weights by
 * which a signed sum over triangles, edges and nodes counts the nearest once. */
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "geometry/contact_parts.h"
#include "geometry/contact_set.h"

/* A number that is added up for everything of one key. */
typedef struct entry {
  int64_t key;
  int value;
} entry;

typedef struct entries {
  int count;
  entry *list;
} entries;

/* Rooms of a point's scratch, for each of its candidates: sides, corners, and what bears nearest points. */
enum { SIDES = 3, CORNERS = 9, FEATURES = 7, ENTRIES = SIDES + CORNERS + FEATURES };

/* What a feature's key begins with. */
enum { NODE, EDGE, FACE };

typedef struct job {
  flesh_contact_set *set;
  const flesh_contact_candidates *candidates;
  const double *x;
  int point_parts, edge_parts, most; /* candidates of a point */
  struct {
    int count, wanted, undefined;
    double squared; /* least distance */
  } found[2 * FLESH_CONTACT_PARTS];
} job;

static void push(entries *e, int64_t key, int value) { e->list[e->count++] = (entry){key, value}; }

static int64_t key_of(int type, int number) { return ((int64_t)type << 32) | number; }

/* Sorts by keys (Shell 1959, gaps of Ciura 2001) and adds up what has one key. */
static void merge(entries *e)
{
  static const int gaps[] = {701, 301, 132, 57, 23, 10, 4, 1};
  for (size_t g = 0; g < sizeof gaps / sizeof *gaps; g++)
    for (int i = gaps[g]; i < e->count; i++) {
      const entry moved = e->list[i];
      int j = i;
      for (; j >= gaps[g] && e->list[j - gaps[g]].key > moved.key; j -= gaps[g]) e->list[j] = e->list[j - gaps[g]];
      e->list[j] = moved;
    }
  int kept = 0;
  for (int i = 0; i < e->count; i++) {
    if (kept && e->list[kept - 1].key == e->list[i].key) e->list[kept - 1].value += e->list[i].value;
    else e->list[kept++] = e->list[i];
  }
  e->count = kept;
}

/* Whether the boxes around two groups of nodes are at least `reach` apart; NaN is not far. */
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

static void emit(job *j, int part, int room, size_t offset, const flesh_contact_pair *pair)
{
  const int at = j->found[part].wanted++;
  if (at >= room) return;
  j->set->pairs[offset + (size_t)at] = *pair;
  j->found[part].count = at + 1;
}

/* Whether what is at this distance squared is felt; notes where it touches. */
static int is_felt(job *j, int part, double squared)
{
  const double w = j->set->law.thickness;
  if (squared >= w * w) return 0;
  if (!(squared > 0)) j->found[part].undefined = 1;
  if (squared < j->found[part].squared) j->found[part].squared = squared;
  return 1;
}

/* The feature of a triangle that bears its nearest point, by the weights there. */
static int64_t bearer_of(const flesh_contact_surface *s, int face, const double weights[3])
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

/* The triangles near p, with their sides and corners; returns the least distance squared. */
static double list_faces(job *j, int part, int node, int begin, int end, const double p[3], entries *sides,
                         entries *corners, entries *features)
{
  const flesh_contact_surface *s = j->set->surface;
  double least = INFINITY;
  sides->count = corners->count = features->count = 0;
  for (int k = begin; k < end; k++) {
    double weights[3];
    const int face = j->candidates->point_faces[2 * k + 1], *nodes = s->faces + 3 * face;
    if (is_far(j->x, 1, &node, 3, nodes, j->set->law.thickness)) continue;
    const double squared = flesh_contact_nearest_of_triangle(p, nodes, j->x, weights);
    if (!is_felt(j, part, squared)) continue;
    least = squared < least ? squared : least;
    push(features, bearer_of(s, face, weights), 1);
    for (int c = 0; c < 3; c++) {
      push(sides, s->face_edges[3 * face + c], 1);
      push(corners, s->node_place[nodes[c]], -1);
    }
  }
  return least;
}

/* Nodes are looked at from a place beside them, so far off: features that tie, such as the sides of an edge that the node
 * is exactly above, are told apart there, the same for all of them. What is nearest there is at the same distance from
 * the node itself but for the square of what this is of it: so far nearer than the thickness the place has to be nearer,
 * too. */
static const double beside = 1e-9, far_nearer = 1e-3;

static void find_place(const double *x, double off, double p[3])
{
  static const double aside[3] = {0.5377, 0.7251, -0.4309};
  for (int c = 0; c < 3; c++) p[c] = x[c] + off * aside[c];
}

static void look(job *j, int part, int node, int begin, int end, double p[3], entries *sides, entries *corners,
                 entries *features)
{
  const double *x = j->x + 3 * (size_t)node, w = j->set->law.thickness;
  find_place(x, beside * w, p);
  if (!(list_faces(j, part, node, begin, end, p, sides, corners, features) < far_nearer * far_nearer * w * w)) return;
  const double least = list_faces(j, part, node, begin, end, x, sides, corners, features);
  find_place(x, beside / far_nearer * sqrt(least), p);
  list_faces(j, part, node, begin, end, p, sides, corners, features);
}

/* Takes edges off and puts nodes back, as often as the triangles that have been listed share them. */
static void add_edges_and_nodes(const job *j, const double p[3], entries *sides, entries *corners, entries *features)
{
  const flesh_contact_surface *s = j->set->surface;
  const double w = j->set->law.thickness;
  merge(sides);
  for (int k = 0; k < sides->count; k++) {
    const int edge = (int)sides->list[k].key, again = sides->list[k].value - 1, *ends = s->edges + 2 * edge;
    double weights[2];
    if (again == 0) continue;
    for (int c = 0; c < 2; c++) push(corners, s->node_place[ends[c]], again);
    if (flesh_contact_nearest_of_edge(p, ends, j->x, weights) >= w * w) continue;
    const int64_t bearer = weights[0] == 0   ? key_of(NODE, s->node_place[ends[1]])
                           : weights[1] == 0 ? key_of(NODE, s->node_place[ends[0]])
                                             : key_of(EDGE, edge);
    push(features, bearer, -again);
  }
  merge(corners);
  for (int k = 0; k < corners->count; k++) {
    const int place = (int)corners->list[k].key, times = 1 + corners->list[k].value;
    double squared = 0;
    if (times == 0) continue;
    for (int c = 0; c < 3; c++) {
      const double d = p[c] - j->x[3 * (size_t)s->nodes[place] + c];
      squared += d * d;
    }
    if (squared < w * w) push(features, key_of(NODE, place), times);
  }
}

static void pairs_of_point(job *j, int part, int begin, int end, entry *scratch)
{
  const flesh_contact_set *set = j->set;
  const flesh_contact_surface *s = set->surface;
  const int place = j->candidates->point_faces[2 * begin], node = s->nodes[place];
  entries sides = {0, scratch}, corners = {0, sides.list + SIDES * (size_t)j->most},
          features = {0, corners.list + CORNERS * (size_t)j->most};
  double p[3];
  look(j, part, node, begin, end, p, &sides, &corners, &features);
  if (features.count > 1) add_edges_and_nodes(j, p, &sides, &corners, &features);
  merge(&features);
  for (int k = 0; k < features.count; k++) {
    const int type = (int)(features.list[k].key >> 32), number = (int)(features.list[k].key & INT32_MAX);
    flesh_contact_pair pair = {.nodes = {node, -1, -1, -1}, .owner = place, .within = 1};
    if (features.list[k].value == 0) continue;
    pair.thickness = set->law.thickness;
    pair.weight = features.list[k].value * (set->law.stiffness * s->node_area[place] / 2);
    pair.kind = type == NODE ? FLESH_CONTACT_POINT_POINT
                             : type == EDGE ? FLESH_CONTACT_POINT_EDGE : FLESH_CONTACT_POINT_TRIANGLE;
    if (type == NODE) pair.nodes[1] = s->nodes[number];
    else memcpy(pair.nodes + 1, type == EDGE ? s->edges + 2 * number : s->faces + 3 * number,
                (size_t)(type + 1) * sizeof *pair.nodes);
    emit(j, part, set->room, (size_t)part * (size_t)set->room, &pair);
  }
}

/* The first candidate of a part of the points: all of a point are in one part. */
static int first_of_points(const job *j, int part)
{
  const int count = j->candidates->point_count, *list = j->candidates->point_faces;
  int k = flesh_contact_part(count, j->point_parts, part);
  while (k > 0 && k < count && list[2 * k] == list[2 * k - 2]) k++;
  return k;
}

static void points_of_part(job *j, int part)
{
  const int *list = j->candidates->point_faces, end = first_of_points(j, part + 1);
  entry *scratch = (entry *)j->set->scratch + (size_t)part * ENTRIES * (size_t)j->most;
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
            begin = flesh_contact_part(count, j->edge_parts, part), found = j->point_parts + part;
  const size_t offset = (size_t)j->point_parts * (size_t)set->room + (size_t)begin;
  const double w = set->law.edge_thickness;
  for (int k = begin; k < end; k++) {
    const int a = j->candidates->edge_pairs[2 * k], b = j->candidates->edge_pairs[2 * k + 1];
    const int *first = s->edges + 2 * a, *second = s->edges + 2 * b;
    flesh_contact_closest at;
    if (is_far(j->x, 2, first, 2, second, w)) continue;
    flesh_contact_pair pair = {.nodes = {first[0], first[1], second[0], second[1]}, .owner = -1, .thickness = w};
    pair.kind = FLESH_CONTACT_EDGE_EDGE;
    flesh_contact_find_closest(pair.kind, 0, pair.nodes, j->x, &at);
    if (at.distance >= w || !is_felt(j, found, at.distance * at.distance)) continue;
    pair.weight = set->law.stiffness * (s->edge_area[a] + s->edge_area[b]) / 4;
    pair.parallel = flesh_contact_parallel(set->edge_squared[a], set->edge_squared[b]);
    emit(j, found, end - begin, offset, &pair);
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

/* Room for `capacity` pairs and the scratch of the points. */
static int make_room(flesh_contact_set *set, size_t capacity, size_t scratch)
{
  if (capacity > set->capacity) {
    flesh_free(set->pairs);
    flesh_free(set->values);
    flesh_free(set->gradients);
    set->capacity = 0;
    set->pairs = flesh_malloc(capacity * sizeof *set->pairs);
    set->values = flesh_malloc(capacity * sizeof *set->values);
    set->gradients = flesh_malloc(12 * capacity * sizeof *set->gradients);
    if (set->pairs && set->values && set->gradients) set->capacity = capacity;
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

/* Brings the pairs of all parts together. */
static void gather(job *j)
{
  flesh_contact_set *set = j->set;
  for (int part = 0; part < j->point_parts + j->edge_parts; part++) {
    const int edges = part - j->point_parts;
    size_t from = (size_t)part * (size_t)set->room;
    if (edges >= 0)
      from = (size_t)j->point_parts * (size_t)set->room +
             (size_t)flesh_contact_part(j->candidates->edge_count, j->edge_parts, edges);
    memmove(set->pairs + set->count, set->pairs + from, (size_t)j->found[part].count * sizeof *set->pairs);
    set->count += j->found[part].count;
    set->distance = fmin(set->distance, sqrt(j->found[part].squared));
  }
}

/* The most candidates of a point. */
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
  const int least = candidates->point_count / j.point_parts + j.most; /* a pair for each candidate */
  if (set->room < least) set->room = least;
  for (int again = 1; again;) {
    const size_t scratch = (size_t)j.point_parts * ENTRIES * (size_t)j.most * sizeof(entry);
    int status = make_room(set, (size_t)j.point_parts * (size_t)set->room + (size_t)candidates->edge_count + 1, scratch);
    if (status) return status;
    flesh_threads_run(threads, j.point_parts + j.edge_parts, find_part, &j);
    again = 0;
    for (int part = 0; part < j.point_parts + j.edge_parts; part++) {
      if (j.found[part].undefined) return FLESH_UNDEFINED;
      if (part < j.point_parts && j.found[part].wanted > set->room) set->room = j.found[part].wanted, again = 1;
    }
  }
  gather(&j);
  return FLESH_OK;
}
