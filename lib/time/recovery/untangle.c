/* untangle.c: when a tangle is one for good, and what is done about it. */
#include "time/recovery/untangle.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/parallel_vector.h"
#include "mesh/inspect.h"
#include "mesh/pieces.h"
#include "system/feasible_step.h"
#include "system/one_effect.h"
#include "time/recovery/winding.h"

/* Quasi-static: inertial forces are below this fraction of the force that strains the average edge by its own
 * length. */
static const double quasi_static_force = 1e-3;
/* Nor does any edge change its length by more than this fraction of the mean edge within a step: a fine
 * mesh swings with small inertial forces. */
static const double quasi_static_displacement = 1e-3;
/* Loads above this fraction of that force on one of its nodes hold a tangle in place. */
static const double holding_force = 0.05;
static const double rounding_of_terms = 1e-10; /* of a potential */
static const double vanished_fraction = 0.01;     /* of the volume at rest */
enum {
  VECTORS = 9,
  QUASI_STATIC_STEPS = 5,   /* in a row, so that no turning point of a motion passes for rest */
  ATTEMPT_LIMIT = 12, /* 2^11 layers are the whole of any mesh that fits here */
  REPETITION_LIMIT = 20 /* of a step whose potential falls, but not yet below that of the tangle */
};

struct flesh_untangler {
  const flesh_system *system;
  const flesh_mesh *mesh;
  int has_inertia;
  flesh_reserve *reserve;          /* of the winding, and of what moves nodes by it */
  flesh_winding *winding;      /* made at the first suspicion */
  int n, quasi_static, attempts, know_velocity;
  int stressed;     /* at rest */
  int may_collapse; /* stressed, or it began in a point or line */
  double expected;  /* time of the state that the next step starts from; NaN: none yet */
  double edge;      /* mean, m */
  double force;     /* that strains the average edge by its own length, N */
  double *v, *a, *r, *saved, *zero; /* [n] */
  struct {
    double *x, *v; /* [n] */
  } begin, end;    /* of the last step; the end with the tangle, and so are the numbers below */
  double t_begin, t_end;
  double *multipliers; /* [multiplier_count] of the end */
  int multiplier_count;
  int vanished; /* The body is a point, in which form E has no more energy than at rest for a ratio of 0. */
  int moved, repetitions, in_time; /* of the repositioning under trial */
  double phi, last;                /* J, of the tangle and of the last repetition */
  uint8_t *fixed; /* [n] */
};

static const unsigned elastic = FLESH_ROLE_BIT(FLESH_ROLE_ELASTICITY);
static const unsigned others =
    FLESH_ROLES_ALL & ~(FLESH_ROLE_BIT(FLESH_ROLE_ELASTICITY) | FLESH_ROLE_BIT(FLESH_ROLE_INERTIA));

/* Adds up, in `r`, what effects of these roles do to nodes that stand still at x. */
static int forces(flesh_untangler *self, double t, const double *x, const double *multipliers, unsigned roles)
{
  const flesh_point point = {.t = t, .load = 1, .x = x, .v = self->zero, .a = self->zero,
                             .x_lag = x, .v_lag = self->zero, .t_lag = t, .multipliers = multipliers};
  return flesh_system_roles_residual(self->system, roles, &point, self->r);
}

/* The force that strains the average edge by its own length: the mean size of what elasticity does
 * to nodes that a millionth of that has displaced at random. 0 without elasticity; *stressed says
 * whether there is force without displacement. */
static double force_scale(flesh_untangler *self, int *stressed)
{
  const double part = 1e-6, *X = flesh_mesh_positions(self->mesh);
  unsigned long long random = 1;
  double sum = 0;
  *stressed = 1;
  if (forces(self, 0, X, NULL, elastic)) return 0;
  memcpy(self->saved, self->r, sizeof(double) * (size_t)self->n);
  for (int d = 0; d < self->n; d++) {
    random = random * 6364136223846793005ULL + 1442695040888963407ULL; /* Knuth's, for its sign */
    self->a[d] = X[d] + part * self->edge * (random >> 63 ? 1 : -1);
  }
  if (forces(self, 0, self->a, NULL, elastic)) return 0;
  for (int d = 0; d < self->n; d++) sum += fabs(self->r[d] - self->saved[d]);
  double force = sum / self->n / part;
  *stressed = flesh_largest(NULL, self->n, self->saved) > 1e-6 * force;
  return force;
}

