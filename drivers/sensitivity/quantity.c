/* quantity.c: columns of probes and their derivatives by the state: known ones for positions, velocities and reactions,
 * closed expressions at each state for quantities of tets, and a product with the tangent there for other forces. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "mesh/mesh.h"
#include "output/node_forces.h"
#include "output/probe_place.h"
#include "output/tet_shape.h"
#include "scene/scene.h"
#include "sensitivity/forces.h"
#include "sensitivity/sensitivity.h"

/* Relative residual of linear solves. */
static const double tolerance = 1e-10;

/* Returns the component of a column such as position_z; -1 for other columns. */
static int component_of(const char *column, const char *quantity)
{
  const size_t length = strlen(quantity);
  if (strncmp(column, quantity, length) || column[length] != '_' || !column[length + 1] || column[length + 2]) return -1;
  const int component = column[length + 1] - 'x';
  return component >= 0 && component < 3 ? component : -1;
}

/* Returns a new vector with the weights of the mean over a probe's nodes, or of the value at its point, in one
 * component. */
static double *new_mean(const flesh_scene *scene, const flesh_probe *probe, int component)
{
  double *by = calloc(3 * (size_t)flesh_mesh_node_count(flesh_scene_mesh(scene)) + 1, sizeof *by);
  int nodes[10];
  double weights[10];
  const int point = !isnan(probe->point[0]);
  const int count = point ? flesh_tet_weights(flesh_scene_mesh(scene), probe->tet, probe->weights, nodes, weights)
                          : probe->node_count;
  for (int k = 0; by && k < count; k++)
    by[3 * (size_t)(point ? nodes[k] : probe->nodes[k]) + (size_t)component] = point ? weights[k] : 1. / count;
  return by;
}

