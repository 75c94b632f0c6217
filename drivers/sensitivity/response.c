/* response.c: columns of probes and their derivatives by the state: known ones for positions, velocities and reactions,
 * closed expressions at each state for quantities of tets, and a product with the tangent there for other forces. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "cli/interrupt.h"
#include "mesh/mesh.h"
#include "output/node_forces.h"
#include "output/probe_place.h"
#include "output/tet_shape.h"
#include "run/start.h"
#include "scene/scene.h"
#include "sensitivity/forces.h"
#include "sensitivity/sensitivity.h"
#include "system/parts.h"

/* Relative residual of linear solves for derivatives of forces. */
static const double force_tolerance = 1e-10;

/* Returns a new vector with the weights of the mean over a probe's nodes, or of the value at its point, in the column's
 * component. */
static double *new_mean(const flesh_scene *scene, const flesh_probe *probe, flesh_response *response)
{
  double *by = flesh_arena_take(&response->memory, (size_t)response->n * sizeof *by);
  int nodes[10];
  double weights[10];
  const int point = !isnan(probe->point[0]);
  const int count = point ? flesh_tet_weights(flesh_scene_mesh(scene), probe->tet, probe->weights, nodes, weights)
                          : probe->node_count;
  for (int k = 0; by && k < count; k++)
    by[3 * (size_t)(point ? nodes[k] : probe->nodes[k]) + (size_t)response->column] = point ? weights[k] : 1. / count;
  return by;
}

/* Makes the weights of a reaction: 1 at the constrained dofs of a probe's nodes in the column's component, of its pin only if
 * it has one. */
static int make_reaction(const flesh_scene *scene, const flesh_probe *probe, double t, flesh_response *response)
{
  int *holder = flesh_arena_take(&response->memory, (size_t)response->n * sizeof *holder);
  response->of_residual = flesh_arena_take(&response->memory, (size_t)response->n * sizeof *response->of_residual);
  if (!holder || !response->of_residual) return flesh_no_memory();
  flesh_system_holders(flesh_scene_system(scene), t, holder);
  for (int k = 0; k < probe->node_count; k++) {
    const size_t d = 3 * (size_t)probe->nodes[k] + (size_t)response->column;
    response->of_residual[d] = probe->holder ? holder[d] == probe->holder : holder[d] != 0;
  }
  return FLESH_OK;
}

const flesh_probe *flesh_probe_of(const flesh_scene *scene, const char *column)
{
  int count;
  const flesh_probe *probes = flesh_scene_probes(scene, &count);
  const char *dot = strrchr(column, '.');
  for (int k = 0; k < count && dot; k++)
    if (strlen(probes[k].name) == (size_t)(dot - column) && !strncmp(probes[k].name, column, (size_t)(dot - column)))
      return &probes[k];
  return NULL;
}

int flesh_probe_is_at_pin(const flesh_scene *scene, const flesh_probe *probe, double t, int *is)
{
  const flesh_mesh *mesh = flesh_scene_mesh(scene);
  uint8_t *fixed = calloc(3 * (size_t)flesh_mesh_node_count(mesh) + 1, 1);
  *is = 0;
  if (!fixed) return flesh_no_memory();
  flesh_system_fixed(flesh_scene_system(scene), t, fixed);
  for (size_t a = 0; a < 4 && !isnan(probe->point[0]); a++) {
    const uint8_t *node = fixed + 3 * (size_t)flesh_mesh_tets(mesh)[4 * (size_t)probe->tet + a];
    *is |= node[0] || node[1] || node[2];
  }
  free(fixed);
  return FLESH_OK;
}

/* Finds the quantity of a column, whether the probe has that or not, with the column's index and unit. Returns whether
 * there is one. */
