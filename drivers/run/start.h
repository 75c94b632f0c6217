/* start.h: states that own their arrays, and the integrator that a scene asks for. */
#ifndef FLESH_RUN_START_H
#define FLESH_RUN_START_H

#include "flesh/integrator.h"
#include "flesh/scene.h"
#include "flesh/skin.h"

/* Makes the arrays of a state, all zero, in one piece: free(state->x) frees all. FLESH_ERR_MEMORY. */
int flesh_state_make(int nodes, int multipliers, int internal, flesh_state *state);
/* Makes the scene's state at the start, with pressures and internal variables of effects. FLESH_ERR_MEMORY. */
int flesh_start_make(const flesh_scene *scene, flesh_state *state);

/* Checks that the scene's time can be stepped from its start to its end; FLESH_ERR_ARGUMENT with the place in the
 * scene. */
int flesh_start_check(const flesh_scene *scene);
/* Checks everything that a run would refuse before its first step. */
int flesh_start_try(const flesh_scene *scene);
/* Returns `status`; if an effect refuses the state, adds its place in the scene to the error's text. */
int flesh_start_place(const flesh_scene *scene, const flesh_state *state, int status);
/* Makes the surface and the skin of the scene; leaves both unchanged if its frames have none. */
int flesh_start_skin(const flesh_scene *scene, flesh_surface **surface, flesh_skin **skin);

/* Makes a new integrator of the scene's method with all settings of its section `time`. */
int flesh_start_integrator(const flesh_scene *scene, const flesh_system *system, const flesh_solver_options *solver,
                           flesh_integrator **integrator);

#endif
