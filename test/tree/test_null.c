// TEST quick
/* test_null.c: every public function that returns a status refuses NULL with FLESH_ERR_ARGUMENT and a sentence, but for
 * pointers that it can do without; callbacks are refused first. test_every_pointer.sh compares the headers with this. */
#include <kinsol/kinsol.h>
#include <nvector/nvector_serial.h>
#include <stdlib.h>

#include "body.h"
#include "flesh/ida.h"
#include "flesh/kinsol.h"
#include "flesh/ode.h"
#include "flesh/sunnonlinsol.h"
#include "sundials/compatibility.h"
#include "test.h"

/* Arguments that may be NULL, or that nobody reads:
 * flesh_effect_create data, flesh_effect_force amplitude, flesh_effect_traction amplitude, flesh_effect_pressure amplitude, flesh_effect_surface_contact pairs,
 * flesh_effect_joint axis, flesh_effect_muscle tets, flesh_effect_muscle activation, flesh_ida_jacobian r,
 * flesh_ida_jacobian w1, flesh_ida_jacobian w2, flesh_ida_jacobian w3, flesh_ida_preconditioner_setup r, flesh_ida_preconditioner_solve y,
 * flesh_ida_preconditioner_solve yp, flesh_ida_preconditioner_solve r, flesh_ida_jacobian_times y,
 * flesh_ida_jacobian_times yp, flesh_ida_jacobian_times r, flesh_ida_jacobian_times w1, flesh_ida_jacobian_times w2,
 * flesh_integrator_step stats, flesh_kinsol_jacobian r, flesh_kinsol_jacobian w1, flesh_kinsol_jacobian w2,
 * flesh_kinsol_jacobian_times u, flesh_kinsol_jacobian_times new_u, flesh_kinsol_preconditioner_setup uscale,
 * flesh_kinsol_preconditioner_setup fval, flesh_kinsol_preconditioner_setup fscale, flesh_kinsol_preconditioner_solve
 * u, flesh_kinsol_preconditioner_solve uscale, flesh_kinsol_preconditioner_solve fval,
 * flesh_kinsol_preconditioner_solve fscale, flesh_material_from_psi user, flesh_material_small_strain mu,
 * flesh_material_small_strain lambda, flesh_material_small_strain rest_stress, flesh_mesh_create regions,
 * flesh_mesh_create_quadratic regions, flesh_mesh_refine_marked parents, flesh_communicator_create mpi_comm, flesh_rank_part_create ranks,
 * flesh_rank_part_create_for ranks, flesh_history_close history, flesh_probes_close probes, flesh_frames_close frames,
 * flesh_run steps, flesh_run_resume steps, flesh_integrator_save data, flesh_ode_jacobian fy, flesh_ode_jacobian w1, flesh_ode_jacobian w2,
 * flesh_ode_jacobian w3, flesh_ode_jacobian_times_setup fy, flesh_ode_jacobian_times y, flesh_ode_jacobian_times fy,
 * flesh_ode_jacobian_times tmp, flesh_ode_preconditioner_setup fy, flesh_ode_preconditioner_solve y,
 * flesh_ode_preconditioner_solve fy, flesh_scene_read overrides, flesh_scene_read_text overrides,
 * flesh_problem_solve u, flesh_sensitivity_set lagged, flesh_trajectory_gradient by_start, flesh_trajectory_tangents
 * start, flesh_trajectory_tangents data, flesh_trajectory_tet_gradient data, flesh_skin_frames_close frames, flesh_surface_write x. */

/* Arguments that the tests below try by hand, because these functions own what they are given, or their callers have
 * no other word than user_data:
 * flesh_effect_obstacle_contact body, flesh_effect_obstacle_contact options,
 * flesh_effect_obstacle_contact obstacle, flesh_effect_obstacle_contact effect,
 * flesh_effect_surface_contact body, flesh_effect_surface_contact options, flesh_effect_surface_contact effect,
 * flesh_effect_create operations, flesh_effect_create mesh, flesh_effect_create effect, flesh_ida_start y,
 * flesh_ida_start yp, flesh_ida_tolerances atol, flesh_ida_get_state y, flesh_ode_tolerances atol, flesh_ode_get_state y, flesh_ida_residual y, flesh_ida_residual yp, flesh_ida_residual r, flesh_ida_residual problem, flesh_ida_jacobian y, flesh_ida_jacobian
 * yp, flesh_ida_jacobian J, flesh_ida_jacobian problem, flesh_ida_preconditioner_setup y,
 * flesh_ida_preconditioner_setup yp, flesh_ida_preconditioner_setup problem, flesh_ida_preconditioner_solve right,
 * flesh_ida_preconditioner_solve z, flesh_ida_preconditioner_solve problem, flesh_ida_jacobian_times v,
 * flesh_ida_jacobian_times Jv, flesh_ida_jacobian_times problem, flesh_kinsol_residual u, flesh_kinsol_residual r,
 * flesh_kinsol_residual problem, flesh_kinsol_jacobian u, flesh_kinsol_jacobian J, flesh_kinsol_jacobian problem,
 * flesh_kinsol_jacobian_times v, flesh_kinsol_jacobian_times Jv, flesh_kinsol_jacobian_times problem,
 * flesh_kinsol_preconditioner_setup u, flesh_kinsol_preconditioner_setup problem, flesh_kinsol_preconditioner_solve z,
 * flesh_kinsol_preconditioner_solve problem, flesh_ode_start y, flesh_ode_accept y, flesh_ode_accept problem, flesh_ode_rhs y, flesh_ode_rhs ydot, flesh_ode_rhs
 * problem, flesh_ode_jacobian y, flesh_ode_jacobian J, flesh_ode_jacobian problem, flesh_ode_jacobian_times_setup y,
 * flesh_ode_jacobian_times_setup problem, flesh_ode_jacobian_times v, flesh_ode_jacobian_times Jv,
 * flesh_ode_jacobian_times problem, flesh_ode_preconditioner_setup y, flesh_ode_preconditioner_setup jcur,
 * flesh_ode_preconditioner_setup problem, flesh_ode_preconditioner_solve r, flesh_ode_preconditioner_solve z,
 * flesh_ode_preconditioner_solve problem, flesh_system_add_effect system, flesh_system_add_effect effect,
 * flesh_material_from_psi psi. */

