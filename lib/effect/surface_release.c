/* surface_release.c: features released by broken bonds: they lie on a seat until they have come apart, then touch.
 *
 * A bonded point is HELD while all its bonds hold. When one of them breaks, it is SEATED (contact_seat.h) on the face
 * that it was held to, and, step by step, on those that it slides to. When no bond holds any more and the point is out
 * of reach of forces, in front of the faces or beyond an edge of the body, it is APART and touches everything. Edges
 * have no seat: they are APART once they are that far from each other and their nodes are APART. States change only
 * between steps, and change neither forces nor energy, except where a seat slides to a face at an angle. */
#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "effect/environment.h"
#include "effect/surface_contact.h"
#include "geometry/continuous_collision.h"
#include "math/area.h"
#include "math/mat3.h"

typedef flesh_surface_contact contact;
typedef flesh_surface_near near;

enum { POINTS, EDGES };

int flesh_surface_release_create(near *self)
{
  const flesh_near_bonds *bonds = self->contact->bonds;
  if (!bonds) return FLESH_OK;
  const size_t points = (size_t)bonds->count[POINTS], all = points + (size_t)bonds->count[EDGES];
  self->bonded = calloc(all + 1, 1);
  self->seats = malloc((points + 1) * sizeof *self->seats);
  if (!self->bonded || !self->seats) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %zu bonded features", all);
  self->finder->bonds = bonds;
  self->finder->bonded[POINTS] = self->bonded;
  self->finder->bonded[EDGES] = self->bonded + points;
  return FLESH_OK;
}

static int state_of(const flesh_near_bonds *bonds, int kind, int k, const double *internal)
{
  const double state = internal && bonds->state[kind][k] >= 0 ? internal[bonds->state[kind][k]] : FLESH_HELD;
  return state == FLESH_APART ? FLESH_APART : state == FLESH_SEATED && kind == POINTS && bonds->seat[k] >= 0 ? FLESH_SEATED : FLESH_HELD;
}

/* Returns the face that a point is seated on; a number loaded from a file may be invalid. */
static int face_of(const contact *contact, int k, const double *own)
{
  const double face = own[FLESH_POINT_FACE];
  return face >= 0 && face < contact->surface.face_count ? (int)face : contact->bonds->seat[k];
}

/* Lists the nodes of a bonded point and a face. */
static void seat_nodes(const contact *contact, int k, int face, int nodes[4])
{
  const flesh_contact_surface *s = &contact->surface;
  nodes[0] = s->nodes[contact->bonds->first[POINTS][k]];
  for (int c = 0; c < 3; c++) nodes[c + 1] = s->faces[3 * (size_t)face + (size_t)c];
}

static flesh_contact_seat seat_of(const contact *contact, int k, const double *own)
{
  const double area = contact->surface.node_area[contact->bonds->first[POINTS][k]];
  flesh_contact_seat seat = {.least = own[FLESH_POINT_LEAST],
                             .stiffness = contact->law.stiffness / contact->law.thickness * area / 2};
  seat_nodes(contact, k, face_of(contact, k, own), seat.nodes);
  return seat;
}

void flesh_surface_near_let_go(near *self, const double *internal)
{
  const flesh_near_bonds *bonds = self->contact->bonds;
  int changed = 0;
  self->seat_count = 0;
  for (int kind = 0; bonds && kind < 2; kind++)
    for (int k = 0; k < bonds->count[kind]; k++) {
      const int state = state_of(bonds, kind, k, internal);
      unsigned char *known = &self->bonded[(kind ? bonds->count[POINTS] : 0) + k];
      changed |= *known != state;
      *known = (unsigned char)state;
      if (state != FLESH_SEATED) continue;
      self->seats[self->seat_count] = seat_of(self->contact, k, internal + bonds->state[POINTS][k]);
      self->seat_count += self->seats[self->seat_count].nodes[0] < self->contact->own;
    }
  if (changed) flesh_surface_near_forget(self);
}

double flesh_surface_seats_evaluate(const near *self, const double *x, double *r)
{
  double energy = 0, g[12];
  for (int k = 0; k < self->seat_count; k++) {
    energy += flesh_contact_seat_gradient(&self->seats[k], x, r ? g : NULL);
    for (int d = 0; r && d < 12; d++) r[3 * (size_t)self->seats[k].nodes[d / 3] + (size_t)(d % 3)] += g[d];
  }
  return energy;
}

/* Returns the distance of the hulls of the first nodes and of the others. */
static double distance_of(int first, const int nodes[4], const double *x)
{
  const double *at[4];
  double unit[3];
  for (int a = 0; a < 4; a++) at[a] = x + 3 * (size_t)nodes[a];
  return flesh_hull_distance(first, 4 - first, at, unit);
}

/* Whether bonded feature k is at least `distance` away from everything it was held to. */
static int is_away(const contact *contact, int kind, int k, const double *x, double distance)
{
  const flesh_near_rows *others = &contact->bonds->others[kind];
  const int *edges = contact->surface.edges, *own = edges + 2 * (size_t)contact->bonds->first[kind][k];
  int away = 1, nodes[4];
  for (int j = others->start[k]; j < others->start[k + 1] && away; j++) {
    const int *other = edges + 2 * (size_t)others->second[j];
    if (kind == POINTS) seat_nodes(contact, k, others->second[j], nodes);
    for (int a = 0; a < 4 && kind == EDGES; a++) nodes[a] = a < 2 ? own[a] : other[a - 2];
    away = distance_of(1 + kind, nodes, x) >= distance;
  }
  return away;
}

/* Returns the number of a feature's bonds that hold. */
static int count_holding(const flesh_near_bonds *bonds, int kind, int k, const double *all_internal)
{
  const flesh_near_rows *rows = &bonds->bonds[kind];
  int hold = 0;
  for (int j = rows->start[k]; j < rows->start[k + 1]; j++) hold += all_internal[rows->second[j]] == 0;
  return hold;
}

