/* map_linear.c: linearises the measured quantities by the keys and a map. Derivatives by the keys, of which there are
 * few, form a matrix. By the map, J = -C K^-1 B, with the equilibria's K, the forces B of single tets and the measured
 * functions C; only products with it are computed: J u by a tangent, J^T y by an adjoint, each with one solve for every
 * equilibrium, or along a motion. The few columns of probes of equilibria keep their adjoints. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "fit/map.h"
#include "fit/told.h"
#include "mesh/mesh.h"
#include "mesh/pieces.h"
#include "sensitivity/sensitivity.h"

/* Relative residual of linear solves; difference of q for the forces of tets. */
static const double tolerance = 1e-8, difference = 1e-5;

/* An equilibrium. */
typedef struct linear_state {
  flesh_sensitivity *at; /* NULL: the start, which depends on no parameter */
  double *forces;        /* [map][3*size] dr/dq at the nodes of each tet of the map */
  double **answers;      /* [columns of probes][3*nodes] such that dQ = answer . dr */
} linear_state;

/* An experiment. */
typedef struct linear_experiment {
  const flesh_fit_experiment *e;
  flesh_fit_motion *motion;  /* NULL: the experiment has equilibria */
  flesh_scene *scene, *beside[2]; /* at p; with the whole map slightly changed, in both directions */
  flesh_fit_told told;
  linear_state *states;
} linear_experiment;

struct flesh_fit_linear {
  flesh_fit *fit;
  flesh_arena memory; /* owns all arrays */
  int size, n;      /* number of nodes of a tet; number of unknowns */
  int *dofs;        /* [map][3*size]; -1: no dof */
  double *p;        /* [parameters] */
  double *keys;     /* [measured numbers][keys] derivatives by q, over the deviations */
  double *sizes;    /* [parameters] dp/dq of the map's tets; 0 for keys */
  double *changes;  /* [parameters] workspace */
  double *differences; /* [tets of the mesh] difference of q between the two changed scenes */
  double *room[3];  /* [n] */
  double *y, *by_tet; /* [measured numbers], [tets of the mesh]; workspace */
  linear_experiment *experiments;
};

static flesh_tet_parameter parameter_of(const flesh_fit_linear *self, const linear_experiment *x)
{
  return (flesh_tet_parameter){{flesh_scene_body(x->beside[0]), flesh_scene_body(x->beside[1])}, self->differences};
}

/* Computes dr/dq of the map's tets at all states. */
static int find_forces(flesh_fit_linear *self, linear_experiment *x)
{
  const flesh_fit_map *map = self->fit->map;
  const flesh_fit_kept *kept = &x->e->kept;
  const size_t each = 3 * (size_t)self->size;
  const flesh_tet_parameter by_tet = parameter_of(self, x);
  double *all = malloc((size_t)map->tet_count * each * sizeof *all);
  int status = all ? FLESH_OK : flesh_no_memory();
  for (int s = kept->has_start; s < kept->count && !status; s++) {
    status = flesh_tet_forces(&by_tet, &kept->states[s], all);
    double *to = x->states[s].forces = flesh_arena_take(&self->memory, (size_t)map->count * each * sizeof *to);
    if (!status && !to) status = flesh_no_memory();
    for (int k = 0; k < map->count && !status; k++)
      memcpy(to + (size_t)k * each, all + (size_t)map->tets[k] * each, each * sizeof *to);
  }
  free(all);
  return status;
}

/* Computes the adjoints of the columns of probes at a state. */
static int find_columns(flesh_fit_linear *self, linear_experiment *x, double t, linear_state *state)
{
  const int count = x->e->column_count;
  int status = FLESH_OK;
  state->answers = flesh_arena_take(&self->memory, (size_t)count * sizeof *state->answers);
  if (!state->answers) return flesh_no_memory();
  for (int c = 0; c < count && !status; c++) {
    flesh_response response = {0};
    double *answer = state->answers[c] = flesh_arena_take(&self->memory, (size_t)self->n * sizeof *answer);
    status = answer ? flesh_response_find(x->scene, x->e->columns[c], t, &response) : flesh_no_memory();
    if (!status) status = flesh_sensitivity_adjoint(state->at, &(flesh_quantity){response.by_x, response.of_residual}, answer);
    for (int d = 0; d < self->n && !status; d++) answer[d] = (response.of_residual ? response.of_residual[d] : 0) - answer[d];
    flesh_response_clear(&response);
    self->fit->linear++;
  }
  return status;
}