/* No status, so that NULL is the caller's business:
 * flesh_derivative_report_passes flesh_method_order flesh_mesh_node_count flesh_mesh_tet_count flesh_mesh_order
 * flesh_scene_material_count flesh_surface_vertex_count flesh_surface_face_count flesh_system_unknowns
 * flesh_system_effect_count flesh_system_has_role flesh_system_moves flesh_system_fixed
 * flesh_system_multiplier_count flesh_system_internal_count flesh_integrator_saves_all flesh_integrator_separation
 * flesh_communicator_rank flesh_communicator_size flesh_rank_part_own flesh_rank_part_find flesh_mesh_set_count. */

/* Replaces ARKStepGetNonlinearSystemData and CVodeGetNonlinearSystemData; never called. */
static void nothing(void) {}
static const flesh_arkode_system_data ARK = (flesh_arkode_system_data)nothing;
static const flesh_cvode_system_data CV = (flesh_cvode_system_data)nothing;

/* Some pointer that is not NULL: it is not read before all pointers have been checked. */
static union {
  long double aligned;
  char bytes[1 << 16];
} something;
static void *const any = &something;

static int psi(double I_C, double J, const flesh_material *material, flesh_psi *result)
{
  (void)I_C, (void)J, (void)material, (void)result;
  return FLESH_OK;
}

static void check(int status, const char *sentence)
{
  CHECK(status == FLESH_ERR_ARGUMENT);
  if (strcmp(flesh_error_text(), sentence)) {
    test_failures++;
    printf("# \"%s\" in place of \"%s\"\n", flesh_error_text(), sentence);
  }
}

#define REFUSES(function, name, arguments) check(function arguments, #function ": " #name " is NULL")

static void null_is_refused_by_effects(void)
{
  REFUSES(flesh_obstacle_plane, point, (NULL, any, any)), REFUSES(flesh_obstacle_plane, normal, (any, NULL, any));
  REFUSES(flesh_obstacle_plane, obstacle, (any, any, NULL));
  REFUSES(flesh_obstacle_sphere, centre, (NULL, 1, any)), REFUSES(flesh_obstacle_sphere, obstacle, (any, 1, NULL));
  REFUSES(flesh_obstacle_capsule, a, (NULL, any, 1, any)), REFUSES(flesh_obstacle_capsule, b, (any, NULL, 1, any));
  REFUSES(flesh_obstacle_capsule, obstacle, (any, any, 1, NULL));
  REFUSES(flesh_obstacle_mesh, positions, (1, NULL, 1, any, any));
  REFUSES(flesh_obstacle_mesh, triangle_nodes, (1, any, 1, NULL, any));
  REFUSES(flesh_obstacle_mesh, obstacle, (1, any, 1, any, NULL));
  REFUSES(flesh_obstacle_move, obstacle, (NULL, any)), REFUSES(flesh_obstacle_move, motion, (any, NULL));
  REFUSES(flesh_obstacle_surface, obstacle, (NULL, 1, any, 1, any));
  flesh_obstacle *floor = NULL;
  CHECK_OK(flesh_obstacle_plane((const double[]){0, 0, 0}, (const double[]){0, 0, 1}, &floor));
  REFUSES(flesh_obstacle_surface, centre, (floor, 0, NULL, 1, any));
  flesh_obstacle_destroy(&floor);
  REFUSES(flesh_obstacle_surface, surface, (any, 1, any, 1, NULL));
  REFUSES(flesh_cells_of_tets, mesh, (NULL, any)), REFUSES(flesh_cells_of_tets, cells, (any, NULL));
  REFUSES(flesh_effect_check_derivatives, effect, (NULL, any, 1, any, 1, any));
  REFUSES(flesh_effect_check_derivatives, mesh, (any, NULL, 1, any, 1, any));
  REFUSES(flesh_effect_check_derivatives, x, (any, any, 1, NULL, 1, any));
  REFUSES(flesh_effect_check_derivatives, report, (any, any, 1, any, 1, NULL));
  REFUSES(flesh_effect_inertia, body, (NULL, any)), REFUSES(flesh_effect_inertia, effect, (any, NULL));
  REFUSES(flesh_effect_elasticity, body, (NULL, any)), REFUSES(flesh_effect_elasticity, effect, (any, NULL));
  REFUSES(flesh_effect_gravity, body, (NULL, any, any)), REFUSES(flesh_effect_gravity, acceleration, (any, NULL, any));
  REFUSES(flesh_effect_gravity, effect, (any, any, NULL));
  REFUSES(flesh_effect_spring, body, (NULL, any, 1, any, 1, 1, any));
  REFUSES(flesh_effect_spring, point, (any, NULL, 1, any, 1, 1, any));
  REFUSES(flesh_effect_spring, target, (any, any, 1, NULL, 1, 1, any));
  REFUSES(flesh_effect_spring, effect, (any, any, 1, any, 1, 1, NULL));
  REFUSES(flesh_effect_spring_within, body, (NULL, any, 1, 1, any, 1, 1, any));
  REFUSES(flesh_effect_spring_within, point, (any, NULL, 1, 1, any, 1, 1, any));
  REFUSES(flesh_effect_spring_within, target, (any, any, 1, 1, NULL, 1, 1, any));
  REFUSES(flesh_effect_spring_within, effect, (any, any, 1, 1, any, 1, 1, NULL));
  REFUSES(flesh_effect_damping, body, (NULL, 1, 1, 1, any)), REFUSES(flesh_effect_damping, effect, (any, 1, 1, 1, NULL));
  REFUSES(flesh_effect_settling_damping, body, (NULL, 1, 1, 1, 1, any));
  REFUSES(flesh_effect_settling_damping, effect, (any, 1, 1, 1, 1, NULL));
  REFUSES(flesh_effect_viscosity, body, (NULL, 1, 1, any)), REFUSES(flesh_effect_viscosity, effect, (any, 1, 1, NULL));
  REFUSES(flesh_effect_force, body, (NULL, 1, any, any, any, any));
  REFUSES(flesh_effect_force, nodes, (any, 1, NULL, any, any, any));
  REFUSES(flesh_effect_force, force, (any, 1, any, NULL, any, any));
  REFUSES(flesh_effect_force, effect, (any, 1, any, any, any, NULL));
  REFUSES(flesh_effect_traction, body, (NULL, 1, any, any, any, any));
  REFUSES(flesh_effect_traction, triangles, (any, 1, NULL, any, any, any));
  REFUSES(flesh_effect_traction, traction, (any, 1, any, NULL, any, any));
  REFUSES(flesh_effect_traction, effect, (any, 1, any, any, any, NULL));
  REFUSES(flesh_effect_pressure, body, (NULL, 1, any, 1, any, any));
  REFUSES(flesh_effect_pressure, triangles, (any, 1, NULL, 1, any, any));
  REFUSES(flesh_effect_pressure, effect, (any, 1, any, 1, any, NULL));
  REFUSES(flesh_effect_muscle, body, (NULL, 1, any, any, any, any, any));
  REFUSES(flesh_effect_muscle, fibres, (any, 1, any, NULL, any, any, any));
  REFUSES(flesh_effect_muscle, fibre, (any, 1, any, any, NULL, any, any));
  REFUSES(flesh_effect_muscle, effect, (any, 1, any, any, any, any, NULL));
  REFUSES(flesh_effect_drag, body, (NULL, 1, any, 1, any, 1, any));
  REFUSES(flesh_effect_drag, triangles, (any, 1, NULL, 1, any, 1, any));
  REFUSES(flesh_effect_drag, velocity, (any, 1, any, 1, NULL, 1, any));
  REFUSES(flesh_effect_drag, effect, (any, 1, any, 1, any, 1, NULL));
  const flesh_triangles side = {1, any}, no_side = {1, NULL};
  const flesh_nodes group = {1, any}, no_group = {1, NULL};
  REFUSES(flesh_effect_weld, body, (NULL, side, side, 1, 1, 1, any));
  REFUSES(flesh_effect_weld, first, (any, no_side, side, 1, 1, 1, any));
  REFUSES(flesh_effect_weld, second, (any, side, no_side, 1, 1, 1, any));
  REFUSES(flesh_effect_weld, effect, (any, side, side, 1, 1, 1, NULL));
  REFUSES(flesh_effect_joint, body, (NULL, group, group, any, any, 1, any));
  REFUSES(flesh_effect_joint, first, (any, no_group, group, any, any, 1, any));
  REFUSES(flesh_effect_joint, second, (any, group, no_group, any, any, 1, any));
  REFUSES(flesh_effect_joint, point, (any, group, group, NULL, any, 1, any));
  REFUSES(flesh_effect_joint, effect, (any, group, group, any, any, 1, NULL));
  REFUSES(flesh_effect_joint_spring, body, (NULL, any, any, 1, 1, any));
  REFUSES(flesh_effect_joint_spring, first, (any, NULL, any, 1, 1, any));
  REFUSES(flesh_effect_joint_spring, second, (any, any, NULL, 1, 1, any));
  REFUSES(flesh_effect_joint_spring, effect, (any, any, any, 1, 1, NULL));
  REFUSES(flesh_effect_buoyancy, body, (NULL, 1, 1, any, any)), REFUSES(flesh_effect_buoyancy, acceleration, (any, 1, 1, NULL, any));
  REFUSES(flesh_effect_buoyancy, effect, (any, 1, 1, any, NULL));
}

