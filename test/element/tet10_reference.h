/* tet10_reference.h: energy, residual and matrix of ten-node tets, one tet at a time through flesh/material.h and the
 * gradients of ten shape functions, for tests of kernels. */
#ifndef FLESH_TEST_TET10_REFERENCE_H
#define FLESH_TEST_TET10_REFERENCE_H

#include <gsl/gsl_eigen.h>
#include <stdlib.h>

#include "kernel_problem.h"
#include "test_matrix.h"
#include "material/form.h"

/* A user-defined psi with the volume term 3/2 (J-1)^2. */
static int own_psi(double I_C, double J, const flesh_material *m, flesh_psi *psi)
{
  (void)m;
  *psi = (flesh_psi){.value = I_C / 4 + 1.5 * (J - 1) * (J - 1) - J / 2 + 0.01 * I_C * I_C,
                     .I = 0.25 + 0.02 * I_C,
                     .J = 3 * (J - 1) - 0.5,
                     .II = 0.02,
                     .JJ = 3};
  return FLESH_OK;
}

static flesh_material material_number(int n, double young)
{
  flesh_material m;
  if (n == FLESH_ENERGY_USER) {
    CHECK_OK(flesh_material_from_psi(own_psi, NULL, &m));
    m.lambda = 3;
    return m;
  }
  CHECK_OK(flesh_material_from_young((flesh_energy)n, FLESH_CONSTANTS_RAW, young, 0.45, &m));
  return m;
}

/* Returns the mesh with randomly renumbered nodes, moved by up to `bend`; takes it. */
static flesh_mesh *shuffled(flesh_mesh *mesh, double bend)
{
  const int nodes = flesh_mesh_node_count(mesh), tets = flesh_mesh_tet_count(mesh);
  int *number = malloc((size_t)nodes * sizeof *number), *node = malloc(10 * (size_t)tets * sizeof *node);
  double *X = malloc(3 * (size_t)nodes * sizeof *X);
  for (int i = 0; i < nodes; i++) number[i] = i;
  for (int i = nodes - 1; i > 0; i--) {
    const int j = (int)(0.5 * (uniform() + 1) * i), swap = number[i];
    number[i] = number[j];
    number[j] = swap;
  }
  for (int i = 0; i < nodes; i++)
    for (int c = 0; c < 3; c++)
      X[3 * number[i] + c] = flesh_mesh_positions(mesh)[3 * i + c] + (bend > 0 ? bend * uniform() : 0);
  for (int k = 0; k < tets; k++)
    for (int a = 0; a < 10; a++)
      node[10 * k + a] =
          number[a < 4 ? flesh_mesh_tets(mesh)[4 * k + a] : flesh_mesh_tet_edges(mesh)[6 * k + a - 4]];
  flesh_mesh *made = NULL;
  CHECK_OK(flesh_mesh_create_quadratic(nodes, X, tets, node, NULL, &made));
  flesh_mesh_destroy(&mesh);
  free(number);
  free(node);
  free(X);
  return made;
}

/* Makes a problem; takes the mesh, of order 1. */
static void problem_of(int energy, flesh_element element, flesh_mesh *linear, double bend, problem *p)
{
  flesh_mesh *mesh = NULL;
  CHECK_OK(flesh_mesh_raise_order(linear, &mesh));
  flesh_mesh_destroy(&linear);
  *p = (problem){.mesh = shuffled(mesh, bend), .element = element};
  p->materials[0] = material_number(energy, 10);
  p->materials[1] = material_number(energy == FLESH_ENERGY_USER ? FLESH_ENERGY_S : energy, 20);
  problem_make(p);
}

static void problem_open(int energy, flesh_element element, const int cells[3], double bend, problem *p)
{
  flesh_mesh *mesh;
  CHECK_OK(flesh_mesh_box(cells, (double[]){cells[0], cells[1], cells[2]}, (double[]){1, -2, 0.5}, &mesh));
  problem_of(energy, element, mesh, bend, p);
  p->K = malloc((size_t)p->n * (size_t)p->n * sizeof *p->K);
}

