/* energy_watch.c: the balance of a motion's energy with the external work.
 *
 * The motion obeys M a + dV/dx(x,t) + f + d = R, with the forces f of effects without an energy (a pressure on an open
 * surface), dissipative ones d with d.v >= 0 (damping, viscosity, friction) and the reactions R of the constrained dofs.
 * Its product with v is the balance of the energy E = v.Mv/2 + V (Belytschko, Liu & Moran 2000, "Nonlinear Finite Elements
 * for Continua and Structures", section 6.2.3):
 *
 *   dE/dt = P - d.v <= P,   P = dV/dt|_x + R.v - f.v.
 *
 * dV/dt|_x is the work of loads, springs and obstacles that change with time: of an obstacle the force on the body
 * times the obstacle's own motion, friction included, since what friction takes is d.v relative to it. W is the sum of
 * P over the steps; so D = E - W never rises in truth, and methods that damp only lower it. What D rises by above its
 * least value before is spurious energy, the excess. It is reported as a fraction of the energy that the motion has had
 * rightly: the largest of E - V_least - excess so far, V_least being the lowest V so far. Both do not depend on what V
 * is counted from.
 *
 * W of a step, u being the displacement over it:
 * - Backward Euler has E_1 - E_0 <= (forces at the end).(displacements of what is moved) - |v_1 - v_0|^2_M / 2 where V
 *   is convex, as V_1 - V_0 <= dV/dx_1.u there. So R_1.u, f_1.u and an obstacle's forces at the end along its path; and
 *   V(t_1,x_0) - V(t_0,x_0). Along a prescribed rotation V is not convex: R_1 does little along the chord of a large
 *   rotation, and all of a constant torque's work with the prescribed velocity v_1. The excess of h R_1.v_1 over R_1.u
 *   may be external work, too, and is taken as not known. Where the step rotates by more than a right angle (u and v_1
 *   are apart by half of that), nothing of its work is known: the change of E counts as external work.
 * - Others are of second order: power at the step's middle, interpolated between their stages, R.v there. For the
 *   midpoint rule that is its own stage, and v_1.Mv_1/2 - v_0.Mv_0/2 = u.Ma exactly; for Newmark's, BDF2 and HHT the
 *   line through the stages of two steps, which for Newmark's is the trapezoidal rule of its own accelerations. V(t,x)
 *   by half the sum of its change at x_0 and at x_1, exact where V is quadratic.
 * - Runge-Kutta methods add up the power of their stages with the weights of the step, R_i.V_i at each. V(t,x) by
 *   its changes at the ends and the middle of the step, to order 4.
 * - IDA has an interpolant, along which the power is integrated by Simpson's rule with as many parts as it needs: where
 *   all is prescribed no error limits the steps (ida_energy.c).
 * At an event, where constraints jump and loads begin and end, the change of E counts as external work; so does, where
 * backward Euler stands in for another method, that from the velocities u/h of constrained dofs to the prescribed ones.
 *
 * Where internal variables change at the end of a step (something breaks), E falls by what that dissipates; so does D.
 *
 * Between their stages, methods that damp little end steps where a stiff barrier is met deeper or has been passed: the
 * energy of one such state says little, and the next step takes it back. So an excess counts where three steps in a row
 * have it.
 *
 * Nothing is reported below what is unknown: the rounding of V (1e-10 of the sizes of its terms), the work that residuals
 * left by the solves can do (their norm times that of u) and what is not known of the reactions' work. Where errors choose
 * steps, residuals are a part of these errors, and what they gain is reported; unknown is half the tolerance of all work so
 * far. What is at rest has no energy to gain a share of: the share is of no less than the energy of a vibration as large as
 * the error that a step may make or, of IDA, of a motion as slow as its tolerance. */
#include "time/energy_watch.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "mesh/inspect.h"
#include "system/internal.h"
#include "system/one_effect.h"
#include "system/ranks.h"
#include "system/work.h"

