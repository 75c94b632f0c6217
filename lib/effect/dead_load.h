/* dead_load.h: loads that keep their direction and size however the body moves, as gravity, forces and tractions do:
 * r_a = -s f_a and V = -s sum of f_a.(x_a - X_a), with s = scale load amplitude(t). */
#ifndef FLESH_EFFECT_DEAD_LOAD_H
#define FLESH_EFFECT_DEAD_LOAD_H

#include "effect/amplitude.h"
#include "effect/effect.h"

typedef struct flesh_dead_load {
  int count;       /* of loaded nodes */
  int *nodes;      /* [count] each acts as often as it is there; NULL: all nodes of the mesh */
  double *force;   /* [3*count] f_a, N */
  const double *X; /* rest positions, borrowed; not read without a list: V is 0 at the origin */
  double vector[3]; /* what the load was given: an acceleration, a force, a traction */
  double scale;
  int is_shared; /* the nodes share `vector`: scale is 1 over their number */
  flesh_amplitude_copy amplitude;
} flesh_dead_load;

/* A load of `vector`, called `name` and measured in `unit`, with room for `count` nodes whose forces are 0. `amplitude`
 * NULL: 1 at all times. FLESH_ERR_ARGUMENT for a vector that is not finite or an amplitude that cannot be. Further
 * errors: FLESH_ERR_MEMORY. */
int flesh_dead_load_create(const char *name, const char *unit, const double vector[3], int count,
                           const flesh_amplitude *amplitude, flesh_dead_load **load);

/* The operations of an effect whose data are a dead load. */
int flesh_dead_load_residual(const flesh_effect *effect, const flesh_point *point, double *r);
int flesh_dead_load_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                              double *phi, double *magnitude);
int flesh_dead_load_energy(const flesh_effect *effect, const flesh_point *point, double *energy);
void flesh_dead_load_destroy(void *load);
extern const flesh_effect_time flesh_dead_load_time;
extern const flesh_effect_figures flesh_dead_load_figures;
extern const flesh_effect_private flesh_dead_load_private; /* for loads with a list of nodes */

#endif
