/* surface_contact_make.c: creates contact effects between bodies, and checks that they start apart. */
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "effect/contact.h"
#include "effect/effect.h"
#include "effect/surface_contact.h"
#include "element/body.h"
#include "geometry/surface_intersections.h"
#include "geometry/surface_winding.h"

typedef flesh_surface_contact contact;

/* Distance beyond the reach of forces within which pairs are searched for, over the mean edge at rest. A search is then
 * valid for several steps, and few neighbours in one surface, which never touch, are found. */
static const double SLACK = 0.2;

/* Returns a new array of each tet's part number; NULL: no memory. */
static int *list_parts(const flesh_body *body)
{
  int *parts = calloc((size_t)flesh_mesh_tet_count(body->mesh) + 1, sizeof *parts);
  for (int k = 0; parts && k < body->part_count; k++)
    for (int e = 0; e < body->parts[k].tets; e++) parts[body->parts[k].first_tet + e] = k;
  return parts;
}

/* Records which parts may touch, from their numbers. */
static int take_pairs(contact *self, int parts, int count, const int *pairs)
{
  if (count < 0 || (count && !pairs))
    return flesh_fail(FLESH_ERR_ARGUMENT, "pair_count is %d; pairs must be an array of as many", count);
  self->may_meet = calloc((size_t)parts * (size_t)parts + 1, 1);
  if (!self->may_meet) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d bodies that touch", parts);
  if (!pairs) memset(self->may_meet, 1, (size_t)parts * (size_t)parts);
  for (int k = 0; k < 2 * count; k += 2) {
    for (int end = 0; end < 2; end++)
      if (pairs[k + end] < 0 || pairs[k + end] >= parts)
        return flesh_fail(FLESH_ERR_ARGUMENT, "contact is asked for body %d; the bodies are 0 to %d", pairs[k + end],
                          parts - 1);
    self->may_meet[pairs[k] * parts + pairs[k + 1]] = self->may_meet[pairs[k + 1] * parts + pairs[k]] = 1;
  }
  return FLESH_OK;
}

static int make(const flesh_body *body, const flesh_contact_options *options, int count, const int *pairs, contact *self)
{
  flesh_contact_options own = *options;
  int *parts = list_parts(body), part_count = body->part_count > 0 ? body->part_count : 1;
  if (!parts) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the contact of %d tets", flesh_mesh_tet_count(body->mesh));
  self->mesh = body->mesh;
  self->part_count = body->part_count;
  self->parts = body->parts;
  int status = flesh_contact_surface_of_mesh(body->mesh, parts, &self->surface);
  free(parts);
  if (status) return status;
  self->surface.body_count = part_count; /* the last part may have no tets */
  self->own = INT_MAX;
  self->places = (flesh_cells){.count = self->surface.node_count, .nodes_per_cell = 1, .nodes = self->surface.nodes};
  if (isnan(own.stiffness)) own.stiffness = flesh_contact_body_stiffness(body);
  if (isnan(own.thickness)) own.thickness = self->surface.mean_edge / 20;
  status = flesh_contact_options_check(&own);
  if (status) return status;
  self->law = (flesh_contact_law){own.stiffness, own.thickness, FLESH_CONTACT_EDGE_THICKNESS * own.thickness};
  self->friction = own.friction;
  self->slip_speed = own.slip_speed;
  self->separates = own.separates;
  self->adaptive = own.adaptive;
  self->slack = fmax(SLACK * self->surface.mean_edge, own.thickness);
  return take_pairs(self, part_count, count, pairs);
}

/* Returns the name of a part for messages. */
static const char *name_of(const contact *self, int part)
{
  return self->part_count > 1 && self->parts[part].name ? self->parts[part].name : "the body";
}

/* Returns the number of a node for messages. */
static int number_of(const contact *self, int node) { return self->numbers ? self->numbers[node] : node; }

/* Fails with FLESH_ERR_ARGUMENT, naming the first intersection of surfaces and their number. */
static int complain(const contact *self, const flesh_surface_intersections *found)
{
  const flesh_surface_intersection *first = &found->items[0];
  const int *edge = self->surface.edges + 2 * (size_t)first->edge, *face = self->surface.faces + 3 * (size_t)first->face;
  return flesh_fail(FLESH_ERR_ARGUMENT,
                    "surfaces in contact intersect: the edge of the nodes %d and %d of %s meets the "
                    "triangle of the nodes %d, %d and %d of %s at (%g, %g, %g) m, and there are %d such places in all; "
                    "bodies with contact between them must start apart, or have intersecting: separate",
                    number_of(self, edge[0]), number_of(self, edge[1]), name_of(self, first->edge_body),
                    number_of(self, face[0]), number_of(self, face[1]), number_of(self, face[2]),
                    name_of(self, first->face_body), first->place[0], first->place[1], first->place[2], found->count);
}