static const double gain_to_report = 0.05, rounding_of_terms = 1e-10;
/* Shares of the motion's energy that all steps together may gain: where errors choose their lengths, a hundredth, at
 * most `tolerance`; else a fiftieth of the gain that ends the run. After that each step may still gain a thousandth of
 * it, as there are gains that no halving lessens. */
static const double gain_of_controlled = 0.01, gain_of_fixed = 0.02, least_of_step = 0.001;

int flesh_energy_watch_create(flesh_evaluation *evaluation, flesh_energy_watch *watch)
{
  const flesh_system *system = evaluation->system;
  const size_t n = (size_t)flesh_system_unknowns(system);
  *watch = (flesh_energy_watch){.system = system, .evaluation = evaluation, .n = (int)n, .limit = INFINITY, .rate = NAN};
  watch->effects = flesh_system_effect_count(system);
  watch->kinds = flesh_system_work_kinds(system);
  watch->energies = calloc((size_t)watch->effects + 1, sizeof *watch->energies);
  if (watch->kinds & FLESH_WORK_OF_FORCES) watch->scratch = calloc(2 * n + 1, sizeof *watch->scratch);
  watch->balance.worst_tet = watch->balance.fastest_node = -1;
  if (watch->energies && (watch->scratch || !(watch->kinds & FLESH_WORK_OF_FORCES))) return FLESH_OK;
  flesh_energy_watch_clear(watch);
  return flesh_fail(FLESH_ERR_MEMORY, "no memory to watch the energy of %zu unknowns", n);
}

void flesh_energy_watch_clear(flesh_energy_watch *watch)
{
  free(watch->energies);
  free(watch->scratch);
  *watch = (flesh_energy_watch){0};
}

int flesh_energy_watch_knows(const flesh_energy_watch *watch)
{
  return watch->known && watch->serial == watch->evaluation->serial;
}

flesh_point flesh_energy_watch_point(const flesh_energy_watch *watch, double t, const flesh_state *state, const double *a)
{
  flesh_point point = flesh_evaluation_point(watch->evaluation, t, state->x, state->v, a ? a : watch->evaluation->zeros);
  point.multipliers = state->multipliers;
  point.internal = state->internal;
  return point;
}

/* Finds the energy and the kinetic energy of the run's state from `energies`; they are known unless one has no value. */
static void add_up(flesh_energy_watch *watch, double t, int status)
{
  double sum = 0;
  for (int e = 0; e < watch->effects; e++) sum += watch->energies[e];
  watch->known = !status && isfinite(sum);
  watch->t = t;
  watch->energy = sum;
  watch->kinetic = flesh_system_role_energy(watch->system, FLESH_ROLE_INERTIA, watch->energies);
  watch->serial = watch->evaluation->serial;
}

/* Starts the balance at the first state: no excess, nothing put in. */
static void begin(flesh_energy_watch *watch, double t, const flesh_state *state)
{
  const flesh_environment uncounted = {.proximity = watch->evaluation->environment.proximity};
  flesh_point point = flesh_energy_watch_point(watch, t, state, NULL);
  double phi, size = 0;
  point.environment = &uncounted;
  watch->balance.supplied = watch->unbalanced = 0;
  watch->least = watch->energy;
  watch->lowest = watch->energy - watch->kinetic;
  watch->balance.t_since = watch->lasting.t = t;
  if (!flesh_system_potential(watch->system, &point, &(flesh_shift){.x = 1}, &phi, &size))
    watch->rounding = rounding_of_terms * size;
}

void flesh_energy_watch_jump(flesh_energy_watch *watch, double t, const flesh_state *state)
{
  const flesh_point point = flesh_energy_watch_point(watch, t, state, NULL);
  const double before = watch->known ? watch->energy : NAN;
  const int first = watch->balance.begun == 0;
  int status = flesh_system_energies(watch->system, &point, watch->energies);
  add_up(watch, t, status);
  watch->rate = NAN;
  if (!watch->known) return;
  if (first) begin(watch, t, state), watch->balance.begun = 1;
  /* Goes on, after a state without an energy, from this one. */
  else watch->balance.supplied += isnan(before) ? watch->energy - watch->balance.supplied - watch->least
                                                : watch->energy - before;
  watch->lowest = fmin(watch->lowest, watch->energy - watch->kinetic);
}

