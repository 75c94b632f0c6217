/* integrator.c: steps with their retries: in halves in time, in load increments in statics; and what the methods
 * remember. */
#include "flesh/integrator.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "flesh/ida.h"
#include "flesh/kinsol.h"
#include "time/adaptive.h"
#include "time/energy_watch.h"
#include "time/extrapolation.h"
#include "time/method.h"
#include "sundials/kinsol.h"
#include "time/prescribed.h"
#include "time/rigid_guess.h"
#include "time/step_energy.h"
#include "time/untangle.h"

struct flesh_integrator {
  const flesh_system *system;
  flesh_method method;
  const flesh_method_row *row;
  flesh_solver_options options;
  flesh_nonlinear *nonlinear;
  flesh_untangler *untangler; /* NULL: not wanted */
  int n;
  flesh_method_memory memory;
  flesh_prescribed prescribed; /* order > 1 */
  flesh_state returned;        /* the state as it was given back; order > 1 */
  double *energies; /* [effects] at the end of a step that is not its stage, J */
  double *start; /* [n] where a static solve with increments began; the end that a stage leads to */
  double *guess, *rigid; /* [n] displacements over a step */
  flesh_extrapolation extrapolation; /* of steps that are not adaptive */
  flesh_rigid_parts parts;
  uint8_t *held; /* [n] constrained dofs, where there are several parts */
  flesh_costs costs;
  flesh_failure failure;
  flesh_adaptive *adaptive; /* of the adaptive methods */
  int calm;                 /* the motion has been found calm: IDA steps */
  struct {
    double t, h;
  } trying;                 /* the part of a step under way, s */
  flesh_energy_watch watch; /* of methods that step in time */
};

static const double max_energy_gain = 0.5;

static int is_adaptive(flesh_method method)
{
  return method == FLESH_METHOD_ADAPTIVE || method == FLESH_METHOD_CALM_ADAPTIVE;
}

static int create_memory(flesh_integrator *self)
{
  flesh_method_memory *memory = &self->memory;
  const int second = flesh_method_order(self->method) > 1,
            returned = second || flesh_system_has_follower_loads(self->system);
  double **vectors[7 + FLESH_METHOD_VECTORS] = {&memory->v0, &memory->a0, &self->start, &self->guess, &self->rigid};
  size_t count = 5, apart;
  memory->n = self->n;
  flesh_method_options_default(&memory->options);
  for (int k = 0; k < self->row->vectors; k++) vectors[count++] = &memory->vectors[k];
  if (returned) {
    vectors[count++] = &self->returned.x;
    vectors[count++] = &self->returned.v;
  }
  double *first = flesh_huge_pages_vectors(count, (size_t)self->n, &apart);
  for (size_t k = 0; first && k < count; k++) *vectors[k] = first + k * apart;
  int failed = !first;
  int status = flesh_rigid_parts_create(self->system, &self->parts);
  if (status) return status;
  if (self->parts.count > 1) failed |= !(self->held = calloc((size_t)self->n + 1, 1));
  self->costs.effects =
      calloc((size_t)flesh_system_effect_count(self->system) + 1, sizeof *self->costs.effects);
  self->energies = calloc((size_t)flesh_system_effect_count(self->system) + 1, sizeof *self->energies);
  if (failed || !self->costs.effects || !self->energies)
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d unknowns", self->n);
  return second ? flesh_prescribed_create(self->system, &self->prescribed) : FLESH_OK;
}