static int find_column(const flesh_probe *probe, const char *column, flesh_response *response)
{
  flesh_probe_column columns[FLESH_PROBE_COLUMNS];
  flesh_probe *alone = &response->probe;
  *alone = *probe;
  for (alone->quantities = 1; alone->quantities <= FLESH_PROBE_CONTACT_FORCE; alone->quantities *= 2)
    for (response->column = flesh_probe_columns(alone, columns); response->column-- > 0;) {
      if (strcmp(columns[response->column].name, column)) continue;
      snprintf(response->unit, sizeof response->unit, "%s", columns[response->column].unit);
      return 1;
    }
  return 0;
}

/* Opens the probe of a column of tets or of forces. */
static int open_probe(const flesh_scene *scene, flesh_response *response)
{
  const unsigned pressed = FLESH_PROBE_STRESS | FLESH_PROBE_REACTION;
  const flesh_system *system = flesh_scene_system(scene);
  flesh_probe *alone = &response->probe;
  if (alone->quantities & pressed && flesh_system_multiplier_count(system))
    return flesh_fail(FLESH_ERR_ARGUMENT, "derivatives of it do not know the pressure of incompressible tets (poisson 0.5)");
  int status = flesh_probe_prepare(alone, &scene->body, system);
  if (!status) status = flesh_probes_open(&scene->body, system, flesh_scene_times(scene)->method, 1, alone, &response->probes);
  if (status) return status;
  response->figures = flesh_arena_take(&response->memory, FLESH_PROBE_COLUMNS * FLESH_PROBE_FIGURES * sizeof(double));
  if (response->figures) flesh_probes_note(response->probes, response->figures);
  return response->figures ? FLESH_OK : flesh_no_memory();
}

/* Sets the derivatives of a column. */
static int differentiate(const flesh_scene *scene, const flesh_probe *probe, const char *column, double t,
                         flesh_response *response)
{
  const int is_static = flesh_scene_times(scene)->method == FLESH_METHOD_STATIC, is = find_column(probe, column, response);
  const unsigned quantity = response->probe.quantities;
  if (!is || (is_static && quantity == FLESH_PROBE_VELOCITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "a probe has no such column, or in equilibria no velocity");
  if (quantity == FLESH_PROBE_POSITION || quantity == FLESH_PROBE_VELOCITY) {
    double *by = new_mean(scene, probe, response);
    *(quantity == FLESH_PROBE_POSITION ? &response->by_x : &response->by_v) = by;
    return by ? FLESH_OK : flesh_no_memory();
  }
  const int is_linear = is_static && !*flesh_scene_tangents_refused(scene) && probe->node_count >= 1;
  return quantity == FLESH_PROBE_REACTION && response->column < 3 && is_linear ? make_reaction(scene, probe, t, response)
                                                                               : open_probe(scene, response);
}

/* Returns the length of a column's name without .mean or .integral, and sets *over by that ending. */
static size_t find_over(const char *name, flesh_over *over)
{
  static const char *const endings[] = {[FLESH_INTEGRAL] = ".integral", [FLESH_MEAN] = ".mean"};
  const char *dot = strrchr(name, '.');
  *over = FLESH_AT_END;
  for (int k = FLESH_INTEGRAL; k <= FLESH_MEAN && dot; k++)
    if (!strcmp(dot, endings[k])) *over = (flesh_over)k;
  return *over ? (size_t)(dot - name) : strlen(name);
}

int flesh_response_find(const flesh_scene *scene, const char *name, double t, flesh_response *response)
{
  char column[FLESH_LIST_ITEM];
  *response = (flesh_response){0};
  snprintf(response->name, sizeof response->name, "%s", name);
  response->n = 3 * flesh_mesh_node_count(flesh_scene_mesh(scene));
  snprintf(column, sizeof column, "%.*s", (int)find_over(name, &response->over), name);
  const flesh_probe *probe = flesh_probe_of(scene, column);
  if (!probe)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "it must be PROBE.COLUMN, a column of a probe that the scene has in output.probes");
  if (response->over && !*flesh_scene_tangents_refused(scene))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "means and integrals over time are of motions, and of equilibria that depend on those before");
  const int status = differentiate(scene, probe, strrchr(column, '.') + 1, t, response);
  if (response->over == FLESH_INTEGRAL)
    strcpy(response->unit + strcspn(response->unit, response->by_v ? "/" : ""), response->by_v ? "" : " s");
  return status;
}

