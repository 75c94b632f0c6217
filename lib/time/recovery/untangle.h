/* untangle.h: puts back what is tangled for good, between steps.
 *
 * A body that has come to rest with inverted tets, or wound once more around some edge, sits in a
 * local minimum of its energy from which no solver leads out; collapsed to a point it may sit in one
 * too (E with small Poisson's ratios). Once it is quasi-static, and no load holds it there, the tangled
 * nodes are repositioned by their neighbours and the rest shape (winding.h), first those of the
 * tangle and one layer around it, then twice as many layers at every further attempt. The step, or the
 * equilibrium, is then solved again from there, and what it leads to is kept if its potential is lower than
 * that of the tangle; else a load holds the tangle, be it through the flesh around it, and it is taken back.
 * That is no motion: it is counted in flesh_solve_stats and can be switched off
 * (FLESH_TECHNIQUE_UNTANGLE). Bodies whose material is stressed at rest, and those that begin
 * in an exact line or point, may collapse: that is where they rest. */
#ifndef FLESH_TIME_RECOVERY_UNTANGLE_H
#define FLESH_TIME_RECOVERY_UNTANGLE_H

#include "base/archive.h"
#include "flesh/integrator.h"

typedef struct flesh_untangler flesh_untangler;

/* Borrows the system. Returns new. */
int flesh_untangler_create(const flesh_system *system, flesh_untangler **untangler);
void flesh_untangler_destroy(flesh_untangler **untangler);

/* To be called with the state before every step, which is where a step is taken again from; a new one is looked at. */
void flesh_untangler_before_step(flesh_untangler *untangler, const flesh_state *state);

/* To be called with the state after every accepted step of h. Returns 1 when it repositioned nodes: the state is then
 * one at the step's beginning from which the step is to be taken again, and judged. Else 0, or a negative status. */
int flesh_untangler_after_step(flesh_untangler *untangler, flesh_state *state, double h);

/* The same for an equilibrium, which is quasi-static by itself; with 1 the state is where it is to be solved from. */
int flesh_untangler_after_equilibrium(flesh_untangler *untangler, flesh_state *state);

/* Judges what the repetition of a step or equilibrium has led to, unless it was not `solved`. Returns 1 where the step
 * is to be taken once more, from the state as it is then: its potential has fallen, but not below that of the tangle.
 * 0: the state is final, and is kept, which adds to *stats, or is that with the tangle again. */
int flesh_untangler_judge(flesh_untangler *untangler, flesh_state *state, int solved, flesh_solve_stats *stats);

size_t flesh_untangler_memory(const flesh_untangler *untangler);
/* What lasts from step to step. */
void flesh_untangler_archive(flesh_untangler *untangler, flesh_archive *archive);

#endif
