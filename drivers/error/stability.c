/* stability.c: how stiff a body is against its softest motion in equilibrium, compared with rest. Where that stiffness
 * comes near 0 or below, equilibria branch or end, and meshes may have different ones. */
#include "error/companion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/parallel_vector.h"
#include "cli/path.h"
#include "material/form.h"
#include "run/start.h"
#include "scene/scene.h"
#include "sensitivity/stage_tangent.h"

/* Number of inverse iterations, and relative tolerance of their solves: the stiffness is mostly within 2 %. */
enum { ITERATIONS = 6 };
static const double tolerance = 1e-2;

/* Finds the smallest eigenvalue of the tangent at a state, N/m, by inverse iteration (Golub & Van Loan 2013, section 8.2.2).
 * room [3*n]. */
static int find_softest(flesh_stage_tangent *tangent, const flesh_state *state, double *room, double *stiffness)
{
  const int n = tangent->n;
  double *v = room, *b = v + n, *u = b + n;
  const flesh_stage stage = {.t = state->t, .load = 1, .shift = {.x = 1}, .x0 = state->x, .x_lag = state->x, .t_lag = state->t,
                             .multipliers = state->multipliers, .internal = state->internal};
  for (int d = 0; d < n; d++) v[d] = sin((double)d * d); /* has a part of every motion */
  memset(u, 0, (size_t)n * sizeof *u);
  int status = flesh_problem_set_stage(tangent->problem, &stage);
  if (!status) flesh_problem_start(tangent->problem, u);
  if (!status) status = flesh_stage_tangent_set(tangent, &stage, u, 0);
  for (int k = 0; k < ITERATIONS && !status; k++) {
    const double size = flesh_norm(NULL, n, v);
    for (int d = 0; d < n; d++) b[d] = v[d] / size;
    status = flesh_stage_tangent_solve(tangent, 0, b, NULL, v);
    *stiffness = flesh_dot(NULL, n, b, v) / flesh_dot(NULL, n, v, v);
  }
  return status;
}

/* Returns whether a material has stress at rest, so that its stiffness there tells nothing. */
static int is_stressed_at_rest(const flesh_scene *scene)
{
  int is = 0;
  for (int k = 0; k < flesh_scene_material_count(scene); k++)
    is |= flesh_material_is_stressed_at_rest(&scene->body.materials[k]);
  return is;
}

int flesh_error_compare_with_rest(const flesh_scene *scene, const char *folder, double *share)
{
  const int nodes = flesh_mesh_node_count(scene->mesh), n = 3 * nodes;
  flesh_stage_tangent tangent = {0};
  flesh_state state = {0};
  *share = NAN;
  if (is_stressed_at_rest(scene)) return FLESH_OK;
  double at_rest = NAN, at_end = NAN, *room = malloc(3 * (size_t)n * sizeof *room);
  int status = room ? flesh_start_make(scene, &state) : flesh_no_memory();
  if (!status) status = flesh_stage_tangent_create(flesh_scene_system(scene), flesh_scene_solver(scene), tolerance, &tangent);
  if (!status) {
    memcpy(state.x, flesh_mesh_positions(scene->mesh), (size_t)n * sizeof *state.x);
    status = find_softest(&tangent, &state, room, &at_rest);
  }
  if (!status) status = flesh_state_read(flesh_path("%s/state.txt", folder), nodes, &state);
  if (!status) status = find_softest(&tangent, &state, room, &at_end);
  if (at_rest > 0) *share = at_end / at_rest; /* nothing may hold the body at rest */
  flesh_stage_tangent_clear(&tangent);
  free(state.x);
  free(room);
  return status == FLESH_ERR_MEMORY || status == FLESH_ERR_INTERRUPTED ? status : FLESH_OK;
}
