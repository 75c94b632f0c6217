/* untangle.c: decides when a tangle is permanent, and whether softer materials have led to a better state. */
#include "time/recovery/untangle.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/parallel_vector.h"
#include "mesh/pieces.h"
#include "system/edge_force.h"
#include "system/inertia_modulus.h"
#include "system/one_effect.h"
#include "system/ranks.h"
#include "time/recovery/lay_out.h"
#include "time/recovery/winding.h"

/* Quasi-static: inertial forces are below this share of the force that strains the average edge by its own length. */
static const double quasi_static_force = 1e-3;
/* Quasi-static, too: no edge changes its length within a step by more than this share of the mean edge, as a fine mesh
 * swings with small inertial forces. */
static const double quasi_static_displacement = 1e-3;
/* Loads above this share of that force on a node hold a tangle in place. */
static const double holding_force = 0.05;
static const double rounding_of_terms = 1e-10; /* of a potential */
/* Modulus of inertia over that of the material in the long steps of backward Euler by which a free body finds its
 * equilibrium. */
static const double inertial_fraction = 1e-6;
enum {
  VECTORS = 7,
  QUASI_STATIC_STEPS = 5, /* steps in a row, so that no turning point of a motion passes for rest */
  ATTEMPT_LIMIT = 3       /* attempts at one tangle, which loads that change meanwhile may no longer hold */
};

struct flesh_untangler {
  const flesh_system *system;
  const flesh_evaluation *evaluation;
  const flesh_team *team; /* the system's team; NULL: no ranks */
  const flesh_mesh *mesh;
  int has_inertia;
  const flesh_rigid_parts *parts;
  flesh_reserve *reserve;      /* of the winding */
  flesh_winding *winding;      /* made at the first suspicion */
  int n, own; /* unknowns, and those of nodes that the rank owns */
  int quasi_static, attempts, know_velocity;
  int may_collapse; /* stressed at rest, or began in a point or line */
  double expected;  /* time of the state that the next step starts from; NaN: none yet */
  flesh_edge_force scale;
  double *v, *a, *r, *saved, *zero; /* [n] */
  flesh_state end; /* end of the last step, with the tangle; the numbers below are of it, too */
  int multiplier_count;
  int vanished; /* A part is a point, in which form E with Poisson's ratio 0 has no more energy than at rest. */
  double phi;   /* J */
  uint8_t *fixed; /* [n] */
  uint8_t *far;   /* [n] dofs far from the tangle */
  int is_local;   /* those are more than half of the body */
};

static const unsigned elastic = FLESH_ROLE_BIT(FLESH_ROLE_ELASTICITY);
static const unsigned others =
    FLESH_ROLES_ALL & ~(FLESH_ROLE_BIT(FLESH_ROLE_ELASTICITY) | FLESH_ROLE_BIT(FLESH_ROLE_INERTIA));

/* Adds to `r` the forces that effects of these roles exert on nodes that stand still at x. */
static int forces(flesh_untangler *self, double t, const double *x, const double *multipliers, const double *internal,
                  unsigned roles)
{
  flesh_point point = flesh_point_at(t, x, self->zero, self->zero);
  point.multipliers = multipliers;
  point.internal = internal;
  return flesh_system_forces(self->system, roles, &point, self->r);
}

static double largest(const flesh_untangler *self, const double *vector)
{
  return flesh_largest(self->evaluation->threads, self->n, vector);
}

static int allocate(flesh_untangler *self)
{
  double **arrays[VECTORS] = {NULL, &self->a, &self->r, &self->saved, &self->zero, &self->end.x, &self->end.v};
  int failed = !(self->fixed = calloc((size_t)self->n + 1, 1));
  failed |= !(self->far = calloc((size_t)self->n + 1, 1));
  failed |= !(self->end.multipliers = calloc((size_t)self->multiplier_count + 1, sizeof(double)));
  failed |= !(self->v = calloc(VECTORS * (size_t)self->n + 1, sizeof(double)));
  for (int k = 1; k < VECTORS && self->v; k++) *arrays[k] = self->v + (size_t)k * (size_t)self->n;
  return failed ? flesh_fail(FLESH_ERR_MEMORY, "no memory for an untangler") : FLESH_OK;
}

int flesh_untangler_create(const flesh_evaluation *evaluation, const flesh_rigid_parts *parts,
                           flesh_untangler **untangler)
{
  const flesh_system *system = evaluation->system;
  flesh_untangler *self = *untangler = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for an untangler");
  *self = (flesh_untangler){.system = system, .evaluation = evaluation, .team = evaluation->team, .parts = parts,
                            .mesh = flesh_system_mesh(system), .n = evaluation->n, .own = evaluation->own,
                            .expected = NAN, .has_inertia = flesh_system_has_role(system, FLESH_ROLE_INERTIA),
                            .multiplier_count = flesh_system_multiplier_count(system)};
  return allocate(self);
}

