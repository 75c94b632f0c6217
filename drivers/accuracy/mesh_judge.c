/* mesh_judge.c: orders, and what reaches an error in the least time. */
#include <math.h>

#include "accuracy/mesh.h"

const double flesh_accuracy_shares[3] = {0.1, 0.01, 0.001};

/* |f0-f1|/|f1-f2| where errors fall as h^p. */
static double ratio(const double h[3], double p)
{
  return (pow(h[0], p) - pow(h[1], p)) / (pow(h[1], p) - pow(h[2], p));
}

double flesh_accuracy_order(const double h[3], double first, double second)
{
  double low = 0.5, high = 4;
  const double wanted = first / second;
  if (!(second > 0) || !(first > 0) || !isfinite(wanted) || wanted < ratio(h, low)) return NAN;
  if (wanted > ratio(h, high)) return high;
  for (int k = 0; k < 60; k++) {
    const double middle = (low + high) / 2;
    if (ratio(h, middle) < wanted) low = middle;
    else high = middle;
  }
  return (low + high) / 2;
}

/* The error of a step, over the motion of the time reference; what is below it counts as its uncertainty. */
static double step_error(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row)
{
  if (row->group != FLESH_ACCURACY_WORK || !row->done || row->figures.status) return NAN;
  const double error = row->figures.below ? plan->reference.uncertainty.position_rms : row->figures.errors.position_rms;
  return error / plan->reference.scale.motion;
}

/* The row of the method and step that the meshes were run with. */
static const flesh_accuracy_row *shared_row(const flesh_accuracy_plan *plan, const flesh_accuracy_meshes *meshes)
{
  for (int k = 0; k < plan->row_count; k++) {
    const flesh_accuracy_row *row = &plan->rows[k];
    if (row->group == FLESH_ACCURACY_WORK && row->method == meshes->method && !*row->tolerance.text &&
        row->step.value == meshes->step.value)
      return row;
  }
  return NULL;
}

static void take(flesh_accuracy_choice *best, const flesh_accuracy_choice *other)
{
  if (!best->mesh || other->cpu_s < best->cpu_s) *best = *other;
}

flesh_accuracy_choice flesh_accuracy_choose(const flesh_accuracy_plan *plan, const flesh_accuracy_meshes *meshes,
                                            double error)
{
  const flesh_accuracy_row *shared = meshes->method < 0 ? NULL : shared_row(plan, meshes);
  const double open = meshes->uncertainty / meshes->motion;
  flesh_accuracy_choice best = {.cpu_s = NAN};
  for (int m = 0; m < meshes->row_count; m++) {
    const flesh_accuracy_mesh_row *row = &meshes->rows[m];
    const double mesh_error = row->below ? open : row->error;
    if (!row->done || row->status || !(mesh_error <= error)) continue;
    if (meshes->method < 0) take(&best, &(flesh_accuracy_choice){row, NULL, mesh_error, 0, row->cpu_s, 1});
    for (int s = 0; shared && s < plan->row_count; s++) {
      const flesh_accuracy_row *step = &plan->rows[s];
      const double of_step = step_error(plan, step);
      if (!(mesh_error + of_step <= error)) continue;
      const double factor = step == shared ? 1 : step->figures.cpu_s / shared->figures.cpu_s;
      take(&best, &(flesh_accuracy_choice){row, step, mesh_error, of_step, row->cpu_s * factor, step == shared});
    }
  }
  return best;
}

/* The element's run with the fewest tets above `tets`; NULL: there is none. */
static const flesh_accuracy_mesh_row *next_finer(const flesh_accuracy_meshes *meshes, int element, int tets)
{
  const flesh_accuracy_mesh_row *best = NULL;
  for (int k = 0; k < meshes->row_count; k++) {
    const flesh_accuracy_mesh_row *row = &meshes->rows[k];
    if (row->element != element || !row->done || row->status || isnan(row->error) || row->tets <= tets) continue;
    if (!best || row->tets < best->tets) best = row;
  }
  return best;
}

double flesh_accuracy_time_to(const flesh_accuracy_meshes *meshes, int element, double error, int *beyond)
{
  const flesh_accuracy_mesh_row *before = NULL, *row = next_finer(meshes, element, 0);
  *beyond = 0;
  if (row && row->error <= error) return row->cpu_s;
  for (; row && row->error > error; before = row, row = next_finer(meshes, element, row->tets))
    ;
  if (!row && before) {
    *beyond = 1;
    return before->cpu_s * pow(before->error / error, element == FLESH_ELEMENT_TET4 ? 3. / 2 : 3. / 3);
  }
  if (!row || !(row->error < before->error) || !(row->cpu_s > before->cpu_s)) return NAN;
  const double slope = log(row->cpu_s / before->cpu_s) / log(row->error / before->error);
  return row->cpu_s * exp(slope * log(error / row->error));
}
