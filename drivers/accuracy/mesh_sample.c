/* mesh_sample.c: runs a scene on another mesh and records the positions of the nodes of the scene's own mesh. */
#include "accuracy/accuracy.h"

#include <math.h>
#include <stdlib.h>

#include "base/clock.h"
#include "base/error.h"
#include "output/tet_shape.h"
#include "run/start.h"
#include "skin/locator.h"

typedef struct sampler {
  const flesh_mesh *mesh;      /* of the run */
  const double *points;        /* [3*count] at rest */
  int count;
  double *weights;             /* [10*count] allocated with `nodes`, which stands behind it */
  int *nodes;                  /* [10*count] nodes of the tet that contains the point */
  flesh_accuracy_grid grid;    /* times that are kept */
  int next;
  flesh_accuracy_track *track; /* positions of the points at these times */
} sampler;

/* Finds for every point the tet that contains it, and weights. */
static int locate(sampler *s)
{
  flesh_locator *locator = NULL;
  int status = flesh_locator_create(s->mesh, &locator), hint = -1;
  for (int p = 0; p < s->count && !status; p++) {
    flesh_place place;
    flesh_locator_find(locator, s->points + 3 * (size_t)p, hint, &place);
    hint = place.tet;
    int *nodes = s->nodes + 10 * (size_t)p;
    double *weights = s->weights + 10 * (size_t)p;
    for (int a = flesh_tet_weights(s->mesh, place.tet, place.weights, nodes, weights); a < 10; a++)
      nodes[a] = nodes[0], weights[a] = 0;
  }
  flesh_locator_destroy(&locator);
  return status;
}

/* Chooses the times of the plan's grid, or every n-th of them, so that there are at most 128 and they fit in memory. */
static void choose_times(const flesh_accuracy_plan *plan, int points, flesh_accuracy_grid *grid)
{
  const int most = (int)fmin(128, fmax(flesh_accuracy_room(3 * points) / 2, 16));
  *grid = plan->grid;
  if (grid->count < 2) return;
  const int every = (grid->count + most - 2) / most;
  grid->interval *= every > 1 ? every : 1;
  grid->count = (int)ceil((grid->end - grid->start) / grid->interval - 1e-6) + 1;
}

/* Opens a sampler for the nodes of plan->measure, and its track, for times of the plan's grid. The scene must outlive it. */
static int open_sampler(const flesh_accuracy_plan *plan, const flesh_scene *scene, flesh_accuracy_track *track, sampler *s)
{
  const size_t count = (size_t)plan->measure.nodes;
  *s = (sampler){.mesh = flesh_scene_mesh(scene), .points = plan->measure.rest, .count = (int)count, .track = track};
  choose_times(plan, (int)count, &s->grid);
  s->weights = malloc(10 * count * (sizeof *s->weights + sizeof *s->nodes));
  if (!s->weights) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %zu points", count);
  s->nodes = (int *)(s->weights + 10 * count);
  const int status = flesh_accuracy_track_open(s->grid.count, 3 * (int)count, track);
  return status ? status : locate(s);
}

/* Records the points' positions at the time with index `at`: the position at rest plus the mesh's displacement
 * there. */
static void keep(sampler *s, int at, double t, const double *x)
{
  const double *X = flesh_mesh_positions(s->mesh);
  double *to = s->track->x + (size_t)at * (size_t)s->track->unknowns;
  s->track->t[at] = t;
  for (int p = 0; p < s->count; p++)
    for (int c = 0; c < 3; c++) {
      double moved = s->points[3 * p + c];
      for (int a = 0; a < 10; a++) {
        const size_t d = 3 * (size_t)s->nodes[10 * p + a] + (size_t)c;
        moved += s->weights[10 * p + a] * (x[d] - X[d]);
      }
      to[3 * p + c] = moved;
    }
}

/* Records the first state at or after each time; the fixed steps of all meshes meet the same times. */
static int see(void *data, const flesh_state *state)
{
  sampler *s = data;
  while (s->next < s->grid.count) {
    const int last = s->next == s->grid.count - 1;
    const double due = last ? s->grid.end : s->grid.start + s->next * s->grid.interval;
    if (state->t < due - 1e-9 * (s->grid.end - s->grid.start)) break;
    keep(s, s->next++, state->t, state->x);
  }
  return FLESH_OK;
}

static int solve(const flesh_scene *scene, sampler *s, double *cpu_s)
{
  const flesh_system *system = flesh_scene_system(scene);
  flesh_state state = {0};
  flesh_integrator *integrator = NULL;
  int status = flesh_start_make(scene, &state);
  const double started = flesh_cpu_seconds();
  if (!status) status = flesh_integrator_create(system, FLESH_METHOD_STATIC, flesh_scene_solver(scene), &integrator);
  if (!status) status = flesh_integrator_step(integrator, &state, flesh_scene_times(scene)->end, NULL);
  *cpu_s = flesh_cpu_seconds() - started;
  if (status > 0) status = flesh_fail(FLESH_ERR_SOLVE, "no equilibrium was found: %s", flesh_status_text(status));
  if (!status && s) keep(s, 0, 0, state.x);
  flesh_integrator_destroy(&integrator);
  free(state.x);
  return status;
}

int flesh_accuracy_sample(const flesh_accuracy_plan *plan, const flesh_scene *scene, flesh_accuracy_track *track,
                          double *cpu_s)
{
  enum { MOST = 5 };
  const int in_time = flesh_scene_times(scene)->method != FLESH_METHOD_STATIC;
  double spent = 0;
  sampler s = {0};
  const flesh_accuracy_watch watch = {see, &s, 0};
  int status = track ? open_sampler(plan, scene, track, &s) : FLESH_OK;
  *cpu_s = status ? NAN : INFINITY;
  for (int k = 0; k < MOST && !status && (!k || spent < 0.2); k++) {
    flesh_accuracy_cost cost = {0};
    const int first = track && !k;
    if (in_time)
      status = flesh_accuracy_integrate(scene, &plan->grid, plan->max_seconds, NULL, first ? &watch : NULL, &cost);
    else status = solve(scene, first ? &s : NULL, &cost.cpu_s);
    spent += cost.cpu_s;
    *cpu_s = fmin(*cpu_s, cost.cpu_s);
  }
  free(s.weights);
  return status;
}
