/* point_load.c: finds loads on single nodes by what their residual touches. */
#include "effect/effect.h"
#include "run/describe.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "flesh/effects.h"
#include "mesh/pieces.h"

/* Whether all marked nodes are those of one tet; 0 where none is. */
static int within_a_tet(const flesh_mesh *mesh, const char *marked)
{
  int count = 0;
  for (int i = 0; i < flesh_mesh_node_count(mesh); i++) count += marked[i];
  if (!count || count > 10) return 0;
  for (int t = 0; t < flesh_mesh_tet_count(mesh); t++) {
    int nodes[10], size = flesh_mesh_tet_nodes(mesh, t, nodes), inside = 0;
    for (int a = 0; a < size; a++) inside += marked[nodes[a]];
    if (inside == count) return 1;
  }
  return 0;
}

/* Marks the nodes on which the effect acts at time t. */
static int mark(const flesh_effect *effect, double t, const double *x, const double *zero, int n, double *r,
                char *marked)
{
  const flesh_point point = flesh_point_at(t, x, zero, zero);
  memset(r, 0, (size_t)n * sizeof *r);
  if (effect->operations->residual(effect, &point, r)) return 1;
  for (int d = 0; d < n; d++) marked[d / 3] |= (char)(r[d] != 0);
  return 0;
}

const char *flesh_point_load(const flesh_scene *scene)
{
  enum { TIMES = 16 };
  const flesh_system *system = flesh_scene_system(scene);
  const flesh_mesh *mesh = flesh_scene_mesh(scene);
  const int n = flesh_system_unknowns(system);
  const char *found = NULL;
  /* Off the rest shape, so that a spring is not without extension. */
  double *x = malloc((size_t)n * sizeof *x), *zero = calloc((size_t)n, sizeof *zero), *r = malloc((size_t)n * sizeof *r);
  char *marked = malloc((size_t)n);
  for (int d = 0; x && d < n; d++) x[d] = flesh_mesh_positions(mesh)[d] * 1.01 + 1e-3;
  for (int k = 0; x && zero && r && marked && !found && k < flesh_system_effect_count(system); k++) {
    const flesh_effect *effect = flesh_system_effect(system, k);
    if (effect->operations->role != FLESH_ROLE_LOAD || flesh_effect_spring_radius(effect, NULL) > 0) continue;
    memset(marked, 0, (size_t)n);
    double t = 0;
    int failed = mark(effect, t, x, zero, n, r, marked);
    for (int e = 0; e < TIMES && !failed; e++) {
      const double next = flesh_system_next_event(system, t);
      if (!(next < INFINITY)) break;
      failed = mark(effect, t + (next - t) / 2, x, zero, n, r, marked) || mark(effect, next, x, zero, n, r, marked);
      t = next;
    }
    if (!failed && within_a_tet(mesh, marked)) found = effect->operations->name;
  }
  free(x);
  free(zero);
  free(r);
  free(marked);
  return found;
}