int flesh_integrator_create(const flesh_system *system, flesh_method method,
                            const flesh_solver_options *options, flesh_integrator **integrator)
{
  FLESH_NEED({integrator, "integrator"});
  *integrator = NULL;
  FLESH_NEED({system, "system"}, {options, "options"});
  const flesh_method_row *row = flesh_method_find(method);
  if (!row) return flesh_fail(FLESH_ERR_ARGUMENT, "there is no integration method %d", (int)method);
  flesh_integrator *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for an integrator");
  self->system = system;
  self->method = method;
  /* Until the motion is calm. */
  self->row = method == FLESH_METHOD_CALM_ADAPTIVE ? &flesh_method_backward_euler : row;
  self->options = *options;
  self->n = flesh_system_unknowns(system);
  int status = create_memory(self);
  if (!status) status = flesh_nonlinear_create(system, options, &self->nonlinear);
  if (!status && self->row->stage)
    status = flesh_extrapolation_create(self->n, flesh_nonlinear_threads(self->nonlinear), &self->extrapolation);
  /* Untangling moves corners only. */
  if (!status && (options->techniques & FLESH_TECHNIQUE_UNTANGLE) && flesh_mesh_order(flesh_system_mesh(system)) == 1)
    status = flesh_untangler_create(system, &self->untangler);
  if (!status) status = flesh_energy_watch_create(system, &self->watch);
  if (!status && is_adaptive(method)) status = flesh_adaptive_create(system, options, &self->watch, &self->adaptive);
  if (status) {
    flesh_integrator_destroy(&self);
    return status;
  }
  self->watch.limit = max_energy_gain;
  self->watch.threads = flesh_nonlinear_threads(self->nonlinear);
  self->watch.costs = &self->costs;
  flesh_nonlinear_set_costs(self->nonlinear, &self->costs);
  if (self->adaptive) flesh_adaptive_set_costs(self->adaptive, &self->costs);
  *integrator = self;
  return FLESH_OK;
}

flesh_costs *flesh_integrator_costs(flesh_integrator *integrator) { return &integrator->costs; }

void flesh_integrator_destroy(flesh_integrator **integrator)
{
  if (!integrator || !*integrator) return;
  flesh_nonlinear_destroy(&(*integrator)->nonlinear);
  flesh_untangler_destroy(&(*integrator)->untangler);
  flesh_adaptive_destroy(&(*integrator)->adaptive);
  flesh_prescribed_clear(&(*integrator)->prescribed);
  free((*integrator)->memory.v0); /* and all other vectors with it */
  free((*integrator)->costs.effects);
  free((*integrator)->energies);
  flesh_rigid_parts_clear(&(*integrator)->parts);
  flesh_extrapolation_clear(&(*integrator)->extrapolation);
  flesh_energy_watch_clear(&(*integrator)->watch);
  free((*integrator)->held);
  free(*integrator);
  *integrator = NULL;
}

int flesh_integrator_set_method_options(flesh_integrator *integrator,
                                        const flesh_method_options *options)
{
  FLESH_NEED({integrator, "integrator"}, {options, "options"});
  int status = flesh_method_options_check(options);
  if (status) return status;
  integrator->memory.options = *options;
  integrator->memory.known = 0;
  return FLESH_OK;
}

flesh_method flesh_integrator_method(const flesh_integrator *integrator)
{
  return integrator->method;
}

flesh_progress flesh_integrator_progress(const flesh_integrator *self)
{
  flesh_progress progress = {.t = self->trying.t, .h = self->trying.h};
  if (self->adaptive && self->calm) flesh_adaptive_progress(self->adaptive, &progress);
  else flesh_nonlinear_progress(self->nonlinear, &progress);
  return progress;
}

const flesh_failure *flesh_integrator_failure(const flesh_integrator *integrator)
{
  return &integrator->failure;
}

size_t flesh_integrator_memory(const flesh_integrator *integrator)
{
  int vectors = 5 + integrator->row->vectors + (integrator->returned.x ? 2 : 0) +
                (integrator->extrapolation.n ? FLESH_EXTRAPOLATION_POINTS + 1 : 0);
  return sizeof *integrator + (size_t)vectors * (size_t)integrator->n * sizeof(double) +
         (size_t)integrator->n * ((2 * sizeof(int) + sizeof(double)) / 3 + (integrator->held ? 1 : 0)) +
         flesh_prescribed_memory(&integrator->prescribed) +
         flesh_nonlinear_memory(integrator->nonlinear) + flesh_energy_watch_memory(&integrator->watch) +
         (integrator->untangler ? flesh_untangler_memory(integrator->untangler) : 0) +
         (integrator->adaptive ? flesh_adaptive_memory(integrator->adaptive) : 0);
}

