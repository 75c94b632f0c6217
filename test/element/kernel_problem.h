/* kernel_problem.h: a body whose energy, residual and matrix from the batched kernels are compared with those computed
 * one tet at a time, for every kind of effect. */
#ifndef FLESH_TEST_KERNEL_PROBLEM_H
#define FLESH_TEST_KERNEL_PROBLEM_H

#include <stdlib.h>

#include "body.h"
#include "effect/effect.h"
#include "system/system.h"
#include "test.h"
#include "test_matrix.h"
#include "viscous_reference.h"

/* Kinds of effects: depending on x, on v (including the mass times a, which is the same here) with the shape at x_lag,
 * or on both. */
typedef enum kind { ELASTIC, REST, CURRENT, VISCOUS, FROZEN, CONSISTENT, LUMPED, KINDS } kind;
static const char *const kind_names[] = {"elasticity", "damping by rest", "damping by current", "viscosity",
                                         "viscosity, frozen", "consistent mass", "lumped mass"};
static const double stiffness = 0.7;

typedef struct problem {
  flesh_mesh *mesh;
  flesh_element element;
  flesh_material materials[2];
  int *tet_material;
  double *density;
  double *x, *v, *r, *K; /* K dense [3n][3n] */
  double *x_frozen, *v_frozen;
  double energy;
  int n; /* unknowns */
} problem;

/* Makes the arrays, except K, of a problem that has its mesh. */
static void problem_make(problem *p)
{
  int tets = flesh_mesh_tet_count(p->mesh);
  p->n = 3 * flesh_mesh_node_count(p->mesh);
  p->tet_material = malloc((size_t)tets * sizeof *p->tet_material);
  for (int k = 0; k < tets; k++) p->tet_material[k] = k % 7 == 3 || k > tets - 4;
  p->density = malloc((size_t)tets * sizeof *p->density);
  for (int k = 0; k < tets; k++) p->density[k] = 1 + k % 5;
  p->x = malloc((size_t)p->n * sizeof *p->x);
  p->v = malloc((size_t)p->n * sizeof *p->v);
  p->x_frozen = malloc((size_t)p->n * sizeof *p->x_frozen);
  p->v_frozen = malloc((size_t)p->n * sizeof *p->v_frozen);
  p->r = malloc((size_t)p->n * sizeof *p->r);
}

static void problem_close(problem *p)
{
  flesh_mesh_destroy(&p->mesh);
  free(p->tet_material);
  free(p->density);
  free(p->x);
  free(p->v);
  free(p->x_frozen);
  free(p->v_frozen);
  free(p->r);
  free(p->K);
}

/* Computes energy and stress of damping by the projected Hessian H, which becomes their derivative. */
static void law_of_rates(const double rate[9], double *value, double P[9], double H[81])
{
  *value = 0;
  for (int q = 0; q < 81; q++) H[q] *= stiffness;
  for (int e = 0; e < 9; e++) {
    P[e] = 0;
    for (int q = 0; q < 9; q++) P[e] += H[9 * e + q] * rate[q];
    *value += rate[e] * P[e] / 2;
  }
}

/* Makes a system of only this effect. */
static int make_system(problem *p, kind kind, flesh_instructions instructions, flesh_system **system)
{
  flesh_body body = {.mesh = p->mesh,
                     .density = p->density,
                     .materials = p->materials,
                     .tet_material = p->tet_material,
                     .mass = kind == LUMPED ? FLESH_MASS_LUMPED : FLESH_MASS_CONSISTENT,
                     .element = p->element,
                     .instructions = instructions};
  flesh_effect *effect = NULL;
  CHECK_OK(flesh_system_create(p->mesh, system));
  int status = kind == ELASTIC    ? flesh_effect_elasticity(&body, &effect)
               : kind == REST     ? flesh_effect_damping(&body, 0, stiffness, FLESH_STIFFNESS_REST, &effect)
               : kind == CURRENT  ? flesh_effect_damping(&body, 0, stiffness, FLESH_STIFFNESS_CURRENT, &effect)
               : kind == VISCOUS || kind == FROZEN ? flesh_effect_viscosity(&body, shear, bulk, &effect)
                                  : flesh_effect_inertia(&body, &effect);
  if (status) return status;
  flesh_instructions asked;
  CHECK_OK(flesh_instructions_find(instructions, &asked));
  CHECK(flesh_effect_instructions(effect) == (kind == LUMPED ? FLESH_INSTRUCTIONS_AUTO : asked));
  CHECK_OK(flesh_system_add_effect(*system, &effect));
  CHECK_OK(flesh_system_finalize(*system));
  return FLESH_OK;
}

