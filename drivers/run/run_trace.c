/* run_trace.c: records every step of a run; finds the step with the most iterations, compared with the median, and a
 * body at rest that is stressed without any load: a tangle, or another stable shape than that at rest. */
#include "run/run_trace.h"

#include <gsl/gsl_statistics_long.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/error.h"
#include "base/memory.h"
#include "system/one_effect.h"

int flesh_run_trace_observe(void *data, const flesh_step_record *record)
{
  flesh_run_trace *trace = data;
  if (!flesh_grow(&trace->rows, sizeof *trace->rows, trace->count, &trace->room)) return flesh_no_memory();
  const flesh_system *system = record->system;
  const double strain = flesh_system_role_energy(system, FLESH_ROLE_ELASTICITY, record->energies) -
                        flesh_system_role_energy(system, FLESH_ROLE_ELASTICITY, record->rest_energies);
  trace->rows[trace->count++] = (flesh_run_trace_row){
      .t = record->state->t, .step = record->step, .strain = strain,
      .kinetic = flesh_system_role_energy(system, FLESH_ROLE_INERTIA, record->energies),
      .newton = record->step ? record->stats->newton : 0, .linear = record->step ? record->stats->linear : 0,
      .cuts = record->step ? record->stats->rejected + record->stats->convergence_failures : 0};
  return FLESH_OK;
}

void flesh_run_trace_clear(flesh_run_trace *trace)
{
  free(trace->rows);
  *trace = (flesh_run_trace){0};
}

enum { LEAST_OF_MEDIAN = 3 }; /* number of steps of which a median is taken */

/* Returns the median over the steps of the Newton iterations, plus the linear ones if `all`; NaN if there are too few
 * steps or out of memory. */
static double median_of(const flesh_run_trace *trace, int all)
{
  long *iterations = malloc(sizeof *iterations * ((size_t)trace->count + 1));
  int count = 0;
  if (!iterations) return NAN;
  for (int k = 0; k < trace->count; k++)
    if (trace->rows[k].newton > 0) iterations[count++] = trace->rows[k].newton + (all ? trace->rows[k].linear : 0);
  const double median = count < LEAST_OF_MEDIAN ? NAN : gsl_stats_long_median(iterations, 1, (size_t)count);
  free(iterations);
  return median;
}

flesh_longest_step flesh_longest_step_find(const flesh_run_trace *trace, long newton, long linear)
{
  const double of_newton = median_of(trace, 0), of_all = median_of(trace, 1);
  flesh_longest_step longest = {.t = NAN, .ratio = NAN};
  for (int k = 0; k <= trace->count; k++) {
    const int finished = k < trace->count;
    const long n = finished ? trace->rows[k].newton : newton, l = finished ? trace->rows[k].linear : linear;
    const double ratio = fmax((double)n / of_newton, (double)(n + l) / of_all);
    if (n <= 0 || !(ratio > longest.ratio || (isnan(longest.ratio) && isfinite(ratio)))) continue;
    const long before = k > 0 ? trace->rows[k - 1].step : 0;
    longest = (flesh_longest_step){finished ? trace->rows[k].step : before + 1, finished ? trace->rows[k].t : NAN,
                                   n, l, finished ? trace->rows[k].cuts : 0, ratio};
  }
  return longest;
}

int flesh_longest_step_tell(const flesh_longest_step *longest, size_t size, char *words)
{
  char place[48] = "not finished", cuts[48] = "";
  if (size) *words = 0;
  if (!(longest->ratio > FLESH_LONG_STEP)) return 0;
  if (isfinite(longest->t)) snprintf(place, sizeof place, "to t = %.6g s", longest->t);
  if (longest->cuts) snprintf(cuts, sizeof cuts, ", with cuts: %ld", longest->cuts);
  snprintf(words, size, "step %ld (%s) took %ld Newton and %ld linear iterations, %.4g times the median step%s",
           longest->step, place, longest->newton, longest->linear, longest->ratio, cuts);
  return 1;
}

/* Limits as shares of the force that strains the body: on what a node may be out of balance by, and on the loads at
 * it. */
static const double unbalanced_share = 0.02, load_share = 1e-3;
/* Limit on the work of loads, as a share of the strain energy; even small loads bend thin bodies far. */
static const double work_share = 0.01;
/* Least strain energy that is considered, as a share of that of a body strained by 1. */
static const double least_stored = 1e-6;
/* Limits for a body at rest: its kinetic energy and its change of strain energy, as shares of the strain energy. */
static const double moving_share = 1e-4, changing_share = 1e-3;
enum { LEAST_STEPS = 5 };