void flesh_energy_watch_begin(flesh_energy_watch *watch, double t, double rate)
{
  watch->rate = rate;
  watch->rate_t = t;
}

void flesh_energy_watch_add_work(flesh_energy_watch *watch, double t_from, double t_to, double t_stage, double work,
                                 int first_order)
{
  const double h = t_to - t_from, rate = work / h, gap = t_stage - watch->rate_t;
  double share = 0; /* weight of the stage before */
  if (!first_order && !isnan(watch->rate) && gap > 0) share = fmin((t_stage - (t_from + h / 2)) / gap, 1);
  watch->balance.supplied += share > 0 ? h * ((1 - share) * rate + share * watch->rate) : work;
  watch->rate = rate;
  watch->rate_t = t_stage;
}

/* Finds the tet with the smallest J and the fastest node. */
static void find_place(flesh_energy_watch *watch, const flesh_state *state)
{
  flesh_energy_balance *b = &watch->balance;
  const flesh_mesh *mesh = flesh_system_mesh(watch->system);
  const uint8_t *used = flesh_mesh_node_used(mesh);
  b->worst_J = flesh_mesh_jacobians(mesh, state->x, NULL, &b->worst_tet, NULL);
  flesh_mesh_centre(mesh, state->x, b->worst_tet, b->worst_position);
  double fastest = -1;
  for (int i = 0; i < watch->n / 3; i++) {
    const double *v = state->v + 3 * (size_t)i, square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    if (used[i] && square > fastest) fastest = square, b->fastest_node = i;
  }
  b->fastest_speed = sqrt(fastest);
  memcpy(b->fastest_position, state->x + 3 * (size_t)b->fastest_node, sizeof b->fastest_position);
}

static void describe(const flesh_energy_balance *b, size_t size, char *text)
{
  char share[96];
  if (b->gain < 10)
    snprintf(share, sizeof share, "%.3g %% of the %.3g J that the motion has had", 100 * b->gain, b->scale);
  else if (b->gain < 1000)
    snprintf(share, sizeof share, "%.3g times the %.3g J that the motion has had", b->gain, b->scale);
  else snprintf(share, sizeof share, "out of all proportion to what the motion has had");
  snprintf(text, size,
           "from t = %.6g s to %.6g s the energy grew by %.3g J although nothing put it in, %s; node %d at (%.4g, "
           "%.4g, %.4g) is fastest with %.3g m/s; smallest J = %.3g in tet %d at "
           "(%.4g, %.4g, %.4g)",
           b->t_least, b->t_largest, b->largest, share, b->fastest_node, b->fastest_position[0], b->fastest_position[1],
           b->fastest_position[2], b->fastest_speed, b->worst_J, b->worst_tet, b->worst_position[0],
           b->worst_position[1], b->worst_position[2]);
}

/* Returns the excess that all of the last steps have had; of steps in parts the least of all parts, or of 16. */
static double lasting(flesh_energy_watch *watch)
{
  enum { PARTS = 16 };
  double least = INFINITY;
  const double excess = watch->balance.excess;
  if (watch->lasting.parts++ == 0 || excess < watch->lasting.part) watch->lasting.part = excess;
  if (watch->t - watch->lasting.t >= 0.999 * watch->step || watch->lasting.parts >= PARTS) {
    watch->lasting.least[watch->lasting.next] = watch->lasting.part;
    watch->lasting.next = (watch->lasting.next + 1) % FLESH_ENERGY_STEPS;
    watch->lasting.count += watch->lasting.count < FLESH_ENERGY_STEPS;
    watch->lasting.parts = 0;
    watch->lasting.t = watch->t;
  }
  if (watch->lasting.count < FLESH_ENERGY_STEPS) return 0;
  for (int k = 0; k < FLESH_ENERGY_STEPS; k++) least = fmin(least, watch->lasting.least[k]);
  return least;
}

