/* dead_load.h: loads that keep direction and magnitude however the body moves (gravity, forces, tractions): r_a = -s
 * f_a and V = -s sum of f_a.(x_a - X_a), with s = scale * load * amplitude(t). */
#ifndef FLESH_EFFECT_DEAD_LOAD_H
#define FLESH_EFFECT_DEAD_LOAD_H

#include "effect/amplitude.h"
#include "effect/effect.h"

typedef struct flesh_dead_load {
  int count;       /* number of loaded nodes */
  int *nodes;      /* [count] loaded nodes; repeated nodes are loaded repeatedly; NULL: all nodes of the mesh */
  double *force;   /* [3*count] f_a, N */
  const double *X; /* rest positions, borrowed; unused without `nodes`, where V is 0 at the origin */
  double vector[3]; /* the given acceleration, force or traction */
  double scale;
  int is_shared; /* whether the nodes share `vector`, so that scale is 1 over their number */
  flesh_amplitude_copy amplitude;
} flesh_dead_load;

/* Creates a load of `vector` (called `name`, in `unit`, in messages) with room for `count` nodes, whose forces are 0.
 * `amplitude` NULL: a factor of 1 at all times. FLESH_ERR_ARGUMENT if the vector is not finite or the amplitude
 * invalid; FLESH_ERR_MEMORY. */
int flesh_dead_load_create(const char *name, const char *unit, const double vector[3], int count,
                           const flesh_amplitude *amplitude, flesh_dead_load **load);

/* Operations of effects whose data are a dead load. */
int flesh_dead_load_residual(const flesh_effect *effect, const flesh_point *point, double *r);
int flesh_dead_load_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                              double *phi, double *magnitude);
int flesh_dead_load_energy(const flesh_effect *effect, const flesh_point *point, double *energy);
void flesh_dead_load_destroy(void *load);
extern const flesh_effect_time flesh_dead_load_time;
extern const flesh_effect_figures flesh_dead_load_figures;
extern const flesh_effect_private flesh_dead_load_private; /* for loads with a list of nodes */

#endif