/* Computes the strain energy of a free body at rest relative to the mesh's shape, and the stiffness mu V, J. Returns 0
 * if the body has none. */
static int find_least(const flesh_scene *scene, double *least, double *stiffness, double *mu)
{
  const flesh_body *body = flesh_scene_body(scene);
  const double *volumes = flesh_mesh_tet_volumes(body->mesh);
  *least = *stiffness = *mu = 0;
  for (int t = 0; body->materials && t < flesh_mesh_tet_count(body->mesh); t++) {
    const flesh_material *material = &body->materials[body->tet_material ? body->tet_material[t] : 0];
    double ratio;
    flesh_psi rest = {0}, mesh = {0};
    if (flesh_material_rest_ratio(material, &ratio) ||
        (ratio != 1 && (material->psi(3 * pow(ratio, 2. / 3), ratio, material, &rest) ||
                        material->psi(3, 1, material, &mesh))))
      return 0;
    *least += volumes[t] * (rest.value - mesh.value);
    *stiffness += volumes[t] * material->mu;
    *mu = fmax(*mu, material->mu);
  }
  return *stiffness > 0;
}

/* Returns whether the body did not move over the last tenth of the motion. */
static int has_rested(const flesh_run_trace *trace, double stored)
{
  const int last = trace->count - 1;
  const double begin = trace->rows[last].t - 0.1 * (trace->rows[last].t - trace->rows[0].t);
  int k = last;
  for (; k >= 0 && (last - k < LEAST_STEPS || trace->rows[k].t >= begin); k--)
    if (!(trace->rows[k].kinetic <= moving_share * stored) ||
        !(fabs(trace->rows[k].strain - trace->rows[last].strain) <= changing_share * stored))
      return 0;
  return last - k >= LEAST_STEPS;
}

/* Returns whether only the body's own stress, of forces of the size `force`, acts on its nodes, and no load has
 * strained it. */
static int is_alone(const flesh_scene *scene, const flesh_state *state, double stored, double force, double edge)
{
  const flesh_system *system = flesh_scene_system(scene);
  const int n = flesh_system_unknowns(system);
  const double *X = flesh_mesh_positions(flesh_scene_mesh(scene));
  double *zeros = calloc((size_t)n, 3 * sizeof *zeros + 1), work = 0;
  if (!zeros) return 0;
  double *own = zeros + n, *others = own + n;
  uint8_t *fixed = (uint8_t *)(others + n); /* the flags stand behind the doubles */
  flesh_point point = flesh_point_at(state->t, state->x, zeros, zeros);
  point.multipliers = state->multipliers;
  point.internal = state->internal;
  flesh_system_fixed(system, state->t, fixed);
  const unsigned inertia = FLESH_ROLE_BIT(FLESH_ROLE_INERTIA), elasticity = FLESH_ROLE_BIT(FLESH_ROLE_ELASTICITY);
  int alone = !flesh_system_roles_residual(system, elasticity, &point, own) &&
              !flesh_system_roles_residual(system, ~(inertia | elasticity), &point, others);
  for (int d = 0; d < n && alone; d++) {
    work -= others[d] * (state->x[d] - X[d]);
    alone = fabs(others[d]) <= load_share * force &&
            (fixed[d] ? fabs(state->x[d] - X[d]) <= 1e-6 * edge : fabs(own[d]) <= unbalanced_share * force);
  }
  alone = alone && fabs(work) <= work_share * stored;
  free(zeros);
  return alone;
}

double flesh_stressed_rest(const flesh_scene *scene, const flesh_run_trace *trace, const flesh_state *state)
{
  double least, stiffness, mu;
  flesh_mesh_info info;
  const int is_static = flesh_scene_times(scene)->method == FLESH_METHOD_STATIC;
  if (trace->count < 2 || !find_least(scene, &least, &stiffness, &mu)) return 0;
  const double stored = trace->rows[trace->count - 1].strain - least;
  if (!(stored > least_stored * stiffness)) return 0;
  if (!is_static && !has_rested(trace, stored)) return 0;
  flesh_mesh_inspect(flesh_scene_mesh(scene), &info);
  const double force = mu * sqrt(2 * stored / stiffness) * info.edge_mean * info.edge_mean;
  return is_alone(scene, state, stored, force, info.edge_mean) ? stored : 0;
}