static void null_is_refused_by_runs(void)
{
  REFUSES(flesh_ida_problem_create, system, (NULL, any, any));
  REFUSES(flesh_ida_problem_create, options, (any, NULL, any));
  REFUSES(flesh_ida_problem_create, problem, (any, any, NULL));
  REFUSES(flesh_ida_vector_create, problem, (NULL, any, any));
  REFUSES(flesh_ida_vector_create, context, (any, NULL, any)), REFUSES(flesh_ida_vector_create, y, (any, any, NULL));
  REFUSES(flesh_ida_start, problem, (NULL, any, any, any)), REFUSES(flesh_ida_start, state, (any, NULL, any, any));
  REFUSES(flesh_ida_tolerances, problem, (NULL, 1, any)), REFUSES(flesh_ode_tolerances, problem, (NULL, 1, any));
  REFUSES(flesh_ida_get_state, problem, (NULL, 0, any, any)), REFUSES(flesh_ida_get_state, state, (any, 0, any, NULL));
  REFUSES(flesh_ode_get_state, problem, (NULL, 0, any, any)), REFUSES(flesh_ode_get_state, state, (any, 0, any, NULL));
  REFUSES(flesh_ida_sunmatrix_create, problem, (NULL, any, any));
  REFUSES(flesh_ida_sunmatrix_create, context, (any, NULL, any)), REFUSES(flesh_ida_sunmatrix_create, matrix, (any, any, NULL));
  REFUSES(flesh_ida_sunlinsol_create, problem, (NULL, any, any)), REFUSES(flesh_ida_sunlinsol_create, context, (any, NULL, any));
  REFUSES(flesh_ida_sunlinsol_create, solver, (any, any, NULL)), REFUSES(flesh_ida_sunnonlinsol_create, problem, (NULL, any, any));
  REFUSES(flesh_ida_sunnonlinsol_create, context, (any, NULL, any));
  REFUSES(flesh_ida_sunnonlinsol_create, solver, (any, any, NULL));
  REFUSES(flesh_arkode_sunnonlinsol_create, problem, (NULL, ARK, any, any));
  REFUSES(flesh_arkode_sunnonlinsol_create, context, (any, ARK, NULL, any));
  REFUSES(flesh_arkode_sunnonlinsol_create, solver, (any, ARK, any, NULL));
  REFUSES(flesh_sunnonlinsol_position_norm, solver, (NULL, any));
  REFUSES(flesh_sunnonlinsol_position_norm, y, (any, NULL)), REFUSES(flesh_ode_vector_create, problem, (NULL, any, any));
  REFUSES(flesh_ode_vector_create, context, (any, NULL, any)), REFUSES(flesh_ode_vector_create, y, (any, any, NULL));
  REFUSES(flesh_cvode_sunnonlinsol_create, problem, (NULL, CV, any, any));
  REFUSES(flesh_cvode_sunnonlinsol_create, context, (any, CV, NULL, any));
  REFUSES(flesh_cvode_sunnonlinsol_create, solver, (any, CV, any, NULL));
  REFUSES(flesh_method_options_check, options, (NULL));
  REFUSES(flesh_integrator_create, system, (NULL, 1, any, any));
  REFUSES(flesh_integrator_create, options, (any, 1, NULL, any));
  REFUSES(flesh_integrator_create, integrator, (any, 1, any, NULL));
  REFUSES(flesh_integrator_set_method_options, integrator, (NULL, any));
  REFUSES(flesh_integrator_set_method_options, options, (any, NULL));
  REFUSES(flesh_integrator_step, integrator, (NULL, any, 1, any));
  REFUSES(flesh_integrator_step, state, (any, NULL, 1, any));
  REFUSES(flesh_integrator_set_adaptive, integrator, (NULL, any));
  REFUSES(flesh_integrator_set_max_energy_gain, integrator, (NULL, 1));
  REFUSES(flesh_integrator_set_adaptive, options, (any, NULL));
  REFUSES(flesh_integrator_save, integrator, (NULL, 1, any, any));
  REFUSES(flesh_integrator_save, size, (any, 1, any, NULL));
  REFUSES(flesh_integrator_load, integrator, (NULL, any, 1)), REFUSES(flesh_integrator_load, data, (any, NULL, 1));
  REFUSES(flesh_problem_create, system, (NULL, any, any)), REFUSES(flesh_problem_create, options, (any, NULL, any));
  REFUSES(flesh_problem_create, problem, (any, any, NULL));
  REFUSES(flesh_sensitivity_create, system, (NULL, any, .1, any)), REFUSES(flesh_sensitivity_create, options, (any, NULL, .1, any));
  REFUSES(flesh_sensitivity_create, sensitivity, (any, any, .1, NULL));
  REFUSES(flesh_sensitivity_set, sensitivity, (NULL, any, NULL)), REFUSES(flesh_sensitivity_set, state, (any, NULL, NULL));
  REFUSES(flesh_sensitivity_force, sensitivity, (NULL, any, any)), REFUSES(flesh_sensitivity_force, parameter, (any, NULL, any));
  REFUSES(flesh_sensitivity_force, force, (any, any, NULL)), REFUSES(flesh_tet_forces, parameter, (NULL, any, any));
  REFUSES(flesh_sensitivity_tangent, sensitivity, (NULL, any, any)), REFUSES(flesh_sensitivity_tangent, parameter, (any, NULL, any));
  REFUSES(flesh_sensitivity_tangent, dx, (any, any, NULL)), REFUSES(flesh_sensitivity_respond, dx, (any, any, NULL));
  REFUSES(flesh_sensitivity_adjoint, sensitivity, (NULL, any, any)), REFUSES(flesh_sensitivity_adjoint, quantity, (any, NULL, any));
  REFUSES(flesh_sensitivity_adjoint, lambda, (any, any, NULL)), REFUSES(flesh_sensitivity_respond, force, (any, NULL, any));
  REFUSES(flesh_sensitivity_gradient, sensitivity, (NULL, any, 1, any, any)), REFUSES(flesh_tet_forces, state, (any, NULL, any));
  REFUSES(flesh_sensitivity_gradient, quantity, (any, NULL, 1, any, any)), REFUSES(flesh_tet_forces, forces, (any, any, NULL));
  REFUSES(flesh_sensitivity_gradient, parameters, (any, any, 1, NULL, any));
  REFUSES(flesh_sensitivity_gradient, gradient, (any, any, 1, any, NULL)), REFUSES(flesh_sensitivity_respond, sensitivity, (NULL, any, any));
  REFUSES(flesh_trajectory_create, integrator, (NULL, .1, 40, any)), REFUSES(flesh_trajectory_create, trajectory, (any, .1, 40, NULL));
  REFUSES(flesh_trajectory_tangent, trajectory, (NULL, any, any, any)), REFUSES(flesh_trajectory_tangent, parameter, (any, NULL, any, any));
  REFUSES(flesh_trajectory_tangents, trajectory, (NULL, 1, any, any, any, any)), REFUSES(flesh_trajectory_tangents, parameters, (any, 1, NULL, any, any, any));
  REFUSES(flesh_trajectory_tangent, dx, (any, any, NULL, any)), REFUSES(flesh_trajectory_tangent, dv, (any, any, any, NULL));
  REFUSES(flesh_trajectory_tangents, visit, (any, 1, any, any, NULL, any)), REFUSES(flesh_trajectory_tet_gradient, trajectory, (NULL, any, any, any, any));
  REFUSES(flesh_trajectory_gradient, trajectory, (NULL, any, 1, any, any, any)), REFUSES(flesh_trajectory_tet_gradient, parameter, (any, NULL, any, any, any));
  REFUSES(flesh_trajectory_gradient, quantity, (any, NULL, 1, any, any, any)), REFUSES(flesh_trajectory_tet_gradient, visit, (any, any, NULL, any, any));
  REFUSES(flesh_trajectory_gradient, parameters, (any, any, 1, NULL, any, any)), REFUSES(flesh_trajectory_tet_gradient, gradient, (any, any, any, any, NULL));
  REFUSES(flesh_trajectory_gradient, gradient, (any, any, 1, any, NULL, any));
  REFUSES(flesh_problem_solve, problem, (NULL, any, 1, any, .1)), REFUSES(flesh_problem_solve, b, (any, any, 1, NULL, .1));
  REFUSES(flesh_problem_set_stage, problem, (NULL, any)), REFUSES(flesh_problem_set_stage, stage, (any, NULL));
  REFUSES(flesh_sunmatrix_create, problem, (NULL, any, any)), REFUSES(flesh_sunmatrix_create, context, (any, NULL, any));
  REFUSES(flesh_sunmatrix_create, matrix, (any, any, NULL));
  REFUSES(flesh_sunlinsol_create, problem, (NULL, any, any)), REFUSES(flesh_sunlinsol_create, context, (any, NULL, any));
  REFUSES(flesh_sunlinsol_create, solver, (any, any, NULL));
  REFUSES(flesh_history_create, path, (NULL, any, any)), REFUSES(flesh_history_create, system, (any, NULL, any));
  REFUSES(flesh_history_create, history, (any, any, NULL));
  REFUSES(flesh_history_observe, history, (NULL, any)), REFUSES(flesh_history_observe, record, (any, NULL));
  REFUSES(flesh_probe_prepare, probe, (NULL, any, any)), REFUSES(flesh_probe_prepare, body, (any, NULL, any));
  REFUSES(flesh_probe_prepare, system, (any, any, NULL));
  REFUSES(flesh_probes_create, path, (NULL, any, any, 0, 1, any, any));
  REFUSES(flesh_probes_create, body, (any, NULL, any, 0, 1, any, any));
  REFUSES(flesh_probes_create, system, (any, any, NULL, 0, 1, any, any));
  REFUSES(flesh_probes_create, probes, (any, any, any, 0, 1, NULL, any));
  REFUSES(flesh_probes_create, result, (any, any, any, 0, 1, any, NULL));
  REFUSES(flesh_probes_observe, probes, (NULL, any)), REFUSES(flesh_probes_observe, record, (any, NULL));
  REFUSES(flesh_frames_create, directory, (NULL, any, 1, any));
  REFUSES(flesh_frames_create, mesh, (any, NULL, 1, any)), REFUSES(flesh_frames_create, frames, (any, any, 1, NULL));
  REFUSES(flesh_frames_set_fields, frames, (NULL, any, any, 0, 4, 1));
  REFUSES(flesh_frames_set_fields, body, (any, NULL, any, 0, 4, 1));
  REFUSES(flesh_frames_set_fields, system, (any, any, NULL, 0, 4, 1));
  REFUSES(flesh_frames_observe, frames, (NULL, any)), REFUSES(flesh_frames_observe, record, (any, NULL));
  REFUSES(flesh_run, system, (NULL, any, any, any, any)), REFUSES(flesh_run, integrator, (any, NULL, any, any, any));
  REFUSES(flesh_run, options, (any, any, NULL, any, any)), REFUSES(flesh_run, state, (any, any, any, NULL, any));
  REFUSES(flesh_run_resume, system, (NULL, any, any, 1, 1, any, any));
  REFUSES(flesh_run_resume, integrator, (any, NULL, any, 1, 1, any, any));
  REFUSES(flesh_run_resume, options, (any, any, NULL, 1, 1, any, any));
  REFUSES(flesh_run_resume, state, (any, any, any, 1, 1, NULL, any));
  REFUSES(flesh_ode_problem_create, system, (NULL, any, any));
  REFUSES(flesh_ode_problem_create, options, (any, NULL, any));
  REFUSES(flesh_ode_problem_create, problem, (any, any, NULL));
  REFUSES(flesh_ode_start, problem, (NULL, any, any)), REFUSES(flesh_ode_start, state, (any, NULL, any));
  REFUSES(flesh_ode_sunmatrix_create, problem, (NULL, any, any));
  REFUSES(flesh_ode_sunmatrix_create, context, (any, NULL, any));
  REFUSES(flesh_ode_sunmatrix_create, matrix, (any, any, NULL));
  REFUSES(flesh_ode_sunlinsol_create, problem, (NULL, any, any));
  REFUSES(flesh_ode_sunlinsol_create, context, (any, NULL, any));
  REFUSES(flesh_ode_sunlinsol_create, solver, (any, any, NULL));
  REFUSES(flesh_scene_read, path, (NULL, 1, any, any)), REFUSES(flesh_scene_read, scene, (any, 1, any, NULL));
  REFUSES(flesh_scene_read_text, text, (NULL, any, 1, any, any));
  REFUSES(flesh_scene_read_text, path, (any, NULL, 1, any, any));
  REFUSES(flesh_scene_read_text, scene, (any, any, 1, any, NULL));
  REFUSES(flesh_state_read, path, (NULL, 1, any)), REFUSES(flesh_state_read, state, (any, 1, NULL));
  REFUSES(flesh_state_write, path, (NULL, 1, any)), REFUSES(flesh_state_write, state, (any, 1, NULL));
  REFUSES(flesh_scene_write, scene, (NULL, any)), REFUSES(flesh_scene_write, path, (any, NULL));
  REFUSES(flesh_scene_schema, text, (1, NULL));
  REFUSES(flesh_solve_stats_print, stats, (NULL, 1, any)), REFUSES(flesh_solve_stats_print, file, (any, 1, NULL));
}

