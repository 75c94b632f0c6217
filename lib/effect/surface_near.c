/* surface_near.c: a run's cache of surfaces near each other: pairs are searched for again when nodes have moved too
 * far. Also finds the nodes that the Jacobian couples. */
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/team.h"
#include "effect/environment.h"
#include "effect/surface_contact.h"
#include "geometry/continuous_collision.h"
#include "linear/block_matrix.h"

typedef flesh_surface_near near;

/* Fraction of the distance of two features that a step must leave; below it the barrier takes over. */
static const double KEPT = 0.1;

/* Least first portion of a long path that is searched in portions; otherwise the first portion is about an edge
 * long. */
static const double SHORTEST = 1e-6;

/* Distance beyond the reach of forces, over the slack, within which K couples nodes before they touch. With 1, twenty
 * thousand more blocks make each iteration on two slabs (contact_cost.sh) dearer, with 1/4 patterns grow more often. */
static const double COUPLED = 0.5;

int flesh_surface_near_create(const flesh_surface_contact *contact, flesh_threads *threads, near **result)
{
  const size_t places = 3 * (size_t)contact->surface.mesh_nodes;
  const double *X = flesh_mesh_positions(contact->mesh);
  near *self = *result = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the neighbours of %d nodes", contact->surface.node_count);
  self->contact = contact;
  self->threads = threads;
  self->t_apart = NAN;
  self->x_set = calloc(FLESH_SURFACE_PLACES * places + 1, sizeof *self->x_set);
  int status = self->x_set ? flesh_surface_near_runs_create(self)
                           : flesh_fail(FLESH_ERR_MEMORY, "no memory for the neighbours of %d nodes",
                                        contact->surface.node_count);
  if (!status) {
    double **next[] = {&self->x_friction, &self->x_secant, &self->x_predicted, &self->x_static, &self->since[0].x,
                        &self->since[1].x, &self->x_shown, &self->x_close, &self->x_patches, &self->moved,
                        &self->touching[0].x, &self->touching[1].x};
    for (size_t k = 0; k < sizeof next / sizeof next[0]; k++) *next[k] = self->x_set + (k + 1) * places;
    status = flesh_contact_secant_create(&contact->surface, &self->secant);
  }
  if (!status) status = flesh_contact_set_create(&contact->surface, X, &contact->law, &self->set);
  self->set.own = contact->own;
  if (!status)
    status = flesh_near_finder_create(&contact->surface, X, contact->may_meet, contact->law.thickness, threads,
                                      &self->finder);
  if (!status) status = flesh_surface_release_create(self);
  if (!status && contact->own < INT_MAX && !contact->adaptive)
    status = flesh_near_finder_restrict(self->finder, contact->own);
  if (!status && contact->separates) status = flesh_contact_patches_create(&contact->surface, &self->patches);
  if (!status) return FLESH_OK;
  flesh_surface_near_destroy(self);
  *result = NULL;
  return status;
}

void flesh_surface_near_destroy(void *data)
{
  near *self = data;
  if (!self) return;
  flesh_near_finder_destroy(&self->finder);
  flesh_near_pairs_clear(&self->static_pairs);
  flesh_near_pairs_clear(&self->close_pairs);
  flesh_near_pairs_clear(&self->swept_pairs);
  flesh_near_drift_clear(&self->drift);
  flesh_contact_set_clear(&self->set);
  flesh_contact_friction_clear(&self->friction);
  flesh_contact_secant_clear(&self->secant);
  flesh_contact_patches_clear(&self->patches);
  free(self->runs);
  free(self->piece);
  free(self->bonded);
  free(self->seats);
  free(self->x_set); /* the other positions share this allocation */
  free(self->cell_nodes);
  free(self->hessians);
  free(self->guards);
  free(self);
}

void flesh_surface_near_take(near *self, const double *internal)
{
  flesh_surface_near_harden(self, internal);
  flesh_surface_near_let_go(self, internal);
}

