/* surface_bonds.c: finds the features of surfaces that bonds of other effects hold together.
 *
 * Two features of different connected pieces are held together if one has a node of a bond's first group, the other has
 * one of its second group, and at rest they are within the bond's gap plus the reach of forces. A node also counts as a
 * feature's if it is near the feature at rest in the same piece, as on a surface with edges shorter than the reach of
 * forces. */
#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/surface_contact.h"
#include "geometry/continuous_collision.h"

enum { POINTS, EDGES };

typedef struct numbers {
  int count, room, *list;
} numbers;

typedef struct building {
  const flesh_contact_surface *s;
  const flesh_near_finder *finder;
  const double *X;
  double distance; /* m, reach of forces */
  int bond_count;
  const flesh_bond *bonds;
  flesh_near_rows of_node[2]; /* [nodes of the surface] bonds whose first or second group has the node */
  int *mark[2], *listed;      /* [bond_count] number of the pair for which a group of the bond was last marked; number
                               * of the row that last listed it */
  int pair, rows;             /* numbers of the current pair and row, from 1 */
} building;

static int no_memory(int bonds) { return flesh_fail(FLESH_ERR_MEMORY, "no memory for the surfaces that %d welds and joints hold", bonds); }

static int push(numbers *to, int number)
{
  if (!flesh_grow(&to->list, sizeof *to->list, to->count, &to->room)) return 0;
  to->list[to->count++] = number;
  return 1;
}

static int list_bonds(building *b, int side)
{
  flesh_near_rows *rows = &b->of_node[side];
  const size_t nodes = (size_t)b->s->node_count;
  rows->start = calloc(nodes + 2, sizeof *rows->start);
  if (!rows->start) return no_memory(b->bond_count);
  for (int pass = 0; pass < 2; pass++) { /* first counts, then lists */
    for (int k = 0; k < b->bond_count; k++)
      for (int a = 0; a < b->bonds[k].count[side]; a++) {
        const int place = b->s->node_place[b->bonds[k].nodes[side][a]];
        if (place < 0) continue;
        if (pass) rows->second[rows->start[place + 1]++] = k;
        else rows->start[place + 2]++;
      }
    if (pass) continue;
    for (size_t n = 0; n < nodes; n++) rows->start[n + 2] += rows->start[n + 1];
    rows->second = malloc(((size_t)rows->start[nodes + 1] + 1) * sizeof *rows->second);
    if (!rows->second) return no_memory(b->bond_count);
  }
  return FLESH_OK;
}

static void mark_bonds(building *b, int place)
{
  for (int side = 0; side < 2; side++)
    for (int k = b->of_node[side].start[place]; k < b->of_node[side].start[place + 1]; k++)
      b->mark[side][b->of_node[side].second[k]] = b->pair;
}

/* Calls `call` for the node, and for the corners of the faces near it at rest in its piece. Returns the sum of the
 * results. */
static int call_near(building *b, int place, int (*call)(building *b, int place, void *data), void *data)
{
  const flesh_near_rows *near = &b->finder->excluded[POINTS];
  int sum = call(b, place, data);
  for (int k = near->start[place]; k < near->start[place + 1]; k++)
    for (int c = 0; c < 3; c++) sum += call(b, b->s->node_place[b->s->faces[3 * (size_t)near->second[k] + (size_t)c]], data);
  return sum;
}

static int mark_one(building *b, int place, void *data)
{
  (void)data;
  mark_bonds(b, place);
  return 0;
}

/* The bonds of one bonded feature. */
typedef struct row {
  double distance;   /* distance of the current pair at rest */
  const int *corner; /* corners of its face; NULL: it is a pair of edges */
  int bears;         /* whether the face belongs to a bond itself, rather than only lying near one */
  int number, for_good, failed;
  numbers *variables;
} row;

static int has_node(const flesh_bond *bond, int side, int node)
{
  for (int a = 0; a < bond->count[side]; a++)
    if (bond->nodes[side][a] == node) return 1;
  return 0;
}