void *flesh_integrator_kinsol(const flesh_integrator *integrator)
{
  return flesh_nonlinear_kinsol(integrator->nonlinear);
}

void *flesh_integrator_ida(const flesh_integrator *integrator)
{
  return integrator->adaptive ? flesh_adaptive_ida(integrator->adaptive) : NULL;
}

int flesh_integrator_set_adaptive(flesh_integrator *integrator, const flesh_adaptive_options *options)
{
  FLESH_NEED({integrator, "integrator"}, {options, "options"});
  integrator->calm = 0;
  return integrator->adaptive ? flesh_adaptive_set_options(integrator->adaptive, options) : FLESH_OK;
}

void flesh_integrator_set_stop(flesh_integrator *integrator, int (*stop)(void *data), void *data)
{
  flesh_nonlinear_set_stop(integrator->nonlinear, stop, data);
  if (integrator->adaptive) flesh_adaptive_set_stop(integrator->adaptive, stop, data);
}

const char *flesh_integrator_warning(const flesh_integrator *integrator)
{
  return integrator->watch.warning[0] ? integrator->watch.warning : NULL;
}

const flesh_energy_balance *flesh_integrator_energy_balance(const flesh_integrator *integrator)
{
  return &integrator->watch.balance;
}

int flesh_integrator_set_max_energy_gain(flesh_integrator *integrator, double gain)
{
  FLESH_NEED({integrator, "integrator"});
  if (!(gain > 0)) return flesh_fail(FLESH_ERR_ARGUMENT, "max_energy_gain is %g; it must be positive", gain);
  integrator->watch.limit = gain;
  return FLESH_OK;
}

const double *flesh_integrator_energies(const flesh_integrator *integrator, const flesh_state *state)
{
  const flesh_energy_watch *watch = &integrator->watch;
  return watch->t == state->t && flesh_energy_watch_knows(watch, state) ? watch->energies : NULL;
}

/* Everything that is known about a solve that failed. */
static void record_failure(flesh_integrator *self, const flesh_stage *stage, double h, int halvings,
                           int status, const flesh_solve_stats *stats)
{
  const flesh_mesh *mesh = flesh_system_mesh(self->system);
  const double *x = flesh_nonlinear_positions(self->nonlinear);
  flesh_failure *f = &self->failure;
  *f = (flesh_failure){.status = status, .t = stage->t, .h = h, .halvings = halvings,
                       .residual = stats->residual_last, .target = stats->residual_target};
  f->worst_J = flesh_mesh_jacobians(mesh, x, NULL, &f->worst_tet, NULL);
  const int *tet = flesh_mesh_tets(mesh) + 4 * (size_t)f->worst_tet;
  for (int c = 0; c < 3; c++)
    for (int a = 0; a < 4; a++) f->worst_position[c] += x[3 * tet[a] + c] / 4;
  f->worst_node = flesh_nonlinear_worst_node(self->nonlinear);
}

static int solve(flesh_integrator *self, const flesh_stage *stage, double h, int halvings,
                 int extensions, flesh_solve_stats *stats)
{
  self->trying.t = stage->t_lag;
  self->trying.h = h;
  int status = flesh_nonlinear_solve(self->nonlinear, stage, NULL, extensions, stats);
  if (status) record_failure(self, stage, h, halvings, status, stats);
  return status;
}

/* A piece of time without events inside; those at its ends (within rounding of the state's time) are told apart so
 * that the piece sees what holds between them. */
typedef struct piece {
  double begin; /* the first time that belongs to it */
  double end;   /* of the piece */
  double event; /* the next event after `begin`; at `end`, later, or INFINITY */
} piece;

/* The last moment before the event. */
static double before(double t, double event) { return t < event ? t : nextafter(event, -INFINITY); }

