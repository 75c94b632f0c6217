/* map_linear.c: what was measured as a linear function of a map's changes: with the equilibria's K, the forces B of single
 * tets and the measured functions C it is J = -C K^-1 B, of which products alone are made: J u by a tangent, J^T y by an
 * adjoint, one solve each for every equilibrium. A column of probes, of which there are few, keeps its adjoint. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/folder.h"
#include "base/confine.h"
#include "base/text.h"
#include "fit/map.h"
#include "mesh/mesh.h"
#include "mesh/pieces.h"
#include "sensitivity/sensitivity.h"

/* The residual that linear solves leave, and the difference of q for the tets' forces. */
static const double tolerance = 1e-8, difference = 1e-3;

/* A column of probes at an equilibrium: dQ = answer . dr. */
typedef struct column {
  int quantity; /* of the measured file */
  double *answer; /* [3*nodes] */
} column;

/* An equilibrium. */
typedef struct linear_state {
  double t;
  flesh_sensitivity *at; /* NULL: the start, which depends on nothing */
  double *forces;        /* [map][3*size] dr/dq at the nodes of each of the map's tets */
  int column_count;      /* of all measured files, one after the other */
  column *columns;
} linear_state;

/* An experiment. */
typedef struct linear_experiment {
  const flesh_fit_experiment *e;
  flesh_scene *scene;
  int state_count;
  linear_state *states;
} linear_experiment;

struct flesh_fit_linear {
  flesh_fit *fit;
  int size, n;      /* nodes of a tet; unknowns */
  int *dofs;        /* [map][3*size] -1: none */
  double *size_of;  /* [map] dp/dq */
  double *room[2];  /* [n] */
  linear_experiment *experiments;
};

static int no_memory(void) { return flesh_fail(FLESH_ERR_MEMORY, "out of memory for the derivatives of a map"); }

/* Finds which states tell a datum, by which weights; returns how many. */
static int places_of(const linear_experiment *x, const flesh_fit_datum *d, int at[2], double weights[2])
{
  const int last = x->state_count - 1;
  int next = 0;
  at[0] = last;
  weights[0] = 1;
  if (isnan(d->t)) return 1;
  while (next < last && x->states[next].t < d->t) next++;
  at[0] = next;
  if (!next || x->states[next].t <= d->t) return 1;
  at[1] = next - 1;
  weights[1] = (x->states[next].t - d->t) / (x->states[next].t - x->states[next - 1].t);
  weights[0] = 1 - weights[1];
  return 2;
}

/* The scene at values a little beside p, whose map is a file for a moment. */
static int scene_beside(flesh_fit *fit, int experiment, const double *p, const double *sizes, double h, flesh_scene **scene)
{
  double *q = malloc((size_t)fit->parameter_count * sizeof *q);
  if (!q) return no_memory();
  for (int k = 0; k < fit->parameter_count; k++) q[k] = p[k] + h * sizes[k];
  const int status = flesh_fit_scene_at(fit, experiment, q, scene);
  free(q);
  return status;
}

/* dr/dq of the map's tets at all states. */
static int find_forces(flesh_fit_linear *self, int experiment, const double *p)
{
  const flesh_fit *fit = self->fit;
  const flesh_fit_map *map = fit->map;
  linear_experiment *x = &self->experiments[experiment];
  const flesh_fit_kept *kept = &x->e->kept;
  const size_t each = 3 * (size_t)self->size;
  flesh_scene *beside[2] = {NULL};
  int status = scene_beside(self->fit, experiment, p, self->size_of, -difference, &beside[0]);
  if (!status) status = scene_beside(self->fit, experiment, p, self->size_of, difference, &beside[1]);
  const int tets = status ? 0 : flesh_mesh_tet_count(flesh_scene_mesh(x->scene));
  double *differences = calloc((size_t)tets + 1, sizeof *differences), *all = malloc((size_t)tets * each * sizeof *all + 1);
  if (!status && (!differences || !all)) status = no_memory();
  for (int k = 0; k < map->count && !status; k++) differences[map->tets[k]] = 2 * difference;
  for (int s = kept->has_start; s < x->state_count && !status; s++) {
    const flesh_tet_parameter by_tet = {{flesh_scene_body(beside[0]), flesh_scene_body(beside[1])}, differences};
    status = flesh_tet_forces(&by_tet, &kept->states[s], all);
    double *to = x->states[s].forces = malloc((size_t)map->count * each * sizeof *to);
    if (!status && !to) status = no_memory();
    for (int k = 0; k < map->count && !status; k++)
      memcpy(to + (size_t)k * each, all + (size_t)map->tets[k] * each, each * sizeof *to);
  }
  free(differences);
  free(all);
  for (int k = 0; k < 2; k++) flesh_scene_destroy(&beside[k]);
  return status;
}