static double product(int n, const double *weights, const double *values)
{
  double sum = 0;
  for (int d = 0; d < n && weights; d++) sum += weights[d] * values[d];
  return sum;
}

void flesh_response_measure(const double *residual, flesh_response *response)
{
  if (response->of_residual) response->value = product(response->n, response->of_residual, residual);
}

int flesh_response_observe(const flesh_scene *scene, const flesh_step_record *record, flesh_response *response)
{
  const flesh_state *state = record->state;
  const int n = response->n;
  flesh_step_record own = *record;
  if (!response->over && !record->last) return FLESH_OK;
  if (record->system != flesh_scene_system(scene)) own.system = flesh_scene_system(scene), own.proximity = NULL;
  const int status = response->probes ? flesh_probes_observe(response->probes, &own) : FLESH_OK;
  const double now = response->probes ? response->figures[FLESH_PROBE_FIGURES * response->column]
                                      : product(n, response->by_x, state->x) + product(n, response->by_v, state->v),
               mean = (response->last + now) / 2;
  if (record->step == 0) response->begin = state->t;
  const double before = state->t - record->h - response->begin, all = state->t - response->begin;
  if (response->over == FLESH_AT_END || record->step == 0) response->value = response->over == FLESH_INTEGRAL ? 0 : now;
  else if (response->over == FLESH_INTEGRAL) response->value += record->h * mean;
  else response->value = (response->value * before + record->h * mean) / all;
  response->last = now;
  return status;
}

/* Computes the weights [n] of node forces in a column, and the part of by_x [n] that comes from the change of the arms
 * of moments. */
static void weigh(const flesh_response *response, const double *x, const double *force, const uint8_t *held,
                  double *weights, double *by_x)
{
  const flesh_probe *probe = &response->probe;
  const int c = response->column % 3, e = (c + 1) % 3, g = (c + 2) % 3;
  for (int k = 0; k < probe->node_count; k++) {
    const size_t at = 3 * (size_t)probe->nodes[k];
    double *w = weights + at;
    if (response->column < 3) w[c] = held[at + (size_t)c];
    else {
      w[g] = held[at + (size_t)g] * (x[at + (size_t)e] - probe->about[e]);
      w[e] = held[at + (size_t)e] * (probe->about[g] - x[at + (size_t)g]);
      by_x[at + (size_t)e] += held[at + (size_t)g] * force[at + (size_t)g];
      by_x[at + (size_t)g] -= held[at + (size_t)e] * force[at + (size_t)e];
    }
  }
}

/* Adds to by [2*n] the derivatives of a reaction, a contact force, or a moment. */
static int differentiate_forces(const flesh_scene *scene, const flesh_step_record *record, flesh_response *response, double *by)
{
  const flesh_system *system = flesh_scene_system(scene);
  const flesh_probe *probe = &response->probe;
  const int contact = probe->quantities == FLESH_PROBE_CONTACT_FORCE, effects = flesh_system_effect_count(system);
  const int is_static = flesh_scene_times(scene)->method == FLESH_METHOD_STATIC;
  flesh_node_forces *forces = flesh_probes_forces(response->probes);
  if (contact && record->stage->t != record->state->t)
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s: contact forces are of a time within the step; derivatives are of those at its "
                                          "end, as backward-euler and newmark have them", response->name);
  int status = FLESH_OK;
  if (!response->tangent.system)
    status = flesh_stage_tangent_create(system, flesh_scene_solver(scene), force_tolerance, &response->tangent);
  double *w = calloc((size_t)response->n + 1, sizeof *w);
  uint8_t *held = calloc((size_t)response->n + (size_t)effects, 1), *left_out = held + response->n;
  if (!status && (!w || !held)) status = flesh_no_memory();
  if (!status) {
    const double *force = !contact ? forces->reaction : forces->contact;
    if (contact && probe->contact) force = flesh_node_forces_of_contact(forces, record, probe->contact - 1);
    for (int e = 0; e < effects; e++)
      left_out[e] = probe->contact ? e != probe->contact - 1
                                   : flesh_system_effect(system, e)->operations->role != FLESH_ROLE_CONTACT;
    for (int d = 0; d < response->n; d++)
      held[d] = contact || (forces->constrained[d] && (!probe->holder || forces->holder[d] == probe->holder));
    weigh(response, record->state->x, force, held, w, by);
    for (int d = 0; d < response->n && contact; d++) w[d] = -w[d];
    const flesh_force_sum sum = {record->state, is_static ? NULL : forces->a, w, contact ? left_out : NULL};
    status = flesh_force_slopes(&response->tangent, &sum, by, by + response->n);
  }
  free(w);
  free(held);
  return status;
}