/* Where the method starts anew, constrained dofs may have jumped, or their velocities: what a short step would make of
 * that; and the acceleration, for methods that go on from it. */
static int start_piece(flesh_integrator *self, flesh_state *state, const piece *piece,
                       flesh_solve_stats *stats)
{
  flesh_method_memory *memory = &self->memory;
  double *a = self->row->acceleration ? memory->vectors[0] : memory->a0;
  flesh_prescribed_set(&self->prescribed, piece->begin, before(piece->end, piece->event), state->x);
  flesh_prescribed_begin(&self->prescribed, memory->v0, a);
  int status = flesh_nonlinear_apply_constraint_jump(self->nonlinear, piece->begin, self->prescribed.x[0], memory->v0,
                                       state->x, state->v, stats);
  if (status || !self->row->acceleration) return status;
  return flesh_nonlinear_acceleration(self->nonlinear, piece->begin, state->x, state->v, a, stats);
}

/* The state that the stage leads to must be one that can be reached and, where it is not the stage itself, have an
 * energy. */
static int check_end(flesh_integrator *self, const flesh_stage *stage, const flesh_state *state,
                     double t_end, flesh_solve_stats *stats)
{
  if (stage->shift.x == 1 && !flesh_system_limits_step(self->system)) return FLESH_OK;
  const double *u = flesh_nonlinear_unknowns(self->nonlinear);
  const int second = flesh_method_order(self->method) > 1;
  for (int d = 0; d < self->n; d++)
    self->start[d] = second && self->prescribed.fixed[d]
                         ? self->prescribed.x[FLESH_PRESCRIBED_POINTS - 1][d]
                         : state->x[d] + u[d];
  if (flesh_system_tunnelled(self->system, state->t, state->x, t_end, self->start)) return FLESH_UNDEFINED;
  if (stage->shift.x == 1) return FLESH_OK;
  return flesh_nonlinear_defined(self->nonlinear, t_end, self->start, state->v, self->energies, stats);
}

/* Whether a solve met nothing but a potential that is all but quadratic: then the next one will, and a first iterate
 * that goes on as before helps. Where bodies are tangled or collide it may lead astray. */
static int was_easy(const flesh_solve_stats *before, const flesh_solve_stats *after)
{
  return after->newton - before->newton <= 8 && after->projections == before->projections &&
         after->backtracks == before->backtracks;
}

/* First iterates for a step of h to stage->t: straight on, and as rigid bodies where some are free. */
static void make_guesses(flesh_integrator *self, const flesh_state *state, const flesh_stage *stage, double h,
                         const double *guesses[3])
{
  const int holds = flesh_system_holds(self->system, stage->t), nearest = self->row == &flesh_method_backward_euler;
  int count = 0;
  if (flesh_extrapolation_guess(&self->extrapolation, state, h, self->guess)) {
    flesh_nonlinear_go_on(self->nonlinear);
    guesses[count++] = self->guess;
  }
  if (holds && self->held) flesh_system_fixed(self->system, stage->t, self->held);
  if (!(holds && !self->held) &&
      flesh_rigid_guess(&self->parts, holds ? self->held : NULL, state, h, nearest, self->rigid))
    guesses[count++] = self->rigid;
  guesses[count] = NULL;
}