/* Linearises all equilibria of an experiment. */
static int linearise_states(flesh_fit_linear *self, linear_experiment *x)
{
  const flesh_fit_kept *kept = &x->e->kept;
  flesh_solver_options options = *flesh_scene_solver(x->scene);
  options.linear_solver = FLESH_LINEAR_KLU; /* a direct solver, for many solves with one matrix */
  x->states = flesh_arena_take(&self->memory, (size_t)kept->count * sizeof *x->states);
  int status = x->states ? FLESH_OK : flesh_no_memory();
  for (int s = 0; s < kept->count && !status; s++) {
    linear_state *state = &x->states[s];
    status = flesh_fit_told_add(&x->told, kept->states[s].t);
    if (status || s < kept->has_start) continue;
    status = flesh_sensitivity_create(flesh_scene_system(x->scene), &options, tolerance, &state->at);
    if (!status) status = flesh_sensitivity_set(state->at, &kept->states[s], NULL);
    if (!status) status = find_columns(self, x, kept->states[s].t, state);
  }
  return status ? status : find_forces(self, x);
}

static int linearise(flesh_fit_linear *self, int experiment)
{
  flesh_fit *fit = self->fit;
  linear_experiment *x = &self->experiments[experiment];
  x->told.e = x->e = &fit->experiments[experiment];
  int status = flesh_fit_scenes_beside(fit, experiment, self->p, self->sizes, difference, x->beside);
  if (status == FLESH_ERR_ARGUMENT)
    flesh_node_fail_within(status, fit->map->of.place, "the search comes to what the scene does not take; give from and to: ");
  if (!status && x->e->moves) return flesh_fit_motion_create(fit, experiment, self->p, &x->motion);
  if (!status) status = flesh_fit_keep_at(fit, experiment, self->p);
  if (!status) status = flesh_fit_scene_at(fit, experiment, self->p, &x->scene);
  return status ? status : linearise_states(self, x);
}

/* Finds the dofs of the map's tets in the mesh, which all experiments share. */
static int find_dofs(flesh_fit_linear *self, const flesh_mesh *mesh)
{
  const flesh_fit_map *map = self->fit->map;
  self->size = flesh_mesh_order(mesh) == 2 ? 10 : 4;
  self->n = 3 * flesh_mesh_node_count(mesh);
  self->dofs = flesh_arena_take(&self->memory, (size_t)map->count * 3 * (size_t)self->size * sizeof *self->dofs);
  for (int k = 0; k < 3; k++) self->room[k] = flesh_arena_take(&self->memory, (size_t)self->n * sizeof(double));
  if (!self->dofs || !self->room[0] || !self->room[1] || !self->room[2]) return flesh_no_memory();
  for (int k = 0; k < map->count; k++) {
    int own[10];
    const int has = flesh_mesh_tet_nodes(mesh, map->tets[k], own);
    for (int i = 0; i < 3 * self->size; i++) self->dofs[3 * k * self->size + i] = i < 3 * has ? 3 * own[i / 3] + i % 3 : -1;
  }
  return FLESH_OK;
}

/* Computes the derivatives by the keys. */
static int find_keys(flesh_fit_linear *self)
{
  flesh_fit *fit = self->fit;
  char why[FLESH_FIT_WORDS];
  int good = 1, status = fit->key_count ? flesh_fit_evaluate(fit, self->p, self->y, self->keys, &good, why) : FLESH_OK;
  for (int i = 0; i < fit->count; i++)
    for (int k = 0; k < fit->key_count; k++)
      self->keys[(size_t)i * (size_t)fit->key_count + (size_t)k] *=
          flesh_fit_slope(&fit->parameters[k], self->p[k]) / flesh_fit_datum_at(fit, i)->deviation;
  return status || good ? status : flesh_fail(FLESH_ERR_SOLVE, "%s", why);
}