/* Returns the part of lambda that damping leaves out: the excess over nine times mu. */
static double excess_of(const flesh_material *m)
{
  double mu, lambda;
  CHECK_OK(flesh_material_small_strain(m, &mu, &lambda, NULL));
  return fmax(0, lambda - 9 * mu);
}

/* Makes a point; vectors that the kind must not read have other values. */
static flesh_point point_of(const problem *p, kind kind)
{
  const int viscous = kind == VISCOUS || kind == FROZEN;
  flesh_point point = flesh_point_at(0, kind == ELASTIC || viscous ? p->x : p->v,
                                     kind == ELASTIC || kind >= CONSISTENT ? p->x : p->v,
                                     kind >= CONSISTENT ? p->v : p->x);
  point.lagged = (flesh_lagged){0, kind == CURRENT ? p->x : p->v, p->x};
  if (kind == FROZEN) point.frozen = (flesh_frozen){p->x_frozen, p->v_frozen};
  return point;
}

static flesh_shift shift_of(kind kind, int project)
{
  if (kind == VISCOUS || kind == FROZEN)
    return (flesh_shift){.x = viscous_shift.x, .v = viscous_shift.v, .filter = project};
  return (flesh_shift){.x = kind == ELASTIC, .v = kind > ELASTIC && kind < CONSISTENT, .a = kind >= CONSISTENT,
                       .filter = project};
}

static double largest_of(const double *a, size_t n)
{
  double largest = 0;
  for (size_t k = 0; k < n; k++) largest = fmax(largest, fabs(a[k]));
  return largest;
}

/* Returns the larger one, and NaN once there is one. */
static double worse(double a, double b) { return a <= b || isnan(b) ? b : a; }

/* Returns the largest difference from the reference, over the largest entry. */
static double residual_error(const problem *p, const double *r)
{
  double worst = 0;
  for (int d = 0; d < p->n; d++) worst = worse(worst, fabs(r[d] - p->r[d]));
  return worst / largest_of(p->r, (size_t)p->n);
}

static double matrix_error(const problem *p, const flesh_block_matrix *A)
{
  double worst = 0;
  size_t n = (size_t)p->n, found = 0, expected = 0;
  for (int i = 0; i < A->rows; i++)
    for (int k = A->row_start[i]; k < A->row_end[i]; k++, found += 9)
      for (int c = 0; c < 9; c++) {
        size_t row = (size_t)(3 * i + c / 3), column = (size_t)(3 * A->column[k] + c % 3);
        worst = worse(worst, fabs(A->values[9 * (size_t)k + c] - p->K[row * n + column]));
      }
  for (size_t q = 0; q < n * n; q++) expected += q / n / 3 <= q % n / 3 && p->K[q] != 0;
  CHECK(expected <= found); /* no entry of the reference lies outside the pattern */
  return worst / largest_of(p->K, n * n);
}

/* Residual and potential have the same bits in one pass. */
static void check_both(const flesh_system *system, const flesh_point *point, const flesh_shift *shift, const double *r,
                       double V)
{
  size_t bytes = (size_t)flesh_system_unknowns(system) * sizeof *r;
  double *both = malloc(bytes), phi, magnitude;
  CHECK_OK(test_evaluate(system, point, shift, both, &phi, &magnitude));
  CHECK(phi == V && magnitude >= fabs(V) * (1 - 1e-14));
  CHECK(!memcmp(both, r, bytes));
  free(both);
}

static int available(int instructions)
{
  flesh_instructions usable;
  return flesh_instructions_find((flesh_instructions)instructions, &usable) == FLESH_OK;
}

/* Computes energy, residual and dense matrix of a problem tet by tet; defined by the including test. */
static void reference(problem *p, kind kind, flesh_eigenvalue_filter project);

/* The largest differences of entries over the largest entry, and of the energy over the reference's. */
typedef struct comparison {
  double matrix, residual, energy;
} comparison;