/* One try of a step of h to t_end. */
static int attempt(flesh_integrator *self, flesh_state *state, const piece *piece, double t_end,
                   double h, int halvings, flesh_solve_stats *stats)
{
  flesh_method_memory *memory = &self->memory;
  const int second = flesh_method_order(self->method) > 1;
  flesh_stage stage;
  self->trying.t = state->t;
  self->trying.h = h;
  self->row->stage(memory, state, t_end, h, &stage);
  stage.t = before(stage.t, piece->event);
  stage.x_lag = state->x;
  stage.v_lag = state->v;
  stage.t_lag = state->t;
  stage.frozen_at_solution = second;
  if (second) {
    flesh_prescribed_set(&self->prescribed, fmax(state->t, piece->begin), before(t_end, piece->event),
                         state->x);
    flesh_prescribed_stage(&self->prescribed, &stage, memory->v0, memory->a0);
  }
  const flesh_solve_stats before_solve = *stats;
  const double *guesses[3];
  make_guesses(self, state, &stage, h, guesses);
  int status = flesh_nonlinear_solve(self->nonlinear, &stage, guesses, 0, stats);
  if (!status) status = check_end(self, &stage, state, t_end, stats);
  if (status) {
    record_failure(self, &stage, h, halvings, status, stats);
    return status;
  }
  const double from = fmax(state->t, piece->begin), to = before(t_end, piece->event);
  const flesh_step_energy energy = {&self->watch, self->nonlinear, &stage, second, from, to, self->energies};
  status = flesh_step_energy_count(&energy, state);
  if (status) return status;
  self->row->finish(memory, flesh_nonlinear_unknowns(self->nonlinear), h, state);
  state->t = t_end;
  stats->steps++;
  stats->order = second ? 2 : 1;
  stats->h_last = h;
  if (second) {
    flesh_prescribed_finish(&self->prescribed, state->x, state->v);
    memory->known = 1;
    memory->h = h;
  }
  if (self->extrapolation.n)
    flesh_extrapolation_remember(&self->extrapolation, flesh_nonlinear_unknowns(self->nonlinear), state, h,
                                 was_easy(&before_solve, stats));
  status = flesh_step_energy_judge(&energy, state, stats);
  if (status == FLESH_ERR_ENERGY) record_failure(self, &stage, h, halvings, status, stats);
  return status;
}

/* Steps through a piece of length h, halving what fails: an explicit walk over the binary subdivision, so that depth
 * is bounded by max_cutbacks and work by its leaves. */
static int walk(flesh_integrator *self, flesh_state *state, const piece *piece, double h,
                flesh_solve_stats *stats)
{
  const double begin = state->t;
  unsigned long long place = 0; /* of the next part, in units of h / 2^depth */
  int depth = 0;
  for (;;) {
    unsigned long long parts = 1ULL << depth;
    double t_end = place + 1 == parts ? piece->end : begin + h * ((double)(place + 1) / (double)parts);
    int status = attempt(self, state, piece, t_end, h / (double)parts, depth, stats);
    if (status < 0) return status;
    if (status) {
      stats->convergence_failures++;
      if (depth == self->options.max_cutbacks) return status;
      depth++;
      place *= 2;
      continue;
    }
    place++;
    while (depth > 0 && place % 2 == 0) depth--, place /= 2;
    if (depth == 0) return FLESH_OK;
  }
}

static int same_state(const flesh_state *a, const flesh_state *b, int n, double tolerance)
{
  return fabs(a->t - b->t) <= tolerance && !memcmp(a->x, b->x, (size_t)n * sizeof *a->x) &&
         !memcmp(a->v, b->v, (size_t)n * sizeof *a->v);
}

static void remember(flesh_integrator *self, const flesh_state *state)
{
  self->returned.t = state->t;
  memcpy(self->returned.x, state->x, (size_t)self->n * sizeof *state->x);
  memcpy(self->returned.v, state->v, (size_t)self->n * sizeof *state->v);
}