int flesh_surface_contact_may_meet(const flesh_effect *effect, int a, int b)
{
  if (!flesh_is_surface_contact(effect)) return 0;
  const contact *self = effect->data;
  const int parts = self->part_count > 0 ? self->part_count : 1;
  return self->may_meet[a * parts + b];
}

/* Checks that no surface is inside out: one without intersections that winds around points just outside of it. It could
 * only turn back through itself. FLESH_ERR_ARGUMENT for the first such piece that may not pass through itself. */
static int check_sides(const contact *self, const double *x)
{
  const flesh_contact_surface *s = &self->surface;
  const int parts = self->part_count > 0 ? self->part_count : 1;
  int *piece = malloc(((size_t)s->face_count + 1) * sizeof *piece), status = FLESH_OK;
  if (!piece) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d faces", s->face_count);
  for (int f = 0; f < s->face_count; f++) piece[f] = s->node_piece[s->node_place[s->faces[3 * f]]];
  unsigned char *seen = calloc((size_t)s->mesh_nodes + 1, 1);
  if (!seen) status = flesh_fail(FLESH_ERR_MEMORY, "no memory for %d faces", s->face_count);
  for (int f = 0; f < s->face_count && !status; f++) {
    const int body = s->node_body[s->node_place[s->faces[3 * f]]], *corner = s->faces + 3 * (size_t)f;
    const double *at = x + 3 * (size_t)corner[0];
    if (seen[piece[f]] || !self->may_meet[body * parts + body]) continue;
    seen[piece[f]] = 1;
    if (!flesh_surface_winding(s, piece, piece[f], f, x)) continue;
    status = flesh_fail(FLESH_ERR_ARGUMENT,
                        "%s is inside out at the start, as at the triangle of the nodes %d, %d and %d, (%g, %g, %g) m: "
                        "contact with itself would keep it so; start it from another state, or leave out that contact",
                        name_of(self, body), number_of(self, corner[0]), number_of(self, corner[1]),
                        number_of(self, corner[2]), at[0], at[1], at[2]);
  }
  free(piece);
  free(seen);
  return status;
}

/* Checks that surfaces are not so near that the barrier would throw them apart. */
static int check_gap(const contact *self, flesh_surface_near *near, const double *x)
{
  int status = flesh_surface_near_update_pairs(near, x);
  if (status < 0 || (!status && near->set.distance > flesh_contact_least_gap * self->law.thickness)) return status;
  return flesh_fail(FLESH_ERR_ARGUMENT,
                    "surfaces in contact are %g m apart at the start, %g of the thickness: they must start farther apart",
                    near->set.distance, near->set.distance / self->law.thickness);
}

int flesh_surface_contact_check(const flesh_effect *effect, const double *internal, double t, const double *x)
{
  (void)t; /* unused: all surfaces belong to the bodies */
  const contact *self = effect->data;
  flesh_surface_near *near;
  flesh_surface_intersections found = {0};
  int status = flesh_surface_near_create(self, NULL, &near);
  if (status) return status;
  flesh_surface_near_take(near, internal);
  status = flesh_surface_intersections_find(near->finder, x, NULL, &found);
  if (!status && found.count) status = self->separates ? FLESH_OK : complain(self, &found);
  else if (!status) status = check_sides(self, x);
  if (!status && !self->separates) status = check_gap(self, near, x);
  flesh_surface_intersections_clear(&found);
  flesh_surface_near_destroy(near);
  return status;
}

int flesh_surface_contact_left_out(const flesh_effect *effect, flesh_left_out *found)
{
  const contact *self = effect->data;
  flesh_surface_near *near;
  *found = (flesh_left_out){.node = -1, .face = -1};
  if (!flesh_is_surface_contact(effect)) return FLESH_OK;
  int status = flesh_surface_near_create(self, NULL, &near);
  if (status) return status;
  status = flesh_near_finder_left_out(near->finder, flesh_mesh_positions(self->mesh), self->law.thickness, found);
  flesh_surface_near_destroy(near);
  return status;
}

int flesh_effect_surface_contact(const flesh_body *body, const flesh_contact_options *options, int pair_count,
                                 const int *pairs, flesh_effect **effect)
{
  FLESH_NEED_BODY({body, "body"}, {options, "options"});
  contact *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a contact effect");
  const int status = make(body, options, pair_count, pairs, self);
  return flesh_effect_create_after(status,
                                   self->separates ? &flesh_separating_contact_operations : &flesh_surface_contact_operations,
                                   body->mesh, self, effect);
}