static void null_is_refused_by_bodies(void)
{
  REFUSES(flesh_instructions_find, usable, (1, NULL));
  REFUSES(flesh_material_from_lame, material, (1, 1, 1, 1, NULL));
  REFUSES(flesh_material_from_young, material, (1, 1, 1, 1, NULL));
  REFUSES(flesh_material_from_given, given, (1, 1, NULL, any));
  REFUSES(flesh_material_from_given, material, (1, 1, any, NULL));
  check(flesh_material_from_psi(NULL, any, any), "psi is NULL; it must be a function psi(I_C, J)");
  REFUSES(flesh_material_from_psi, material, (psi, any, NULL));
  REFUSES(flesh_fibre_default, fibre, (1, 1, NULL));
  REFUSES(flesh_fibre_tension, fibre, (NULL, 1, 1, any)), REFUSES(flesh_fibre_tension, tension, (any, 1, 1, NULL));
  REFUSES(flesh_energy_from_name, name, (NULL, any)), REFUSES(flesh_energy_from_name, energy, (any, NULL));
  REFUSES(flesh_constants_from_name, name, (NULL, any)), REFUSES(flesh_constants_from_name, constants, (any, NULL));
  REFUSES(flesh_material_small_strain, material, (NULL, any, any, any));
  REFUSES(flesh_material_rest_ratio, material, (NULL, any));
  REFUSES(flesh_material_rest_ratio, volume_ratio, (any, NULL));
  REFUSES(flesh_material_energy, material, (NULL, any, any)), REFUSES(flesh_material_energy, F, (any, NULL, any));
  REFUSES(flesh_material_energy, psi, (any, any, NULL));
  REFUSES(flesh_material_stress, material, (NULL, any, any)), REFUSES(flesh_material_stress, F, (any, NULL, any));
  REFUSES(flesh_material_stress, P, (any, any, NULL));
  REFUSES(flesh_material_hessian, material, (NULL, any, any)), REFUSES(flesh_material_hessian, F, (any, NULL, any));
  REFUSES(flesh_material_hessian, H, (any, any, NULL));
  REFUSES(flesh_material_eigen, material, (NULL, any, any, any));
  REFUSES(flesh_material_eigen, F, (any, NULL, any, any)), REFUSES(flesh_material_eigen, values, (any, any, NULL, any));
  REFUSES(flesh_material_eigen, vectors, (any, any, any, NULL));
  REFUSES(flesh_material_hessian_projected, material, (NULL, any, any));
  REFUSES(flesh_material_hessian_projected, F, (any, NULL, any));
  REFUSES(flesh_material_hessian_projected, H, (any, any, NULL));
  REFUSES(flesh_mesh_create, positions, (1, NULL, 1, any, any, any));
  REFUSES(flesh_mesh_create, tet_nodes, (1, any, 1, NULL, any, any));
  REFUSES(flesh_mesh_create, mesh, (1, any, 1, any, any, NULL));
  REFUSES(flesh_mesh_create_quadratic, positions, (1, NULL, 1, any, any, any));
  REFUSES(flesh_mesh_create_quadratic, tet_nodes, (1, any, 1, NULL, any, any));
  REFUSES(flesh_mesh_create_quadratic, mesh, (1, any, 1, any, any, NULL));
  REFUSES(flesh_mesh_raise_order, mesh, (NULL, any)), REFUSES(flesh_mesh_raise_order, raised, (any, NULL));
  REFUSES(flesh_mesh_refine, mesh, (NULL, any)), REFUSES(flesh_mesh_refine, refined, (any, NULL));
  REFUSES(flesh_mesh_refine_marked, mesh, (NULL, any, any, NULL));
  REFUSES(flesh_mesh_refine_marked, halvings, (any, NULL, any, NULL));
  REFUSES(flesh_mesh_refine_marked, refined, (any, any, NULL, NULL));
  REFUSES(flesh_mesh_transfer, mesh, (NULL, any, 3, any, any));
  REFUSES(flesh_mesh_transfer, parents, (any, NULL, 3, any, any));
  REFUSES(flesh_mesh_transfer, field, (any, any, 3, NULL, any));
  REFUSES(flesh_mesh_transfer, finer, (any, any, 3, any, NULL));
  REFUSES(flesh_mesh_lower_order, mesh, (NULL, any)), REFUSES(flesh_mesh_lower_order, lowered, (any, NULL));
  REFUSES(flesh_mesh_box, cells, (NULL, any, any, any)), REFUSES(flesh_mesh_box, size, (any, NULL, any, any));
  REFUSES(flesh_mesh_box, origin, (any, any, NULL, any)), REFUSES(flesh_mesh_box, mesh, (any, any, any, NULL));
  REFUSES(flesh_mesh_read, path, (NULL, any)), REFUSES(flesh_mesh_read, mesh, (any, NULL));
  REFUSES(flesh_mesh_write, mesh, (NULL, any)), REFUSES(flesh_mesh_write, path, (any, NULL));
  REFUSES(flesh_skin_bind, mesh, (NULL, any, any)), REFUSES(flesh_skin_bind, surface, (any, NULL, any));
  REFUSES(flesh_skin_bind, skin, (any, any, NULL));
  REFUSES(flesh_skin_write, skin, (NULL, any)), REFUSES(flesh_skin_write, path, (any, NULL));
  REFUSES(flesh_skin_read, path, (NULL, any, any, any)), REFUSES(flesh_skin_read, mesh, (any, NULL, any, any));
  REFUSES(flesh_skin_read, surface, (any, any, NULL, any)), REFUSES(flesh_skin_read, skin, (any, any, any, NULL));
  REFUSES(flesh_skin_frames_create, directory, (NULL, any, any, 1, 1, any));
  REFUSES(flesh_skin_frames_create, skin, (any, NULL, any, 1, 1, any));
  REFUSES(flesh_skin_frames_create, surface, (any, any, NULL, 1, 1, any));
  REFUSES(flesh_skin_frames_create, frames, (any, any, any, 1, 1, NULL));
  REFUSES(flesh_skin_frames_observe, frames, (NULL, any)), REFUSES(flesh_skin_frames_observe, record, (any, NULL));
  REFUSES(flesh_surface_create, positions, (1, NULL, 1, any, any, any));
  REFUSES(flesh_surface_create, starts, (1, any, 1, NULL, any, any));
  REFUSES(flesh_surface_create, corners, (1, any, 1, any, NULL, any));
  REFUSES(flesh_surface_create, surface, (1, any, 1, any, any, NULL));
  REFUSES(flesh_surface_read, path, (NULL, any)), REFUSES(flesh_surface_read, surface, (any, NULL));
  REFUSES(flesh_surface_write, surface, (NULL, any, any)), REFUSES(flesh_surface_write, path, (any, any, NULL));
  REFUSES(flesh_surface_of_mesh, mesh, (NULL, any)), REFUSES(flesh_surface_of_mesh, surface, (any, NULL));
  REFUSES(flesh_threads_create, threads, (1, NULL));
}