/* From state->t to state->t + h, in one piece or, for methods of order 2, in pieces between events. */
static int step_in_time(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  const double begin = state->t, end = begin + h;
  if (!flesh_energy_watch_knows(&self->watch, state)) flesh_energy_watch_jump(&self->watch, begin, state);
  if (flesh_method_order(self->method) < 2)
    return walk(self, state, &(piece){begin, end, INFINITY}, h, stats);
  /* Times closer than this are the same: grids of steps and times of events carry rounding. */
  const double tolerance = fmax(1e-9 * h, 8 * DBL_EPSILON * fmax(fabs(begin), fabs(end)));
  if (!same_state(state, &self->returned, self->n, tolerance)) self->memory.known = 0;
  int status = FLESH_OK;
  while (!status && state->t < end) {
    piece next = {.begin = state->t, .end = end};
    next.event = flesh_system_next_event(self->system, state->t);
    while (next.event <= state->t + tolerance) {
      next.begin = next.event;
      next.event = flesh_system_next_event(self->system, next.event);
    }
    if (next.event < end - tolerance) next.end = next.event;
    double length = state->t == begin && next.end == end ? h : next.end - state->t, t = state->t;
    remember(self, state);
    if (!self->memory.known) {
      flesh_extrapolation_forget(&self->extrapolation);
      status = start_piece(self, state, &next, stats);
    }
    if (status > 0)
      record_failure(self, &(flesh_stage){.t = next.begin}, length, 0, status, stats);
    if (!status && !self->memory.known) {
      flesh_energy_watch_jump(&self->watch, next.begin, state);
      if (self->row->acceleration)
        status = flesh_step_energy_begin(&self->watch, &self->prescribed, state, next.begin, length,
                                         self->memory.vectors[0], self->guess);
    }
    if (!status) status = walk(self, state, &next, length, stats);
    if (status && state->t == t) { /* the start has moved nothing */
      memcpy(state->x, self->returned.x, (size_t)self->n * sizeof *state->x);
      memcpy(state->v, self->returned.v, (size_t)self->n * sizeof *state->v);
    }
    if (status || next.event <= state->t + tolerance) self->memory.known = 0;
  }
  remember(self, state);
  return status;
}

/* Repeats a solve that has succeeded, with the lagged state that the last one led to, until none is needed. */
static int follow(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  enum { REPETITIONS = 100 };
  flesh_stage stage;
  for (int k = 0; k < REPETITIONS; k++) {
    const int before = stats->newton;
    self->row->stage(&self->memory, state, state->t, h, &stage);
    int status = solve(self, &stage, h, 0, 0, stats);
    if (status) return status;
    if (stats->newton == before) return FLESH_OK;
    self->row->finish(&self->memory, flesh_nonlinear_unknowns(self->nonlinear), h, state);
  }
  return FLESH_NOT_CONVERGED;
}

/* Equilibrium at t+h: the full load first, then in increments that shrink on failure and grow on success. */
static int solve_static(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  flesh_stage stage;
  self->row->stage(&self->memory, state, state->t + h, h, &stage);
  stage.x_lag = state->x;
  stage.t_lag = state->t;
  /* From a far start the full load may need many iterations, each of which is nearer. */
  int status = solve(self, &stage, h, 0, self->options.max_cutbacks, stats);
  if (status == FLESH_OK) {
    self->row->finish(&self->memory, flesh_nonlinear_unknowns(self->nonlinear), h, state);
    state->t = stage.t;
    memset(state->v, 0, (size_t)self->n * sizeof *state->v);
    return FLESH_OK;
  }
  /* The load is raised from nothing to the full one while what is prescribed moves along. */
  memcpy(self->start, state->x, (size_t)self->n * sizeof *self->start);
  double reached = 0, increment = 0.5;
  const double smallest = ldexp(1, -self->options.max_cutbacks), begin = state->t;
  while (status >= 0 && reached < 1) {
    double load = fmin(1, reached + increment);
    self->row->stage(&self->memory, state, state->t + h, h, &stage);
    stage.load = load;
    stage.x_lag = state->x;
    stage.t_lag = reached > 0 ? stage.t : begin; /* obstacles and targets are at the end at once */
    stage.prescribed_fraction = (load - reached) / (1 - reached);
    status = solve(self, &stage, h, (int)lround(-log2(increment)), 0, stats);
    if (status < 0) break;
    if (status) {
      increment /= 2;
      if (increment < smallest) break;
      continue;
    }
    self->row->finish(&self->memory, flesh_nonlinear_unknowns(self->nonlinear), h, state);
    reached = load;
    increment *= 2;
    state->t = reached < 1 ? begin : stage.t;
  }
  if (reached >= 1) {
    memset(state->v, 0, (size_t)self->n * sizeof *state->v);
    return FLESH_OK;
  }
  /* A part of the load is no equilibrium that was asked for. */
  memcpy(state->x, self->start, (size_t)self->n * sizeof *self->start);
  return status;
}