int flesh_surface_near_of(const flesh_effect *effect, const flesh_point *point, near **result, int *own)
{
  *own = !flesh_point_near(point);
  *result = flesh_point_near(point);
  int changed, status = *own ? flesh_surface_near_create(effect->data, point->threads, result) : FLESH_OK;
  if (!status) flesh_surface_near_take(*result, point->internal);
  if (!status && *own && (*result)->contact->separates)
    status = flesh_surface_near_follow(*result, 0, point->lagged.t, point->lagged.x, &changed);
  return status;
}

static size_t size_of_places(const near *self) { return 3 * (size_t)self->contact->surface.mesh_nodes * sizeof(double); }

void flesh_surface_near_keep(const near *self, const double *x, double *places) { memcpy(places, x, size_of_places(self)); }

int flesh_surface_near_is_at(const near *self, const double *x, const double *places)
{
  return !memcmp(places, x, size_of_places(self));
}

void flesh_surface_near_forget(near *self)
{
  self->static_known = self->set_known = self->friction_known = self->secant_known = 0;
  self->touching[0].known = self->touching[1].known = 0;
}

static int search_static_pairs(near *self, const double *x)
{
  const flesh_surface_contact *contact = self->contact;
  self->static_known = self->close_known = self->room_known = 0;
  self->shown = 0;
  /* two nodes may both come nearer by the slack */
  int status = flesh_near_pairs_find(self->finder, x, NULL, contact->law.thickness + 2 * contact->slack, self->threads,
                                     &self->static_pairs);
  self->static_known = !status;
  self->since[0].known = self->since[1].known = 0;
  if (status) return status;
  flesh_surface_near_keep(self, x, self->x_static);
  flesh_surface_near_group(self);
  return FLESH_OK;
}

static int keep_gaps(void *memory, const flesh_team *team, const double *internal, const double *x_from, double *x)
{
  near *self = memory;
  flesh_surface_near_take(self, internal);
  const double touching = self->contact->law.thickness, within = touching + self->contact->slack;
  int status = FLESH_OK;
  if (!flesh_surface_near_is_valid(self, x_from, self->static_pairs.point_count ? within : touching))
    status = search_static_pairs(self, x_from);
  return flesh_surface_near_keep_gaps(self, team, status, within, x_from, x);
}

static flesh_contact_candidates candidates_of(const flesh_near_pairs *pairs)
{
  return (flesh_contact_candidates){pairs->point_count, pairs->point_faces, pairs->edge_count, pairs->edge_pairs};
}

int flesh_surface_near_update_pairs(near *self, const double *x)
{
  if (self->set_known && flesh_surface_near_is_at(self, x, self->x_set)) return FLESH_OK;
  self->set_known = 0;
  const flesh_contact_law *law = &self->contact->law;
  const flesh_near_pairs *pairs = flesh_surface_near_pairs_at(self, x, law->thickness, law->edge_thickness);
  int status = pairs ? FLESH_OK : search_static_pairs(self, x);
  if (status) return status;
  if (!pairs) pairs = flesh_surface_near_pairs_at(self, x, law->thickness, law->edge_thickness);
  const flesh_contact_candidates candidates = candidates_of(pairs ? pairs : &self->static_pairs);
  status = flesh_contact_set_update(&self->set, &candidates, x, self->threads);
  if (status) return status;
  flesh_surface_near_keep(self, x, self->x_set);
  self->set_known = 1;
  return FLESH_OK;
}

int flesh_surface_near_update_friction(near *self, const flesh_point *point)
{
  if (!(self->contact->friction > 0)) return FLESH_OK;
  if (self->friction_known && flesh_surface_near_is_at(self, point->lagged.x, self->x_friction)) return FLESH_OK;
  self->friction_known = 0;
  int status = flesh_surface_near_update_pairs(self, point->lagged.x);
  if (status) return status;
  self->friction.coefficient = self->contact->friction;
  self->friction.slip_speed = self->contact->slip_speed;
  status = flesh_contact_friction_update(&self->friction, &self->set, point->lagged.x);
  if (status) return status;
  flesh_surface_near_keep(self, point->lagged.x, self->x_friction);
  self->friction_known = 1;
  return FLESH_OK;
}