/* The adjoints of the columns of probes at a state. */
static int find_columns(flesh_fit_linear *self, linear_experiment *x, linear_state *state)
{
  int count = 0, status = FLESH_OK;
  for (int k = 0; k < x->e->measured_count; k++)
    if (x->e->measured[k].table == FLESH_FIT_OF_PROBES) count += x->e->measured[k].quantity_count;
  state->columns = calloc((size_t)count + 1, sizeof *state->columns);
  if (!state->columns) return no_memory();
  for (int k = 0; k < x->e->measured_count && !status; k++)
    for (int q = 0; q < x->e->measured[k].quantity_count && x->e->measured[k].table == FLESH_FIT_OF_PROBES && !status; q++) {
      flesh_asked asked;
      column *own = &state->columns[state->column_count++];
      own->answer = malloc((size_t)self->n * sizeof *own->answer);
      status = own->answer ? flesh_asked_find(x->scene, x->e->measured[k].quantities[q].name, state->t, &asked) : no_memory();
      if (status) return status;
      status = flesh_sensitivity_adjoint(state->at, &(flesh_quantity){asked.by_x, asked.of_residual}, own->answer);
      for (int d = 0; d < self->n; d++) own->answer[d] = (asked.of_residual ? asked.of_residual[d] : 0) - own->answer[d];
      flesh_asked_clear(&asked);
      self->fit->linear++;
    }
  return status;
}

static int linearise(flesh_fit_linear *self, int experiment, const double *p)
{
  flesh_fit *fit = self->fit;
  linear_experiment *x = &self->experiments[experiment];
  x->e = &fit->experiments[experiment];
  int status = flesh_fit_keep_at(fit, experiment, p);
  if (!status) status = flesh_fit_scene_at(fit, experiment, p, &x->scene);
  if (status) return status;
  const flesh_fit_kept *kept = &x->e->kept;
  flesh_solver_options options = *flesh_scene_solver(x->scene);
  options.linear_solver = FLESH_LINEAR_KLU; /* for many solves with one matrix */
  x->state_count = kept->count;
  x->states = calloc((size_t)kept->count + 1, sizeof *x->states);
  if (!x->states) return no_memory();
  for (int s = 0; s < kept->count && !status; s++) {
    linear_state *state = &x->states[s];
    state->t = kept->states[s].t;
    if (s < kept->has_start) continue;
    status = flesh_sensitivity_create(flesh_scene_system(x->scene), &options, tolerance, &state->at);
    if (!status) status = flesh_sensitivity_set(state->at, &kept->states[s], NULL);
    if (!status) status = find_columns(self, x, state);
  }
  return status ? status : find_forces(self, experiment, p);
}

/* The dofs of the map's tets, by the mesh, which all experiments have. */
static int find_dofs(flesh_fit_linear *self, const flesh_mesh *mesh)
{
  const flesh_fit_map *map = self->fit->map;
  self->size = flesh_mesh_order(mesh) == 2 ? 10 : 4;
  self->n = 3 * flesh_mesh_node_count(mesh);
  self->dofs = malloc((size_t)map->count * 3 * (size_t)self->size * sizeof *self->dofs);
  for (int k = 0; k < 2; k++) self->room[k] = malloc((size_t)self->n * sizeof(double));
  if (!self->dofs || !self->room[0] || !self->room[1]) return no_memory();
  for (int k = 0; k < map->count; k++) {
    int own[10];
    const int has = flesh_mesh_tet_nodes(mesh, map->tets[k], own);
    for (int i = 0; i < 3 * self->size; i++) self->dofs[3 * k * self->size + i] = i < 3 * has ? 3 * own[i / 3] + i % 3 : -1;
  }
  return FLESH_OK;
}

int flesh_fit_linear_create(flesh_fit *fit, const double *p, flesh_fit_linear **linear)
{
  flesh_fit_linear *self = calloc(1, sizeof *self);
  flesh_scene *scene = NULL;
  *linear = NULL;
  if (!self) return no_memory();
  self->fit = fit;
  self->experiments = calloc((size_t)fit->experiment_count, sizeof *self->experiments);
  self->size_of = malloc((size_t)fit->parameter_count * sizeof *self->size_of);
  int status = self->experiments && self->size_of ? flesh_fit_scene_at(fit, 0, p, &scene) : no_memory();
  if (!status) status = find_dofs(self, flesh_scene_mesh(scene));
  flesh_scene_destroy(&scene);
  for (int k = 0; k < fit->parameter_count && !status; k++) self->size_of[k] = flesh_fit_map_size(fit->map, p[k]);
  for (int e = 0; e < fit->experiment_count && !status; e++) status = linearise(self, e, p);
  if (status) flesh_fit_linear_destroy(&self);
  else *linear = self;
  return status;
}

void flesh_fit_linear_destroy(flesh_fit_linear **linear)
{
  flesh_fit_linear *self = *linear;
  if (!self) return;
  for (int e = 0; e < self->fit->experiment_count && self->experiments; e++) {
    linear_experiment *x = &self->experiments[e];
    for (int s = 0; s < x->state_count && x->states; s++) {
      flesh_sensitivity_destroy(&x->states[s].at);
      free(x->states[s].forces);
      for (int c = 0; c < x->states[s].column_count; c++) free(x->states[s].columns[c].answer);
      free(x->states[s].columns);
    }
    free(x->states);
    flesh_scene_destroy(&x->scene);
  }
  free(self->experiments);
  free(self->dofs);
  free(self->size_of);
  free(self->room[0]);
  free(self->room[1]);
  free(self);
  *linear = NULL;
}