static comparison measure(problem *p, kind kind, flesh_instructions instructions)
{
  flesh_system *system;
  flesh_block_matrix *A;
  comparison found = {0};
  CHECK_OK(make_system(p, kind, instructions, &system));
  CHECK_OK(flesh_system_matrix_create(system, &A));
  const flesh_point point = point_of(p, kind);
  double *r = malloc((size_t)p->n * sizeof *r), V, size;
  for (int project = FLESH_FILTER_NONE; project <= FLESH_FILTER_ABSOLUTE; project++) {
    const flesh_shift shift = shift_of(kind, project);
    reference(p, kind, (flesh_eigenvalue_filter)project);
    CHECK_OK(flesh_system_jacobian(system, &point, &shift, A));
    found.matrix = worse(found.matrix, matrix_error(p, A));
  }
  const flesh_shift shift = shift_of(kind, 0);
  CHECK_OK(flesh_system_residual(system, &point, r));
  CHECK_OK(flesh_system_potential(system, &point, &shift, &V, &size));
  check_both(system, &point, &shift, r, V);
  found.residual = residual_error(p, r);
  found.energy = V * (shift.v != 0 ? shift.v : 1) / p->energy;
  free(r);
  flesh_block_matrix_destroy(&A);
  flesh_system_destroy(&system);
  return found;
}

/* Makes tets that share only their first `shared` nodes: with 0, tiles run out of room for nodes, with 2 for pairs. */
static inline flesh_mesh *tets_apart(int tets, int shared)
{
  const int own = 4 - shared, nodes = shared + tets * own;
  double *X = malloc(3 * (size_t)nodes * sizeof *X);
  int *node = malloc(4 * (size_t)tets * sizeof *node);
  for (int i = 0; i < nodes; i++) { /* around an axis, or on it */
    const int on_axis = i < shared || i % own == 3;
    const double angle = i / own + 1.1 * (i % own), height = i < shared ? i : on_axis;
    const double corner[3] = {on_axis ? 0 : cos(angle), on_axis ? 0 : sin(angle), height};
    for (int c = 0; c < 3; c++) X[3 * i + c] = corner[c] + 0.1 * uniform();
  }
  for (int k = 0; k < 4 * tets; k++) node[k] = k % 4 < shared ? k % 4 : shared + k / 4 * own + k % 4 - shared;
  flesh_mesh *mesh;
  CHECK_OK(flesh_mesh_create(nodes, X, tets, node, NULL, &mesh));
  free(X);
  free(node);
  return mesh;
}

/* Any number of threads gives the same bits. */
static inline void check_threads(problem *p, kind kind)
{
  flesh_system *system;
  flesh_block_matrix *A[2];
  CHECK_OK(make_system(p, kind, FLESH_INSTRUCTIONS_AUTO, &system));
  double *r[2], V[2], size;
  for (int k = 0; k < 2; k++) {
    CHECK_OK(flesh_system_matrix_create(system, &A[k]));
    r[k] = malloc((size_t)p->n * sizeof *r[k]);
  }
  for (int count = 1; count <= 3; count++) {
    int k = count > 1;
    flesh_threads *threads;
    CHECK_OK(flesh_threads_create(count, &threads));
    flesh_point point = point_of(p, kind);
    const flesh_shift shift = shift_of(kind, FLESH_FILTER_CLAMP);
    point.threads = threads;
    CHECK_OK(flesh_system_residual(system, &point, r[k]));
    CHECK_OK(flesh_system_jacobian(system, &point, &shift, A[k]));
    CHECK_OK(flesh_system_potential(system, &point, &shift, &V[k], &size));
    check_both(system, &point, &shift, r[k], V[k]);
    flesh_threads_destroy(&threads);
    if (!k) continue;
    CHECK(!memcmp(r[0], r[1], (size_t)p->n * sizeof *r[0]));
    CHECK(!memcmp(A[0]->values, A[1]->values,
                  (size_t)A[0]->row_start[A[0]->rows] * 9 * sizeof(double)));
    CHECK(V[0] == V[1] && V[0] != 0);
  }
  for (int k = 0; k < 2; k++) {
    flesh_block_matrix_destroy(&A[k]);
    free(r[k]);
  }
  flesh_system_destroy(&system);
}

#endif
