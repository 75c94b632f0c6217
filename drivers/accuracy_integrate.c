/* accuracy_integrate.c: one integration from a scene's start to its end, timed. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "accuracy_track.h"
#include "base/error.h"
#include "interrupt.h"
#include "io/file.h"

static double seconds(clockid_t clock)
{
  struct timespec now;
  clock_gettime(clock, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static int is_finite(const flesh_state *state, int unknowns)
{
  double sum = 0;
  for (int d = 0; d < unknowns; d++) sum += 0 * state->x[d] + 0 * state->v[d];
  return sum == 0;
}

static int keep(const flesh_state *state, int place, flesh_accuracy_track *track)
{
  size_t size = sizeof(double) * (size_t)track->unknowns;
  size_t at = (size_t)place * (size_t)track->unknowns;
  if (!is_finite(state, track->unknowns))
    return flesh_fail(FLESH_ERR_NONFINITE, "the state at t = %g s is not finite", state->t);
  track->t[place] = state->t;
  memcpy(track->x + at, state->x, size);
  memcpy(track->v + at, state->v, size);
  return FLESH_OK;
}

static void add(const flesh_solve_stats *stats, flesh_accuracy_cost *cost)
{
  cost->steps += stats->steps; /* none where IDA had stepped past already */
  cost->rejected += stats->rejected + stats->convergence_failures;
  cost->residuals += stats->residuals;
  cost->assemblies += stats->assemblies;
  cost->newton += stats->newton;
  cost->linear += stats->linear;
}

/* What is asked between steps, also the adaptive method's own. */
typedef struct limit {
  const flesh_state *state;
  double started, seconds;
} limit;

static int ask(void *data)
{
  const limit *l = data;
  if (flesh_interrupt_signal())
    return flesh_fail(FLESH_ERR_INTERRUPTED, "interrupted at t = %g s", l->state->t);
  if (l->seconds > 0 && seconds(CLOCK_MONOTONIC) - l->started > l->seconds)
    return flesh_fail(FLESH_ERR_BUDGET, "the budget of %g s is spent at t = %g s", l->seconds,
                      l->state->t);
  return FLESH_OK;
}

/* The adaptive method's own steps, gathered in memory. */
typedef struct steps {
  size_t count, room;
  flesh_internal_step *all;
} steps;

static int note_step(void *data, const flesh_internal_step *step)
{
  steps *s = data;
  if (s->count == s->room) {
    size_t room = s->room ? 2 * s->room : 1024;
    flesh_internal_step *all = realloc(s->all, room * sizeof *all);
    if (!all) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %zu steps", room);
    s->all = all;
    s->room = room;
  }
  s->all[s->count++] = *step;
  return FLESH_OK;
}

static int write_steps(const char *path, const steps *s)
{
  flesh_file file;
  int status = flesh_file_open(path, &file);
  if (status) return status;
  fputs("t,h,order,rejected,convergence_failures\n", file.stream);
  for (size_t k = 0; k < s->count; k++) {
    const flesh_internal_step *step = &s->all[k];
    flesh_number_print(file.stream, step->t);
    putc(',', file.stream);
    flesh_number_print(file.stream, step->h);
    fprintf(file.stream, ",%d,%d,%d\n", step->order, step->rejected, step->convergence_failures);
  }
  return flesh_file_commit(&file);
}

static int integrate(flesh_integrator *integrator, double h, const flesh_accuracy_grid *grid,
                     double max_seconds, flesh_state *state, flesh_accuracy_track *track,
                     flesh_accuracy_cost *cost)
{
  long between = lround(grid->interval / h) * grid->every; /* steps from one time to the next */
  double cpu = seconds(CLOCK_PROCESS_CPUTIME_ID);
  limit l = {state, seconds(CLOCK_MONOTONIC), max_seconds};
  flesh_integrator_set_stop(integrator, ask, &l);
  int status = FLESH_OK, place = 0, done = 0;
  /* The same times as flesh_run's, so that `flesh run` repeats it bit for bit. */
  for (long step = 1; !done && !status; step++) {
    double target = grid->start + (double)step * h, length = h;
    done = target > grid->end - 1e-6 * h;
    if (done) target = grid->end;
    if (fabs(target - state->t - h) > 1e-9 * h) length = target - state->t;
    flesh_solve_stats stats = {0};
    status = flesh_integrator_step(integrator, state, length, &stats);
    add(&stats, cost);
    if (status > 0)
      status = flesh_fail(FLESH_ERR_SOLVE, "the step from t = %g s failed: %s", state->t,
                          flesh_status_text(status));
    if (status) break;
    state->t = target;
    if (done || (step % between == 0 && place < grid->count - 1))
      status = keep(state, place++, track);
    if (!status && !done) status = ask(&l);
  }
  cost->wall_s = seconds(CLOCK_MONOTONIC) - l.started;
  cost->cpu_s = seconds(CLOCK_PROCESS_CPUTIME_ID) - cpu;
  return status;
}

int flesh_accuracy_integrate(const flesh_scene *scene, const flesh_accuracy_grid *grid,
                             double max_seconds, const char *steps_file,
                             flesh_accuracy_track *track, flesh_accuracy_cost *cost)
{
  const flesh_system *system = flesh_scene_system(scene);
  const flesh_scene_time *time = flesh_scene_times(scene);
  size_t unknowns = (size_t)flesh_system_unknowns(system);
  flesh_state state = {0, malloc(sizeof(double) * unknowns), malloc(sizeof(double) * unknowns)};
  flesh_integrator *integrator = NULL;
  *cost = (flesh_accuracy_cost){0};
  flesh_adaptive_options adaptive = time->adaptive;
  steps s = {0};
  if (steps_file) adaptive.observe = note_step, adaptive.observe_data = &s;
  int status =
      state.x && state.v ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for a state");
  if (!status) flesh_scene_start(scene, &state);
  if (!status)
    status = flesh_integrator_create(system, time->method, flesh_scene_solver(scene), &integrator);
  if (!status) status = flesh_integrator_set_method_options(integrator, &time->options);
  if (!status) status = flesh_integrator_set_adaptive(integrator, &adaptive);
  if (!status) status = integrate(integrator, time->step, grid, max_seconds, &state, track, cost);
  if (!status && s.count) status = write_steps(steps_file, &s);
  free(s.all);
  flesh_integrator_destroy(&integrator);
  free(state.x);
  free(state.v);
  return status;
}