int flesh_untangler_create(const flesh_system *system, flesh_untangler **untangler)
{
  flesh_untangler *self = calloc(1, sizeof *self);
  *untangler = self;
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for an untangler");
  self->system = system;
  self->mesh = flesh_system_mesh(system);
  self->n = flesh_system_unknowns(system);
  self->expected = NAN;
  self->has_inertia = flesh_system_has_role(system, FLESH_ROLE_INERTIA);
  self->edge = flesh_mesh_mean_edge(self->mesh);
  self->multiplier_count = flesh_system_multiplier_count(system);
  double **arrays[] = {&self->v, &self->a, &self->r, &self->saved, &self->zero,
                       &self->begin.x, &self->begin.v, &self->end.x, &self->end.v};
  int failed = !(self->fixed = calloc((size_t)self->n + 1, 1));
  failed |= !(self->reserve = flesh_reserve_create(flesh_winding_room(self->mesh)));
  failed |= !(self->multipliers = calloc((size_t)self->multiplier_count + 1, sizeof(double)));
  for (int k = 0; k < VECTORS; k++) failed |= !(*arrays[k] = calloc((size_t)self->n + 1, sizeof(double)));
  if (!failed) {
    self->force = force_scale(self, &self->stressed);
    return FLESH_OK;
  }
  flesh_untangler_destroy(untangler);
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for an untangler");
}

void flesh_untangler_destroy(flesh_untangler **untangler)
{
  if (!untangler || !*untangler) return;
  flesh_reserve_destroy(&(*untangler)->reserve); /* and the winding with it */
  free((*untangler)->v);
  free((*untangler)->a);
  free((*untangler)->r);
  free((*untangler)->saved);
  free((*untangler)->zero);
  free((*untangler)->begin.x);
  free((*untangler)->begin.v);
  free((*untangler)->end.x);
  free((*untangler)->end.v);
  free((*untangler)->multipliers);
  free((*untangler)->fixed);
  free(*untangler);
  *untangler = NULL;
}

size_t flesh_untangler_memory(const flesh_untangler *self)
{
  return sizeof *self + (size_t)self->n * (VECTORS * sizeof(double) + 1) +
         (size_t)self->multiplier_count * sizeof(double) + flesh_reserve_most(self->reserve);
}

void flesh_untangler_before_step(flesh_untangler *self, const flesh_state *state)
{
  self->t_begin = state->t;
  memcpy(self->begin.x, state->x, sizeof(double) * (size_t)self->n);
  memcpy(self->begin.v, state->v, sizeof(double) * (size_t)self->n);
  if (state->t == self->expected) return;
  self->expected = state->t;
  self->may_collapse = self->stressed || flesh_mesh_is_flat(self->mesh, state->x);
}

/* Whether the body moves as a rigid one within h. */
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
        if (!(fabs(sqrt(now) - sqrt(before)) <= quasi_static_displacement * self->edge)) return 0;
      }
  }
  return 1;
}

/* Whether the body hardly accelerates and hardly changes. */
static int is_quasi_static(flesh_untangler *self, const flesh_state *state, double h)
{
  int known = self->know_velocity;
  for (int d = 0; d < self->n; d++) {
    self->a[d] = (state->v[d] - self->v[d]) / h;
    self->v[d] = state->v[d];
  }
  self->know_velocity = 1;
  flesh_point point = {.t = state->t, .load = 1, .x = state->x, .v = state->v, .a = self->a,
                       .x_lag = state->x, .v_lag = state->v, .t_lag = state->t};
  if (!known || !self->has_inertia ||
      flesh_system_roles_residual(self->system, FLESH_ROLE_BIT(FLESH_ROLE_INERTIA), &point, self->r))
    return 0;
  return flesh_largest(NULL, self->n, self->r) <= quasi_static_force * self->force && keeps_its_shape(self, state, h);
}

/* Whether the body would not begin to move if it stood still: what creeps through much damping is
 * quasi-static, but not in equilibrium. Leaves the constrained dofs in `fixed`. */
static int is_balanced(flesh_untangler *self, const flesh_state *state)
{
  flesh_system_fixed(self->system, state->t, self->fixed);
  if (forces(self, state->t, state->x, state->multipliers, elastic | others)) return 0;
  for (int d = 0; d < self->n; d++)
    if (!self->fixed[d] && fabs(self->r[d]) > 2 * quasi_static_force * self->force) return 0;
  return 1;
}

/* Whether nothing strains the body: its nodes are constrained to rest positions if at all, and all loads
 * together could not hold a tangle. */
static int is_unloaded(flesh_untangler *self, const flesh_state *state)
{
  double sum = 0, largest_offset = 0;
  const double *X = flesh_mesh_positions(self->mesh);
  if (forces(self, state->t, state->x, NULL, others)) return 0;
  for (int d = 0; d < self->n; d++) {
    sum += fabs(self->r[d]);
    if (self->fixed[d]) largest_offset = fmax(largest_offset, fabs(state->x[d] - X[d]));
  }
  return sum <= holding_force * self->force && largest_offset <= 1e-6 * self->edge;
}

