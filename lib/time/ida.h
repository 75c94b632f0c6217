/* ida.h: variable steps and orders by IDA behind flesh_integrator_step. */
#ifndef FLESH_TIME_IDA_H
#define FLESH_TIME_IDA_H

#include <stddef.h>

#include "base/archive.h"
#include "flesh/integrator.h"
#include "system/system.h"
#include "time/energy_watch.h"

typedef struct flesh_ida_steps flesh_ida_steps;

/* Borrows the run's evaluation and the watch; copies the options. Returns new, unless a rank comes with a `status` other
 * than FLESH_OK, of what it has made before; it may fail on one rank alone. Collective. */
int flesh_ida_steps_create_after(int status, flesh_evaluation *evaluation, const flesh_solver_options *solver,
                                 flesh_energy_watch *watch, flesh_ida_steps **steps);
void flesh_ida_steps_destroy(flesh_ida_steps **steps);
/* FLESH_ERR_ARGUMENT where a value is out of its range. */
int flesh_adaptive_options_check(const flesh_adaptive_options *options);
/* Shows an internal step to who observes them; the status is that of all ranks. */
int flesh_adaptive_options_show(const flesh_adaptive_options *options, const flesh_team *team,
                                const flesh_internal_step *step);
int flesh_ida_steps_set_options(flesh_ida_steps *steps, const flesh_adaptive_options *options);
void flesh_ida_steps_set_stop(flesh_ida_steps *steps, int (*stop)(void *data), void *data);

/* Takes the state to t+h by internal steps, starting anew at events and when the state is not the one it was given
 * back. FLESH_ERR_INTEGRATOR with what is known in flesh_ida_steps_failure; the state is then the last one reached. */
int flesh_ida_steps_step(flesh_ida_steps *steps, flesh_state *state, double h, flesh_solve_stats *stats);

const flesh_failure *flesh_ida_steps_failure(const flesh_ida_steps *steps);
/* t and h of IDA's internal step. */
void flesh_ida_steps_progress(const flesh_ida_steps *steps, flesh_progress *progress);
/* Sets the counter of its evaluations, borrowed. */
void flesh_ida_steps_set_costs(flesh_ida_steps *steps, flesh_costs *costs);
/* IDA's memory. */
void *flesh_ida_steps_ida(const flesh_ida_steps *steps);
size_t flesh_ida_steps_memory(const flesh_ida_steps *steps);
/* But for IDA's history, which it does not take back: loaded, it starts anew from the state given back last. */
void flesh_ida_steps_archive(flesh_ida_steps *steps, flesh_archive *archive);
/* Whether there is such a history. */
int flesh_ida_steps_runs(const flesh_ida_steps *steps);

#endif
