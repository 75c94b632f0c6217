/* observer.h: runs and their observers: history, frames, the skin.
 * Functions that return no status cannot fail. */
#ifndef FLESH_OBSERVER_H
#define FLESH_OBSERVER_H

#include "flesh/integrator.h"
#include "flesh/skin.h"

#ifdef __cplusplus
extern "C" {
#endif

/* An accepted step as observers see it; step 0 is the start. Everything is borrowed for the call. For a part of a
 * body (flesh/ranks.h) the system, the state, tet_J_mean and tet_J_min are those of the rank; everything else,
 * J_min_tet included, is that of the body. */
typedef struct flesh_step_record {
  int step;
  int last; /* 1 when the run ends with this step, at its end or because it was stopped */
  double h; /* s; 0 at the start */
  const flesh_system *system;
  const flesh_state *state;
  /* t, x and v where the forces of the step balance, for which contact is reported: before the step's end for methods
   * that balance there (midpoint, HHT, generalized-alpha, the first step of BDF2); else the state itself. */
  const flesh_state *stage;
  const flesh_solve_stats *stats; /* counts of this step; zeros at the start */
  const double *energies;         /* [effects], J, energies at the state */
  /* [effects], J, energies at the mesh's rest shape of effects for which that is only the formula's constant
   * (elasticity); 0 for the others */
  const double *rest_energies;
  double volume, rest_volume;     /* m^3 */
  /* [tets] mean and smallest value of J = det F (flesh/mesh.h) over the tet's quadrature points */
  const double *tet_J_mean, *tet_J_min;
  double J_min;   /* smallest J of all quadrature points */
  double J_bound; /* smallest bound of flesh_mesh_jacobian_bounds; J_min for four-node tets */
  int J_min_tet, inverted; /* tet with J_min; number of tets with J <= 0 at a quadrature point */
  const struct flesh_proximity *proximity; /* for the library's own observers; NULL: none */
  /* On a part of a body, four numbers of each effect for the whole body [4*effects], for the library's own observers;
   * else NULL. */
  const double *reports;
} flesh_step_record;

/* An observer, called after every accepted step; a negative status ends the run with that status. */
typedef struct flesh_observer {
  int (*observe)(void *data, const flesh_step_record *record);
  void *data;
} flesh_observer;

/* history.csv: a header and a row per step, flushed as it is written, so that an interrupted run leaves a valid file.
 * Columns: t, step, h, internal_steps, newton, linear, assemblies, projections, backtracks, residual, residual_target
 * [N], energy_<effect> per effect and energy_total [J] (elasticity relative to rest; a second effect of a name is
 * energy_<effect>_2), volume [m^3], volume_ratio, J_min, J_min_tet, J_bound, inverted, and the columns of effects:
 * contact_gap [m] (the smallest distance, at most the thickness), contact_nodes (number closer than the thickness; of
 * contact between bodies contact_pairs), contact_force [N] (size of the sum of their normal forces), all at the step's
 * stage; for a weld that can break, weld_broken (fraction of its area), weld_released [J] and weld_traction [Pa] (the
 * largest value of its criterion over unbroken parts); muscle_activation. Numbers read back exactly. */
typedef struct flesh_history flesh_history;
/* Opens the file; borrows `system`. Returns new. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY, FLESH_ERR_FILE. */
FLESH_API int flesh_history_create(const char *path, const flesh_system *system,
                                   flesh_history **history);
/* NULL-safe; sets *history to NULL. FLESH_ERR_FILE when not all could be written. */
FLESH_API int flesh_history_close(flesh_history **history);
/* A flesh_observer's function. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_FILE. */
FLESH_API int flesh_history_observe(void *history, const flesh_step_record *record);

/* Frames: files frame_000000.vtu ... (the number is the step's) in `directory`, and frames.pvd, an index that is
 * valid after every frame. Point data: displacement, velocity; cell data: J_mean, J_min, region. Frames are the
 * start, every `every`-th step (>= 1) and the last one. Obstacles are written as obstacle_<k>.obj, moving ones as
 * obstacle_<k>_<step>.obj, k counting from 1. Frames of an earlier run in the directory are removed. */
typedef struct flesh_frames flesh_frames;
/* Makes the directory if it does not exist; borrows `mesh`. Returns new. Errors: FLESH_ERR_ARGUMENT,
 * FLESH_ERR_MEMORY, FLESH_ERR_FILE. */
FLESH_API int flesh_frames_create(const char *directory, const flesh_mesh *mesh, int every,
                                  flesh_frames **frames);
/* Further fields of frames, and their places. Arrays at nodes and for tets have the names below; arrays at the
 * quadrature points (one for a four-node tet, four for a ten-node tet, point q next to corner q) are cell data named
 * ..._at_points with the components of all points. Every array has its unit as VTK's key UNITS_LABEL. Stress is the
 * Cauchy stress of the elastic energy and of effects that define one (flesh_effect_figures: the fibres of muscles), in
 * VTK's order XX, YY, ZZ, XY, YZ, XZ.
 *
 *   J               at nodes as J_mean, at points as J_at_points; for tets J_mean and J_min are always written
 *   stretch         singular values of F, descending, the last with the sign of J
 *   stress          Pa
 *   von_mises       Pa, computed from the stress at the same place
 *   pressure        Pa, minus a third of the trace of the stress at the same place; for tet10-mean, at nodes and for
 *                   tets, from the continuous, linear field that best fits the tets' means within each material
 *   energy_density  J/m^3 of rest volume, strain energy relative to rest
 *   reaction        N on the body, at nodes: the terms that flesh_probe (flesh/probe.h) sums
 *   contact_force   N on the body, at nodes, at the step's stage
 *
 * The value for a tet is a mean: of stress over its volume, of other fields over its rest volume. The value at a node
 * is the mean over its tets, weighted by their rest volumes, whatever their material; stress and stretch of a
 * ten-node tet are those of the linear field through its points (Hinton & Campbell 1974). A value that does not exist
 * is NaN. */
typedef enum flesh_field {
  FLESH_FIELD_DISPLACEMENT = 1, /* this and the next are always written */
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

/* Adds the `fields` (flesh_field, or'ed) at `places` (flesh_field_place, or'ed) to later frames, instead of those set
 * before; `method` is the run's. Borrows body and system. Errors: FLESH_ERR_ARGUMENT for a body or a system of
 * another mesh, fields of a material if there is none, contact_force without contact, fields at no place;
 * FLESH_ERR_MEMORY. */
FLESH_API int flesh_frames_set_fields(flesh_frames *frames, const flesh_body *body,
                                      const flesh_system *system, flesh_method method,
                                      unsigned fields, unsigned places);
/* NULL-safe; sets *frames to NULL. Cannot fail. */
FLESH_API int flesh_frames_close(flesh_frames **frames);
/* A flesh_observer's function. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY, FLESH_ERR_FILE. */
FLESH_API int flesh_frames_observe(void *frames, const flesh_step_record *record);

/* Skin frames: the moving skin in files of `directory`: skin_000000.obj ... and skin_000000.vtu ... (the number is
 * the step's) with the index skin.pvd, and skin.pc2, a point cache for Blender's Mesh Cache (one sample per frame).
 * Frames are the start, every `every`-th step and the last one, like those of flesh_frames. Numbers have single
 * precision, in the VTU double precision. Older files of these names are removed. An OBJ contains texture
 * coordinates, the VTU the point data displacement and velocity. The point cache appears when it is closed. Borrows
 * skin and surface. */
enum { FLESH_SKIN_OBJ = 1, FLESH_SKIN_PC2 = 2, FLESH_SKIN_VTU = 4 }; /* formats, or'ed */
typedef struct flesh_skin_frames flesh_skin_frames;
/* Makes the directory if it does not exist. Returns new. Errors: FLESH_ERR_ARGUMENT, also for a surface with another
 * number of vertices; FLESH_ERR_MEMORY, FLESH_ERR_FILE. */
FLESH_API int flesh_skin_frames_create(const char *directory, const flesh_skin *skin,
                                       const flesh_surface *surface, unsigned formats, int every,
                                       flesh_skin_frames **frames);
/* NULL-safe; FLESH_ERR_FILE when the point cache cannot be completed. */
FLESH_API int flesh_skin_frames_close(flesh_skin_frames **frames);
/* A flesh_observer's function. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY, FLESH_ERR_FILE. */
FLESH_API int flesh_skin_frames_observe(void *frames, const flesh_step_record *record);

/* Options of a run: steps of h from state->t to `end`. The last step is shortened to end there exactly, or longer by a
 * thousandth, so that times of few digits never add a tiny step. Observers are called after every step, and first with
 * the start. A static integrator on a system that does not move makes one solve, to `end`. `stop` (may be NULL) is
 * called between and within steps: a negative status ends the run with it, in order. *steps (may be NULL) receives the
 * number of accepted steps. The state is always that of the last success.
 *
 * With error control, steps are not cut to h if they are easy to solve, contact does not limit them, and there are no
 * multipliers or internal variables: observers then see states on the cubic through a step's ends or, if their stresses
 * would be off by more than three tolerances, states solved from there.
 *
 * For a part of a body every rank calls flesh_run, and all ranks continue or end together: a status that an observer
 * or `stop` returns on one rank ends the run on all. */
typedef struct flesh_run_options {
  double h, end; /* s; h > 0, end >= state->t, fewer than INT_MAX steps */
  int observer_count;
  const flesh_observer *observers;
  int (*stop)(void *data);
  void *stop_data;
  /* Receives the counts of a step that ended the run early; else zeros. May be NULL. */
  flesh_solve_stats *unfinished;
} flesh_run_options;
/* Makes a run. Errors: FLESH_ERR_ARGUMENT, also for an integrator of another system; FLESH_ERR_MEMORY; the errors of
 * flesh_integrator_step, of observers and of `stop`. Frames, skins and probes of another mesh, and histories of
 * another system, are FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_run(const flesh_system *system, flesh_integrator *integrator,
                        const flesh_run_options *options, flesh_state *state, int *steps);
/* Continues a run that began at `begin` s and of which `step` steps have led to the state: observers are not called
 * with that state again, steps end at the same times as in the whole run, and *steps counts from the beginning. The
 * result is bitwise that of the whole run if the integrator has loaded (flesh_integrator_load) what the first part's
 * integrator saved there. Step 0: only the start has been observed. Errors: as flesh_run, FLESH_ERR_ARGUMENT if so
 * many steps cannot have led to the state. */
FLESH_API int flesh_run_resume(const flesh_system *system, flesh_integrator *integrator,
                               const flesh_run_options *options, int step, double begin,
                               flesh_state *state, int *steps);

#ifdef __cplusplus
}
#endif
#endif