int flesh_untangler_create_collective(flesh_untangler *self)
{
  const flesh_point rest = flesh_point_at(0, flesh_mesh_positions(self->mesh), self->zero, self->zero);
  const int status = flesh_system_edge_force(self->evaluation, elastic, &rest, self->v, &self->scale);
  memset(self->v, 0, (size_t)self->n * sizeof *self->v);
  self->reserve = flesh_reserve_create(flesh_winding_room(self->mesh, self->team, self->a));
  if (status || self->reserve) return status;
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for an untangler");
}

void flesh_untangler_destroy(flesh_untangler **untangler)
{
  if (!untangler || !*untangler) return;
  flesh_reserve_destroy(&(*untangler)->reserve); /* frees the winding, too */
  free((*untangler)->v); /* frees all other vectors, too */
  free((*untangler)->end.multipliers);
  free((*untangler)->fixed);
  free((*untangler)->far);
  free(*untangler);
  *untangler = NULL;
}

void flesh_untangler_before_step(flesh_untangler *self, const flesh_state *state)
{
  if (state->t == self->expected) return;
  self->expected = state->t;
  self->may_collapse =
      self->scale.stressed || !flesh_team_any(self->team, !flesh_mesh_is_flat(self->mesh, state->x));
}

/* Returns whether this rank's part moves as a rigid body within h. */
static int keeps_its_shape(const flesh_untangler *self, const flesh_state *state, double h)
{
  for (int t = 0; t < flesh_mesh_piece_count(self->mesh); t++) {
    int node[4];
    flesh_mesh_piece(self->mesh, t, node);
    for (int a = 0; a < 4; a++)
      for (int b = 0; b < a; b++) {
        int p = 3 * node[a], q = 3 * node[b];
        double now = 0, before = 0;
        for (int c = 0; c < 3; c++) {
          double d = state->x[p + c] - state->x[q + c];
          double d_before = d - h * (state->v[p + c] - state->v[q + c]);
          now += d * d;
          before += d_before * d_before;
        }
        if (!(fabs(sqrt(now) - sqrt(before)) <= quasi_static_displacement * self->scale.edge)) return 0;
      }
  }
  return 1;
}

/* Returns whether the body hardly accelerates and hardly changes its shape. */
static int is_quasi_static(flesh_untangler *self, const flesh_state *state, double h)
{
  int known = self->know_velocity;
  for (int d = 0; d < self->n; d++) {
    self->a[d] = (state->v[d] - self->v[d]) / h;
    self->v[d] = state->v[d];
  }
  self->know_velocity = 1;
  const flesh_point point = flesh_point_at(state->t, state->x, state->v, self->a);
  if (!known || !self->has_inertia ||
      flesh_system_roles_residual(self->system, FLESH_ROLE_BIT(FLESH_ROLE_INERTIA), &point, self->r))
    return 0;
  return largest(self, self->r) <= quasi_static_force * self->scale.mean &&
         !flesh_team_any(self->team, !keeps_its_shape(self, state, h));
}

/* Returns whether the body would not begin to move from rest here: a body that creeps through much damping is
 * quasi-static, but not in equilibrium. Leaves the constrained dofs in `fixed`. */
static int is_balanced(flesh_untangler *self, const flesh_state *state)
{
  flesh_system_fixed(self->system, state->t, self->fixed);
  if (forces(self, state->t, state->x, state->multipliers, state->internal, elastic | others)) return 0;
  for (int d = 0; d < self->n; d++)
    if (self->fixed[d]) self->r[d] = 0;
  return largest(self, self->r) <= 2 * quasi_static_force * self->scale.mean;
}

/* Returns whether an effect other than the material acts on a node of a tangled tet strongly enough to hold the tangle. */
static int is_held(flesh_untangler *self, const flesh_state *state, const uint8_t *tangled)
{
  int held = 0;
  if (forces(self, state->t, state->x, NULL, state->internal, others)) return 1;
  for (int t = 0; t < flesh_mesh_piece_count(self->mesh) && !held; t++) {
    int node[4];
    flesh_mesh_piece(self->mesh, t, node);
    for (int a = 0; tangled[t] && a < 4; a++)
      for (int c = 0; c < 3; c++) held |= fabs(self->r[3 * node[a] + c]) > holding_force * self->scale.mean;
  }
  return flesh_team_any(self->team, held);
}

/* Counts the tangled tets of the body, and those of this rank into *here. *collapsed: most of the body is tangled, or
 * most of the volume gone, although the material has no stress there or nothing shows how it lay. */
static double count_tangled(const flesh_untangler *self, const flesh_state *state, const uint8_t **here, int *collapsed)
{
  double sums[] = {flesh_winding_find(self->winding, state->x, here), flesh_mesh_piece_count(self->mesh),
                   flesh_mesh_volume(self->mesh, state->x),
                   flesh_mesh_volume(self->mesh, flesh_mesh_positions(self->mesh))};
  flesh_team_sum(self->team, 4, sums);
  *collapsed = self->may_collapse && (sums[0] > sums[1] / 2 || sums[2] < 0.4 * sums[3]);
  return sums[0];
}