/* Deformations: mild enough for J > 0; with tets inverted and shrunk to a point; only inverted; all reflected; all
 * flat. */
enum { MILD, WILD, INVERTED, REFLECTED, FLAT, DEFORMATIONS };
static void deform(problem *p, int how)
{
  const int wild = how == WILD || how == INVERTED;
  const double height[] = {[REFLECTED] = -1, [FLAT] = 0};
  const double *X = flesh_mesh_positions(p->mesh);
  double R[9];
  random_rotation(R);
  for (int i = 0; i < p->n / 3; i++) {
    double y[3] = {0.6 * X[3 * i], 1.3 * X[3 * i + 1] + 0.4 * X[3 * i],
                   (how > INVERTED ? height[how] : 1) * X[3 * i + 2]};
    flesh_mat3_times(R, y, p->x + 3 * i);
    for (int c = 0; c < 3 && how != FLAT; c++) p->x[3 * i + c] += (wild ? 0.6 : 0.02) * uniform();
    for (int c = 0; c < 3; c++) p->v[3 * i + c] = uniform();
  }
  for (int a = 0; a < 10 && how == WILD; a++) /* to a point */
    for (int c = 0; c < 3; c++)
      p->x[3 * (a < 4 ? flesh_mesh_tets(p->mesh)[a] : flesh_mesh_tet_edges(p->mesh)[a - 4]) + c] = c;
  for (int d = 0; d < p->n; d++) {
    const double way = 0.1 * uniform();
    p->x_frozen[d] = p->x[d] + viscous_shift.x * way;
    p->v_frozen[d] = p->v[d] + viscous_shift.v * way;
  }
}

/* psi minus the share of its volume term that the mean of J bears, and with the pressure of the mean: `share` U minus
 * `local` x^4/(2 (x^2 + d^2)), x = J - 1, d = 0.3. */
typedef struct split {
  const flesh_material *whole;
  double share, local, mean, excess; /* of J; excess: the part of its second derivative that damping leaves out */
  int logarithmic;
} split;

static void volume_term(const split *s, double J, double *U, double *first, double *second)
{
  const double x = J - 1, d2 = 0.09, sum = x * x + d2;
  *U = s->logarithmic ? 0.5 * log(J) * log(J) : 0.5 * (J - 1) * (J - 1);
  *first = s->logarithmic ? log(J) / J : J - 1;
  *second = s->logarithmic ? (1 - log(J)) / (J * J) : 1;
  *U = s->share * *U - s->local * pow(x, 4) / (2 * sum);
  *first = s->share * *first - s->local * pow(x, 3) * (x * x + 2 * d2) / (sum * sum);
  *second = s->share * *second - s->local * x * x * (pow(x, 4) + 3 * d2 * x * x + 6 * d2 * d2) / pow(sum, 3);
}

static int split_psi(double I_C, double J, const flesh_material *m, flesh_psi *psi)
{
  const split *s = m->user;
  double U, first, second, U_mean, pressure, stiff;
  int status = FLESH_OK;
  if (flesh_form_of_stretches(s->whole->energy)) *psi = (flesh_psi){0};
  else status = s->whole->psi(I_C, J, s->whole, psi);
  if (s->share == 0) psi->JJ -= s->excess;
  if (status || s->share == 0) return status;
  volume_term(s, J, &U, &first, &second);
  volume_term(s, s->mean, &U_mean, &pressure, &stiff);
  psi->value -= U;
  psi->J += pressure - first;
  psi->JJ -= second;
  return FLESH_OK;
}

/* Computes d2 psi / dF2 [9][9] of a material of split_psi; a form of the singular values has the split beside it. */
static void hessian_of(const flesh_material *m, const double F[9], double H[81])
{
  const flesh_material *whole = ((const split *)m->user)->whole;
  double own[81];
  CHECK_OK(flesh_material_hessian(m, F, H));
  if (!flesh_form_of_stretches(whole->energy)) return;
  CHECK_OK(flesh_material_hessian(whole, F, own));
  for (int k = 0; k < 81; k++) H[k] += own[k];
}