/* Whether anything beside the material acts on a node of a tangled tet strongly enough to be what
 * holds it. */
static int is_held(flesh_untangler *self, const flesh_state *state, const uint8_t *tangled)
{
  if (forces(self, state->t, state->x, NULL, others)) return 1;
  for (int t = 0; t < flesh_mesh_piece_count(self->mesh); t++) {
    int node[4];
    flesh_mesh_piece(self->mesh, t, node);
    for (int a = 0; tangled[t] && a < 4; a++)
      for (int c = 0; c < 3; c++)
        if (fabs(self->r[3 * node[a] + c]) > holding_force * self->force) return 1;
  }
  return 0;
}

/* A body of which most is tangled, or most of the volume gone, although its material rests there or
 * nothing shows how it lay. */
static int has_collapsed(const flesh_untangler *self, const flesh_state *state, int tangled)
{
  return self->may_collapse &&
         (tangled > flesh_mesh_piece_count(self->mesh) / 2 ||
          flesh_mesh_volume(self->mesh, state->x) <
              0.4 * flesh_mesh_volume(self->mesh, flesh_mesh_positions(self->mesh)));
}

/* Moved nodes take the mean velocity of their group: how fast they would move is not known. */
static void settle_velocities(flesh_untangler *self, flesh_state *state)
{
  const int *moved = flesh_winding_moved(self->winding);
  int nodes = self->n / 3, groups = 0;
  for (int i = 0; i < nodes; i++) groups = moved[i] > groups ? moved[i] : groups;
  for (int g = 1; g <= groups; g++) {
    double mean[3] = {0};
    int count = 0;
    for (int i = 0; i < nodes; i++) {
      count += moved[i] == g;
      for (int c = 0; c < 3; c++) mean[c] += (moved[i] == g) * state->v[3 * i + c];
    }
    for (int d = 0; d < self->n; d++)
      if (moved[d / 3] == g) state->v[d] = self->fixed[d] ? 0 : mean[d % 3] / count;
  }
}

/* The potential of the body that stands still there, and the size of its terms, J. */
static int potential(flesh_untangler *self, const flesh_state *state, double *phi, double *magnitude)
{
  const flesh_point point = {.t = state->t, .load = 1, .x = state->x, .v = self->zero, .a = self->zero};
  return flesh_system_potential(self->system, &point, &(flesh_shift){.x = 1}, phi, magnitude);
}

static void remember_end(flesh_untangler *self, const flesh_state *state)
{
  self->t_end = state->t;
  memcpy(self->end.x, state->x, sizeof(double) * (size_t)self->n);
  memcpy(self->end.v, state->v, sizeof(double) * (size_t)self->n);
  if (state->multipliers) memcpy(self->multipliers, state->multipliers, sizeof(double) * (size_t)self->multiplier_count);
}

static void take_back(flesh_untangler *self, flesh_state *state)
{
  state->t = self->t_end;
  memcpy(state->x, self->end.x, sizeof(double) * (size_t)self->n);
  memcpy(state->v, self->end.v, sizeof(double) * (size_t)self->n);
  if (state->multipliers) memcpy(state->multipliers, self->multipliers, sizeof(double) * (size_t)self->multiplier_count);
}

/* From positions at the end of the step to those at its beginning that lead there by the motion that it had. */
static void begin_again(flesh_untangler *self, flesh_state *state)
{
  const int *moved = flesh_winding_moved(self->winding);
  settle_velocities(self, state);
  state->t = self->t_begin;
  for (int d = 0; d < self->n; d++) {
    if (self->fixed[d]) state->x[d] = self->begin.x[d];
    else state->x[d] -= self->end.x[d] - self->begin.x[d];
    if (self->fixed[d] || !moved[d / 3]) state->v[d] = self->begin.v[d];
  }
}

/* A group that lies behind an obstacle in part is moved before it as a whole, as pushing single nodes out would flatten
 * it again. Between two obstacles there may be no such place. */
static void clear_obstacles(flesh_untangler *self, flesh_state *state)
{
  enum { TRIES = 4 };
  const int *moved = flesh_winding_moved(self->winding);
  int nodes = self->n / 3, groups = 0;
  for (int i = 0; i < nodes; i++) groups = moved[i] > groups ? moved[i] : groups;
  for (int k = 0; k < TRIES * groups; k++) {
    double farthest[3] = {0}, square = 0;
    int is_free = 1;
    memcpy(self->saved, state->x, sizeof(double) * (size_t)self->n);
    flesh_system_push_out(self->system, state->t, self->end.x, state->t, self->saved);
    for (int i = 0; i < nodes; i++) {
      if (moved[i] != k % groups + 1) continue;
      double shift[3], length = 0;
      for (int c = 0; c < 3; c++) {
        shift[c] = self->saved[3 * i + c] - state->x[3 * i + c];
        length += shift[c] * shift[c];
        is_free &= !self->fixed[3 * i + c];
      }
      if (length > square) square = length, memcpy(farthest, shift, sizeof shift);
    }
    for (int d = 0; d < self->n && is_free; d++)
      if (moved[d / 3] == k % groups + 1) state->x[d] += farthest[d % 3];
  }
}