static void null_is_refused_by_systems(void)
{
  REFUSES(flesh_communicator_create, communicator, (NULL, NULL)), REFUSES(flesh_communicator_agree, communicator, (NULL, 0));
  REFUSES(flesh_rank_part_create, communicator, (NULL, any, any, any));
  REFUSES(flesh_rank_part_create, whole, (any, NULL, any, any));
  REFUSES(flesh_rank_part_create, rank_part, (any, any, any, NULL));
  REFUSES(flesh_rank_part_create_for, whole, (any, NULL, any, any)), REFUSES(flesh_system_finalize, system, (NULL));
  REFUSES(flesh_rank_part_create_for, communicator, (NULL, any, any, any));
  REFUSES(flesh_rank_part_create_for, rank_part, (any, any, any, NULL));
  REFUSES(flesh_rank_part_gather, rank_part, (NULL, any, any)), REFUSES(flesh_rank_part_gather, vector, (any, NULL, any));
  REFUSES(flesh_rank_part_gather, whole, (any, any, NULL));
  REFUSES(flesh_system_set_part, system, (NULL, any)), REFUSES(flesh_system_set_part, rank_part, (any, NULL));
  REFUSES(flesh_system_create, mesh, (NULL, any)), REFUSES(flesh_system_create, system, (any, NULL));
  REFUSES(flesh_system_add_pin, system, (NULL, 1, any, 1, 1, 1));
  REFUSES(flesh_system_add_pin, nodes, (any, 1, NULL, 1, 1, 1));
  REFUSES(flesh_system_add_prescribed_motion, system, (NULL, 1, any, 1, any, 1, 1));
  REFUSES(flesh_system_add_prescribed_motion, nodes, (any, 1, NULL, 1, any, 1, 1));
  REFUSES(flesh_system_add_prescribed_motion, motion, (any, 1, any, 1, NULL, 1, 1));
  REFUSES(flesh_system_update_internal, system, (NULL, any, any, any));
  REFUSES(flesh_system_update_internal, point, (any, NULL, any, any));
  REFUSES(flesh_system_update_internal, internal, (any, any, NULL, any));
  REFUSES(flesh_system_update_internal, changed, (any, any, any, NULL));
  REFUSES(flesh_system_residual, system, (NULL, any, any));
  REFUSES(flesh_system_residual, point, (any, NULL, any)), REFUSES(flesh_system_residual, r, (any, any, NULL));
  REFUSES(flesh_system_load, system, (NULL, any, any)), REFUSES(flesh_system_load, point, (any, NULL, any));
  REFUSES(flesh_system_load, r, (any, any, NULL));
  REFUSES(flesh_system_jacobian, system, (NULL, any, any, any));
  REFUSES(flesh_system_jacobian, point, (any, NULL, any, any));
  REFUSES(flesh_system_jacobian, shift, (any, any, NULL, any)), REFUSES(flesh_system_jacobian, K, (any, any, any, NULL));
  REFUSES(flesh_system_potential, system, (NULL, any, any, any, any));
  REFUSES(flesh_system_potential, point, (any, NULL, any, any, any));
  REFUSES(flesh_system_potential, shift, (any, any, NULL, any, any));
  REFUSES(flesh_system_potential, phi, (any, any, any, NULL, any));
  REFUSES(flesh_system_potential, magnitude, (any, any, any, any, NULL));
  REFUSES(flesh_system_energies, system, (NULL, any, any)), REFUSES(flesh_system_energies, point, (any, NULL, any));
  REFUSES(flesh_system_energies, energies, (any, any, NULL));
  REFUSES(flesh_system_check, system, (NULL, 1, any)), REFUSES(flesh_system_check, x, (any, 1, NULL));
  REFUSES(flesh_system_matrix_create, system, (NULL, any)), REFUSES(flesh_system_matrix_create, matrix, (any, NULL));
}