/* Returns the number of bonds that hold a node of one feature to marked nodes of the other, and adds them to the
 * row. */
static int take_one(building *b, int place, void *data)
{
  row *r = data;
  int held = 0;
  for (int side = 0; side < 2; side++)
    for (int j = b->of_node[side].start[place]; j < b->of_node[side].start[place + 1]; j++) {
      const int k = b->of_node[side].second[j];
      if (b->mark[1 - side][k] != b->pair || !(r->distance < b->distance + b->bonds[k].gap)) continue;
      held++;
      if (r->corner && !r->bears)
        r->bears = has_node(&b->bonds[k], 1 - side, r->corner[0]) && has_node(&b->bonds[k], 1 - side, r->corner[1]) &&
                   has_node(&b->bonds[k], 1 - side, r->corner[2]);
      if (b->listed[k] == r->number) continue;
      b->listed[k] = r->number;
      if (b->bonds[k].variable < 0) r->for_good = 1;
      else r->failed |= !push(r->variables, b->bonds[k].variable);
    }
  return held;
}

/* Lists the mesh nodes of a pair's features; the first *first belong to the first one. */
static void nodes_of(const flesh_contact_surface *s, int kind, const int pair[2], int *first, int nodes[4])
{
  const int *p = s->edges + 2 * (size_t)pair[0], *q = (kind ? s->edges : s->faces) + (kind ? 2 : 3) * (size_t)pair[1];
  *first = kind ? 2 : 1;
  for (int k = 0; k < *first; k++) nodes[k] = kind ? p[k] : s->nodes[pair[0]];
  for (int k = *first; k < 4; k++) nodes[k] = q[k - *first];
}

/* Whether bonds hold the pair together. */
static int is_held(building *b, int kind, const int pair[2], row *r)
{
  const double *x[4];
  double unit[3];
  int nodes[4], first, held = 0;
  nodes_of(b->s, kind, pair, &first, nodes);
  if (b->s->node_piece[b->s->node_place[nodes[0]]] == b->s->node_piece[b->s->node_place[nodes[3]]]) return 0;
  for (int k = 0; k < 4; k++) x[k] = b->X + 3 * (size_t)nodes[k];
  r->corner = kind == POINTS ? nodes + 1 : NULL;
  r->bears = 0;
  r->distance = flesh_hull_distance(first, 4 - first, x, unit);
  b->pair++;
  for (int k = first; k < 4; k++) call_near(b, b->s->node_place[nodes[k]], mark_one, NULL);
  for (int k = 0; k < first; k++) held += call_near(b, b->s->node_place[nodes[k]], take_one, r);
  return held;
}

/* Builds the rows of one kind from ascending pairs [2*count]. */
static int make_rows(building *b, int kind, int count, const int *pairs, flesh_near_bonds *self)
{
  numbers firsts = {0}, others = {0}, starts = {0}, variables = {0}, variable_starts = {0}, seats = {0};
  int failed = !push(&starts, 0) || !push(&variable_starts, 0);
  for (int k = 0, next; k < count && !failed; k = next) {
    row r = {.number = ++b->rows, .variables = &variables};
    double nearest = INFINITY;
    int seat = -1;
    for (next = k; next < count && pairs[2 * (size_t)next] == pairs[2 * (size_t)k]; next++) {
      const int *pair = pairs + 2 * (size_t)next;
      if (!is_held(b, kind, pair, &r)) continue;
      failed |= !push(&others, pair[1]);
      if (r.bears && r.distance < nearest) nearest = r.distance, seat = pair[1];
    }
    if (r.for_good) variables.count = variable_starts.list[firsts.count];
    if (others.count == starts.list[firsts.count]) continue;
    failed |= r.failed || !push(&firsts, pairs[2 * (size_t)k]) || !push(&starts, others.count) ||
              !push(&variable_starts, variables.count) || !push(&seats, seat);
  }
  self->count[kind] = firsts.count;
  self->first[kind] = firsts.list;
  self->others[kind] = (flesh_near_rows){starts.list, others.list};
  self->bonds[kind] = (flesh_near_rows){variable_starts.list, variables.list};
  if (kind == POINTS) self->seat = seats.list;
  else free(seats.list);
  return failed ? no_memory(b->bond_count) : FLESH_OK;
}

