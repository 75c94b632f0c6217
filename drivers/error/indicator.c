/* indicator.c: compares recovered stresses and gradients of the adjoint with those of the elements. */

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "error/meshes.h"
#include "math/mat3.h"
#include "mesh/mesh.h"
#include "mesh/tet10.h"
#include "output/tet_shape.h"
#include "output/tet_stress.h"
#include "scene/scene.h"
#include "sensitivity/sensitivity.h"

enum { POINTS = FLESH_TET10_POINTS, FIELDS = 19 }; /* P, gradient of the adjoint, its pressure */

/* Relative residual of the adjoint's solve, which need not be exact. */
static const double tolerance = 1e-6;

typedef struct work {
  const flesh_scene *scene;
  const flesh_state *state;
  flesh_tet_stress stress;
  double *lambda;   /* [3*nodes]; the other arrays stand behind it */
  double *values;   /* [FIELDS*POINTS*tets] at the points of quadrature */
  double *volumes;  /* [POINTS*tets] */
  double *dilation; /* [POINTS*tets] J minus its mean */
  double *means;    /* [FIELDS*nodes] for one material */
  double *weights;  /* [nodes] */
} work;

/* Solves K lambda = dQ/dx at the state. */
static int solve_adjoint(work *w, const double *gradient)
{
  flesh_sensitivity *sensitivity = NULL;
  int status = flesh_sensitivity_create(flesh_scene_system(w->scene), flesh_scene_solver(w->scene), tolerance, &sensitivity);
  if (!status) status = flesh_sensitivity_set(sensitivity, w->state, NULL);
  if (!status) status = flesh_sensitivity_adjoint(sensitivity, &(flesh_quantity){gradient, NULL}, w->lambda);
  flesh_sensitivity_destroy(&sensitivity);
  return status;
}

/* Computes the fields at a tet's points of quadrature. */
static void find_values(work *w, int t)
{
  flesh_strain_point points[POINTS];
  double *values = w->values + (size_t)FIELDS * POINTS * (size_t)t, mean_J = 0, volume = 0, pressure = 0;
  const int m = w->scene->body.tet_material ? w->scene->body.tet_material[t] : 0;
  flesh_tet_stress_points(&w->stress, w->state, t, points);
  for (int q = 0; q < POINTS; q++) {
    double L[4], inverse[9], cofactor[9], *own = values + FIELDS * q;
    for (int c = 0; c < 4; c++) L[c] = c == q ? FLESH_TET10_NEAR : FLESH_TET10_FAR;
    flesh_mat3_inverse(points[q].F, inverse);
    flesh_mat3_multiply_transposed(points[q].tau, inverse, own);
    flesh_tet_gradient(w->scene->mesh, t, L, w->lambda, own + 9);
    flesh_mat3_cofactor(points[q].F, cofactor);
    w->volumes[POINTS * (size_t)t + (size_t)q] = points[q].volume;
    volume += points[q].volume;
    mean_J += points[q].volume * points[q].J;
    pressure += points[q].volume * flesh_mat3_inner(cofactor, own + 9);
  }
  for (int q = 0; q < POINTS; q++) {
    values[FIELDS * q + 18] = w->stress.shares[m].share * pressure / volume;
    w->dilation[POINTS * (size_t)t + (size_t)q] = points[q].J - mean_J / volume;
  }
}

/* Extrapolates a field linearly from the points of quadrature to a corner. */
static double at_corner(const double *values, int field, int corner)
{
  double sum = 0;
  for (int q = 0; q < POINTS; q++) sum += values[FIELDS * q + field];
  return (values[FIELDS * corner + field] - FLESH_TET10_FAR * sum) / (FLESH_TET10_NEAR - FLESH_TET10_FAR);
}

/* Averages the tets' values at corners, over the tets of one material, as stress jumps between materials. */
static void average(work *w, int material)
{
  const flesh_mesh *mesh = w->scene->mesh;
  const int *of = w->scene->body.tet_material;
  memset(w->means, 0, (size_t)FIELDS * (size_t)mesh->nodes * sizeof *w->means);
  memset(w->weights, 0, (size_t)mesh->nodes * sizeof *w->weights);
  for (int t = 0; t < mesh->tets; t++)
    for (int c = 0; c < 4 && (!of || of[t] == material); c++) {
      const size_t node = (size_t)mesh->tet_nodes[4 * (size_t)t + (size_t)c];
      w->weights[node] += mesh->volumes[t];
      for (int f = 0; f < FIELDS; f++)
        w->means[FIELDS * node + (size_t)f] +=
            mesh->volumes[t] * at_corner(w->values + (size_t)FIELDS * POINTS * (size_t)t, f, c);
    }
  for (size_t n = 0; n < (size_t)mesh->nodes; n++)
    for (size_t f = 0; f < FIELDS && w->weights[n] > 0; f++) w->means[FIELDS * n + f] /= w->weights[n];
}