int flesh_surface_near_expect(near *self, const flesh_point *point)
{
  const int predicted = !flesh_environment_of(point)->tangents && self->secant_known &&
                        flesh_surface_near_is_at(self, point->x, self->x_predicted) &&
                        flesh_surface_near_is_at(self, point->lagged.x, self->x_secant);
  flesh_contact_secant_apply(predicted ? &self->secant : NULL, &self->set);
  return predicted ? self->secant.updates : 0;
}

int flesh_surface_near_reserve(near *self, int hessians)
{
  const size_t numbers = 144 * (size_t)hessians;
  if (numbers <= self->hessian_room) return FLESH_OK;
  double *grown = realloc(self->hessians, 2 * numbers * sizeof *grown);
  if (!grown) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the Hessians of %d pairs", hessians);
  self->hessians = grown;
  self->hessian_room = 2 * numbers;
  return FLESH_OK;
}

/* Whether K has the blocks of all pairs of these nodes. */
static int has_blocks(const flesh_block_matrix *K, int count, const int *nodes)
{
  for (int a = 0; a < count; a++)
    for (int b = a + 1; b < count; b++) {
      const int low = nodes[a] < nodes[b] ? nodes[a] : nodes[b], high = nodes[a] < nodes[b] ? nodes[b] : nodes[a];
      if (flesh_block_find(K, low, high) < 0) return 0;
    }
  return 1;
}

static int create(const flesh_effect *effect, flesh_threads *threads, void **memory)
{
  return flesh_surface_near_create(effect->data, threads, (near **)memory);
}

/* Whether K has the blocks of all pairs that the Jacobian couples at the point. */
static int covers(near *self, const flesh_point *point, const flesh_block_matrix *K)
{
  if (flesh_surface_near_update_friction(self, point) || flesh_surface_near_update_pairs(self, point->x)) return 1; /* the
                                                                                                                     * effect
                                                                                                                     * is
                                                                                                                     * undefined
                                                                                                                     * here */
  for (int k = 0; k < self->set.count; k++)
    if (flesh_contact_set_owns(&self->set, &self->set.pairs[k]) &&
        !has_blocks(K, flesh_contact_kind_nodes(self->set.pairs[k].kind), self->set.pairs[k].nodes))
      return 0;
  for (int k = 0; k < self->friction.count; k++)
    if (!has_blocks(K, 4, self->friction.pairs[k].nodes)) return 0;
  for (int k = 0; k < self->seat_count; k++)
    if (!has_blocks(K, 4, self->seats[k].nodes)) return 0;
  return 1;
}

static void predict(const flesh_effect *effect, const flesh_point *point)
{
  near *self = flesh_point_near(point);
  (void)effect;
  flesh_surface_near_take(self, point->internal);
  if (flesh_surface_near_update_pairs(self, point->x)) return;
  if (!self->secant_known || !flesh_surface_near_is_at(self, point->lagged.x, self->x_secant)) {
    flesh_contact_secant_forget(&self->secant);
    flesh_surface_near_keep(self, point->lagged.x, self->x_secant);
    self->secant_known = 1;
  } else if (flesh_surface_near_is_at(self, point->x, self->x_predicted)) return;
  flesh_contact_secant_predict(&self->secant, &self->set, point->lagged.x);
  flesh_surface_near_keep(self, point->x, self->x_predicted);
}

