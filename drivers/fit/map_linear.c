/* map_linear.c: linearises the measured quantities by the keys and a map. Derivatives by the keys, of which there are
 * few, form a matrix. By the map, J = -C K^-1 B, with the equilibria's K, the forces B of single tets and the measured
 * functions C; only products with it are computed: J u by a tangent, J^T y by an adjoint, each with one solve for every
 * equilibrium, or along a motion. The few columns of probes of equilibria keep their adjoints. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "fit/map.h"
#include "fit/observation.h"
#include "mesh/pieces.h"
#include "sensitivity/sensitivity.h"

/* Relative residual of linear solves; difference of q for the forces of tets. */
static const double tolerance = 1e-8, difference = 1e-5;

/* An equilibrium. */
typedef struct linear_state {
  flesh_sensitivity *at; /* NULL: the start, which depends on no parameter */
  double *forces;        /* [tets of the mesh][3*size] dr/dq at the nodes of each tet */
  double **answers;      /* [columns of probes][3*nodes] such that dQ = answer . dr */
} linear_state;

/* An experiment. */
typedef struct linear_experiment {
  flesh_fit_experiment *e;
  flesh_fit_motion *motion;  /* NULL: the experiment has equilibria */
  flesh_scene *scene, *beside[2]; /* at p; with the whole map slightly changed, in both directions */
  flesh_fit_observation observation;
  linear_state *states;
  double *columns; /* [columns of probes] workspace */
} linear_experiment;

struct flesh_fit_linear {
  flesh_fit *fit;
  flesh_arena memory; /* owns all arrays */
  int size, n;      /* number of nodes of a tet; number of unknowns */
  double *p;        /* [parameters] */
  double *keys;     /* [measured numbers][keys] derivatives by q, over the deviations */
  double *sizes;    /* [parameters] dp/dq of the map's tets; 0 for keys */
  double *differences; /* [tets of the mesh] difference of q between the two changed scenes */
  double *room[3];  /* [n] workspace, as the next members */
  double *y, *by_tet; /* [measured numbers]; [tets of the mesh] */
  double *changes;  /* [parameters] */
  linear_experiment *experiments;
};

static flesh_tet_parameter parameter_of(const flesh_fit_linear *self, const linear_experiment *x)
{
  return (flesh_tet_parameter){{flesh_scene_body(x->beside[0]), flesh_scene_body(x->beside[1])}, self->differences};
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
  const flesh_fit_equilibria *kept = &x->e->equilibria;
  const flesh_tet_parameter by_tet = parameter_of(self, x);
  flesh_solver_options options = *flesh_scene_solver(x->scene);
  options.linear_solver = FLESH_LINEAR_KLU; /* a direct solver, for many solves with one matrix */
  self->size = flesh_mesh_order(flesh_scene_mesh(x->scene)) == 2 ? 10 : 4;
  const size_t forces = 3 * (size_t)self->fit->map->tet_count * (size_t)self->size;
  x->states = flesh_arena_take(&self->memory, (size_t)kept->count * sizeof *x->states);
  x->columns = flesh_arena_take(&self->memory, (size_t)x->e->column_count * sizeof *x->columns);
  int status = x->states && x->columns ? FLESH_OK : flesh_no_memory();
  for (int s = 0; s < kept->count && !status; s++) {
    linear_state *state = &x->states[s];
    status = flesh_fit_observation_add(&x->observation, kept->states[s].t);
    if (status || s < kept->has_start) continue;
    status = flesh_sensitivity_create(flesh_scene_system(x->scene), &options, tolerance, &state->at);
    if (!status) status = flesh_sensitivity_set(state->at, &kept->states[s], NULL);
    if (!status) status = find_columns(self, x, kept->states[s].t, state);
    state->forces = flesh_arena_take(&self->memory, forces * sizeof *state->forces);
    if (!status) status = state->forces ? flesh_tet_forces(&by_tet, &kept->states[s], state->forces) : flesh_no_memory();
  }
  return status;
}

static int linearise(flesh_fit_linear *self, flesh_fit_experiment *e, linear_experiment *x)
{
  flesh_fit *fit = self->fit;
  x->observation.e = x->e = e;
  int status = flesh_fit_scenes_beside(fit, e, self->p, self->sizes, difference, x->beside);
  if (status == FLESH_ERR_ARGUMENT)
    flesh_node_fail_within(status, fit->map->of.node, "the search comes to what the scene does not take; give from and to: ");
  if (!status && e->moves) return flesh_fit_motion_create(fit, e, self->p, &x->motion);
  if (!status) status = flesh_fit_equilibria_at(fit, e, self->p);
  if (!status) status = flesh_fit_scene_at(fit, e, self->p, &x->scene);
  return status ? status : linearise_states(self, x);
}

/* Computes the derivatives by the keys. */
static int find_keys(flesh_fit_linear *self)
{
  flesh_fit *fit = self->fit;
  const size_t keys = (size_t)fit->key_count;
  const int status = keys ? flesh_fit_evaluate_accepted(fit, self->p, self->y, self->keys) : FLESH_OK;
  for (size_t i = 0; i < (size_t)fit->count; i++)
    for (size_t k = 0; k < keys; k++)
      self->keys[i * keys + k] *= flesh_fit_slope(&fit->parameters[k], self->p[k]) / fit->data[i]->deviation;
  return status;
}

