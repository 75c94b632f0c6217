/* integrate.c: integrates once from a scene's start to its end, and measures the time. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "accuracy/track.h"
#include "base/clock.h"
#include "base/error.h"
#include "base/memory.h"
#include "cli/interrupt.h"
#include "base/file.h"
#include "run/start.h"

static int is_finite(const flesh_state *state, int unknowns)
{
  double sum = 0;
  for (int d = 0; d < unknowns; d++) sum += 0 * state->x[d] + 0 * state->v[d];
  return sum == 0;
}

/* Data of the test that stops a run; it is made between steps, including those that the adaptive method chooses. */
typedef struct limit {
  const flesh_state *state;
  double started, seconds;
} limit;

static int ask(void *data)
{
  const limit *l = data;
  if (flesh_interrupt_signal())
    return flesh_fail(FLESH_ERR_INTERRUPTED, "interrupted at t = %g s", l->state->t);
  if (l->seconds > 0 && flesh_wall_seconds() - l->started > l->seconds)
    return flesh_fail(FLESH_ERR_BUDGET, "the budget of %g s is spent at t = %g s", l->seconds,
                      l->state->t);
  return FLESH_OK;
}

/* The steps that the adaptive method chose, gathered in memory. */
typedef struct steps {
  int count, room;
  flesh_internal_step *all;
} steps;

/* The observer of a run, and the time that it has taken. */
typedef struct audience {
  const flesh_accuracy_watch *watch; /* NULL: none */
  double end, cpu_s, wall_s;
  int unknowns;
  steps *steps; /* NULL: steps are not gathered */
} audience;

static int show(audience *a, const flesh_state *state)
{
  if (!is_finite(state, a->unknowns))
    return flesh_fail(FLESH_ERR_NONFINITE, "the state at t = %g s is not finite", state->t);
  if (!a->watch) return FLESH_OK;
  double cpu = flesh_cpu_seconds(), wall = flesh_wall_seconds();
  int status = a->watch->see(a->watch->data, state);
  a->cpu_s += flesh_cpu_seconds() - cpu;
  a->wall_s += flesh_wall_seconds() - wall;
  return status;
}

static int note_step(void *data, const flesh_internal_step *step)
{
  audience *a = data;
  steps *s = a->steps;
  if (s && !flesh_grow(&s->all, sizeof *s->all, s->count, &s->room))
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for more than %d steps", s->count);
  if (s) s->all[s->count++] = *step;
  return a->watch && a->watch->own_steps && !(step->t > a->end) ? show(a, step->state) : FLESH_OK;
}

static int write_steps(const char *path, const steps *s)
{
  flesh_file file;
  int status = flesh_file_open(path, &file);
  if (status) return status;
  fputs("t,h,order,rejected,convergence_failures\n", file.stream);
  for (int k = 0; k < s->count; k++) {
    const flesh_internal_step *step = &s->all[k];
    flesh_number_print(file.stream, step->t);
    putc(',', file.stream);
    flesh_number_print(file.stream, step->h);
    fprintf(file.stream, ",%d,%d,%d\n", step->order, step->rejected, step->convergence_failures);
  }
  return flesh_file_commit(&file);
}

static int integrate(flesh_integrator *integrator, double h, const flesh_accuracy_grid *grid, double max_seconds,
                     flesh_state *state, audience *a, flesh_accuracy_cost *cost)
{
  double cpu = flesh_cpu_seconds();
  limit l = {state, flesh_wall_seconds(), max_seconds};
  flesh_integrator_set_stop(integrator, ask, &l);
  int status = show(a, state), done = 0;
  /* The loop uses the same times as flesh_run, so that `flesh run` repeats it bit for bit. */
  for (long step = 1; !done && !status; step++) {
    double target = grid->start + (double)step * h, length = h;
    done = target > grid->end - 1e-3 * h;
    if (done) target = grid->end;
    if (fabs(target - state->t - h) > 1e-9 * h) length = target - state->t;
    status = flesh_integrator_step(integrator, state, length, &cost->counts);
    if (status > 0)
      status = flesh_fail(FLESH_ERR_SOLVE, "the step from t = %g s failed: %s", state->t,
                          flesh_status_text(status));
    if (status) break;
    state->t = target;
    status = show(a, state);
    if (!status && !done) status = ask(&l);
  }
  cost->rejected = cost->counts.rejected + cost->counts.convergence_failures;
  cost->wall_s = flesh_wall_seconds() - l.started - a->wall_s;
  cost->cpu_s = flesh_cpu_seconds() - cpu - a->cpu_s;
  return status;
}

int flesh_accuracy_integrate(const flesh_scene *scene, const flesh_accuracy_grid *grid, double max_seconds,
                             const char *steps_file, const flesh_accuracy_watch *watch, flesh_accuracy_cost *cost)
{
  const flesh_system *system = flesh_scene_system(scene);
  const flesh_scene_time *time = flesh_scene_times(scene);
  flesh_state state = {0};
  flesh_integrator *integrator = NULL;
  *cost = (flesh_accuracy_cost){0};
  flesh_adaptive_options adaptive = time->adaptive;
  steps s = {0};
  audience a = {.watch = watch, .end = grid->end, .unknowns = flesh_system_unknowns(system), .steps = steps_file ? &s : NULL};
  if (steps_file || (watch && watch->own_steps)) adaptive.observe = note_step, adaptive.observe_data = &a;
  int status = flesh_start_make(scene, &state);
  if (!status) status = flesh_start_integrator(scene, system, flesh_scene_solver(scene), &integrator);
  if (!status) status = flesh_integrator_set_adaptive(integrator, &adaptive);
  if (!status) status = integrate(integrator, time->step, grid, max_seconds, &state, &a, cost);
  if (integrator) cost->gain = flesh_integrator_energy_balance(integrator)->gain;
  if (!status && s.count) status = write_steps(steps_file, &s);
  free(s.all);
  flesh_integrator_destroy(&integrator);
  free(state.x);
  return status;
}

/* An observer that keeps states. */
typedef struct keeper {
  const flesh_accuracy_grid *grid;
  flesh_accuracy_track *track; /* with grid->count times */
  int next;
} keeper;

static int keep_state(void *data, const flesh_state *state)
{
  keeper *k = data;
  const flesh_accuracy_grid *grid = k->grid;
  int last = k->next == grid->count - 1;
  double due = last ? grid->end : grid->start + k->next * grid->interval;
  if (state->t < due - 1e-6 * fmin(grid->interval, grid->longest)) return FLESH_OK;
  size_t size = sizeof(double) * (size_t)k->track->unknowns, at = (size_t)k->next * (size_t)k->track->unknowns;
  k->track->t[k->next] = state->t;
  memcpy(k->track->x + at, state->x, size);
  memcpy(k->track->v + at, state->v, size);
  k->next += !last;
  return FLESH_OK;
}

int flesh_accuracy_integrate_into(const flesh_scene *scene, const flesh_accuracy_grid *grid, double max_seconds,
                                  const flesh_accuracy_grid *keep, flesh_accuracy_track *track, flesh_accuracy_cost *cost)
{
  keeper kept = {keep, track, 0};
  const flesh_accuracy_watch watch = {keep_state, &kept, 0};
  return flesh_accuracy_integrate(scene, grid, max_seconds, NULL, &watch, cost);
}