/* Computes the unit normal of a face. */
static void normal_of(const contact *contact, int face, const double *x, double n[3])
{
  flesh_area_vector_at(x, contact->surface.faces + 3 * (size_t)face, n);
  const double length = sqrt(flesh_vec3_dot(n, n));
  for (int c = 0; c < 3; c++) n[c] /= length;
}

/* Returns the nearest of the faces around a seat that have a similar normal. A point that slides over an edge of the
 * body has left it, and is not seated on the side beyond. */
static int nearest_around(const contact *contact, int k, int seat, const double *x)
{
  const flesh_contact_surface *s = &contact->surface;
  const flesh_near_rows *around = &contact->bonds->around;
  double n[3], other[3];
  int nodes[4], best = seat;
  normal_of(contact, seat, x, n);
  seat_nodes(contact, k, seat, nodes);
  double nearest = distance_of(1, nodes, x);
  for (int c = 0; c < 3; c++) {
    const int place = s->node_place[s->faces[3 * (size_t)seat + (size_t)c]];
    for (int j = around->start[place]; j < around->start[place + 1]; j++) {
      seat_nodes(contact, k, around->second[j], nodes);
      const double distance = distance_of(1, nodes, x);
      if (!(distance < nearest)) continue;
      normal_of(contact, around->second[j], x, other);
      if (flesh_vec3_dot(n, other) < 0.5) continue;
      nearest = distance;
      best = around->second[j];
    }
  }
  return best;
}

/* Moves the seat along with a sliding point; openings gained are never given up. Returns whether the point is out of
 * reach of forces, in front of the seat or beside it. */
static int reseat(const contact *contact, int k, const double *x, double *own)
{
  int face = face_of(contact, k, own), nodes[4];
  for (int next = face, steps = 0; steps < contact->surface.face_count; steps++) {
    next = nearest_around(contact, k, face, x);
    if (next == face) break;
    face = next;
  }
  seat_nodes(contact, k, face, nodes);
  const double opening = flesh_contact_seat_opening(nodes, x), distance = distance_of(1, nodes, x);
  own[FLESH_POINT_FACE] = face;
  own[FLESH_POINT_LEAST] = fmax(own[FLESH_POINT_LEAST], fmin(opening, 0));
  return distance >= contact->law.thickness && (opening > 0 || distance > 2 * -opening);
}

static int update_point(const contact *contact, int k, const flesh_point *point, double *internal)
{
  const flesh_near_bonds *bonds = contact->bonds;
  const int state = state_of(bonds, POINTS, k, internal), rests = bonds->seat[k] >= 0;
  const int hold = count_holding(bonds, POINTS, k, flesh_environment_of(point)->all_internal);
  double *own = internal + bonds->state[POINTS][k];
  const double *x = point->x, face = own[FLESH_POINT_FACE];
  int nodes[4];
  if (state == FLESH_HELD) {
    if (hold == bonds->bonds[POINTS].start[k + 1] - bonds->bonds[POINTS].start[k]) return 0;
    if (!rests && (hold || !is_away(contact, POINTS, k, x, contact->law.thickness))) return 0;
    own[FLESH_POINT_STATE] = rests ? FLESH_SEATED : FLESH_APART;
    own[FLESH_POINT_FACE] = bonds->seat[k];
    if (rests) seat_nodes(contact, k, bonds->seat[k], nodes);
    if (rests) own[FLESH_POINT_LEAST] = flesh_contact_seat_opening(nodes, x);
    return 1;
  }
  if (state == FLESH_APART) return 0;
  const int apart = reseat(contact, k, x, own) && !hold;
  if (apart) own[FLESH_POINT_STATE] = FLESH_APART;
  return apart || own[FLESH_POINT_FACE] != face;
}

/* Whether all nodes of the edge, and of those that it was held to, are APART or not bonded. */
static int are_free(const contact *contact, int k, const double *internal)
{
  const flesh_near_bonds *bonds = contact->bonds;
  const flesh_near_rows *others = &bonds->others[EDGES];
  int are = 1;
  for (int j = others->start[k] - 1; j < others->start[k + 1] && are; j++)
    for (int end = 0; end < 2 && are; end++) {
      const int edge = j < others->start[k] ? bonds->first[EDGES][k] : others->second[j];
      const int row = bonds->row[POINTS][contact->surface.node_place[contact->surface.edges[2 * (size_t)edge + (size_t)end]]];
      are = row < 0 || state_of(bonds, POINTS, row, internal) == FLESH_APART;
    }
  return are;
}

static int update_edge(const contact *contact, int k, const flesh_point *point, double *internal)
{
  double *own = internal + contact->bonds->state[EDGES][k];
  if (*own == FLESH_APART || count_holding(contact->bonds, EDGES, k, flesh_environment_of(point)->all_internal) || !are_free(contact, k, internal) ||
      !is_away(contact, EDGES, k, point->x, contact->law.edge_thickness))
    return 0;
  *own = FLESH_APART;
  return 1;
}

int flesh_surface_contact_release(const contact *contact, const flesh_point *point, double *internal)
{
  const flesh_near_bonds *bonds = contact->bonds;
  int changed = 0;
  if (!bonds || !flesh_environment_of(point)->all_internal) return 0;
  for (int k = 0; k < bonds->count[POINTS]; k++)
    if (bonds->state[POINTS][k] >= 0) changed |= update_point(contact, k, point, internal);
  for (int k = 0; k < bonds->count[EDGES]; k++)
    if (bonds->state[EDGES][k] >= 0) changed |= update_edge(contact, k, point, internal);
  return changed;
}