int flesh_fit_linear_create(flesh_fit *fit, const double *p, flesh_fit_linear **linear)
{
  const flesh_fit_map *map = fit->map;
  const size_t all = (size_t)fit->parameter_count, numbers = (size_t)fit->count, tets = (size_t)map->tet_count,
               keys = (size_t)fit->key_count, n = 3 * (size_t)fit->experiments[0].nodes;
  flesh_fit_linear *self = *linear = calloc(1, sizeof *self);
  if (!self) return flesh_no_memory();
  self->fit = fit;
  self->n = (int)n;
  self->experiments = flesh_arena_take(&self->memory, (size_t)fit->experiment_count * sizeof *self->experiments);
  self->p = flesh_arena_take(&self->memory, (3 * all + numbers * (keys + 1) + 2 * tets + 3 * n) * sizeof *self->p);
  int status = self->experiments && self->p ? FLESH_OK : flesh_no_memory();
  if (!status) {
    memcpy(self->p, p, all * sizeof *p);
    self->sizes = self->p + all, self->changes = self->sizes + all, self->y = self->changes + all;
    self->differences = self->y + numbers, self->by_tet = self->differences + tets, self->keys = self->by_tet + tets;
    for (size_t k = 0; k < 3; k++) self->room[k] = self->keys + numbers * keys + k * n;
    for (int k = 0; k < map->count; k++) {
      self->sizes[fit->key_count + k] = flesh_fit_slope(&map->of, p[fit->key_count + k]);
      self->differences[map->tets[k]] = 2 * difference;
    }
    status = find_keys(self);
  }
  for (int e = 0; e < fit->experiment_count && !status; e++)
    status = linearise(self, &fit->experiments[e], &self->experiments[e]);
  if (status) flesh_fit_linear_destroy(linear);
  return status;
}

void flesh_fit_linear_destroy(flesh_fit_linear **linear)
{
  flesh_fit_linear *self = *linear;
  if (!self) return;
  for (int e = 0; e < self->fit->experiment_count && self->experiments; e++) {
    linear_experiment *x = &self->experiments[e];
    for (int s = 0; s < x->observation.count && x->states; s++) flesh_sensitivity_destroy(&x->states[s].at);
    free(x->observation.times);
    flesh_fit_motion_destroy(&x->motion);
    flesh_scene_destroy(&x->scene);
    for (int k = 0; k < 2; k++) flesh_scene_destroy(&x->beside[k]);
  }
  flesh_arena_free(&self->memory);
  free(self);
  *linear = NULL;
}

/* Lists the dofs [3*size] of a tet; returns their number. */
static int list_dofs(const linear_experiment *x, int tet, size_t dofs[30])
{
  int nodes[10];
  const int count = 3 * flesh_mesh_tet_nodes(flesh_scene_mesh(x->scene), tet, nodes);
  for (int i = 0; i < count; i++) dofs[i] = 3 * (size_t)nodes[i / 3] + (size_t)(i % 3);
  return count;
}

/* Adds to y [of the experiment] J u of its equilibria, for u of the map. */
static int times_states(flesh_fit_linear *self, const linear_experiment *x, const double *u, double *y)
{
  const int *tets = self->fit->map->tets;
  double *force = self->room[0], *dx = self->room[1];
  size_t dofs[30];
  int status = FLESH_OK;
  for (int s = 0; s < x->observation.count && !status; s++) {
    const linear_state *state = &x->states[s];
    if (!state->at) continue;
    memset(force, 0, (size_t)self->n * sizeof *force);
    for (int k = 0; k < self->fit->map->count; k++)
      for (int i = list_dofs(x, tets[k], dofs); i-- > 0;) force[dofs[i]] += u[k] * state->forces[3 * tets[k] * self->size + i];
    status = flesh_sensitivity_respond(state->at, force, dx);
    self->fit->linear++;
    for (int c = 0; c < x->e->column_count; c++) {
      x->columns[c] = 0;
      for (int i = 0; i < self->n; i++) x->columns[c] += state->answers[c][i] * force[i];
    }
    if (!status) flesh_fit_observation_apply(&x->observation, s, dx, x->columns, y, 1);
  }
  return status;
}

/* Adds to u [map] J^T y of its equilibria. */
static int back_states(flesh_fit_linear *self, const linear_experiment *x, const double *y, double *u)
{
  const int *tets = self->fit->map->tets;
  const size_t bytes = (size_t)self->n * sizeof(double);
  double *by_x = self->room[0], *answer = self->room[1], *lambda = self->room[2];
  size_t dofs[30];
  int status = FLESH_OK;
  for (int s = 0; s < x->observation.count && !status; s++) {
    const linear_state *state = &x->states[s];
    if (!state->at) continue;
    memset(by_x, 0, bytes);
    memset(answer, 0, bytes);
    for (int c = 0; c < x->e->column_count; c++) x->columns[c] = 0;
    flesh_fit_observation_transpose(&x->observation, s, y, by_x, x->columns);
    for (int c = 0; c < x->e->column_count; c++)
      for (int i = 0; i < self->n; i++) answer[i] += x->columns[c] * state->answers[c][i];
    status = flesh_sensitivity_adjoint(state->at, &(flesh_quantity){by_x, NULL}, lambda);
    self->fit->linear++;
    for (int k = 0; k < self->fit->map->count && !status; k++)
      for (int i = 0, all = list_dofs(x, tets[k], dofs); i < all; i++)
        u[k] += (answer[dofs[i]] - lambda[dofs[i]]) * state->forces[3 * tets[k] * self->size + i];
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
    y[i] /= fit->data[i]->deviation;
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
    self->y[i] = y[i] / fit->data[i]->deviation;
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
