/* stability.c: how stiff a body is against its softest motion in equilibrium, compared with rest. Where that stiffness
 * comes near 0 or below, equilibria branch or end, and meshes may have different ones. */
#include "error/companion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/parallel_vector.h"
#include "cli/interrupt.h"
#include "material/form.h"
#include "run/start.h"
#include "scene/scene.h"
#include "sensitivity/stage_tangent.h"
#include "time/integrator.h"

/* Number of inverse iterations from no motion and from that of another equilibrium, and relative tolerance of their solves and
 * of equilibria on the way: the stiffness is mostly within 2 %. */
enum { ITERATIONS = 6, FURTHER_ITERATIONS = 2 };
static const double tolerance = 1e-2;
/* Equilibria have bars of the mesh if the softest motion keeps at least these shares of its stiffness at rest: in the
 * equilibria of the run; on the way to the first one, of which only these parts of the load, or of the run's time, are looked
 * at. A body that buckles is soft near the load where it does, and may be stiff again beyond. */
static const double least_share = 0.65, least_on_way = 0.8;
static const double parts[] = {0.125, 0.25, 0.5};

/* Finds the smallest eigenvalue of the tangent, N/m, in the equilibrium `state` or, if x is not that of the state, at rest, by
 * inverse iteration (Golub & Van Loan 2013, section 8.2.2). room [3*n] begins with the softest motion of another equilibrium, or
 * 0, which becomes that of this one. */
static int find_softest(flesh_stage_tangent *tangent, const flesh_state *state, const double *x, double *room,
                        double *stiffness)
{
  const int n = tangent->n;
  double *v = room, *b = v + n, *u = b + n;
  const double before = flesh_norm(NULL, n, v), every = before > 0 ? 0.5 * before / sqrt(n) : 1;
  const int iterations = before > 0 ? FURTHER_ITERATIONS : ITERATIONS;
  const flesh_stage stage = {.t = state->t, .load = 1, .shift = {.x = 1}, .x0 = x, .x_lag = x, .t_lag = state->t,
                             .multipliers = x == state->x ? state->multipliers : NULL, .internal = state->internal};
  for (int d = 0; d < n; d++) v[d] = (before > 0 ? v[d] : 0) + every * sin((double)d * d); /* has a part of every motion */
  memset(u, 0, (size_t)n * sizeof *u);
  int status = flesh_problem_set_stage(tangent->problem, &stage);
  if (!status) flesh_problem_start(tangent->problem, u);
  if (!status) status = flesh_stage_tangent_set(tangent, &stage, u, 0);
  for (int k = 0; k < iterations && !status; k++) {
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

/* Takes in how stiff the body is in the equilibrium `state`, after `part` of the way to the first one or, with 1, in one of the
 * run. room [9*nodes]. */
static int compare(flesh_error_stability *self, flesh_stage_tangent *tangent, const flesh_state *state, double part, double *room)
{
  const int moves = flesh_system_moves(self->scene->system);
  double stiffness = NAN;
  const int status = find_softest(tangent, state, state->x, room, &stiffness);
  if (self->at_rest > 0 && stiffness < (part < 1 ? least_on_way : least_share) * self->at_rest)
    snprintf(self->words, sizeof self->words, "the body is %.2g times as stiff against its softest motion as at rest, %s %.3g%s, "
                                              "as where it buckles or folds: other meshes may have other equilibria",
             stiffness / self->at_rest, moves ? "at t =" : "under", moves ? state->t : 100 * part,
             moves ? " s" : " % of its load");
  return status;
}

/* Returns the status if it ends the run; else FLESH_OK, as nothing is known of an equilibrium then. */
static int must_end(int status)
{
  if (status == FLESH_ERR_BUDGET) return flesh_fail(status, "the budget is spent before it is known how stiff the equilibrium is");
  return status == FLESH_ERR_MEMORY || status == FLESH_ERR_INTERRUPTED ? status : FLESH_OK;
}

/* Looks at equilibria on the way to the first one of the run, at `first` s: at earlier times or, if nothing changes with time,
 * under parts of the load. */
static int look_on_way(flesh_error_stability *self, flesh_stage_tangent *tangent, double first, double *room)
{
  const flesh_scene *scene = self->scene;
  const double begin = scene->start.t, span = scene->time.end - begin;
  const int moves = flesh_system_moves(scene->system);
  flesh_integrator *integrator = NULL;
  flesh_solver_options solver = *flesh_scene_solver(scene);
  flesh_solve_stats stats = {0};
  flesh_state state = {0};
  double before = 0, deadline = self->options->begun + self->options->max_seconds;
  solver.newton_tolerance = fmax(solver.newton_tolerance, tolerance);
  int status = flesh_start_make(scene, &state);
  if (!status) status = flesh_start_integrator(scene, scene->system, &solver, &integrator);
  if (!status)
    flesh_integrator_set_stop(integrator, flesh_interrupt_asked, self->options->max_seconds > 0 ? &deadline : NULL);
  if (!status) status = flesh_integrator_begin(integrator, &state);
  for (size_t k = 0; k < sizeof parts / sizeof *parts && !status && !*self->words; k++) {
    if (parts[k] * span > 0.99 * (first - begin)) break;
    const flesh_load_increment increment = {.from = before, .to = parts[k], .fraction = (parts[k] - before) / (1 - before)};
    status = moves ? flesh_integrator_step(integrator, &state, (parts[k] - before) * span, &stats)
                   : flesh_integrator_find_at_load(integrator, &state, &increment, span, &stats);
    if (!status) status = compare(self, tangent, &state, parts[k], room);
    before = parts[k];
  }
  flesh_integrator_destroy(&integrator);
  free(state.x);
  return must_end(status);
}

int flesh_error_watch_stability(void *data, const flesh_step_record *record)
{
  flesh_error_stability *self = data;
  flesh_stage_tangent tangent = {0};
  if (!record->step || *self->words || is_stressed_at_rest(self->scene)) return FLESH_OK;
  double *room = calloc(9 * (size_t)flesh_mesh_node_count(self->scene->mesh), sizeof *room);
  int status = room ? FLESH_OK : flesh_no_memory();
  if (!status)
    status = flesh_stage_tangent_create(self->scene->system, flesh_scene_solver(self->scene), tolerance, &tangent);
  if (!status && !self->at_rest) {
    self->at_rest = -1; /* unless it is known: nothing may hold the body at rest */
    find_softest(&tangent, record->state, flesh_mesh_positions(self->scene->mesh), room, &self->at_rest);
  }
  if (!status && record->step == 1 && self->from_rest) status = look_on_way(self, &tangent, record->state->t, room);
  if (!status && !*self->words) status = compare(self, &tangent, record->state, 1, room);
  flesh_stage_tangent_clear(&tangent);
  free(room);
  return must_end(status);
}