/* Makes a new vector that is 1 at the constrained dofs of a probe's nodes in one component. */
static int make_reaction(const flesh_scene *scene, const flesh_probe *probe, int component, double t, double **weights)
{
  const size_t n = 3 * (size_t)flesh_mesh_node_count(flesh_scene_mesh(scene));
  uint8_t *fixed = calloc(n + 1, 1);
  *weights = calloc(n + 1, sizeof **weights);
  const int status = fixed && *weights ? FLESH_OK : flesh_no_memory();
  if (!status) flesh_system_fixed(flesh_scene_system(scene), t, fixed);
  for (int k = 0; k < probe->node_count && !status; k++) {
    const size_t d = 3 * (size_t)probe->nodes[k] + (size_t)component;
    (*weights)[d] = fixed[d] != 0;
  }
  free(fixed);
  return status;
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

/* Opens a probe with this column only, which is one of tets or of forces. */
static int open_column(const flesh_scene *scene, const flesh_probe *probe, const char *column, flesh_asked *asked)
{
  const unsigned forces = FLESH_PROBE_REACTION | FLESH_PROBE_CONTACT_FORCE, pressed = FLESH_PROBE_STRESS | FLESH_PROBE_REACTION;
  flesh_probe_column columns[FLESH_PROBE_COLUMNS];
  flesh_probe *alone = &asked->probe;
  const flesh_system *system = flesh_scene_system(scene);
  int is = 0;
  *alone = *probe;
  for (unsigned k = 1; k <= (FLESH_PROBE_OF_TETS | forces) && !is; k *= 2) {
    if (!(k & (FLESH_PROBE_OF_TETS | forces))) continue;
    alone->quantities = k;
    asked->column = flesh_probe_columns(alone, columns);
    while (asked->column && !is) is = !strcmp(columns[--asked->column].name, column);
  }
  if (!is) return flesh_fail(FLESH_ERR_ARGUMENT, "a probe has no such column, or in equilibria no velocity");
  if (alone->quantities & pressed && flesh_system_multiplier_count(system))
    return flesh_fail(FLESH_ERR_ARGUMENT, "derivatives of it do not know the pressure of incompressible tets (poisson 0.5)");
  snprintf(asked->unit, sizeof asked->unit, "%s", columns[asked->column].unit);
  int status = flesh_probe_prepare(alone, &scene->body, system);
  if (!status) status = flesh_probes_open(&scene->body, system, flesh_scene_times(scene)->method, 1, alone, &asked->probes);
  if (status) return status;
  asked->figures = calloc(FLESH_PROBE_COLUMNS * FLESH_PROBE_FIGURES, sizeof *asked->figures);
  if (asked->figures) flesh_probes_note(asked->probes, asked->figures);
  return asked->figures ? FLESH_OK : flesh_no_memory();
}

/* Sets the derivatives of a column that exists. */
static int differentiate(const flesh_scene *scene, const flesh_probe *probe, const char *column, double t,
                         flesh_asked *asked)
{
  const int is_static = flesh_scene_times(scene)->method == FLESH_METHOD_STATIC;
  int component;
  if ((component = component_of(column, "position")) >= 0) {
    strcpy(asked->unit, "m");
    return (asked->by_x = new_mean(scene, probe, component)) ? FLESH_OK : flesh_no_memory();
  }
  if ((component = component_of(column, "velocity")) >= 0 && !is_static) {
    strcpy(asked->unit, "m/s");
    return (asked->by_v = new_mean(scene, probe, component)) ? FLESH_OK : flesh_no_memory();
  }
  component = component_of(column, "reaction");
  if (component < 0 || !is_static || *flesh_scene_tangents_refused(scene) || probe->node_count < 1 || probe->holder != 0)
    return open_column(scene, probe, column, asked);
  strcpy(asked->unit, "N");
  return make_reaction(scene, probe, component, t, &asked->of_residual);
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

int flesh_asked_find(const flesh_scene *scene, const char *name, double t, flesh_asked *asked)
{
  char column[FLESH_LIST_ITEM];
  *asked = (flesh_asked){0};
  snprintf(asked->name, sizeof asked->name, "%s", name);
  asked->n = 3 * flesh_mesh_node_count(flesh_scene_mesh(scene));
  snprintf(column, sizeof column, "%.*s", (int)find_over(name, &asked->over), name);
  const flesh_probe *probe = flesh_probe_of(scene, column);
  if (!probe)
    return flesh_fail(FLESH_ERR_ARGUMENT, "it must be PROBE.COLUMN for a probe of output.probes, such as tip.position_z");
  if (asked->over && !*flesh_scene_tangents_refused(scene))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "means and integrals over time are of motions, and of equilibria that depend on those before");
  const int status = differentiate(scene, probe, strrchr(column, '.') + 1, t, asked);
  if (asked->over == FLESH_INTEGRAL) strcpy(asked->unit + strcspn(asked->unit, asked->by_v ? "/" : ""), asked->by_v ? "" : " s");
  return status;
}

static double product(size_t n, const double *weights, const double *values)
{
  double sum = 0;
  for (size_t d = 0; d < n && weights; d++) sum += weights[d] * values[d];
  return sum;
}

void flesh_asked_measure(const flesh_scene *scene, const double *residual, flesh_asked *asked)
{
  const size_t n = 3 * (size_t)flesh_mesh_node_count(flesh_scene_mesh(scene));
  if (asked->of_residual) asked->value = product(n, asked->of_residual, residual);
}

int flesh_asked_go_on(const flesh_scene *scene, const flesh_step_record *record, flesh_asked *asked)
{
  const flesh_state *state = record->state;
  const size_t n = 3 * (size_t)flesh_mesh_node_count(flesh_scene_mesh(scene));
  flesh_step_record own = *record;
  if (!asked->over && !record->last) return FLESH_OK;
  if (record->system != flesh_scene_system(scene)) own.system = flesh_scene_system(scene), own.proximity = NULL;
  const int status = asked->probes ? flesh_probes_observe(asked->probes, &own) : FLESH_OK;
  const double now = asked->probes ? asked->figures[FLESH_PROBE_FIGURES * asked->column]
                                   : product(n, asked->by_x, state->x) + product(n, asked->by_v, state->v),
               mean = (asked->last + now) / 2;
  if (record->step == 0) asked->begin = state->t;
  const double before = state->t - record->h - asked->begin, all = state->t - asked->begin;
  if (asked->over == FLESH_AT_END || record->step == 0) asked->value = asked->over == FLESH_INTEGRAL ? 0 : now;
  else if (asked->over == FLESH_INTEGRAL) asked->value += record->h * mean;
  else asked->value = (asked->value * before + record->h * mean) / all;
  asked->last = now;
  return status;
}

/* Computes the weights [n] of node forces in a column, and the part of by_x [n] that comes from the change of the arms
 * of moments. */
static void weigh(const flesh_asked *asked, const double *x, const double *force, const uint8_t *held, double *weights,
                  double *by_x)
{
  const flesh_probe *probe = &asked->probe;
  const int c = asked->column % 3, e = (c + 1) % 3, g = (c + 2) % 3;
  for (int k = 0; k < probe->node_count; k++) {
    const size_t at = 3 * (size_t)probe->nodes[k];
    double *w = weights + at;
    if (asked->column < 3) w[c] = held[at + (size_t)c];
    else {
      w[g] = held[at + (size_t)g] * (x[at + (size_t)e] - probe->about[e]);
      w[e] = held[at + (size_t)e] * (probe->about[g] - x[at + (size_t)g]);
      by_x[at + (size_t)e] += held[at + (size_t)g] * force[at + (size_t)g];
      by_x[at + (size_t)g] -= held[at + (size_t)e] * force[at + (size_t)e];
    }
  }
}

/* Adds to by [2*n] the derivatives of a reaction, a contact force, or a moment. */
static int differentiate_forces(const flesh_scene *scene, const flesh_step_record *record, flesh_asked *asked, double *by)
{
  const flesh_system *system = flesh_scene_system(scene);
  const flesh_probe *probe = &asked->probe;
  const int contact = probe->quantities == FLESH_PROBE_CONTACT_FORCE, effects = flesh_system_effect_count(system);
  const int is_static = flesh_scene_times(scene)->method == FLESH_METHOD_STATIC;
  flesh_node_forces *forces = flesh_probes_forces(asked->probes);
  if (contact && record->stage->t != record->state->t)
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s: contact forces are of a time within the step; derivatives are of those at its "
                                          "end, as backward-euler and newmark have them", asked->name);
  int status = FLESH_OK;
  if (!asked->tangent.system)
    status = flesh_stage_tangent_create(system, flesh_scene_solver(scene), tolerance, &asked->tangent);
  double *w = calloc((size_t)asked->n + 1, sizeof *w);
  uint8_t *held = calloc((size_t)asked->n + (size_t)effects, 1), *left_out = held + asked->n;
  if (!status && (!w || !held)) status = flesh_no_memory();
  if (!status) {
    const double *force = !contact ? forces->reaction : forces->contact;
    if (contact && probe->contact) force = flesh_node_forces_of_contact(forces, record, probe->contact - 1);
    for (int e = 0; e < effects; e++)
      left_out[e] = probe->contact ? e != probe->contact - 1
                                   : flesh_system_effect(system, e)->operations->role != FLESH_ROLE_CONTACT;
    for (int d = 0; d < asked->n; d++)
      held[d] = contact || (forces->constrained[d] && (!probe->holder || forces->holder[d] == probe->holder));
    weigh(asked, record->state->x, force, held, w, by);
    for (int d = 0; d < asked->n && contact; d++) w[d] = -w[d];
    const flesh_force_sum sum = {record->state, is_static ? NULL : forces->a, w, contact ? left_out : NULL};
    status = flesh_force_slopes(&asked->tangent, &sum, by, by + asked->n);
  }
  free(w);
  free(held);
  return status;
}