/* Finds the potential of the body at rest there, and the size of its terms, J. */
static int potential(flesh_untangler *self, const flesh_state *state, double *phi, double *magnitude)
{
  flesh_point point = flesh_point_at(state->t, state->x, self->zero, self->zero);
  point.internal = state->internal;
  return flesh_system_potential(self->system, &point, &(flesh_shift){.x = 1}, phi, magnitude);
}

static void copy(const flesh_untangler *self, const flesh_state *from, flesh_state *to)
{
  memcpy(to->x, from->x, sizeof *to->x * (size_t)self->n);
  memcpy(to->v, from->v, sizeof *to->v * (size_t)self->n);
  if (from->multipliers && to->multipliers)
    memcpy(to->multipliers, from->multipliers, sizeof *to->multipliers * (size_t)self->multiplier_count);
}

/* Returns whether there is a tangle that only softening leads out of. */
static int find(flesh_untangler *self, const flesh_state *state)
{
  const uint8_t *tangled = NULL;
  double count = 0;
  int collapsed = 0;
  if (flesh_body_may_be_tangled(self->mesh, self->team, state->x)) {
    const int status = self->winding ? FLESH_OK : flesh_winding_create(self->mesh, self->team, &self->winding);
    if (status) return status;
    count = count_tangled(self, state, &tangled, &collapsed);
  }
  if (count == 0) self->attempts = 0;
  if (count == 0 || self->attempts == ATTEMPT_LIMIT || collapsed || !is_balanced(self, state) ||
      is_held(self, state, tangled))
    return 0;
  const int far = flesh_winding_find_far(self->mesh, self->team, tangled, self->saved, self->far);
  self->is_local = flesh_team_total(self->team, 2 * far - self->own) > 0;
  return 1;
}

/* Does what `find` does, without a request for memory; if that returns 1, remembers the end. */
static int find_from_reserve(flesh_untangler *self, flesh_state *state)
{
  double magnitude;
  flesh_reserve *before = flesh_reserve_enter(self->reserve);
  int status = find(self, state);
  flesh_reserve_enter(before);
  if (status != 1) return status;
  if (potential(self, state, &self->phi, &magnitude)) return 0;
  self->attempts++;
  copy(self, state, &self->end);
  return 1;
}

int flesh_untangler_after_step(flesh_untangler *self, flesh_state *state, double h)
{
  self->expected = state->t;
  if (h > 0) {
    self->quasi_static = is_quasi_static(self, state, h) ? self->quasi_static + 1 : 0;
    if (self->quasi_static < QUASI_STATIC_STEPS) return 0;
    self->quasi_static = 0;
  }
  return find_from_reserve(self, state);
}

void flesh_untangler_begin(flesh_untangler *self, flesh_state *state)
{
  copy(self, &self->end, state);
  self->vanished = flesh_lay_out(self->system, self->parts, self->fixed, state->t, self->end.x, self->saved, state->x);
}

const uint8_t *flesh_untangler_held(const flesh_untangler *self) { return self->is_local ? self->far : NULL; }

double flesh_untangler_long_step(const flesh_untangler *self)
{
  const double inertia = flesh_system_inertia_modulus(self->system, self->a, self->r);
  return self->scale.mean > 0 ? sqrt(inertia * self->scale.edge * self->scale.edge / (inertial_fraction * self->scale.mean)) : 0;
}

int flesh_untangler_is_still(const flesh_untangler *self, const double *u)
{
  return largest(self, u) <= quasi_static_displacement * self->scale.edge;
}

int flesh_untangler_judge(flesh_untangler *self, flesh_state *state, int solved, flesh_solve_stats *stats)
{
  double phi = INFINITY, magnitude = 0;
  int moved = 0;
  if (solved && potential(self, state, &phi, &magnitude)) phi = INFINITY;
  for (int i = 0; i < self->own / 3; i++) {
    double farthest = 0;
    for (int c = 0; c < 3; c++) farthest = fmax(farthest, fabs(state->x[3 * i + c] - self->end.x[3 * i + c]));
    moved += farthest > quasi_static_displacement * self->scale.edge;
  }
  moved = (int)flesh_team_total(self->team, moved);
  const int better = phi < self->phi - rounding_of_terms * magnitude ||
                     (phi < INFINITY && self->vanished && !flesh_body_may_be_tangled(self->mesh, self->team, state->x));
  if (!moved || !better) {
    copy(self, &self->end, state);
    return 0;
  }
  memcpy(self->v, state->v, sizeof(double) * (size_t)self->n);
  stats->untanglings++;
  stats->untangled_nodes += moved;
  return 1;
}

void flesh_untangler_archive(flesh_untangler *self, flesh_archive *archive)
{
  FLESH_ARCHIVE(archive, self->quasi_static);
  flesh_archive_int(archive, &self->attempts, 0, ATTEMPT_LIMIT);
  FLESH_ARCHIVE(archive, self->know_velocity);
  FLESH_ARCHIVE(archive, self->may_collapse);
  FLESH_ARCHIVE(archive, self->expected);
  if (self->know_velocity) flesh_archive_bytes(archive, self->v, (size_t)self->n * sizeof *self->v);
}
