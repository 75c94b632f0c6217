/* stressed_rest.h: whether a run has ended at rest in a stressed state that no load holds. */
#ifndef FLESH_RUN_STRESSED_REST_H
#define FLESH_RUN_STRESSED_REST_H

#include "flesh/scene.h"
#include "run/run_trace.h"

/* The strain energy, J above that of a free body at rest, of a state in which the body rests without being held: its
 * kinetic energy has been below 1e-4 of it and it has changed by less than a thousandth over the last tenth of the
 * motion (five steps at least; an equilibrium rests), its nodes balance, and neither loads nor obstacles nor displaced
 * constraints act on it. 0 where that is not so, and where its material has no rest. */
double flesh_stressed_rest(const flesh_scene *scene, const flesh_run_trace *trace, const flesh_state *state);

#endif