int flesh_fit_linear_create(flesh_fit *fit, const double *p, flesh_fit_linear **linear)
{
  const flesh_fit_map *map = fit->map;
  const size_t all = (size_t)fit->parameter_count, numbers = (size_t)fit->count, tets = (size_t)map->tet_count;
  flesh_fit_linear *self = *linear = calloc(1, sizeof *self);
  flesh_scene *scene = NULL;
  if (!self) return flesh_no_memory();
  self->fit = fit;
  self->experiments = flesh_arena_take(&self->memory, (size_t)fit->experiment_count * sizeof *self->experiments);
  self->p = flesh_arena_take(&self->memory, (3 * all + numbers * ((size_t)fit->key_count + 1) + 2 * tets) * sizeof *self->p);
  int status = self->experiments && self->p ? flesh_fit_scene_at(fit, 0, p, &scene) : flesh_no_memory();
  if (!status) {
    memcpy(self->p, p, all * sizeof *p);
    self->sizes = self->p + all, self->changes = self->sizes + all, self->y = self->changes + all;
    self->differences = self->y + numbers, self->by_tet = self->differences + tets, self->keys = self->by_tet + tets;
    for (int k = 0; k < map->count; k++) {
      self->sizes[fit->key_count + k] = flesh_fit_slope(&map->of, p[fit->key_count + k]);
      self->differences[map->tets[k]] = 2 * difference;
    }
    status = find_dofs(self, flesh_scene_mesh(scene));
  }
  flesh_scene_destroy(&scene);
  if (!status) status = find_keys(self);
  for (int e = 0; e < fit->experiment_count && !status; e++) status = linearise(self, e);
  if (status) flesh_fit_linear_destroy(linear);
  return status;
}

void flesh_fit_linear_destroy(flesh_fit_linear **linear)
{
  flesh_fit_linear *self = *linear;
  if (!self) return;
  for (int e = 0; e < self->fit->experiment_count && self->experiments; e++) {
    linear_experiment *x = &self->experiments[e];
    for (int s = 0; s < x->told.count && x->states; s++) flesh_sensitivity_destroy(&x->states[s].at);
    free(x->told.times);
    flesh_fit_motion_destroy(&x->motion);
    flesh_scene_destroy(&x->scene);
    for (int k = 0; k < 2; k++) flesh_scene_destroy(&x->beside[k]);
  }
  flesh_arena_free(&self->memory);
  free(self);
  *linear = NULL;
}

/* Vectors that a visitor reads and writes. */
typedef struct product {
  const linear_state *state;
  int n;
  double *force, *dx; /* forces and displacements of a change; or the derivatives by x and the sum of answers */
  double *y;          /* for the experiment's measured numbers */
} product;

static void take(void *data, const flesh_fit_measured *m, const flesh_fit_datum *d, int row, double weight, int c)
{
  product *p = data;
  double sum = c < 0 ? flesh_fit_told_position(m, d, p->dx) : 0;
  for (int i = 0; i < p->n && c >= 0; i++) sum += p->state->answers[c][i] * p->force[i];
  p->y[row] += weight * sum;
}

static void give(void *data, const flesh_fit_measured *m, const flesh_fit_datum *d, int row, double weight, int c)
{
  product *p = data;
  const double y = weight * p->y[row];
  if (c < 0) flesh_fit_told_give(m, d, y, p->dx);
  for (int i = 0; i < p->n && c >= 0; i++) p->force[i] += y * p->state->answers[c][i];
}