/* A function that takes its argument does so when it fails, too. */
static int destroyed;
static void count_destroyed(void *data) { destroyed += data != NULL; }
static void what_is_taken_is_freed(void)
{
  static const flesh_effect_operations operations = {.name = "none", .destroy = count_destroyed};
  flesh_effect *effect = NULL;
  flesh_obstacle *obstacle = NULL;
  flesh_mesh *mesh = test_box(1, 1, 1, 1, 1, 1);
  check(flesh_effect_create(NULL, mesh, any, &effect), "flesh_effect_create: operations is NULL");
  check(flesh_effect_create(&operations, mesh, any, NULL), "flesh_effect_create: effect is NULL");
  check(flesh_effect_create(&operations, NULL, any, &effect), "flesh_effect_create: mesh is NULL");
  CHECK(destroyed == 2 && !effect);
  CHECK_OK(flesh_effect_create(&operations, mesh, any, &effect));
  flesh_mesh_destroy(&mesh);
  check(flesh_system_add_effect(any, NULL), "flesh_system_add_effect: effect is NULL");
  check(flesh_system_add_effect(NULL, &effect), "flesh_system_add_effect: system is NULL");
  CHECK(destroyed == 3 && !effect);
  check(flesh_effect_obstacle_contact(any, any, NULL, &effect), "flesh_effect_obstacle_contact: obstacle is NULL");
  for (int k = 0; k < 3; k++) {
    static const char *const sentences[] = {"flesh_effect_obstacle_contact: body is NULL",
                                            "flesh_effect_obstacle_contact: options is NULL",
                                            "flesh_effect_obstacle_contact: effect is NULL"};
    CHECK_OK(flesh_obstacle_sphere((const double[]){0, 0, 0}, 1, &obstacle));
    check(flesh_effect_obstacle_contact(k == 0 ? NULL : any, k == 1 ? NULL : any, &obstacle, k == 2 ? NULL : &effect),
          sentences[k]);
    CHECK(!obstacle && !effect);
  }
}

