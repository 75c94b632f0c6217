/* end.c: finds rest shapes, the dimension of a shape, and whether an end is a true local minimum. */

#include <gsl/gsl_eigen.h>
#include <gsl/gsl_sort_vector.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "flesh/system.h"
#include "material/form.h"
#include "math/eig3.h"
#include "mesh/mesh.h"
#include "hardcases/hardcases.h"
#include "run/start.h"

/* Most unknowns for dense eigenvalues, which take 2.8 s for 1800 unknowns and eight times as long for twice as many. */
enum { DENSE_LIMIT = 2400 };

/* Finds the static equilibrium from the state, with the scene's pins, solved to rounding if possible. */
static int settle(const flesh_scene *scene, flesh_state *state, double tolerance)
{
  flesh_solver_options options;
  flesh_integrator *integrator = NULL;
  flesh_solver_options_default(&options);
  options.newton_tolerance = tolerance;
  options.max_newton = 200;
  options.max_cutbacks = 0;
  options.techniques &= ~(unsigned)FLESH_TECHNIQUE_UNTANGLE; /* to find the energy's own equilibrium */
  options.accept_unconverged = 1; /* the result is judged by its gradient */
  int status = flesh_integrator_create(flesh_scene_system(scene), FLESH_METHOD_STATIC, &options, &integrator);
  /* Repeats the solve from its end: a tolerance relative to the first residual, which stiff parts dominate, says little
   * about soft parts. */
  for (int again = 0; again < 5 && !status; again++) {
    flesh_solve_stats stats = {0};
    status = flesh_integrator_step(integrator, state, 0, &stats);
    if (stats.at_rounding || !stats.newton) break;
  }
  flesh_integrator_destroy(&integrator);
  return status;
}

/* Makes a state at rest with positions x [3*nodes]. */
static int start_at(double t, int nodes, const double *x, flesh_state *state)
{
  const int status = flesh_state_make(nodes, 0, 0, state);
  if (status) return status;
  state->t = t;
  memcpy(state->x, x, sizeof *x * 3 * (size_t)nodes);
  return FLESH_OK;
}

void flesh_hardcases_rest_shape(const flesh_scene *scene, double t, flesh_mesh **rest)
{
  const flesh_mesh *mesh = flesh_scene_mesh(scene);
  const flesh_body *body = flesh_scene_body(scene);
  int nodes = flesh_mesh_node_count(mesh), materials = flesh_scene_material_count(scene), stressed = 0;
  flesh_state state = {0};
  uint8_t *fixed = calloc(3 * (size_t)nodes, 1);
  int status = fixed ? start_at(t, nodes, flesh_mesh_positions(mesh), &state) : FLESH_ERR_MEMORY;
  *rest = NULL;
  for (int m = 0; m < materials; m++) stressed |= flesh_material_is_stressed_at_rest(&body->materials[m]);
  if (!status && stressed) {
    double ratio;
    status = flesh_material_rest_ratio(&body->materials[0], &ratio);
    if (!status && flesh_system_fixed(flesh_scene_system(scene), t, fixed)) status = settle(scene, &state, 1e-8);
    else
      for (int d = 0; d < 3 * nodes && !status; d++) state.x[d] *= cbrt(ratio);
  }
  if (!status)
    flesh_mesh_build(&(flesh_mesh_lists){.nodes = nodes, .tets = flesh_mesh_tet_count(mesh), .positions = state.x,
                                         .tet_nodes = flesh_mesh_tets(mesh), .edge_nodes = flesh_mesh_tet_edges(mesh)},
                     NULL, rest);
  free(state.x);
  free(fixed);
}

int flesh_hardcases_rank(const flesh_mesh *mesh, const double *x)
{
  int nodes = flesh_mesh_node_count(mesh), rank = 0;
  flesh_mesh_info info;
  flesh_mesh_inspect(mesh, &info);
  double length = info.high[0] - info.low[0], mean[3] = {0};
  double spread[9] = {0};
  for (int d = 0; d < 3 * nodes; d++) mean[d % 3] += x[d] / nodes;
  for (int i = 0; i < nodes; i++)
    for (int a = 0; a < 3; a++)
      for (int b = 0; b < 3; b++)
        spread[3 * a + b] += (x[3 * i + a] - mean[a]) * (x[3 * i + b] - mean[b]) / nodes;
  double values[3], vectors[9];
  flesh_eigh3(spread, values, vectors);
  for (int k = 0; k < 3; k++) rank += !(values[k] <= 1e-12 * length * length); /* 3 if a position is not finite */
  return rank;
}

