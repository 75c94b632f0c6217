/* work.h: what effects that are not passive put in over a step. */
#ifndef FLESH_SYSTEM_WORK_H
#define FLESH_SYSTEM_WORK_H

#include "flesh/state.h"
#include "flesh/system.h"

/* How effects put in energy, or'ed. */
typedef enum flesh_work_kind {
  FLESH_WORK_OF_FORCES = 1, /* without an energy, or by what moves: forces along displacements */
  FLESH_WORK_IN_TIME = 2    /* with an energy that may change with t at a place */
} flesh_work_kind;

/* Which kinds a system has; 0: its effects are all passive. */
int flesh_system_work_kinds(const flesh_system *system);

/* Work, J, over a step from t_from to t_to by the forces that effects have at `point`: those without an energy (-r.u),
 * and those that stand for something that moves (-r.dx with its displacement dx, flesh_effect_time.carry). `u`
 * [3*n] is the body's displacement over the step; NULL: body and obstacles are as fast as at `point`, which is within
 * the step. Overwrites scratch [2 * 3*n]. */
int flesh_system_work_of_forces(const flesh_system *system, const flesh_point *point, double t_from, double t_to,
                                const double *u, double *scratch, double *work);

/* The change of the effects' energies with time from t_from to t_to while the body stays in this state, J: *work is
 * theirs at t_to less those at t_from; `energies` [effects] (may be NULL) are known there and at one of these times
 * (`at_end`), which saves their evaluation. */
int flesh_system_work_in_time(const flesh_system *system, double t_from, double t_to, const flesh_state *state,
                              const double *energies, int at_end, double *work);

#endif
