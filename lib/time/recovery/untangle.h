/* untangle.h: decides when a body is tangled permanently, and whether softer materials have led out of it.
 *
 * A body that has come to rest with inverted tets, or wound once more around some edge, sits in a local minimum of
 * its energy: every way out goes through changes of volume, which the material resists. Collapsed to a point it may
 * sit in one too (E with small Poisson's ratios). Once it is quasi-static, and no load holds it there, the
 * integrator solves for the equilibrium of softer materials from there, and from that for the equilibrium of the true
 * ones (continuation.h). The result is kept if its potential is lower than that of the tangle;
 * else the tangle stays. That is no motion: it is counted in
 * flesh_solve_stats and can be switched off (FLESH_TECHNIQUE_UNTANGLE). Bodies whose material is stressed at rest,
 * and those that begin in an exact line or point, may collapse: that is an equilibrium of theirs, and is left. */
#ifndef FLESH_TIME_RECOVERY_UNTANGLE_H
#define FLESH_TIME_RECOVERY_UNTANGLE_H

#include <stdint.h>

#include "base/archive.h"
#include "flesh/integrator.h"
#include "system/evaluation.h"
#include "time/rigid_guess.h"

typedef struct flesh_untangler flesh_untangler;

/* Makes what this rank needs, without the others. Borrows the evaluation of the system, and the parts of its body,
 * which may be found later. Returns new, even when it fails: FLESH_ERR_MEMORY. */
int flesh_untangler_create(const flesh_evaluation *evaluation, const flesh_rigid_parts *parts,
                           flesh_untangler **untangler);
/* Measures the body, once all ranks have made their own. Collective; FLESH_ERR_MEMORY on this rank alone. */
int flesh_untangler_create_collective(flesh_untangler *untangler);
void flesh_untangler_destroy(flesh_untangler **untangler);

/* To be called with the state before every step; a state that is new is examined. */
void flesh_untangler_before_step(flesh_untangler *untangler, const flesh_state *state);

/* To be called with the state after every accepted step of h, or with an equilibrium, which is quasi-static by itself
 * (h = 0). Returns 1 if it is tangled for good, and remembers it; else 0, or a negative status. */
int flesh_untangler_after_step(flesh_untangler *untangler, flesh_state *state, double h);

/* Sets the state to the start of an attempt: the tangle or, if a body has vanished into a point, its rest shape around
 * that. */
void flesh_untangler_begin(flesh_untangler *untangler, flesh_state *state);
/* Returns whether the attempt, if it was `solved`, has led to a lower potential; then the state is kept, which adds to
 * *stats. Else the state becomes the tangle again. */
int flesh_untangler_judge(flesh_untangler *untangler, flesh_state *state, int solved, flesh_solve_stats *stats);

/* Returns the dofs [n] that are held while an equilibrium's materials are softened: all that are far from the tangle.
 * NULL: none, as half of the body is near it. */
const uint8_t *flesh_untangler_held(const flesh_untangler *untangler);

/* Returns a step of backward Euler, s, so long that inertia only just holds a free body; 0: without elasticity. Not to
 * be called between the two above. */
double flesh_untangler_long_step(const flesh_untangler *untangler);
/* Returns whether displacements u [n] are so small that the body is at rest. */
int flesh_untangler_is_still(const flesh_untangler *untangler, const double *u);

/* Archives the memory that lasts from step to step. */
void flesh_untangler_archive(flesh_untangler *untangler, flesh_archive *archive);

#endif