/* Numbers the bonded features and their internal variables, the latter from `begin` on. */
static int number_rows(const flesh_contact_surface *s, int begin, flesh_near_bonds *self)
{
  self->variables = 0;
  for (int kind = 0; kind < 2; kind++) {
    const int count = self->count[kind], all = kind ? s->edge_count : s->node_count;
    self->row[kind] = malloc(((size_t)all + 1) * sizeof *self->row[kind]);
    self->state[kind] = malloc(((size_t)count + 1) * sizeof *self->state[kind]);
    if (!self->row[kind] || !self->state[kind]) return no_memory(count);
    for (int k = 0; k < all; k++) self->row[kind][k] = -1;
    for (int k = 0; k < count; k++) {
      const int breaks = self->bonds[kind].start[k + 1] > self->bonds[kind].start[k];
      self->row[kind][self->first[kind][k]] = k;
      self->state[kind][k] = breaks ? begin + self->variables : -1;
      self->variables += breaks ? (kind == POINTS ? FLESH_POINT_VARIABLES : 1) : 0;
    }
  }
  return self->variables ? flesh_contact_surface_around(s, 3, &self->around.start, &self->around.second) : FLESH_OK;
}

static int build(building *b, flesh_near_finder *finder, int begin, flesh_near_bonds *self)
{
  flesh_near_pairs pairs = {0};
  double gap = 0;
  for (int k = 0; k < b->bond_count; k++) gap = fmax(gap, b->bonds[k].gap);
  for (int side = 0; side < 2; side++) {
    const int status = list_bonds(b, side);
    b->mark[side] = calloc((size_t)b->bond_count + 1, sizeof *b->mark[side]);
    if (status) return status;
  }
  b->listed = calloc((size_t)b->bond_count + 1, sizeof *b->listed);
  if (!b->mark[0] || !b->mark[1] || !b->listed) return no_memory(b->bond_count);
  int status = flesh_near_pairs_find(finder, b->X, NULL, b->distance + gap, NULL, &pairs);
  if (!status) status = make_rows(b, POINTS, pairs.point_count, pairs.point_faces, self);
  if (!status) status = make_rows(b, EDGES, pairs.edge_count, pairs.edge_pairs, self);
  if (!status) status = number_rows(b->s, begin, self);
  flesh_near_pairs_clear(&pairs);
  return status;
}

int flesh_surface_contact_take_bonds(flesh_effect *effect, int count, const flesh_bond *bonds)
{
  flesh_surface_contact *contact = effect->data;
  flesh_surface_near *near;
  if (contact->bonded) return FLESH_OK;
  contact->bonded = 1;
  if (!count) return FLESH_OK;
  int status = flesh_surface_near_create(contact, NULL, &near);
  if (status) return status;
  building b = {.s = &contact->surface, .finder = near->finder, .X = flesh_mesh_positions(contact->mesh),
                .distance = contact->law.thickness, .bond_count = count, .bonds = bonds};
  flesh_near_bonds *made = calloc(1, sizeof *made);
  status = made ? build(&b, near->finder, contact->adaptive, made) : no_memory(count);
  contact->owns_bonds = !status && made->count[POINTS] + made->count[EDGES] > 0;
  if (contact->owns_bonds) contact->bonds = made;
  else flesh_near_bonds_destroy(made);
  for (int side = 0; side < 2; side++) {
    free(b.of_node[side].start);
    free(b.of_node[side].second);
    free(b.mark[side]);
  }
  free(b.listed);
  flesh_surface_near_destroy(near);
  return status;
}