/* Filters the Hessian's negative eigenvalues according to `project`, with a general eigensolver. */
static void projected_hessian(const flesh_material *m, const double F[9], flesh_eigenvalue_filter project, double H[81])
{
  double values[9], vectors[81], copy[81];
  hessian_of(m, F, H);
  if (!project) return;
  memcpy(copy, H, sizeof copy);
  gsl_matrix_view a = gsl_matrix_view_array(copy, 9, 9), v = gsl_matrix_view_array(vectors, 9, 9);
  gsl_vector_view w = gsl_vector_view_array(values, 9);
  gsl_eigen_symmv_workspace *space = gsl_eigen_symmv_alloc(9);
  gsl_eigen_symmv(&a.matrix, &w.vector, &v.matrix, space);
  gsl_eigen_symmv_free(space);
  memset(H, 0, 81 * sizeof *H);
  for (int e = 0; e < 9; e++)
    for (int q = 0; q < 81; q++)
      H[q] += (values[e] > 0 ? values[e] : project == FLESH_FILTER_CLAMP ? 0 : -values[e]) *
              vectors[9 * (q / 9) + e] * vectors[9 * (q % 9) + e];
}

static void energy_and_stress(const flesh_material *m, const double F[9], double *value, double P[9])
{
  const flesh_material *whole = ((const split *)m->user)->whole;
  double own = 0, own_stress[9] = {0};
  CHECK_OK(flesh_material_energy(m, F, value));
  CHECK_OK(flesh_material_stress(m, F, P));
  if (!flesh_form_of_stretches(whole->energy)) return;
  CHECK_OK(flesh_material_energy(whole, F, &own));
  CHECK_OK(flesh_material_stress(whole, F, own_stress));
  *value += own;
  for (int c = 0; c < 9; c++) P[c] += own_stress[c];
}

/* Returns the shear modulus at small strain, 2 psi_I at rest. */
static double shear_modulus(const flesh_material *m)
{
  const double n = 1 / m->links;
  if (m->energy == FLESH_ENERGY_USER) return 0.5 + 0.02 * 6;
  if (m->energy == FLESH_ENERGY_S) return 0.75 * m->mu;
  if (m->energy != FLESH_ENERGY_AB) return m->mu;
  return m->mu * (1 + 3 * n / 5 + 2 * 297 * n * n / 1050 + 2 * 2052 * n * n * n / 7000 +
                  2 * 210195 * n * n * n * n / 673750);
}

/* Splits the volume term. From lambda = three shear moduli on, the mean of J bears lambda less twice the shear modulus;
 * below, a share whose second derivative by x = lambda/mu - 2 is 3 (1 - x^2)/4. The points take back less than four
 * fifths of it and less than five shear moduli. Nothing is split for C, M, CR and StVK, which have no term of J. */
static split split_of(const problem *p, const flesh_material *m)
{
  const double mu = shear_modulus(m);
  const int has = m->energy != FLESH_ENERGY_C && m->energy != FLESH_ENERGY_M && m->energy != FLESH_ENERGY_CR &&
                  m->energy != FLESH_ENERGY_STVK;
  const double x = fmax(-1, fmin(1, m->lambda / mu - 2)), joined = 3 * x * x / 8 - x * x * x * x / 16 + x / 2 + 3. / 16;
  const double share = p->element == FLESH_ELEMENT_TET10_MEAN && has ? mu * joined + fmax(0, m->lambda - 3 * mu) : 0;
  return (split){.whole = m,
                 .share = share,
                 .local = share > 0 ? 1 / sqrt(pow(0.8 * share, -2) + pow(5 * mu, -2)) : 0,
                 .logarithmic = m->energy == FLESH_ENERGY_NEO};
}

/* A tet at a quadrature point, in VTK's order of nodes. */
typedef struct place {
  double gradient[10][3], volume;
} place;