/* Adds a cell of these nodes, ascending and padded with the last one. */
static void add_cell(near *self, int count, const int *nodes)
{
  int *cell = self->cell_nodes + 4 * (size_t)self->cells.count++;
  for (int a = 0; a < count; a++) {
    int place = a;
    for (; place > 0 && cell[place - 1] > nodes[a]; place--) cell[place] = cell[place - 1];
    cell[place] = nodes[a];
  }
  for (int a = count; a < 4; a++) cell[a] = cell[count - 1];
}

/* Adds the pairs that are near enough to touch, probably, before the pattern changes for another reason. They depend
 * only on the nodes' positions, so that a resumed run has the same pattern. */
static void add_candidates(near *self, const double *x)
{
  const flesh_surface_contact *contact = self->contact;
  const flesh_contact_surface *surface = &contact->surface;
  const flesh_contact_candidates all = candidates_of(&self->static_pairs), *candidates = &all;
  const double early = COUPLED * contact->slack;
  const double points = contact->law.thickness + early, edges = contact->law.edge_thickness + early;
  for (int k = 0; k < candidates->point_count; k++) {
    const int *of = candidates->point_faces + 2 * (size_t)k, *corner = surface->faces + 3 * (size_t)of[1];
    const int nodes[4] = {surface->nodes[of[0]], corner[0], corner[1], corner[2]};
    if (nodes[0] < contact->own && !flesh_hulls_stay_apart(1, 3, nodes, x, NULL, points)) add_cell(self, 4, nodes);
  }
  for (int k = 0; k < candidates->edge_count; k++) {
    const int *of = candidates->edge_pairs + 2 * (size_t)k, *a = surface->edges + 2 * (size_t)of[0],
              *b = surface->edges + 2 * (size_t)of[1];
    const int nodes[4] = {a[0], a[1], b[0], b[1]};
    if (nodes[0] < contact->own && !flesh_hulls_stay_apart(2, 2, nodes, x, NULL, edges)) add_cell(self, 4, nodes);
  }
}

static int coupled(const flesh_effect *effect, const flesh_point *point, const flesh_block_matrix *K,
                   const flesh_cells **cells)
{
  near *self = flesh_point_near(point);
  (void)effect;
  *cells = NULL;
  flesh_surface_near_take(self, point->internal);
  if (K && covers(self, point, K)) return FLESH_OK;
  int status = flesh_surface_near_update_friction(self, point);
  const double within = self->contact->law.thickness + COUPLED * self->contact->slack;
  if (!status && !flesh_surface_near_is_valid(self, point->x, within))
    status = search_static_pairs(self, point->x);
  if (status) return status;
  const int most = self->static_pairs.point_count + self->static_pairs.edge_count + self->friction.count + self->seat_count;
  if (most > self->cell_room) {
    int *grown = realloc(self->cell_nodes, 4 * (size_t)most * sizeof *grown);
    if (!grown) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d pairs that may touch", most);
    self->cell_nodes = grown;
    self->cell_room = most;
  }
  self->cells = (flesh_cells){.nodes_per_cell = 4, .nodes = self->cell_nodes, .padded = 1};
  add_candidates(self, point->x);
  for (int k = 0; k < self->friction.count; k++) add_cell(self, 4, self->friction.pairs[k].nodes);
  for (int k = 0; k < self->seat_count; k++) add_cell(self, 4, self->seats[k].nodes);
  *cells = &self->cells;
  return FLESH_OK;
}

/* Returns the feasible step by swept_pairs, for steps beyond static_pairs. A path that is long compared to the mesh is
 * searched in portions from its start, because few pairs lie on the path to the first contact. */