int flesh_asked_keep(const flesh_scene *scene, const flesh_step_record *record, flesh_asked *asked)
{
  const int n = asked->n;
  if (!asked->probes || (!asked->over && !record->last)) return FLESH_OK;
  if (!flesh_grow(&asked->rows, sizeof *asked->rows, asked->row_count, &asked->row_room)) return flesh_no_memory();
  double *by = calloc(2 * (size_t)n + 1, sizeof *by);
  int count = 0, status = by ? FLESH_OK : flesh_no_memory();
  if (!status && asked->probe.quantities & FLESH_PROBE_OF_TETS)
    flesh_probes_differentiate(asked->probes, record->state, asked->column, by);
  else if (!status) status = differentiate_forces(scene, record, asked, by);
  for (int d = 0; d < 2 * n && !status; d++) count += by[d] != 0;
  flesh_asked_row *row = &asked->rows[asked->row_count++];
  *row = (flesh_asked_row){record->state->t, 0, malloc(((size_t)count + 1) * sizeof(int)),
                           malloc(((size_t)count + 1) * sizeof(double))};
  if (!status && (!row->at || !row->by)) status = flesh_no_memory();
  for (int d = 0; d < 2 * n && !status; d++)
    if (by[d] != 0) row->at[row->count] = d, row->by[row->count++] = by[d];
  free(by);
  return status;
}

int flesh_asked_visit(void *data, double t, double *by_x, double *by_v)
{
  const flesh_asked *asked = data;
  int k = asked->row_count - 1;
  while (k > 0 && fabs(asked->rows[k - 1].t - t) < fabs(asked->rows[k].t - t)) k--;
  const flesh_asked_row *row = &asked->rows[k];
  for (int i = 0; i < row->count; i++) *(row->at[i] < asked->n ? by_x + row->at[i] : by_v + row->at[i] - asked->n) += row->by[i];
  return FLESH_OK;
}

void flesh_asked_clear(flesh_asked *asked)
{
  free(asked->by_x);
  free(asked->by_v);
  free(asked->of_residual);
  flesh_probes_close(&asked->probes);
  if (asked->tangent.system) flesh_stage_tangent_clear(&asked->tangent);
  free(asked->figures);
  for (int k = 0; k < asked->row_count; k++) {
    free(asked->rows[k].at);
    free(asked->rows[k].by);
  }
  free(asked->rows);
  *asked = (flesh_asked){0};
}
