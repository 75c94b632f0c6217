/* mesh_part.c: how much of a figure is an error of the mesh: the finest scene, and the next finest that it is judged by. */
#include <math.h>

#include "drift/drift.h"

const flesh_drift_case *flesh_drift_find(const flesh_drift_plan *plan, int scene, int poisson, int variant,
                                         flesh_drift_solver solver)
{
  for (int k = 0; k < plan->case_count; k++) {
    const flesh_drift_case *c = &plan->cases[k];
    if (c->scene == scene && c->poisson == poisson && c->variant == variant && c->solver == solver) return c;
  }
  return NULL;
}

/* Element and nodes of a scene, from any of its cases that ran. */
static const struct flesh_drift_figures *figures_of(const flesh_drift_plan *plan, int scene)
{
  for (int k = 0; k < plan->case_count; k++)
    if (plan->cases[k].scene == scene && plan->cases[k].figures.tets) return &plan->cases[k].figures;
  return NULL;
}

/* Whether scene a is finer than b; of equals the first is. */
static int finer(const flesh_drift_plan *plan, int a, int b)
{
  const struct flesh_drift_figures *f = figures_of(plan, a), *g = figures_of(plan, b);
  if (!f || !g) return f && !g;
  if (f->element != g->element) return f->element > g->element; /* the enum rises with accuracy */
  return f->nodes != g->nodes ? f->nodes > g->nodes : a < b;
}

int flesh_drift_finest(const flesh_drift_plan *plan, int place)
{
  for (int s = 0; s < plan->scene_count; s++) {
    int before = 0;
    for (int other = 0; other < plan->scene_count; other++) before += other != s && finer(plan, other, s);
    if (before == place && figures_of(plan, s)) return s;
  }
  return -1;
}

/* How much of the difference of two meshes may be left on the finer one, 1 or more: with the same element and cells
 * smaller by r, 1/(r - 1), as if errors fell with the size of the cells and no faster (Roache, J. Fluids Eng. 116, 1994,
 * with order 1). */
static double left_over(const struct flesh_drift_figures *best, const struct flesh_drift_figures *next)
{
  const double r = cbrt((double)best->nodes / next->nodes);
  if (best->element != next->element || !(r > 1)) return 1;
  return fmax(1, 1 / (r - 1));
}

flesh_drift_part flesh_drift_mesh_part(const flesh_drift_plan *plan, int poisson, int variant,
                                       flesh_drift_solver solver)
{
  const int best = flesh_drift_finest(plan, 0), next = flesh_drift_finest(plan, 1);
  flesh_drift_part part = {.value = NAN, .unsure = NAN};
  if (best >= 0) part.best = flesh_drift_find(plan, best, poisson, variant, solver);
  if (next >= 0) part.next = flesh_drift_find(plan, next, poisson, variant, solver);
  if (part.best && part.best->figures.status) part.best = NULL;
  if (part.next && part.next->figures.status) part.next = NULL;
  if (part.best) part.value = part.best->figures.max_volume_drift;
  if (part.best && part.next)
    part.unsure = left_over(&part.best->figures, &part.next->figures) *
                  fabs(part.value - part.next->figures.max_volume_drift);
  return part;
}