/* Adds to y [of the experiment] J u of its equilibria, for u of the map. */
static int times_states(flesh_fit_linear *self, linear_experiment *x, const double *u, double *y)
{
  const size_t each = 3 * (size_t)self->size, count = (size_t)self->fit->map->count;
  double *force = self->room[0], *dx = self->room[1];
  int status = FLESH_OK;
  for (int s = 0; s < x->told.count && !status; s++) {
    linear_state *state = &x->states[s];
    if (!state->at) continue;
    memset(force, 0, (size_t)self->n * sizeof *force);
    for (size_t i = 0; i < each * count; i++)
      if (self->dofs[i] >= 0) force[self->dofs[i]] += u[i / each] * state->forces[i];
    status = flesh_sensitivity_respond(state->at, force, dx);
    self->fit->linear++;
    if (!status) flesh_fit_told_visit(&x->told, s, take, &(product){state, self->n, force, dx, y});
  }
  return status;
}

/* Adds to u [map] J^T y of its equilibria. */
static int back_states(flesh_fit_linear *self, linear_experiment *x, double *y, double *u)
{
  const size_t each = 3 * (size_t)self->size, count = (size_t)self->fit->map->count;
  double *by_x = self->room[0], *answer = self->room[1], *lambda = self->room[2];
  int status = FLESH_OK;
  for (int s = 0; s < x->told.count && !status; s++) {
    linear_state *state = &x->states[s];
    if (!state->at) continue;
    memset(by_x, 0, (size_t)self->n * sizeof *by_x);
    memset(answer, 0, (size_t)self->n * sizeof *answer);
    flesh_fit_told_visit(&x->told, s, give, &(product){state, self->n, answer, by_x, y});
    status = flesh_sensitivity_adjoint(state->at, &(flesh_quantity){by_x, NULL}, lambda);
    self->fit->linear++;
    for (size_t i = 0; i < each * count && !status; i++)
      if (self->dofs[i] >= 0) u[i / each] += (answer[self->dofs[i]] - lambda[self->dofs[i]]) * state->forces[i];
  }
  return status;
}

int flesh_fit_linear_times(flesh_fit_linear *self, const double *u, double *y)
{
  const flesh_fit *fit = self->fit;
  const int keys = fit->key_count;
  double largest = 0;
  int status = FLESH_OK;
  for (int k = keys; k < fit->parameter_count; k++) {
    largest = fmax(largest, fabs(u[k]));
    self->changes[k] = self->sizes[k] * u[k];
  }
  const double h = largest > 0 ? difference / largest : 0;
  memset(y, 0, (size_t)fit->count * sizeof *y);
  for (int e = 0; e < fit->experiment_count && !status; e++) {
    linear_experiment *x = &self->experiments[e];
    double *own = y + x->e->first;
    status = x->motion ? flesh_fit_motion_along(x->motion, 1, self->changes, &h, own) : times_states(self, x, u + keys, own);
  }
  for (int i = 0; i < fit->count; i++) {
    y[i] /= flesh_fit_datum_at(fit, i)->deviation;
    for (int k = 0; k < keys; k++) y[i] += self->keys[(size_t)i * (size_t)keys + (size_t)k] * u[k];
  }
  return status;
}

int flesh_fit_linear_times_transposed(flesh_fit_linear *self, const double *y, double *u)
{
  const flesh_fit *fit = self->fit;
  const flesh_fit_map *map = fit->map;
  const int keys = fit->key_count;
  int status = FLESH_OK;
  memset(u, 0, (size_t)fit->parameter_count * sizeof *u);
  for (int i = 0; i < fit->count; i++) {
    self->y[i] = y[i] / flesh_fit_datum_at(fit, i)->deviation;
    for (int k = 0; k < keys; k++) u[k] += self->keys[(size_t)i * (size_t)keys + (size_t)k] * y[i];
  }
  for (int e = 0; e < fit->experiment_count && !status; e++) {
    linear_experiment *x = &self->experiments[e];
    if (!x->motion) {
      status = back_states(self, x, self->y + x->e->first, u + keys);
      continue;
    }
    const flesh_tet_parameter by_tet = parameter_of(self, x);
    status = flesh_fit_motion_back(x->motion, &by_tet, self->y + x->e->first, self->by_tet);
    for (int k = 0; k < map->count && !status; k++) u[keys + k] += self->by_tet[map->tets[k]];
  }
  return status;
}