/* Reports an excess that counts; returns whether it exceeds the limit. */
static int report(flesh_energy_watch *watch, const flesh_state *state, double excess)
{
  flesh_energy_balance *b = &watch->balance;
  const double unknown = watch->rounding + watch->unbalanced + watch->doubt * watch->worked;
  const double gain = (excess - unknown) / fmax(b->scale, fmax(unknown, watch->floor));
  if (!(gain > b->gain)) return 0;
  b->gain = gain;
  b->largest = excess;
  b->t_least = b->t_since;
  b->t_largest = watch->t;
  if (!(gain > gain_to_report)) return 0;
  if (excess > 1.1 * watch->reported || gain > watch->limit) {
    watch->reported = excess;
    find_place(watch, state);
    describe(b, sizeof watch->warning, watch->warning);
  }
  return gain > watch->limit;
}

/* Returns how much the energy may rise beyond what is put in, J. */
static double most_rise(const flesh_energy_watch *watch, double tolerance)
{
  const flesh_energy_balance *b = &watch->balance;
  const double scale = fmax(b->scale, watch->energy - fmin(watch->lowest, watch->energy - watch->kinetic));
  const double most = (tolerance > 0 ? fmin(gain_of_controlled, tolerance) : gain_of_fixed * watch->limit) * scale;
  return watch->rounding + fmax(watch->floor + watch->doubt * watch->worked + most - fmax(b->excess, 0), least_of_step * most);
}

int flesh_energy_watch_refuses(const flesh_energy_watch *watch, const flesh_energy_watch *before, double tolerance)
{
  const double rise = (watch->energy - watch->balance.supplied) - (before->energy - before->balance.supplied);
  return before->known && watch->known && !watch->turned && rise > most_rise(watch, tolerance);
}

int flesh_energy_watch_puts_off(const flesh_energy_watch *watch, const flesh_state *state, const double *next, double tolerance)
{
  double energies[watch->effects + 1], sums[2];
  flesh_point point = flesh_energy_watch_point(watch, state->t, state, NULL);
  int status = flesh_system_internal_energies(watch->system, &point, energies, &sums[0]);
  point.internal = next;
  if (!status) status = flesh_system_internal_energies(watch->system, &point, energies, &sums[1]);
  return !status && watch->known && sums[1] - sums[0] > most_rise(watch, tolerance);
}

int flesh_energy_watch_judge(flesh_energy_watch *watch, const flesh_state *state, double unbalanced)
{
  flesh_energy_balance *b = &watch->balance;
  const double net = watch->energy - b->supplied, potential = watch->energy - watch->kinetic;
  if (!watch->known) return FLESH_OK;
  watch->unbalanced += watch->doubt > 0 ? 0 : unbalanced;
  watch->worked += fabs(b->supplied - watch->counted);
  watch->counted = b->supplied;
  watch->lowest = fmin(watch->lowest, potential);
  if (net <= watch->least) {
    watch->least = net;
    watch->unbalanced = 0;
    b->t_since = watch->t;
  }
  b->excess = net - watch->least;
  b->scale = fmax(b->scale, watch->energy - watch->lowest - b->excess);
  return report(watch, state, lasting(watch)) ? flesh_fail(FLESH_ERR_ENERGY, "%s", watch->warning) : FLESH_OK;
}

void flesh_energy_watch_last(flesh_energy_watch *watch, const flesh_state *state)
{
  if (watch->known) report(watch, state, watch->balance.excess);
}