/* Returns a tet's share of the error: sum (P* - P):(G* - G) - (J - mean J)(mu* - mu), whose two parts mostly have
 * opposite signs. */
static double compare(const work *w, int t)
{
  const int *corners = w->scene->mesh->tet_nodes + 4 * (size_t)t;
  double sum = 0;
  for (int q = 0; q < POINTS; q++) {
    const double *own = w->values + (size_t)FIELDS * (POINTS * (size_t)t + (size_t)q);
    const double volume = w->volumes[POINTS * (size_t)t + (size_t)q];
    double off[FIELDS];
    for (int f = 0; f < FIELDS; f++) {
      off[f] = -own[f];
      for (int c = 0; c < 4; c++)
        off[f] += (c == q ? FLESH_TET10_NEAR : FLESH_TET10_FAR) * w->means[FIELDS * (size_t)corners[c] + (size_t)f];
    }
    sum += volume * (flesh_mat3_inner(off, off + 9) - w->dilation[POINTS * (size_t)t + (size_t)q] * off[18]);
  }
  return sum;
}

static void indicate(work *w, double *indicators)
{
  const int *of = w->scene->body.tet_material, materials = of ? flesh_scene_material_count(w->scene) : 1;
  for (int t = 0; t < w->scene->mesh->tets; t++) find_values(w, t);
  for (int m = 0; m < materials; m++) {
    average(w, m);
    for (int t = 0; t < w->scene->mesh->tets; t++)
      if (!of || of[t] == m) indicators[t] = compare(w, t);
  }
}

/* Adds the errors of tets that a box cuts. In the volume beyond the box, P is that of the other material at the tet's F if F is
 * continuous along the box, or the tet's P at another F if P is. Between both is P times the logarithm of their ratio, which
 * is the same from the stiffer and from the softer side. *cut_off becomes the sum. */
static int add_cut(work *w, double *indicators, double *cut_off)
{
  flesh_cut cut;
  const int status = flesh_cut_find(w->scene, &cut);
  flesh_body beyond = w->scene->body;
  flesh_tet_stress stress = w->stress;
  beyond.tet_material = cut.materials;
  stress.body = &beyond;
  *cut_off = 0;
  for (int t = 0; t < w->scene->mesh->tets && cut.count; t++) {
    double own = 0, other = 0, work = 0, P[9], inverse[9];
    flesh_strain_point points[POINTS];
    if (!(cut.shares[t] > 0)) continue;
    flesh_tet_stress_points(&stress, w->state, t, points);
    for (int q = 0; q < POINTS; q++) {
      const double *values = w->values + (size_t)FIELDS * (POINTS * (size_t)t + (size_t)q);
      flesh_mat3_inverse(points[q].F, inverse);
      flesh_mat3_multiply_transposed(points[q].tau, inverse, P);
      own += points[q].volume * flesh_mat3_inner(values, values);
      other += points[q].volume * flesh_mat3_inner(P, P);
      work += points[q].volume * flesh_mat3_inner(values, values + 9);
    }
    const double off = own > 0 && other > 0 ? -cut.shares[t] * .5 * log(other / own) * work : 0;
    indicators[t] += off;
    *cut_off += off;
  }
  flesh_cut_clear(&cut);
  return status;
}

int flesh_error_indicate(const flesh_scene *scene, const flesh_state *state, const char *column, double *indicators,
                         int *is_goal, double *cut_off)
{
  const size_t nodes = (size_t)scene->mesh->nodes, tets = (size_t)scene->mesh->tets;
  work w = {.scene = scene, .state = state,
            .lambda = calloc((FIELDS + 4) * nodes + (FIELDS + 2) * POINTS * tets, sizeof(double))};
  int status = flesh_tet_stress_open(&scene->body, flesh_scene_system(scene), &w.stress);
  if (!status && !w.lambda) status = flesh_no_memory();
  if (!status) {
    w.values = w.lambda + 3 * nodes;
    w.volumes = w.values + FIELDS * POINTS * tets;
    w.dilation = w.volumes + POINTS * tets;
    w.means = w.dilation + POINTS * tets;
    w.weights = w.means + FIELDS * nodes;
  }
  flesh_response response = {0}; /* by_x only for positions */
  if (!status && flesh_response_find(scene, column, state->t, &response) == FLESH_ERR_MEMORY) status = FLESH_ERR_MEMORY;
  *is_goal = !status && response.by_x;
  for (size_t i = 0; i < 3 * nodes && !status && !*is_goal; i++) w.lambda[i] = state->x[i] - scene->mesh->positions[i];
  if (!status && *is_goal) status = solve_adjoint(&w, response.by_x);
  if (!status) indicate(&w, indicators);
  if (!status) status = add_cut(&w, indicators, cut_off);
  flesh_response_clear(&response);
  flesh_tet_stress_clear(&w.stress);
  free(w.lambda);
  return status;
}