/* Calls `at` for each datum that tells of a state: row is that of y, w its weight over the deviation; `c` the column of
 * probes, or -1 of positions. */
typedef void each_datum(void *data, const flesh_fit_measured *m, const flesh_fit_datum *d, int row, double w, int c);
static void visit(const linear_experiment *x, int s, each_datum *see, void *data)
{
  int row = x->e->first, first = 0;
  for (int k = 0; k < x->e->measured_count; k++) {
    const flesh_fit_measured *m = &x->e->measured[k];
    const int of_probes = m->table == FLESH_FIT_OF_PROBES;
    for (int i = 0; i < m->count; i++, row++) {
      int at[2];
      double weights[2];
      const int count = places_of(x, &m->data[i], at, weights);
      for (int w = 0; w < count; w++)
        if (at[w] == s)
          see(data, m, &m->data[i], row, weights[w] / m->data[i].deviation, of_probes ? first + m->data[i].quantity : -1);
    }
    if (of_probes) first += m->quantity_count;
  }
}

/* Vectors that a visit reads and writes. */
typedef struct product {
  const linear_state *state;
  int n;
  const double *force, *dx; /* of a change */
  double *y;
  const double *from;       /* y of a transposed product */
  double *by_x, *answer;
} product;

static double *entry(const flesh_fit_measured *m, const flesh_fit_datum *d, int a, double *x)
{
  return x + 3 * (size_t)m->points[d->row].nodes[a] + (size_t)(*m->quantities[d->quantity].name - 'x');
}

static void take(void *data, const flesh_fit_measured *m, const flesh_fit_datum *d, int row, double w, int c)
{
  product *p = data;
  double sum = 0;
  if (c >= 0)
    for (int i = 0; i < p->n; i++) sum += p->state->columns[c].answer[i] * p->force[i];
  else
    for (int a = 0; a < m->points[d->row].count; a++) sum += m->points[d->row].weights[a] * *entry(m, d, a, (double *)p->dx);
  p->y[row] += w * sum;
}

static void give(void *data, const flesh_fit_measured *m, const flesh_fit_datum *d, int row, double w, int c)
{
  product *p = data;
  const double y = w * p->from[row];
  if (c >= 0)
    for (int i = 0; i < p->n; i++) p->answer[i] += y * p->state->columns[c].answer[i];
  else
    for (int a = 0; a < m->points[d->row].count; a++) *entry(m, d, a, p->by_x) += m->points[d->row].weights[a] * y;
}

int flesh_fit_linear_times(flesh_fit_linear *self, const double *u, double *y)
{
  const flesh_fit *fit = self->fit;
  const size_t each = 3 * (size_t)self->size;
  int status = FLESH_OK;
  memset(y, 0, (size_t)fit->count * sizeof *y);
  for (int e = 0; e < fit->experiment_count; e++) {
    linear_experiment *x = &self->experiments[e];
    for (int s = 0; s < x->state_count && !status; s++) {
      linear_state *state = &x->states[s];
      double *force = self->room[0], *dx = self->room[1];
      if (!state->at) continue;
      memset(force, 0, (size_t)self->n * sizeof *force);
      for (size_t i = 0; i < each * (size_t)fit->parameter_count; i++)
        if (self->dofs[i] >= 0) force[self->dofs[i]] += u[i / each] * state->forces[i];
      status = flesh_sensitivity_respond(state->at, force, dx);
      self->fit->linear++;
      if (!status) visit(x, s, take, &(product){.state = state, .n = self->n, .force = force, .dx = dx, .y = y});
    }
  }
  return status;
}

int flesh_fit_linear_times_transposed(flesh_fit_linear *self, const double *y, double *u)
{
  const flesh_fit *fit = self->fit;
  const size_t each = 3 * (size_t)self->size;
  int status = FLESH_OK;
  double *lambda = malloc((size_t)self->n * sizeof *lambda);
  if (!lambda) return no_memory();
  memset(u, 0, (size_t)fit->parameter_count * sizeof *u);
  for (int e = 0; e < fit->experiment_count; e++) {
    linear_experiment *x = &self->experiments[e];
    for (int s = 0; s < x->state_count && !status; s++) {
      linear_state *state = &x->states[s];
      double *by_x = self->room[0], *answer = self->room[1];
      if (!state->at) continue;
      memset(by_x, 0, (size_t)self->n * sizeof *by_x);
      memset(answer, 0, (size_t)self->n * sizeof *answer);
      visit(x, s, give, &(product){.state = state, .n = self->n, .from = y, .by_x = by_x, .answer = answer});
      status = flesh_sensitivity_adjoint(state->at, &(flesh_quantity){by_x, NULL}, lambda);
      self->fit->linear++;
      for (size_t i = 0; i < each * (size_t)fit->parameter_count && !status; i++)
        if (self->dofs[i] >= 0) u[i / each] += (answer[self->dofs[i]] - lambda[self->dofs[i]]) * state->forces[i];
    }
  }
  free(lambda);
  return status;
}
