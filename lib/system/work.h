/* work.h: the energy that non-passive effects put in over a step. */
#ifndef FLESH_SYSTEM_WORK_H
#define FLESH_SYSTEM_WORK_H

#include "flesh/state.h"
#include "flesh/system.h"

/* Ways in which effects put in energy, or'ed. */
typedef enum flesh_work_kind {
  FLESH_WORK_OF_FORCES = 1, /* effects without an energy, or against moving things: forces along displacements */
  FLESH_WORK_IN_TIME = 2    /* effects with an energy that may change with t at fixed positions */
} flesh_work_kind;

/* Returns the kinds that a system has; 0: its effects are all passive. */
int flesh_system_work_kinds(const flesh_system *system);

/* Computes the work, J, over a step from t_from to t_to of the forces that effects have at `point`: of those without an
 * energy (-r.u), and of those against something that moves (-r.dx with its displacement dx, flesh_effect_time.carry). `u`
 * [3*n] is the body's displacement over the step; NULL: body and obstacles move as fast as at `point`, which is within the
 * step. Overwrites scratch [2 * 3*n]. */
int flesh_system_work_of_forces(const flesh_system *system, const flesh_point *point, double t_from, double t_to,
                                const double *u, double *scratch, double *work);

/* Computes the change, J, of the effects' energies with time from t_from to t_to while the body stays in this state: *work
 * is the energies at t_to minus those at t_from. `energies` [effects] (may be NULL) are already known in this state at one
 * of these times (t_to if `at_end`), which saves their evaluation. */
int flesh_system_work_in_time(const flesh_system *system, double t_from, double t_to, const flesh_state *state,
                              const double *energies, int at_end, double *work);

#endif
