/* observer.h: a run, and what observes it: history, frames, the skin.
 * Functions that return no status cannot fail. */
#ifndef FLESH_OBSERVER_H
#define FLESH_OBSERVER_H

#include "flesh/integrator.h"
#include "flesh/skin.h"

#ifdef __cplusplus
extern "C" {
#endif

/* An accepted step as observers see it; step 0 is the start. Everything is borrowed for the
 * call. Of a part of a body (flesh/ranks.h) the system, the state, tet_J_mean and tet_J_min are those of the rank;
 * everything else is of the body, J_min_tet too. */
typedef struct flesh_step_record {
  int step;
  int last; /* 1 when the run ends here: at its end or stopped in order */
  double h; /* s; 0 at the start */
  const flesh_system *system;
  const flesh_state *state;
  /* t, x and v where the forces of the step balance, which contact is reported of: before the step's end for methods
   * that balance there (midpoint, HHT, generalized-alpha, the first step of BDF2); else the state itself. */
  const flesh_state *stage;
  const flesh_solve_stats *stats; /* of this step; zeros at the start */
  const double *energies;         /* [effects], J, at the state */
  /* [effects], J, of the effects whose energy at the mesh's rest shape is only the formula's
   * constant (elasticity); 0 for the others */
  const double *rest_energies;
  double volume, rest_volume;     /* m^3 */
  /* [tets] J = det F (flesh/mesh.h): its mean in the tet and its least value, over the points of quadrature */
  const double *tet_J_mean, *tet_J_min;
  double J_min;   /* the least of all points */
  double J_bound; /* the least of flesh_mesh_jacobian_bounds; J_min for tets of four nodes */
  int J_min_tet, inverted; /* inverted: tets with J <= 0 at a point of quadrature */
  const struct flesh_proximity *proximity; /* what the run knows of nodes near each other (effect.h), or NULL */
  /* On a part of a body, what each effect reports of the whole body [effects*FLESH_RANK_SUMS]; else NULL. */
  const double *reports;
} flesh_step_record;

/* Called after every accepted step; a negative status ends the run with it. */
typedef struct flesh_observer {
  int (*observe)(void *data, const flesh_step_record *record);
  void *data;
} flesh_observer;

/* history.csv: a header and a row per step, flushed as it is written, so that an interrupted run
 * leaves a valid file. Columns: t, step, h, internal_steps, newton, linear, assemblies, projections,
 * backtracks, residual, residual_target [N], energy_<effect> per effect and energy_total [J] (elasticity
 * relative to rest; a second effect of a name is energy_<effect>_2), volume [m^3], volume_ratio,
 * J_min, J_min_tet, J_bound, inverted, and what effects report of themselves: contact_gap [m] (the smallest
 * distance, at most the thickness), contact_nodes (nearer than that), contact_force [N] (size of
 * the sum of their normal forces), all three of the step's stage; of a weld that breaks weld_broken (of
 * its area), weld_released [J] and weld_traction (the largest that counts of what
 * holds) [Pa]. Numbers read back exactly. */
typedef struct flesh_history flesh_history;
/* Opens the file; borrows the rest. Returns new. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY,
 * FLESH_ERR_FILE. */
FLESH_API int flesh_history_create(const char *path, const flesh_system *system,
                                   flesh_history **history);
/* NULL-safe; sets *history to NULL. FLESH_ERR_FILE when not all could be written. */
FLESH_API int flesh_history_close(flesh_history **history);
/* A flesh_observer's function. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_FILE. */
FLESH_API int flesh_history_observe(void *history, const flesh_step_record *record);

/* frame_000000.vtu ... (the number is the step's) in `directory` and frames.pvd, an index that is
 * valid after every frame. Point data: displacement, velocity; cell data: J_mean, J_min, region. The start,
 * every `every`-th step (>= 1) and the last one. Obstacles stand beside them as obstacle_<k>.obj,
 * where they move obstacle_<k>_<step>.obj, k counting from 1. Frames of an earlier run in the
 * directory are removed. */
typedef struct flesh_frames flesh_frames;
/* Makes the directory where it is not there; borrows `mesh`. Returns new.
 * Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY, FLESH_ERR_FILE. */
FLESH_API int flesh_frames_create(const char *directory, const flesh_mesh *mesh, int every,
                                  flesh_frames **frames);
/* Further fields of frames, and their places. Arrays at nodes and of tets are named as below; at the points of
 * quadrature (one of a tet of four nodes, four of one of ten, point q next to corner q) they are cell
 * data named ..._at_points with the components of all points. Every array has its unit as VTK's key
 * UNITS_LABEL. Stress is Cauchy's, of the elastic energy and of effects that say theirs (flesh_effect_figures:
 * the fibres of muscles), in VTK's order XX, YY, ZZ, XY, YZ, XZ.
 *
 *   J               at nodes as J_mean, at points as J_at_points; of tets J_mean and J_min are always there
 *   stretch         singular values of F, descending, the last with the sign of J
 *   stress          Pa
 *   von_mises       Pa, of the stress of that place
 *   pressure        Pa, minus a third of the trace of the stress of that place; of tet10-mean at nodes and of tets
 *                   that of the continuous, linear field that fits the tets' means best, within each material
 *   energy_density  J/m^3 of volume at rest, strain energy from rest
 *   reaction        N on the body, at nodes: as flesh_probe's (flesh/probe.h) before it is summed up
 *   contact_force   N on the body, at nodes, of the step's stage
 *
 * The value of a tet is a mean: of stress over its volume, of the rest over its volume at rest. At a node: the mean
 * over its tets, by their volume at rest and whatever their material; stress and stretch of a tet of
 * ten nodes are those of the linear field through its points (Hinton & Campbell 1974). A value that
 * does not exist is NaN. */
typedef enum flesh_field {
  FLESH_FIELD_DISPLACEMENT = 1, /* this and the next are there in any case */
  FLESH_FIELD_VELOCITY = 2,
  FLESH_FIELD_J = 4,
  FLESH_FIELD_STRETCH = 8,
  FLESH_FIELD_STRESS = 16,
  FLESH_FIELD_VON_MISES = 32,
  FLESH_FIELD_PRESSURE = 64,
  FLESH_FIELD_ENERGY_DENSITY = 128,
  FLESH_FIELD_REACTION = 256,
  FLESH_FIELD_CONTACT_FORCE = 512
} flesh_field;
typedef enum flesh_field_place { FLESH_AT_NODES = 1, FLESH_AT_TETS = 2, FLESH_AT_POINTS = 4 } flesh_field_place;

/* Adds the `fields` (flesh_field, or'ed) at `places` (flesh_field_place, or'ed) to the frames to come,
 * instead of earlier ones; `method` is the run's. Borrows body and system.
 * Errors: FLESH_ERR_ARGUMENT for a body or a system of another mesh, fields of a material without one,
 * contact_force without contact, fields at no place; FLESH_ERR_MEMORY. */
FLESH_API int flesh_frames_set_fields(flesh_frames *frames, const flesh_body *body,
                                      const flesh_system *system, flesh_method method,
                                      unsigned fields, unsigned places);
/* NULL-safe; sets *frames to NULL. Cannot fail. */
FLESH_API int flesh_frames_close(flesh_frames **frames);
/* A flesh_observer's function. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY, FLESH_ERR_FILE. */
FLESH_API int flesh_frames_observe(void *frames, const flesh_step_record *record);

/* The skin as it moves, in files of `directory`: skin_000000.obj ... and skin_000000.vtu ... (the
 * number is the step's) with the index skin.pvd, and skin.pc2, a point cache as Blender's Mesh
 * Cache reads it (one sample per frame). Frames are the start, every `every`-th step and the last
 * one, as those of flesh_frames. Numbers are of single precision, in the VTU double. Older files of
 * these names are removed. An OBJ has its texture coordinates; the VTU has the point data
 * displacement and velocity. The point cache appears when it is closed. Borrows the rest. */
enum { FLESH_SKIN_OBJ = 1, FLESH_SKIN_PC2 = 2, FLESH_SKIN_VTU = 4 }; /* formats, to be or-ed */
typedef struct flesh_skin_frames flesh_skin_frames;
/* Makes the directory where it is not there. Returns new.
 * Errors: FLESH_ERR_ARGUMENT, also for a surface with another count of vertices; FLESH_ERR_MEMORY, FLESH_ERR_FILE. */
FLESH_API int flesh_skin_frames_create(const char *directory, const flesh_skin *skin,
                                       const flesh_surface *surface, unsigned formats, int every,
                                       flesh_skin_frames **frames);
/* NULL-safe; FLESH_ERR_FILE when the point cache cannot be completed. */
FLESH_API int flesh_skin_frames_close(flesh_skin_frames **frames);
/* A flesh_observer's function. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY, FLESH_ERR_FILE. */
FLESH_API int flesh_skin_frames_observe(void *frames, const flesh_step_record *record);

/* A run: steps of h from state->t to `end` (the last one is shortened to end there exactly, or longer by a
 * thousandth, so that times of few digits never add a tiny step), calling the observers, first with the start. A
 * static integrator on a system that does not move makes one solve, to `end`. `stop` (may be NULL) is asked between
 * and within steps: a negative status ends the run with it, in order. *steps (may be NULL) receives
 * the accepted steps. The state is always that of the last success. Steps whose errors choose their lengths are not cut
 * to h where they are easy to solve, nothing limits them (contact), no tet has a multiplier and no effect internal
 * variables: states that observers see then lie on the cubic through a step's ends or, where their stresses would be off
 * by more than three tolerances, are solved for from there.
 * Of a part of a body every rank calls it, and all go on or end together: what an observer or `stop` returns on one rank
 * ends the run on all. */
typedef struct flesh_run_options {
  double h, end; /* s; h > 0, end >= state->t, fewer than INT_MAX steps */
  int observer_count;
  const flesh_observer *observers;
  int (*stop)(void *data);
  void *stop_data;
  /* Receives what a step that ended the run before its end has taken; else zeros. May be NULL. */
  flesh_solve_stats *unfinished;
} flesh_run_options;
/* Errors: FLESH_ERR_ARGUMENT, also for an integrator of another system; FLESH_ERR_MEMORY; what flesh_integrator_step
 * returns, what an observer or `stop` returns. Frames, skins and probes of another mesh are FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_run(const flesh_system *system, flesh_integrator *integrator,
                        const flesh_run_options *options, flesh_state *state, int *steps);
/* The rest of a run that began at `begin` s and of which `step` steps have been taken, the last of
 * them to the state: observers are not called with that one again, steps end where those of the
 * whole run do, and *steps counts from its begin. With an integrator that has loaded what that of
 * the first part saved there (flesh_integrator_load), it has the bits of the whole run. Step 0: only
 * the start has been observed. Errors: as flesh_run, FLESH_ERR_ARGUMENT
 * where so many steps cannot have led to the state. */
FLESH_API int flesh_run_resume(const flesh_system *system, flesh_integrator *integrator,
                               const flesh_run_options *options, int step, double begin,
                               flesh_state *state, int *steps);

#ifdef __cplusplus
}
#endif
#endif