/* Computes the gradients of N_i = L_i (2 L_i - 1) and N_ik = 4 L_i L_k by the positions that they define. */
static void find_place(const double *X, const int node[10], int q, place *at)
{
  static const int ends[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
  double L[4], by_L[10][4] = {{0}}, local[10][3], D[9] = {0}, inverse[9];
  for (int i = 0; i < 4; i++) L[i] = i == q ? 0.58541019662496845446 : 0.13819660112501051518;
  for (int i = 0; i < 4; i++) by_L[i][i] = 4 * L[i] - 1;
  for (int k = 0; k < 6; k++) {
    by_L[4 + k][ends[k][0]] = 4 * L[ends[k][1]];
    by_L[4 + k][ends[k][1]] = 4 * L[ends[k][0]];
  }
  for (int a = 0; a < 10; a++)
    for (int j = 0; j < 3; j++) {
      local[a][j] = by_L[a][j + 1] - by_L[a][0];
      for (int i = 0; i < 3; i++) D[3 * i + j] += X[3 * node[a] + i] * local[a][j];
    }
  at->volume = fabs(flesh_mat3_inverse(D, inverse)) / 24;
  for (int a = 0; a < 10; a++) flesh_mat3_transposed_times(inverse, local[a], at->gradient[a]);
}

static void gradient_of(const double *y, const int node[10], const place *at, double G[9])
{
  memset(G, 0, 9 * sizeof *G);
  for (int a = 0; a < 10; a++)
    for (int c = 0; c < 9; c++) G[c] += y[3 * node[a] + c / 3] * at->gradient[a][c % 3];
}

/* Computes energy, stress and its derivative at a point, for F, the rate F', and the frozen F and F'. */
static void law(kind kind, const flesh_material *m, const double F[9], const double rate[9], const double frozen[9],
                const double frozen_rate[9], flesh_eigenvalue_filter project, double *value, double P[9], double H[81])
{
  if (kind == ELASTIC) {
    energy_and_stress(m, F, value, P);
    projected_hessian(m, F, project, H);
    return;
  }
  if (kind == VISCOUS || kind == FROZEN) {
    viscous_law(F, kind == VISCOUS ? F : frozen, kind == VISCOUS ? rate : frozen_rate, project, value, P, H);
    return;
  }
  projected_hessian(m, F, FLESH_FILTER_CLAMP, H);
  law_of_rates(rate, value, P, H);
}

static void add_to_K(problem *p, int a, int b, int i, int j, double value)
{
  p->K[(size_t)(3 * a + i) * (size_t)p->n + (size_t)(3 * b + j)] += value;
}

static void add_point(problem *p, const int node[10], const place *at, const double P[9], const double H[81])
{
  for (int a = 0; a < 10; a++)
    for (int i = 0; i < 3; i++) {
      p->r[3 * node[a] + i] += at->volume * flesh_vec3_dot(P + 3 * i, at->gradient[a]);
      for (int b = 0; b < 10; b++)
        for (int j = 0; j < 3; j++) {
          double sum = 0;
          for (int q = 0; q < 9; q++)
            sum += H[9 * (3 * i + q / 3) + 3 * j + q % 3] * at->gradient[a][q / 3] * at->gradient[b][q % 3];
          add_to_K(p, node[a], node[b], i, j, at->volume * sum);
        }
    }
}

/* Adds the part of the mean of J: V S(J'). Its forces are already included at the points, except for damping's. */
static void add_mean(problem *p, kind kind, const int node[10], const place at[4], const double *x, double volume,
                     const split *s, int project)
{
  double b[10][3] = {{0}}, U, first, second, rate = 0;
  for (int q = 0; q < 4; q++) {
    double F[9], C[9], f[3];
    gradient_of(x, node, &at[q], F);
    flesh_mat3_cofactor(F, C);
    for (int a = 0; a < 10; a++) {
      flesh_mat3_times(C, at[q].gradient[a], f);
      for (int i = 0; i < 3; i++) b[a][i] += at[q].volume / volume * f[i];
    }
  }
  volume_term(s, s->mean, &U, &first, &second);
  second -= s->excess;
  if (second < 0 && (kind != ELASTIC || project))
    second = kind == ELASTIC && project == FLESH_FILTER_ABSOLUTE ? -second : 0;
  second *= volume * (kind == ELASTIC ? 1 : stiffness);
  for (int a = 0; a < 10; a++) rate += flesh_vec3_dot(b[a], p->v + 3 * node[a]);
  p->energy += kind == ELASTIC ? volume * U : second * rate * rate / 2;
  for (int a = 0; a < 10; a++)
    for (int i = 0; i < 3; i++) {
      if (kind != ELASTIC) p->r[3 * node[a] + i] += second * rate * b[a][i];
      for (int c = 0; c < 10; c++)
        for (int j = 0; j < 3; j++) add_to_K(p, node[a], node[c], i, j, second * b[a][i] * b[c][j]);
    }
}

static void add_tet(problem *p, kind kind, const int node[10], const flesh_material *material, int project)
{
  const double *X = flesh_mesh_positions(p->mesh), *x = kind == REST ? X : p->x;
  place at[4];
  double volume = 0, sum = 0;
  split s = split_of(p, material);
  if (kind == REST) s.share = s.local = 0;
  if (kind == REST || kind == CURRENT) s.excess = excess_of(material);
  for (int q = 0; q < 4; q++) {
    double F[9];
    find_place(X, node, q, &at[q]);
    gradient_of(x, node, &at[q], F);
    volume += at[q].volume;
    sum += at[q].volume * flesh_mat3_determinant(F);
  }
  s.mean = sum / volume;
  for (int q = 0; q < 4; q++) {
    flesh_material m;
    double F[9], rate[9], frozen[9], frozen_rate[9], P[9], H[81], value;
    CHECK_OK(flesh_material_from_psi(split_psi, &s, &m));
    gradient_of(x, node, &at[q], F);
    gradient_of(p->v, node, &at[q], rate);
    gradient_of(p->x_frozen, node, &at[q], frozen);
    gradient_of(p->v_frozen, node, &at[q], frozen_rate);
    law(kind, &m, F, rate, frozen, frozen_rate, (flesh_eigenvalue_filter)project, &value, P, H);
    p->energy += at[q].volume * value;
    add_point(p, node, &at[q], P, H);
  }
  if (kind < VISCOUS && s.share > 0) add_mean(p, kind, node, at, x, volume, &s, project);
}

/* Computes energy, residual and dense matrix tet by tet from the material's functions. */
static void reference(problem *p, kind kind, flesh_eigenvalue_filter project)
{
  const size_t n = (size_t)p->n;
  p->energy = 0;
  memset(p->r, 0, n * sizeof *p->r);
  memset(p->K, 0, n * n * sizeof *p->K);
  for (int k = 0; k < flesh_mesh_tet_count(p->mesh) && kind < CONSISTENT; k++) {
    int node[10];
    memcpy(node, flesh_mesh_tets(p->mesh) + 4 * k, 4 * sizeof *node);
    memcpy(node + 4, flesh_mesh_tet_edges(p->mesh) + 6 * k, 6 * sizeof *node);
    add_tet(p, kind, node, &p->materials[p->tet_material[k]], project);
  }
  if (kind < CONSISTENT) return;
  double *e = calloc(n, sizeof *e), *column = malloc(n * sizeof *column), *lumped = malloc(n * sizeof *lumped);
  flesh_mesh_lumped_mass(p->mesh, p->density, lumped);
  for (size_t d = 0; d < n; d++) { /* the mass reported by the mesh */
    e[d] = 1;
    flesh_mesh_consistent_mass_times(p->mesh, p->density, e, column);
    e[d] = 0;
    for (size_t row = 0; row < n; row++) {
      const double m = kind == LUMPED ? (row == d ? lumped[d / 3] : 0) : column[row];
      p->K[row * n + d] = m;
      p->r[row] += m * p->v[d];
      p->energy += m * p->v[row] * p->v[d] / 2;
    }
  }
  free(e);
  free(column);
  free(lumped);
}

#endif