static double step_by_swept_pairs(near *self, const double *x_from, const double *x_to, double apart)
{
  const flesh_contact_surface *surface = &self->contact->surface;
  double portion = 1, least = 1;
  while (apart > FLESH_SURFACE_LONG * surface->mean_edge && portion * apart > surface->mean_edge && portion > SHORTEST) portion /= 2;
  for (;;) {
    double *to = self->moved;
    flesh_surface_near_without_mean(self, x_from, x_to);
    for (int k = 0; k < surface->node_count && portion < 1; k++)
      for (size_t d = 3 * (size_t)surface->nodes[k], c = 0; c < 3; c++)
        to[d + c] = x_from[d + c] + portion * (to[d + c] - x_from[d + c]);
    if (flesh_near_pairs_find(self->finder, x_from, to, 0, self->threads, &self->swept_pairs)) return 0;
    if (portion < 1) flesh_surface_near_without_mean(self, x_from, x_to);
    least = fmin(least, flesh_near_pairs_feasible_step(self->finder, &self->swept_pairs, x_from, to, KEPT, apart, self->threads));
    if (least <= portion) return least;
    portion = fmin(least, 2 * portion);
  }
}

/* Uses static_pairs, or a search at x_from if that will also be valid at x_to, or swept_pairs. Pairs more than `apart`
 * from each other cannot limit the step. */
double flesh_surface_near_feasible_step(near *self, const double *x_from, const double *x_to)
{
  if (flesh_surface_near_is_free(self, x_from, x_to)) return 1;
  const double apart = flesh_surface_near_limiting_distance(self, x_from, x_to);
  const flesh_near_pairs *pairs = flesh_surface_near_pairs_at(self, x_from, apart, apart);
  if (!pairs) {
    if (!(apart <= 2 * self->contact->slack)) return step_by_swept_pairs(self, x_from, x_to, apart);
    if (search_static_pairs(self, x_from)) return 0;
    pairs = &self->static_pairs;
  }
  const double *to = flesh_surface_near_without_mean(self, x_from, x_to);
  return flesh_near_pairs_feasible_step(self->finder, pairs, x_from, to, KEPT, apart, self->threads);
}

static double max_feasible_step(const flesh_effect *effect, void *memory, const double *internal, double t_from,
                                const double *x_from, double t_to, const double *x_to)
{
  (void)t_from, (void)t_to; /* unused: all surfaces belong to the bodies */
  near *self = memory;
  int changed;
  if (!self && flesh_surface_near_create(effect->data, NULL, &self)) return 0;
  if (!memory && self->contact->separates && flesh_surface_near_follow(self, 0, 0, x_from, &changed)) {
    flesh_surface_near_destroy(self);
    return 0;
  }
  flesh_surface_near_take(self, internal);
  const double fraction = flesh_surface_near_feasible_step(self, x_from, x_to);
  if (!memory) flesh_surface_near_destroy(self);
  return fraction;
}

static int follow(void *memory, int accepted, double t, const double *x, int *changed)
{
  return flesh_surface_near_follow(memory, accepted, t, x, changed);
}

static int archive_of(void *memory, flesh_archive *archive) { return flesh_surface_near_archive(memory, archive); }

static void separation_of(const void *memory, flesh_separation *separation)
{
  flesh_surface_near_separation(memory, separation);
}

#define BARRIER                                                                                                         \
  .max_feasible_step = max_feasible_step, .check = flesh_surface_contact_check, .remember = create,                     \
  .forget = flesh_surface_near_destroy, .coupled = coupled
const flesh_effect_barrier flesh_surface_contact_barrier = {BARRIER},
                           flesh_separating_contact_barrier = {BARRIER, .follow = follow};

static const flesh_effect_partials partials = {.couple = flesh_surface_contact_couple};

#define LIBRARY                                                                                                         \
  .evaluate = flesh_surface_contact_evaluate, .ranks = &flesh_surface_contact_ranks, .predict = predict,                \
  .is_far = flesh_surface_near_is_far, .keep_gaps = keep_gaps, .tunnelled = flesh_surface_near_tunnelled,               \
  .take_bonds = flesh_surface_contact_take_bonds, .partials = &partials
const flesh_effect_private flesh_surface_contact_private = {LIBRARY},
                           flesh_separating_contact_private = {LIBRARY, .archive = archive_of,
                                                               .separation = separation_of};