int flesh_energy_watch_record_state(flesh_energy_watch *watch, double t, const flesh_state *state,
                                    const flesh_position_potential *by_position, const double *energies)
{
  const flesh_point point = flesh_energy_watch_point(watch, t, state, NULL);
  int status = FLESH_OK;
  if (!watch->balance.begun || !watch->known) {
    flesh_energy_watch_jump(watch, t, state);
    return FLESH_OK;
  }
  if (energies) {
    memcpy(watch->energies, energies, (size_t)watch->effects * sizeof *energies);
    double kinetic;
    status = flesh_system_kinetic_energies(watch->system, &point, watch->energies, &kinetic);
  } else {
    flesh_position_potential unknown = {0};
    status = flesh_system_energies_by_position(watch->system, &point, by_position ? by_position : &unknown, watch->energies);
  }
  add_up(watch, t, status);
  return status;
}

int flesh_energy_watch_kick(flesh_energy_watch *watch, const flesh_state *state)
{
  const flesh_point point = flesh_energy_watch_point(watch, watch->t, state, NULL);
  const double before = watch->energy;
  double kinetic;
  if (!watch->known) return FLESH_OK;
  int status = flesh_system_kinetic_energies(watch->system, &point, watch->energies, &kinetic);
  add_up(watch, watch->t, status);
  if (watch->known) watch->balance.supplied += watch->energy - before;
  return status < 0 ? status : FLESH_OK;
}

int flesh_energy_watch_release(flesh_energy_watch *watch, const double *before, const flesh_state *state)
{
  flesh_point point = flesh_energy_watch_point(watch, state->t, state, NULL);
  double sums[2];
  point.internal = before;
  int status = flesh_system_internal_energies(watch->system, &point, watch->energies, &sums[0]);
  point.internal = state->internal;
  if (!status) status = flesh_system_internal_energies(watch->system, &point, watch->energies, &sums[1]);
  if (!status) watch->balance.released += sums[0] - sums[1];
  if (status || watch->known) add_up(watch, watch->t, status);
  return status < 0 ? status : FLESH_OK;
}

int flesh_energy_watch_add_work_in_time(flesh_energy_watch *watch, double t_from, const flesh_state *state)
{
  double work = 0;
  if (!(watch->kinds & FLESH_WORK_IN_TIME) || !watch->known) return FLESH_OK;
  int status = flesh_system_work_in_time(watch->system, t_from, watch->t, state, watch->energies, 1, &work);
  watch->balance.supplied += work / 2;
  if (status) watch->known = 0;
  return status;
}

void flesh_energy_watch_archive(flesh_energy_watch *self, flesh_archive *archive)
{
  flesh_archive_bytes(archive, self->energies, (size_t)self->effects * sizeof *self->energies);
  FLESH_ARCHIVE(archive, self->known);
  FLESH_ARCHIVE(archive, self->t);
  FLESH_ARCHIVE(archive, self->serial);
  FLESH_ARCHIVE(archive, self->energy);
  FLESH_ARCHIVE(archive, self->least);
  FLESH_ARCHIVE(archive, self->lowest);
  FLESH_ARCHIVE(archive, self->rounding);
  FLESH_ARCHIVE(archive, self->unbalanced);
  FLESH_ARCHIVE(archive, self->floor);
  FLESH_ARCHIVE(archive, self->worked);
  FLESH_ARCHIVE(archive, self->counted);
  FLESH_ARCHIVE(archive, self->rate);
  FLESH_ARCHIVE(archive, self->rate_t);
  FLESH_ARCHIVE(archive, self->turned);
  FLESH_ARCHIVE(archive, self->step);
  flesh_archive_int(archive, &self->lasting.count, 0, FLESH_ENERGY_STEPS);
  flesh_archive_int(archive, &self->lasting.next, 0, FLESH_ENERGY_STEPS - 1);
  FLESH_ARCHIVE(archive, self->lasting.least);
  FLESH_ARCHIVE(archive, self->lasting.parts);
  FLESH_ARCHIVE(archive, self->lasting.part);
  FLESH_ARCHIVE(archive, self->lasting.t);
  FLESH_ARCHIVE(archive, self->reported);
  FLESH_ARCHIVE(archive, self->balance);
  FLESH_ARCHIVE(archive, self->warning);
  self->warning[sizeof self->warning - 1] = 0;
}
