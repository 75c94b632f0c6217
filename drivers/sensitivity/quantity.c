/* quantity.c: columns of probes whose derivatives by the state are known: positions, velocities and reactions. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "mesh/mesh.h"
#include "output/tet_shape.h"
#include "sensitivity/sensitivity.h"

static int no_memory(void) { return flesh_fail(FLESH_ERR_MEMORY, "out of memory for derivatives"); }

/* The component of a column such as position_z, -1 for other columns. */
static int component_of(const char *column, const char *quantity)
{
  const size_t length = strlen(quantity);
  if (strncmp(column, quantity, length) || column[length] != '_' || !column[length + 1] || column[length + 2]) return -1;
  const int component = column[length + 1] - 'x';
  return component >= 0 && component < 3 ? component : -1;
}

/* Weights of the mean over a probe's nodes, or of the value at its point, in one component of a new vector. */
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

/* The constrained dofs of a probe's nodes in one component, as a new vector with 1 at each. */
static int make_reaction(const flesh_scene *scene, const flesh_probe *probe, int component, double t, double **weights)
{
  const size_t n = 3 * (size_t)flesh_mesh_node_count(flesh_scene_mesh(scene));
  uint8_t *fixed = calloc(n + 1, 1);
  *weights = calloc(n + 1, sizeof **weights);
  const int status = fixed && *weights ? FLESH_OK : no_memory();
  if (!status) flesh_system_fixed(flesh_scene_system(scene), t, fixed);
  for (int k = 0; k < probe->node_count && !status; k++) {
    const size_t d = 3 * (size_t)probe->nodes[k] + (size_t)component;
    (*weights)[d] = fixed[d] != 0;
  }
  free(fixed);
  return status;
}

static const flesh_probe *probe_named(const flesh_scene *scene, const char *name, size_t length)
{
  int count;
  const flesh_probe *probes = flesh_scene_probes(scene, &count);
  for (int k = 0; k < count; k++)
    if (strlen(probes[k].name) == length && !strncmp(probes[k].name, name, length)) return &probes[k];
  return NULL;
}

/* Fills in the derivatives of a column that there is. */
static int differentiate(const flesh_scene *scene, const flesh_probe *probe, const char *column, double t,
                         flesh_asked *asked)
{
  const int is_static = flesh_scene_times(scene)->method == FLESH_METHOD_STATIC;
  int component;
  if ((component = component_of(column, "position")) >= 0) {
    asked->unit = "m";
    return (asked->by_x = new_mean(scene, probe, component)) ? FLESH_OK : no_memory();
  }
  if ((component = component_of(column, "velocity")) >= 0 && !is_static) {
    asked->unit = "m/s";
    return (asked->by_v = new_mean(scene, probe, component)) ? FLESH_OK : no_memory();
  }
  if ((component = component_of(column, "reaction")) < 0 || !is_static || probe->node_count < 1)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "--of is %s; derivatives are of position_x, _y or _z, in motions of velocity_x and in equilibria of "
                      "reaction_x", asked->name);
  if (probe->holder != 0)
    return flesh_fail(FLESH_ERR_ARGUMENT, "--of is %s; derivatives are of reactions to all pins and prescribed motions, "
                      "not to one of them", asked->name);
  asked->unit = "N";
  return make_reaction(scene, probe, component, t, &asked->of_residual);
}

int flesh_asked_find(const flesh_scene *scene, const char *name, double t, flesh_asked *asked)
{
  const char *dot = strrchr(name, '.');
  const flesh_probe *probe = dot ? probe_named(scene, name, (size_t)(dot - name)) : NULL;
  *asked = (flesh_asked){0};
  snprintf(asked->name, sizeof asked->name, "%s", name);
  if (!probe)
    return flesh_fail(FLESH_ERR_ARGUMENT, "--of is '%s'; it must be PROBE.COLUMN for a probe of output.probes, such as "
                      "tip.position_z", name);
  return differentiate(scene, probe, dot + 1, t, asked);
}

static double product(size_t n, const double *weights, const double *values)
{
  double sum = 0;
  for (size_t d = 0; d < n && weights; d++) sum += weights[d] * values[d];
  return sum;
}

void flesh_asked_measure(const flesh_scene *scene, const flesh_state *state, const double *residual, flesh_asked *asked)
{
  const size_t n = 3 * (size_t)flesh_mesh_node_count(flesh_scene_mesh(scene));
  asked->value = product(n, asked->by_x, state->x) + product(n, asked->by_v, state->v) +
                 product(n, residual ? asked->of_residual : NULL, residual);
}

void flesh_asked_clear(flesh_asked *asked)
{
  free(asked->by_x);
  free(asked->by_v);
  free(asked->of_residual);
  *asked = (flesh_asked){0};
}