/* Computes the eigenvalues, ascending, of the true Hessian of the free dofs, whose number is the size of `values`. */
static int spectrum(const flesh_system *system, const flesh_point *point, const uint8_t *fixed, gsl_vector *values)
{
  int unknowns = flesh_system_unknowns(system);
  flesh_block_matrix *K = NULL;
  int *number = malloc(sizeof *number * (size_t)unknowns);
  gsl_matrix *dense = gsl_matrix_calloc(values->size, values->size);
  gsl_eigen_symm_workspace *work = gsl_eigen_symm_alloc(values->size);
  int status = number && dense && work ? flesh_system_matrix_create(system, &K) : FLESH_ERR_MEMORY;
  const flesh_shift shift = {.x = 1};
  if (!status) status = flesh_system_jacobian(system, point, &shift, K);
  for (int d = 0, next = 0; d < unknowns && !status; d++) number[d] = fixed[d] ? -1 : next++;
  for (int i = 0; !status && i < K->rows; i++)
    for (int k = K->row_start[i]; k < K->row_end[i]; k++)
      for (int e = 0; e < 9; e++) {
        int row = number[3 * i + e / 3], column = number[3 * K->column[k] + e % 3];
        if (row < 0 || column < 0) continue;
        gsl_matrix_set(dense, (size_t)row, (size_t)column, K->values[9 * (size_t)k + e]);
        gsl_matrix_set(dense, (size_t)column, (size_t)row, K->values[9 * (size_t)k + e]);
      }
  if (!status) gsl_eigen_symm(dense, values, work);
  if (!status) gsl_sort_vector(values);
  flesh_block_matrix_destroy(&K);
  free(number);
  gsl_matrix_free(dense);
  gsl_eigen_symm_free(work);
  return status;
}

/* Returns the scale of the norm of forces at the nodes: the shear modulus times the mean edge squared, times the root
 * of the number of nodes. */
static double force_scale(const flesh_scene *scene)
{
  flesh_mesh_info info;
  flesh_mesh_inspect(flesh_scene_mesh(scene), &info);
  return flesh_scene_body(scene)->materials[0].mu * info.edge_mean * info.edge_mean *
         sqrt(info.nodes);
}

/* Sets end, gradient and eigenvalues for the equilibrium x. */
static void judge_equilibrium(const flesh_scene *scene, double t, const double *x,
                              flesh_hardcases_figures *f)
{
  const flesh_system *system = flesh_scene_system(scene);
  int unknowns = flesh_system_unknowns(system);
  double *zero = calloc((size_t)unknowns, 2 * sizeof *zero + 1), sum = 0;
  if (!zero) return;
  double *r = zero + unknowns;
  uint8_t *fixed = (uint8_t *)(r + unknowns); /* stands behind the doubles */
  gsl_vector *values = NULL;
  const flesh_point point = flesh_point_at(t, x, zero, zero);
  const int free_count = unknowns - flesh_system_fixed(system, t, fixed), status = flesh_system_residual(system, &point, r);
  for (int d = 0; d < unknowns; d++) sum += fixed[d] ? 0 : r[d] * r[d];
  f->gradient = sqrt(sum) / force_scale(scene);
  if (!(f->gradient < 1e-6)) {
    f->end = FLESH_HARDCASES_END_MOVING;
  } else if (!status && free_count > 6 && (values = gsl_vector_alloc((size_t)free_count)) &&
             !spectrum(system, &point, fixed, values)) {
    double zero_below = 1e-9 * fabs(gsl_vector_get(values, values->size - 1));
    int rigid = free_count == unknowns ? 6 : 0, zeros = 0;
    for (size_t k = 0; k < values->size; k++) {
      f->negative_eigenvalues += gsl_vector_get(values, k) < -zero_below;
      zeros += fabs(gsl_vector_get(values, k)) <= zero_below;
    }
    /* A free body's rigid motions do not count as zero eigenvalues (some of them do not exist for a point or line). */
    f->smallest_eigenvalue = gsl_vector_get(values, f->negative_eigenvalues ? 0 : (size_t)(zeros < rigid ? zeros : rigid));
    f->end = f->negative_eigenvalues ? FLESH_HARDCASES_END_SADDLE
             : zeros > rigid         ? FLESH_HARDCASES_END_DEGENERATE
                                     : FLESH_HARDCASES_END_MINIMUM;
  }
  free(zero);
  gsl_vector_free(values);
}

void flesh_hardcases_judge_end(const flesh_scene *scene, double t, const double *x,
                               const flesh_mesh *rest, flesh_hardcases_figures *f)
{
  const int nodes = flesh_mesh_node_count(flesh_scene_mesh(scene));
  flesh_state settled;
  if (3 * nodes > DENSE_LIMIT || start_at(t, nodes, x, &settled)) return;
  /* Solve with a small tolerance. For a body at rest to rounding nothing can decrease; its gradient then shows the
   * rest. */
  settle(scene, &settled, 1e-9);
  if (rest && flesh_mesh_distance_from_rest(rest, settled.x) < FLESH_HARDCASES_TOLERANCE)
    f->end = FLESH_HARDCASES_END_UNTANGLES;
  else judge_equilibrium(scene, t, settled.x, f);
  free(settled.x);
}