/* Returns 1 when it has repositioned nodes. */
static int untangle(flesh_untangler *self, flesh_state *state)
{
  double magnitude;
  if (!flesh_mesh_may_be_tangled(self->mesh, state->x)) {
    self->attempts = 0;
    return 0;
  }
  if (!self->winding) {
    int status = flesh_winding_create(self->mesh, &self->winding);
    if (status) return status;
  }
  const uint8_t *tangled;
  int count = flesh_winding_find(self->winding, state->x, &tangled);
  if (!count && !self->may_collapse) {
    count = flesh_winding_find_crushed(self->winding, state->x, &tangled);
    if (count && !is_unloaded(self, state)) count = 0;
  }
  if (!count) {
    self->attempts = 0;
    return 0;
  }
  if (self->attempts >= ATTEMPT_LIMIT || has_collapsed(self, state, count) ||
      !is_balanced(self, state) || is_held(self, state, tangled))
    return 0;
  if (potential(self, state, &self->phi, &magnitude)) return 0;
  remember_end(self, state);
  self->vanished = fabs(flesh_mesh_volume(self->mesh, state->x)) <
                   vanished_fraction * flesh_mesh_volume(self->mesh, flesh_mesh_positions(self->mesh));
  self->moved = flesh_winding_embed(self->winding, 1 << self->attempts++, self->fixed, state->x);
  if (self->moved < 0) return self->moved;
  /* No obstacle is passed: what it bars stays before it. */
  if (self->moved == self->n / 3) clear_obstacles(self, state);
  flesh_system_push_out(self->system, state->t, self->end.x, state->t, state->x);
  /* Energies that inverted tets have no place in must have one afterwards. */
  if (flesh_system_max_feasible_step(self->system, state->t, self->end.x, state->t, state->x) < 1 ||
      potential(self, state, &self->last, &magnitude)) {
    take_back(self, state);
    return 0;
  }
  self->repetitions = 0;
  return 1;
}

/* The same without a request for memory. */
static int untangle_from_reserve(flesh_untangler *self, flesh_state *state)
{
  flesh_reserve *before = flesh_reserve_enter(self->reserve);
  int status = untangle(self, state);
  flesh_reserve_enter(before);
  return status;
}

int flesh_untangler_after_step(flesh_untangler *self, flesh_state *state, double h)
{
  self->expected = state->t;
  self->quasi_static = is_quasi_static(self, state, h) ? self->quasi_static + 1 : 0;
  if (self->quasi_static < QUASI_STATIC_STEPS) return 0;
  self->quasi_static = 0;
  self->in_time = 1;
  const int status = untangle_from_reserve(self, state);
  if (status == 1) begin_again(self, state);
  return status;
}

int flesh_untangler_after_equilibrium(flesh_untangler *self, flesh_state *state)
{
  self->expected = state->t;
  self->in_time = 0;
  return untangle_from_reserve(self, state);
}

int flesh_untangler_judge(flesh_untangler *self, flesh_state *state, int solved, flesh_solve_stats *stats)
{
  double phi = INFINITY, magnitude = 0, largest = 0;
  if (solved && potential(self, state, &phi, &magnitude)) phi = INFINITY;
  for (int d = 0; d < self->n; d++) largest = fmax(largest, fabs(state->x[d] - self->end.x[d]));
  const double rounding = rounding_of_terms * magnitude;
  const int elsewhere = phi < INFINITY && largest > quasi_static_displacement * self->edge;
  const int better = phi < self->phi - rounding ||
                     (self->vanished && !flesh_mesh_may_be_tangled(self->mesh, state->x));
  if (elsewhere && better) {
    memcpy(self->v, state->v, sizeof(double) * (size_t)self->n);
    stats->untanglings++;
    stats->untangled_nodes += self->moved;
    return 0;
  }
  if (elsewhere && self->in_time && phi < self->last - rounding && ++self->repetitions < REPETITION_LIMIT) {
    self->last = phi;
    begin_again(self, state);
    return 1;
  }
  take_back(self, state);
  if (self->moved == self->n / 3) self->attempts = ATTEMPT_LIMIT; /* no further one would be another */
  return 0;
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