/* Adds a row with the nonzero derivatives among by [2*n]. */
static int add_row(double t, const double *by, flesh_response *response)
{
  size_t count = 0;
  for (int d = 0; d < 2 * response->n; d++) count += by[d] != 0;
  flesh_response_row *row = flesh_arena_take(&response->memory, sizeof *row);
  if (!row) return flesh_no_memory();
  *row = (flesh_response_row){.t = t, .at = flesh_arena_take(&response->memory, count * sizeof *row->at),
                              .by = flesh_arena_take(&response->memory, count * sizeof *row->by), .before = response->rows};
  if (!row->at || !row->by) return flesh_no_memory();
  for (int d = 0; d < 2 * response->n; d++)
    if (by[d] != 0) row->at[row->count] = d, row->by[row->count++] = by[d];
  response->rows = row;
  return FLESH_OK;
}

int flesh_response_differentiate(const flesh_scene *scene, const flesh_step_record *record, flesh_response *response)
{
  if (!response->probes || (!response->over && !record->last)) return FLESH_OK;
  double *by = calloc(2 * (size_t)response->n + 1, sizeof *by);
  int status = by ? FLESH_OK : flesh_no_memory();
  if (!status && response->probe.quantities & FLESH_PROBE_OF_TETS)
    flesh_probes_differentiate(response->probes, record->state, response->column, by);
  else if (!status) status = differentiate_forces(scene, record, response, by);
  if (!status) status = add_row(record->state->t, by, response);
  free(by);
  return status;
}

int flesh_response_visit(void *data, double t, double *by_x, double *by_v)
{
  const flesh_response *response = data;
  const flesh_response_row *row = response->rows;
  while (row->before && fabs(row->before->t - t) < fabs(row->t - t)) row = row->before;
  for (int i = 0; i < row->count; i++)
    *(row->at[i] < response->n ? by_x + row->at[i] : by_v + row->at[i] - response->n) += row->by[i];
  return FLESH_OK;
}

int flesh_response_run(const flesh_scene *scene, const flesh_solver_options *solver, const flesh_observer *observer,
                       flesh_state *state, flesh_integrator **integrator, double tolerance, flesh_trajectory **trajectory)
{
  const flesh_scene_time *time = flesh_scene_times(scene);
  const flesh_system *system = flesh_scene_system(scene);
  const flesh_run_options options = {.h = time->step, .end = time->end, .stop = flesh_interrupt_asked, .observer_count = 1,
                                     .observers = observer};
  int status = flesh_start_make(scene, state);
  if (!status) status = flesh_start_integrator(scene, system, solver, integrator);
  if (!status && trajectory)
    status = flesh_trajectory_create(*integrator, tolerance, FLESH_TRAJECTORY_STATES, trajectory);
  return status ? status : flesh_run(system, *integrator, &options, state, NULL);
}

void flesh_response_clear(flesh_response *response)
{
  flesh_probes_close(&response->probes);
  if (response->tangent.system) flesh_stage_tangent_clear(&response->tangent);
  flesh_arena_free(&response->memory);
  *response = (flesh_response){0};
}
