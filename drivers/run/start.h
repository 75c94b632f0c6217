/* start.h: states with arrays of their own, and an integrator as a scene has it. */
#ifndef FLESH_RUN_START_H
#define FLESH_RUN_START_H

#include "flesh/integrator.h"
#include "flesh/scene.h"
#include "flesh/skin.h"

/* New arrays, of zeros, in one piece: free(state->x) frees all. FLESH_ERR_MEMORY. */
int flesh_state_make(int nodes, int multipliers, int internal, flesh_state *state);
/* The scene's start, with the pressures and what effects remember. FLESH_ERR_MEMORY. */
int flesh_start_make(const flesh_scene *scene, flesh_state *state);

/* FLESH_ERR_ARGUMENT with its place where steps from the scene's start to its end cannot be taken. */
int flesh_start_check(const flesh_scene *scene);
/* All that a run refuses before its first step. */
int flesh_start_try(const flesh_scene *scene);
/* Returns `status` after adding the place of the effect that refuses the state, if one does, to the error's text. */
int flesh_start_place(const flesh_scene *scene, const flesh_state *state, int status);
/* New surface and skin of the scene; both stay as they are where frames have none. */
int flesh_start_skin(const flesh_scene *scene, flesh_surface **surface, flesh_skin **skin);

/* An integrator of the scene's method with all that its section `time` says. Returns new. */
int flesh_start_integrator(const flesh_scene *scene, const flesh_system *system, const flesh_solver_options *solver,
                           flesh_integrator **integrator);

#endif
