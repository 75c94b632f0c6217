/* observer.h: those who watch a run: history, frames. */
#ifndef FLESH_OBSERVER_H
#define FLESH_OBSERVER_H

#include "flesh/integrator.h"

#ifdef __cplusplus
extern "C" {
#endif

/* An accepted step as it is told to observers; step 0 is the start. Everything is borrowed for the call. */
typedef struct flesh_step_record {
  int step;
  double h;
  const flesh_system *system;
  const flesh_state *state;
  const flesh_solve_stats *stats; /* of this step; zeros at the start */
  const double *energies;         /* [effects], J, at the state */
  const double *rest_energies;    /* [effects], J, at the mesh's rest shape without motion */
  double volume, rest_volume;     /* m^3 */
  double min_J;
  int min_J_tet, inverted;
} flesh_step_record;

/* Called after every accepted step; a negative status ends the run with it. */
typedef struct flesh_observer {
  int (*observe)(void *data, const flesh_step_record *record);
  void *data;
} flesh_observer;

/* history.csv: t, step, h, newton, linear, halvings..., energy per effect, volume, min J, inverted; a row per
 * step, flushed as it is written, so that an interrupted run leaves a valid file. */
typedef struct flesh_history flesh_history;
FLESH_API int flesh_history_create(const char *path, const flesh_system *system,
                                   flesh_history **history);
FLESH_API int flesh_history_close(flesh_history **history); /* NULL-safe */
FLESH_API int flesh_history_observe(void *history, const flesh_step_record *record);

/* frame_000000.vtu ... in `directory` and frames.pvd, an index that is valid after every frame. Point data:
 * displacement, velocity; cell data: J, region. Every `every`-th step and the start. */
typedef struct flesh_frames flesh_frames;
FLESH_API int flesh_frames_create(const char *directory, const flesh_mesh *mesh, int every,
                                  flesh_frames **frames);
FLESH_API int flesh_frames_close(flesh_frames **frames); /* NULL-safe */
FLESH_API int flesh_frames_observe(void *frames, const flesh_step_record *record);

/* A run: steps of h from state->t to `end` (the last one is shortened to hit it; rounding never adds a
 * sliver step), telling the observers. `stop` (may be NULL) is asked between steps: a non-zero status ends the
 * run with it, in order. *steps (may be NULL) receives the accepted steps. The state is always that of the last
 * success. */
typedef struct flesh_run_options {
  double h, end;
  int observer_count;
  const flesh_observer *observers;
  int (*stop)(void *data);
  void *stop_data;
} flesh_run_options;
FLESH_API int flesh_run(const flesh_system *system, flesh_integrator *integrator,
                        const flesh_run_options *options, flesh_state *state, int *steps);

#ifdef __cplusplus
}
#endif
#endif
