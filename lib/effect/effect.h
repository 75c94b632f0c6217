/* effect.h: what the built-in effects share in being made. */
#ifndef FLESH_EFFECT_EFFECT_H
#define FLESH_EFFECT_EFFECT_H

#include "effect/private.h"
#include "flesh/effects.h"

/* The fraction of a feasible step that is taken: less than 1, so that the body stays apart from obstacles. */
static const double flesh_feasible_step_kept = 0.9;

/* The penalties of incompressible tets are raised by this factor at least, wherever multipliers are solved for. */
enum { FLESH_LEAST_PENALTY = 5 };

/* flesh_effect_create; where `status` is not FLESH_OK, the data are destroyed, and that is returned. */
int flesh_effect_create_after(int status, const flesh_effect_operations *operations, const flesh_mesh *mesh, void *data,
                              flesh_effect **effect);

/* FLESH_ERR_ARGUMENT where the effect is made for a mesh of other counts of nodes or tets: its arrays have other lengths. */
int flesh_effect_check_mesh(const flesh_effect *effect, const flesh_mesh *mesh);

/* The status that an operation of the effect returned. Where it is negative and no sentence was recorded since the thread's
 * flesh_fail_count() was `said`, one that names the effect is: effects from outside of the library cannot record any. */
int flesh_effect_returned(const flesh_effect *effect, unsigned long said, int status);

/* The optional tables of an effect's kind, which are never NULL here: what a kind has not is NULL or 0 in them. */
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

/* Contact is reported where the forces of a step balance: between these stages, the ends of steps may lie deep in the
 * barrier or out of it, and the forces there do not average to those that moved the body. */
static inline int flesh_effect_reports_stage(const flesh_effect *effect)
{
  return effect->operations->role == FLESH_ROLE_CONTACT;
}

/* Parts of an interval [from, until) as the next event after t. */
double flesh_interval_next_event(double from, double until, double t);

/* The acceleration of a gravity effect, [3], borrowed; NULL for every other effect. */
const double *flesh_effect_acceleration(const flesh_effect *effect);

/* The vector instructions that an effect uses; AUTO for one that leaves them to the compiler. */
flesh_instructions flesh_effect_instructions(const flesh_effect *effect);

/* The radius of a spring, m, and in point [3] (may be NULL) where it is attached; NaN, with point
 * untouched, for every other effect. */
double flesh_effect_spring_radius(const flesh_effect *effect, double point[3]);

#endif
