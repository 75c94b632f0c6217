/* untangle.c: when a tangle is one for good, and what is done about it. */
#include "integrator/untangle.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "mesh/winding.h"

/* Calm: inertial forces below this share of the force that strains the average edge by its own length. */
static const double calm_share = 1e-3;
/* A tangle is held in place by loads above this share of that force on one of its nodes. */
static const double held_share = 0.05;
enum {
  CALM_STEPS = 5,   /* in a row, so that no turning point of a motion passes for rest */
  ATTEMPT_LIMIT = 12 /* 2^11 layers are the whole of any mesh that fits here */
};

struct flesh_untangler {
  const flesh_system *system;
  const flesh_mesh *mesh;
  const flesh_effect *inertia; /* NULL: none */
  flesh_winding *winding;      /* made at the first suspicion */
  int n, calm, attempts, know_velocity;
  double force;   /* stiffness times mean edge, N */
  double *v, *a, *r, *saved; /* [n] */
  uint8_t *fixed; /* [n] */
};

int flesh_untangler_create(const flesh_system *system, double stiffness, flesh_untangler **untangler)
{
  flesh_untangler *self = calloc(1, sizeof *self);
  *untangler = self;
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for an untangler");
  self->system = system;
  self->mesh = flesh_system_mesh(system);
  self->n = flesh_system_unknowns(system);
  for (int k = 0; k < flesh_system_effect_count(system); k++)
    if (!strcmp(flesh_system_effect(system, k)->operations->name, "inertia"))
      self->inertia = flesh_system_effect(system, k);
  flesh_mesh_info info;
  flesh_mesh_inspect(self->mesh, &info);
  self->force = stiffness * info.edge_mean;
  double **arrays[] = {&self->v, &self->a, &self->r, &self->saved};
  int failed = !(self->fixed = calloc((size_t)self->n + 1, 1));
  for (int k = 0; k < 4; k++) failed |= !(*arrays[k] = calloc((size_t)self->n + 1, sizeof(double)));
  if (!failed) return FLESH_OK;
  flesh_untangler_destroy(untangler);
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for an untangler");
}

void flesh_untangler_destroy(flesh_untangler **untangler)
{
  if (!untangler || !*untangler) return;
  flesh_winding_destroy(&(*untangler)->winding);
  free((*untangler)->v);
  free((*untangler)->a);
  free((*untangler)->r);
  free((*untangler)->saved);
  free((*untangler)->fixed);
  free(*untangler);
  *untangler = NULL;
}

size_t flesh_untangler_memory(const flesh_untangler *self)
{
  return sizeof *self + (size_t)self->n * (4 * sizeof(double) + 1);
}

/* Whether the body hardly accelerates. */
static int is_calm(flesh_untangler *self, const flesh_state *state, double h)
{
  int known = self->know_velocity;
  for (int d = 0; d < self->n; d++) {
    self->a[d] = (state->v[d] - self->v[d]) / h;
    self->v[d] = state->v[d];
    self->r[d] = 0;
  }
  self->know_velocity = 1;
  flesh_point point = {.t = state->t, .load = 1, .x = state->x, .v = state->v, .a = self->a,
                       .x_lag = state->x, .v_lag = state->v};
  if (!known || !self->inertia ||
      self->inertia->operations->residual(self->inertia, &point, self->r))
    return 0;
  double worst = 0;
  for (int d = 0; d < self->n; d++) worst = fmax(worst, fabs(self->r[d]));
  return worst <= calm_share * self->force;
}

/* Whether a load from outside acts on a node of a tangled tet strongly enough to be what holds it. */
static int is_held(flesh_untangler *self, const flesh_state *state, const uint8_t *tangled)
{
  flesh_point point = {.t = state->t, .load = 1, .x = state->x, .v = state->v, .a = self->a};
  if (flesh_system_load(self->system, &point, self->r)) return 1;
  const int *tets = flesh_mesh_tets(self->mesh);
  for (int t = 0; t < flesh_mesh_tet_count(self->mesh); t++)
    for (int a = 0; tangled[t] && a < 4; a++)
      for (int c = 0; c < 3; c++)
        if (fabs(self->r[3 * tets[4 * (size_t)t + a] + c]) > held_share * self->force) return 1;
  return 0;
}

/* A body of which most is inverted, or most of the volume gone, has collapsed: its material's doing. */
static int has_collapsed(const flesh_untangler *self, const flesh_state *state, int tangled)
{
  return tangled > flesh_mesh_tet_count(self->mesh) / 2 ||
         flesh_mesh_volume(self->mesh, state->x) <
             0.4 * flesh_mesh_volume(self->mesh, flesh_mesh_positions(self->mesh));
}

/* Moved nodes take the mean velocity of the body: how fast they would move is not known. */
static void settle_velocities(flesh_untangler *self, flesh_state *state)
{
  const uint8_t *moved = flesh_winding_moved(self->winding), *used = flesh_mesh_node_used(self->mesh);
  double mean[3] = {0};
  int count = 0;
  for (int i = 0; i < self->n / 3; i++) {
    count += used[i];
    for (int c = 0; c < 3; c++) mean[c] += used[i] * state->v[3 * i + c];
  }
  for (int d = 0; d < self->n; d++)
    if (moved[d / 3]) state->v[d] = self->fixed[d] ? 0 : mean[d % 3] / count;
}

static int untangle(flesh_untangler *self, flesh_state *state, flesh_solve_stats *stats)
{
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
  if (!count) {
    self->attempts = 0;
    return 0;
  }
  if (self->attempts >= ATTEMPT_LIMIT || has_collapsed(self, state, count) || is_held(self, state, tangled))
    return 0;
  flesh_system_fixed(self->system, state->t, self->fixed);
  memcpy(self->saved, state->x, sizeof(double) * (size_t)self->n);
  int moved = flesh_winding_embed(self->winding, 1 << self->attempts++, self->fixed, state->x);
  if (moved < 0) return moved;
  /* Energies that inverted tets have no place in must have one afterwards, and no obstacle be passed. */
  flesh_point point = {.t = state->t, .load = 1, .x = state->x, .v = state->v, .a = self->a};
  double phi, magnitude;
  if (flesh_system_way(self->system, state->t, self->saved, state->t, state->x) < 1 ||
      flesh_system_potential(self->system, &point, &(flesh_shift){.x = 1}, &phi, &magnitude)) {
    memcpy(state->x, self->saved, sizeof(double) * (size_t)self->n);
    return 0;
  }
  settle_velocities(self, state);
  memcpy(self->v, state->v, sizeof(double) * (size_t)self->n);
  stats->untanglings++;
  stats->untangled_nodes += moved;
  return 1;
}

int flesh_untangler_after_step(flesh_untangler *self, flesh_state *state, double h,
                               flesh_solve_stats *stats)
{
  self->calm = is_calm(self, state, h) ? self->calm + 1 : 0;
  if (self->calm < CALM_STEPS) return 0;
  self->calm = 0;
  return untangle(self, state, stats);
}

int flesh_untangler_after_equilibrium(flesh_untangler *self, flesh_state *state,
                                      flesh_solve_stats *stats)
{
  return untangle(self, state, stats);
}