/* IDA's steps; before the motion is calm, backward Euler's where those are asked for. */
static int step_adaptively(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats,
                           int *euler)
{
  int status = FLESH_OK;
  if (self->method == FLESH_METHOD_ADAPTIVE) self->calm = 1;
  else if (!self->calm || !flesh_adaptive_returned(self->adaptive, state))
    status = flesh_adaptive_is_calm(self->adaptive, state, h, &self->calm, stats);
  *euler = !self->calm;
  if (status) return status;
  if (*euler) return step_in_time(self, state, h, stats);
  status = flesh_adaptive_step(self->adaptive, state, h, stats);
  if (status == FLESH_ERR_INTEGRATOR || status == FLESH_ERR_ENERGY)
    self->failure = *flesh_adaptive_failure(self->adaptive);
  return status;
}

/* Equilibrium at t+h with a lagged state that is its own, where effects want that. */
static int balance(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  if (!flesh_system_has_follower_loads(self->system)) return solve_static(self, state, h, stats);
  remember(self, state);
  int status = solve_static(self, state, h, stats);
  if (!status && (status = follow(self, state, h, stats)) > 0) {
    state->t = self->returned.t;
    memcpy(state->x, self->returned.x, (size_t)self->n * sizeof *state->x);
    memcpy(state->v, self->returned.v, (size_t)self->n * sizeof *state->v);
  }
  return status;
}

/* An equilibrium that is a tangle is put back and solved again. */
static int equilibrium(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  int status = balance(self, state, h, stats);
  while (!status && self->untangler &&
         (status = flesh_untangler_after_equilibrium(self->untangler, state, stats)) == 1)
    status = balance(self, state, 0, stats);
  return status;
}

int flesh_integrator_step(flesh_integrator *self, flesh_state *state, double h, flesh_solve_stats *stats)
{
  FLESH_NEED({self, "integrator"}, {state, "state"});
  flesh_solve_stats ignored = {0};
  if (!stats) stats = &ignored;
  if (!(h >= 0 && h < INFINITY) || (h == 0 && self->method != FLESH_METHOD_STATIC))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the step is %g s; it must be positive and finite", h);
  int status, euler = 1;
  if (self->untangler) flesh_untangler_before_step(self->untangler, state);
  self->watch.step = h;
  if (is_adaptive(self->method)) status = step_adaptively(self, state, h, stats, &euler);
  else if (self->method == FLESH_METHOD_STATIC) status = equilibrium(self, state, h, stats);
  else status = step_in_time(self, state, h, stats);
  if (!status && self->untangler && self->method != FLESH_METHOD_STATIC) {
    status = flesh_untangler_after_step(self->untangler, state, h, stats);
    return status < 0 ? status : FLESH_OK;
  }
  if (status == FLESH_ERR_INTEGRATOR || status > 0) flesh_energy_watch_last(&self->watch, state);
  if (status > 0 && !euler) return status;
  if (status <= 0) return status;
  const flesh_failure *f = &self->failure;
  char residual[80] = "there is no residual"; /* where the first iterate has no energy */
  if (f->worst_node >= 0)
    snprintf(residual, sizeof residual, "residual %.3g N, wanted %.3g N", f->residual, f->target);
  return flesh_fail(f->status == FLESH_NONFINITE ? FLESH_ERR_NONFINITE : FLESH_ERR_SOLVE,
                    "at t = %.9g s with h = %.3g s: %s; %s; smallest J = %.3g in tet %d at (%.4g, %.4g, %.4g)",
                    f->t, f->h, flesh_status_text(f->status), residual, f->worst_J, f->worst_tet,
                    f->worst_position[0], f->worst_position[1], f->worst_position[2]);
}
