/* adaptive.h: variable steps and orders by IDA behind flesh_integrator_step. */
#ifndef FLESH_TIME_ADAPTIVE_H
#define FLESH_TIME_ADAPTIVE_H

#include <stddef.h>

#include "base/archive.h"
#include "flesh/integrator.h"
#include "system/system.h"
#include "time/energy_watch.h"

typedef struct flesh_adaptive flesh_adaptive;

/* Borrows the run's evaluation and the watch; copies the options. Returns new. */
int flesh_adaptive_create(flesh_evaluation *evaluation, const flesh_solver_options *solver, flesh_energy_watch *watch,
                          flesh_adaptive **adaptive);
void flesh_adaptive_destroy(flesh_adaptive **adaptive);
/* FLESH_ERR_ARGUMENT where a value is out of its range. */
int flesh_adaptive_options_check(const flesh_adaptive_options *options);
int flesh_adaptive_set_options(flesh_adaptive *adaptive, const flesh_adaptive_options *options);
void flesh_adaptive_set_stop(flesh_adaptive *adaptive, int (*stop)(void *data), void *data);

/* Takes the state to t+h by internal steps, starting anew at events and when the state is not the one it was given
 * back. FLESH_ERR_INTEGRATOR with what is known in flesh_adaptive_failure; the state is then the last one reached. */
int flesh_adaptive_step(flesh_adaptive *adaptive, flesh_state *state, double h, flesh_solve_stats *stats);

const flesh_failure *flesh_adaptive_failure(const flesh_adaptive *adaptive);
/* t and h of IDA's internal step. */
void flesh_adaptive_progress(const flesh_adaptive *adaptive, flesh_progress *progress);
/* Sets the counter of its evaluations, borrowed. */
void flesh_adaptive_set_costs(flesh_adaptive *adaptive, flesh_costs *costs);
/* IDA's memory. */
void *flesh_adaptive_ida(const flesh_adaptive *adaptive);
size_t flesh_adaptive_memory(const flesh_adaptive *adaptive);
/* But for IDA's history, which it does not take back: loaded, it starts anew from the state given back last. */
void flesh_adaptive_archive(flesh_adaptive *adaptive, flesh_archive *archive);
/* Whether there is such a history. */
int flesh_adaptive_runs(const flesh_adaptive *adaptive);

#endif
