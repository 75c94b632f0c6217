/* describe.c: tells which bodies touch, which parts of surfaces are let apart and which never touch; finds loads on
 * single nodes, by the nodes that their residual touches; and counts steps, evaluated at their ends, within which loads
 * and motions begin, turn or end more than once. */
#include "run/describe.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "effect/effect.h"
#include "effect/surface_contact.h"
#include "flesh/effects.h"
#include "flesh/system.h"
#include "mesh/pieces.h"
#include "scene/scene.h"

enum { MOST = 8 }; /* number of pairs of patches that are printed one by one */

/* Prints whether several bodies touch or pass through each other. */
static void describe_bodies(const flesh_scene *scene, FILE *stream)
{
  const flesh_system *system = flesh_scene_system(scene);
  const int bodies = flesh_scene_body(scene)->part_count;
  int pairs = bodies * (bodies - 1) / 2, touching = 0;
  if (bodies < 2) return;
  for (int a = 0; a < bodies; a++)
    for (int b = a + 1; b < bodies; b++) {
      int may = 0;
      for (int k = 0; k < flesh_system_effect_count(system); k++)
        may |= flesh_surface_contact_may_meet(flesh_system_effect(system, k), a, b);
      touching += may;
    }
  if (!touching) fprintf(stream, "bodies: %d, which do not touch each other: they pass through each other\n", bodies);
  else if (touching == pairs) fprintf(stream, "bodies: %d, which touch each other\n", bodies);
  else
    fprintf(stream, "bodies: %d; of their %d pairs %d may touch, the others pass through each other\n", bodies, pairs,
            touching);
}

static const char *name_of(const flesh_body *body, int part)
{
  return body->part_count > 1 && body->parts[part].name ? body->parts[part].name : "the body";
}

static void describe_ignored(const flesh_scene *scene, const flesh_effect *effect, const double *x, FILE *stream)
{
  const flesh_body *body = flesh_scene_body(scene);
  flesh_patch_pair *pairs;
  int count;
  if (flesh_surface_contact_ignored(effect, x, &count, &pairs)) return; /* the run will fail for the same reason */
  for (int k = 0; k < count && k < MOST; k++) {
    const flesh_patch_pair *pair = &pairs[k];
    const int itself = pair->bodies[0] == pair->bodies[1];
    fprintf(stream, "contact: %s goes through %s at (%.4g, %.4g, %.4g) m; %d and %d faces there do not touch each other "
            "until they are apart\n", name_of(body, pair->bodies[0]), itself ? "itself" : name_of(body, pair->bodies[1]),
            pair->place[0], pair->place[1], pair->place[2], pair->faces[0], pair->faces[1]);
  }
  if (count > MOST) fprintf(stream, "  and at %d more places\n", count - MOST);
  free(pairs);
}

static void describe_left_out(const flesh_scene *scene, const flesh_effect *effect, FILE *stream)
{
  const double *X = flesh_mesh_positions(flesh_scene_mesh(scene));
  flesh_left_out found;
  if (flesh_surface_contact_left_out(effect, &found) || !found.nodes) return;
  fprintf(stream, "contact: %d node%s faced across a gap that is smaller than the thickness at rest: %s not touch what is there "
          "(the narrowest is %.3g m, at node %d, (%.4g, %.4g, %.4g) m); a smaller `thickness` enables contact there\n",
          found.nodes, found.nodes == 1 ? " is" : "s are", found.nodes == 1 ? "it does" : "they do", found.gap, found.node,
          X[3 * (size_t)found.node], X[3 * (size_t)found.node + 1], X[3 * (size_t)found.node + 2]);
}

void flesh_describe_touching(const flesh_scene *scene, FILE *stream)
{
  const flesh_system *system = flesh_scene_system(scene);
  describe_bodies(scene, stream);
  for (int k = 0; k < flesh_system_effect_count(system); k++) {
    describe_left_out(scene, flesh_system_effect(system, k), stream);
    describe_ignored(scene, flesh_system_effect(system, k), scene->start.x, stream);
  }
}

/* Returns whether one tet has all marked nodes; 0 if none is marked. */
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
  double *x = calloc((size_t)n, 3 * sizeof *x + 1);
  if (!x) return NULL;
  double *zero = x + n, *r = zero + n;
  char *marked = (char *)(r + n); /* the marks stand behind the doubles */
  /* The positions differ from the rest shape, so that springs are extended. */
  for (int d = 0; d < n; d++) x[d] = flesh_mesh_positions(mesh)[d] * 1.01 + 1e-3;
  for (int k = 0; !found && k < flesh_system_effect_count(system); k++) {
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
  return found;
}

int flesh_steps_over(const flesh_scene *scene, double until, double *first)
{
  const flesh_scene_time *time = flesh_scene_times(scene);
  const flesh_system *system = flesh_scene_system(scene);
  const double slack = 1e-6 * time->step;
  int count = 0;
  if (time->method != FLESH_METHOD_BACKWARD_EULER || time->adaptive.control) return 0;
  for (double t = flesh_system_next_event(system, slack), end; t < until; t = flesh_system_next_event(system, end + slack)) {
    end = time->step * ceil((t - slack) / time->step);
    const int over = t < end - slack && flesh_system_next_event(system, t + slack) < end - slack;
    if (over && !count++) *first = t;
  }
  return count;
}
