/* effect.h: helpers shared by the built-in effects. */
#ifndef FLESH_EFFECT_EFFECT_H
#define FLESH_EFFECT_EFFECT_H

#include "effect/private.h"
#include "flesh/effects.h"

/* Fraction of a feasible step that is taken; below 1, so that the body stays apart from obstacles. */
static const double flesh_feasible_step_kept = 0.9;

/* Least factor by which the penalties of incompressible tets are raised while multipliers are solved for. */
enum { FLESH_LEAST_PENALTY = 5 };

/* Calls flesh_effect_create; but if `status` is not FLESH_OK, destroys the data and returns `status`. */
int flesh_effect_create_after(int status, const flesh_effect_operations *operations, const flesh_mesh *mesh, void *data,
                              flesh_effect **effect);

/* Checks that the mesh has as many nodes and tets as the one the effect was created for; otherwise
 * FLESH_ERR_ARGUMENT. */
int flesh_effect_check_mesh(const flesh_effect *effect, const flesh_mesh *mesh);

/* Returns the status that an operation of the effect returned. If it is negative and no message was recorded since the
 * thread's flesh_fail_count() was `said`, records one that names the effect, because effects from outside the library
 * cannot. */
int flesh_effect_returned(const flesh_effect *effect, unsigned long said, int status);

/* The functions below return the optional tables of an effect's kind, never NULL: missing entries are NULL or 0. */
static inline const flesh_effect_time *flesh_effect_in_time(const flesh_effect *effect)
{
  static const flesh_effect_time none = {0};
  return effect->operations->time ? effect->operations->time : &none;
}

static inline const flesh_effect_barrier *flesh_effect_as_barrier(const flesh_effect *effect)
{
  static const flesh_effect_barrier none = {0};
  return effect->operations->barrier ? effect->operations->barrier : &none;
}

static inline const flesh_effect_figures *flesh_effect_figures_of(const flesh_effect *effect)
{
  static const flesh_effect_figures none = {0};
  return effect->operations->figures ? effect->operations->figures : &none;
}

static inline int flesh_effect_internal_count(const flesh_effect *effect)
{
  return effect->operations->internal ? effect->operations->internal->count(effect) : 0;
}

static inline int flesh_effect_has_trait(const flesh_effect *effect, flesh_trait trait)
{
  return (effect->operations->traits & (unsigned)trait) != 0;
}

/* Whether the effect is reported at the stage where the forces of a step balance. Contact is: between these stages, the
 * ends of steps may lie deep in the barrier or out of it, and the forces there do not average to those that moved the
 * body. */
static inline int flesh_effect_reports_stage(const flesh_effect *effect)
{
  return effect->operations->role == FLESH_ROLE_CONTACT;
}

/* Returns the next event after t of an interval [from, until): one of its ends, or INFINITY. */
double flesh_interval_next_event(double from, double until, double t);

/* Returns the acceleration [3] of a gravity effect, borrowed; NULL for every other effect. */
const double *flesh_effect_acceleration(const flesh_effect *effect);

/* Returns the instruction set that the effect uses; AUTO if it is not vectorised by hand. */
flesh_instructions flesh_effect_instructions(const flesh_effect *effect);

/* Returns the radius of a spring, m, and copies its point of attachment to point [3] (may be NULL). For every other
 * effect returns NaN and leaves `point` unchanged. */
double flesh_effect_spring_radius(const flesh_effect *effect, double point[3]);

#endif