static void contact_between_bodies_needs_all_but_pairs(void)
{
  flesh_effect *effect = NULL;
  static const char *const sentences[] = {"flesh_effect_surface_contact: body is NULL",
                                          "flesh_effect_surface_contact: options is NULL",
                                          "flesh_effect_surface_contact: effect is NULL"};
  for (int k = 0; k < 3; k++) {
    check(flesh_effect_surface_contact(k == 0 ? NULL : any, k == 1 ? NULL : any, 0, NULL, k == 2 ? NULL : &effect),
          sentences[k]);
    CHECK(!effect);
  }
}

typedef struct lower_layer {
  test_body b;
  SUNContext context;
  flesh_problem *problem;
  flesh_ida_problem *ida;
  flesh_ode_problem *rhs;
  N_Vector u, r, y, yp;
  SUNMatrix A, B, C;
} lower_layer;

static void open_lower_layer(lower_layer *l)
{
  const flesh_solver_options options = test_options(1e-6);
  CHECK_OK(test_body_create(test_box(3, 1, 1, 3, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 1,
                            &l->b));
  CHECK_OK(test_body_clamp(&l->b, 1e-9));
  CHECK_OK(flesh_system_finalize(l->b.system));
  CHECK(!flesh_suncontext_create(&l->context));
  CHECK_OK(flesh_problem_create(l->b.system, &options, &l->problem));
  CHECK_OK(flesh_ida_problem_create(l->b.system, &options, &l->ida));
  CHECK_OK(flesh_ode_problem_create(l->b.system, &options, &l->rhs));
  l->u = N_VNew_Serial(l->b.n, l->context);
  l->y = N_VNew_Serial(2 * l->b.n, l->context);
  N_VConst(0, l->u);
  N_VConst(0, l->y);
  l->r = N_VClone(l->u);
  l->yp = N_VClone(l->y);
  CHECK_OK(flesh_sunmatrix_create(l->problem, l->context, &l->A));
  CHECK_OK(flesh_ida_sunmatrix_create(l->ida, l->context, &l->B));
  CHECK_OK(flesh_ode_sunmatrix_create(l->rhs, l->context, &l->C));
}

static void close_lower_layer(lower_layer *l)
{
  SUNMatDestroy(l->A);
  SUNMatDestroy(l->B);
  SUNMatDestroy(l->C);
  N_VDestroy(l->u);
  N_VDestroy(l->r);
  N_VDestroy(l->y);
  N_VDestroy(l->yp);
  flesh_problem_destroy(&l->problem);
  flesh_ida_problem_destroy(&l->ida);
  flesh_ode_problem_destroy(&l->rhs);
  SUNContext_Free(&l->context);
  test_body_destroy(&l->b);
}

/* Calls every callback with these vectors, matrices and problems. Returns the number that refuse with
 * FLESH_ERR_ARGUMENT and a message that contains `word`. */
static int count_refusals(const char *word, N_Vector u, N_Vector r, N_Vector y, N_Vector yp, SUNMatrix A, SUNMatrix B,
                          SUNMatrix C, void *problem, void *ida, void *rhs)
{
  flesh_sunboolean current = 0;
  int refused = 0;
#define TRY(call)                                                                              \
  do {                                                                                         \
    const int status = (call), said = strstr(flesh_error_text(), word) != NULL;                \
    if (status == FLESH_ERR_ARGUMENT && said) refused++;                                       \
    else printf("# %s gives %d: %s\n", #call, status, flesh_error_text());                     \
  } while (0)
  TRY(flesh_kinsol_residual(u, r, problem));
  TRY(flesh_kinsol_jacobian(u, r, A, problem, NULL, NULL));
  TRY(flesh_kinsol_jacobian_times(u, r, u, NULL, problem));
  TRY(flesh_kinsol_preconditioner_setup(u, NULL, r, NULL, problem));
  TRY(flesh_kinsol_preconditioner_solve(u, NULL, r, NULL, r, problem));
  TRY(flesh_ida_residual(0, y, yp, y, ida));
  TRY(flesh_ida_jacobian(0, 1, y, yp, y, B, ida, NULL, NULL, NULL));
  TRY(flesh_ida_jacobian_times(0, y, yp, y, y, yp, 1, ida, NULL, NULL));
  TRY(flesh_ida_preconditioner_setup(0, y, yp, y, 1, ida));
  TRY(flesh_ida_preconditioner_solve(0, y, yp, y, y, yp, 1, 0, ida));
  TRY(flesh_ode_rhs(0, y, yp, rhs));
  TRY(flesh_ode_accept(0, y, rhs));
  TRY(flesh_ode_jacobian(0, y, yp, C, rhs, NULL, NULL, NULL));
  TRY(flesh_ode_jacobian_times_setup(0, y, yp, rhs));
  TRY(flesh_ode_jacobian_times(y, yp, 0, y, yp, rhs, NULL));
  TRY(flesh_ode_preconditioner_setup(0, y, yp, 0, &current, 1, rhs));
  TRY(flesh_ode_preconditioner_solve(0, y, yp, y, yp, 1, 0, 1, rhs));
#undef TRY
  return refused;
}

enum { CALLBACKS = 17 };

/* A residual of 0 would look like a solution. */
static void callbacks_wait_for_a_stage_or_a_start(void)
{
  lower_layer l;
  open_lower_layer(&l);
  CHECK(count_refusals("comes first", l.u, l.r, l.y, l.yp, l.A, l.B, l.C, l.problem, l.ida, l.rhs) == CALLBACKS);
  CHECK(count_refusals("user_data", l.u, l.r, l.y, l.yp, l.A, l.B, l.C, NULL, NULL, NULL) == CALLBACKS);
  /* KINSOL does not take that for a solution. */
  void *kinsol = KINCreate(l.context);
  N_Vector ones = N_VClone(l.u);
  SUNLinearSolver solver;
  N_VConst(1, ones);
  CHECK_OK(flesh_sunlinsol_create(l.problem, l.context, &solver));
  flesh_sundials_silence(l.context, kinsol);
  CHECK(!KINInit(kinsol, flesh_kinsol_residual, l.u) && !KINSetUserData(kinsol, l.problem));
  CHECK(!KINSetLinearSolver(kinsol, solver, l.A) && !KINSetJacFn(kinsol, flesh_kinsol_jacobian));
  CHECK(KINSol(kinsol, l.u, KIN_NONE, ones, ones) < 0);
  KINFree(&kinsol);
  SUNLinSolFree(solver);
  N_VDestroy(ones);
  close_lower_layer(&l);
}

/* Products and solves need a matrix, all callbacks need vectors. */
static void callbacks_wait_for_what_they_need(void)
{
  lower_layer l;
  open_lower_layer(&l);
  const flesh_stage stage = {.load = 1, .prescribed_fraction = 1, .shift = {.x = 1}, .x0 = l.b.state.x};
  CHECK_OK(flesh_problem_set_stage(l.problem, &stage));
  CHECK_OK(flesh_ida_start(l.ida, &l.b.state, l.y, l.yp));
  CHECK_OK(flesh_ode_start(l.rhs, &l.b.state, l.y));
  check(flesh_ida_start(l.ida, &l.b.state, NULL, l.yp),
        "the N_Vector is NULL; it must be a serial, OpenMP or Pthreads one of length 96");
  check(flesh_ida_start(l.ida, &l.b.state, l.y, NULL),
        "the N_Vector is NULL; it must be a serial, OpenMP or Pthreads one of length 96");
  check(flesh_ode_start(l.rhs, &l.b.state, NULL),
        "the N_Vector is NULL; it must be a serial, OpenMP or Pthreads one of length 96");
  CHECK(flesh_ida_start(l.ida, &l.b.state, l.y, l.yp) == FLESH_OK);
  check(flesh_kinsol_jacobian_times(l.u, l.r, l.u, NULL, l.problem),
        "flesh_kinsol_jacobian_times needs flesh_kinsol_jacobian or flesh_kinsol_preconditioner_setup before it");
  check(flesh_kinsol_preconditioner_solve(l.u, NULL, l.r, NULL, l.r, l.problem),
        "flesh_kinsol_preconditioner_solve needs flesh_kinsol_preconditioner_setup before it");
  check(flesh_ida_preconditioner_solve(0, l.y, l.yp, l.y, l.y, l.yp, 1, 0, l.ida),
        "flesh_ida_preconditioner_solve needs flesh_ida_preconditioner_setup before it");
  check(flesh_ode_preconditioner_solve(0, l.y, l.yp, l.y, l.yp, 1, 0, 1, l.rhs),
        "flesh_ode_preconditioner_solve needs flesh_ode_preconditioner_setup before it");
  check(flesh_kinsol_jacobian(l.u, l.r, NULL, l.problem, NULL, NULL), "flesh_kinsol_jacobian: J is NULL");
  check(flesh_ida_jacobian(0, 1, l.y, l.yp, l.y, NULL, l.ida, NULL, NULL, NULL), "flesh_ida_jacobian: J is NULL");
  check(flesh_ode_jacobian(0, l.y, l.yp, NULL, l.rhs, NULL, NULL, NULL), "flesh_ode_jacobian: J is NULL");
  check(flesh_ode_preconditioner_setup(0, l.y, l.yp, 0, NULL, 1, l.rhs),
        "flesh_ode_preconditioner_setup: jcur is NULL");
  CHECK(count_refusals("the N_Vector is NULL", NULL, NULL, NULL, NULL, l.A, l.B, l.C, l.problem, l.ida, l.rhs) ==
        CALLBACKS);
  close_lower_layer(&l);
}

/* For a problem without inertia the message says which kind it is. */
static void each_kind_speaks_of_itself(void)
{
  test_body b;
  flesh_ida_problem *ida = NULL;
  flesh_ode_problem *rhs = NULL;
  const flesh_solver_options options = test_options(1e-6);
  CHECK_OK(test_body_create(test_box(1, 1, 1, 1, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 0,
                            &b));
  CHECK_OK(flesh_system_finalize(b.system));
  check(flesh_ida_problem_create(b.system, &options, &ida),
        "the system has no inertia; IDA needs an equation of motion");
  check(flesh_ode_problem_create(b.system, &options, &rhs),
        "the system has no inertia; a right-hand side y' = f(t, y) needs it");
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(null_is_refused_by_effects), TEST(null_is_refused_by_runs),
                   TEST(null_is_refused_by_bodies), TEST(null_is_refused_by_systems), TEST(what_is_taken_is_freed),
                   TEST(contact_between_bodies_needs_all_but_pairs), TEST(callbacks_wait_for_a_stage_or_a_start),
                   TEST(callbacks_wait_for_what_they_need), TEST(each_kind_speaks_of_itself));
}
