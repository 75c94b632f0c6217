// TEST quick seconds=60
/* test_effects.c: every effect of the registry obeys the contract of effect.h: r and K are derivatives of the potential
 * and of r, Jacobians are symmetric and, projected, positive semi-definite, energies follow their formulas. */
#include <gsl/gsl_eigen.h>
#include <stdlib.h>

#include "body.h"
#include "effect/private.h"
#include "effect/environment.h"
#include "effect_sample.h"
#include "system/derivative_check.h"
#include "system/system.h"
#include "test.h"
#include "material/form.h"

static const flesh_shift shifts[] = {{.x = 1}, {.x = 1, .v = 60, .a = 3600}, {.x = 1, .v = 37.5, .a = 1406.25},
                                     {.x = 0.5, .v = 3, .a = 700}};
enum { SHIFTS = sizeof shifts / sizeof shifts[0] };

static flesh_material material_of(flesh_energy energy)
{
  flesh_material material;
  CHECK_OK(flesh_material_from_lame(energy, FLESH_CONSTANTS_RAW, 4e4, 3e5, &material));
  return material;
}

/* Makes a body of the unit cube without any effect; the system is empty. */
static void make_cube(int cells, flesh_energy energy, flesh_mass mass, test_body *b)
{
  CHECK_OK(test_body_create(test_box(cells, cells, cells, 1, 1, 1), material_of(energy), 1000, mass, 0, b));
  flesh_system_destroy(&b->system);
  CHECK_OK(flesh_system_create(b->mesh, &b->system));
  for (int e = 0; e < flesh_mesh_tet_count(b->mesh); e++) b->density[e] = 900 + 10 * (e % 17);
}

static double smallest_eigenvalue(int n, const double *matrix)
{
  gsl_matrix *A = gsl_matrix_alloc((size_t)n, (size_t)n);
  gsl_vector *values = gsl_vector_alloc((size_t)n);
  gsl_eigen_symm_workspace *work = gsl_eigen_symm_alloc((size_t)n);
  memcpy(A->data, matrix, (size_t)n * n * sizeof *matrix);
  gsl_eigen_symm(A, values, work);
  double low = gsl_vector_min(values);
  gsl_eigen_symm_free(work);
  gsl_vector_free(values);
  gsl_matrix_free(A);
  return low;
}

/* A point that moves with the unknown; statics have no velocity and no acceleration. */
typedef struct place {
  int n;
  const flesh_shift *shift;
  double *x0, *v0, *a0, *u, *x, *v, *a, *x_lag, *v_lag, *x_frozen, *v_frozen;
} place;

static place place_create(const test_body *b, const flesh_shift *shift, unsigned long long seed)
{
  place p = {.n = b->n, .shift = shift};
  double **vectors[] = {&p.x0, &p.v0, &p.a0, &p.u, &p.x, &p.v, &p.a, &p.x_lag, &p.v_lag, &p.x_frozen, &p.v_frozen};
  for (size_t k = 0; k < sizeof vectors / sizeof *vectors; k++) *vectors[k] = calloc((size_t)b->n, sizeof(double));
  memcpy(p.x0, b->state.x, (size_t)b->n * sizeof *p.x0);
  memcpy(p.x_lag, b->state.x, (size_t)b->n * sizeof *p.x_lag);
  test_jitter(b->n, 0.02, seed + 2, p.x_lag);
  test_jitter(b->n, 2, seed + 3, p.v_lag);
  if (shift->v != 0) test_jitter(b->n, 2, seed, p.v0);
  if (shift->a != 0) test_jitter(b->n, 20, seed + 1, p.a0);
  test_jitter(b->n, 0.02, seed + 4, p.u);
  for (int d = 0; d < b->n; d++) {
    p.x_frozen[d] = p.x0[d] + shift->x * p.u[d];
    p.v_frozen[d] = p.v0[d] + shift->v * p.u[d];
    p.u[d] = 0;
  }
  return p;
}

static void place_destroy(place *p)
{
  double *vectors[] = {p->x0, p->v0, p->a0, p->u, p->x, p->v, p->a, p->x_lag, p->v_lag, p->x_frozen, p->v_frozen};
  for (size_t k = 0; k < sizeof vectors / sizeof vectors[0]; k++) free(vectors[k]);
}

static flesh_point point_of(place *p)
{
  for (int d = 0; d < p->n; d++) {
    p->x[d] = p->x0[d] + p->shift->x * p->u[d];
    p->v[d] = p->v0[d] + p->shift->v * p->u[d];
    p->a[d] = p->a0[d] + p->shift->a * p->u[d];
  }
  flesh_point point = flesh_point_at(0.3, p->x, p->v, p->a);
  point.load = 0.7;
  point.lagged = (flesh_lagged){0, p->x_lag, p->v_lag};
  point.frozen = (flesh_frozen){p->x_frozen, p->v_frozen};
  return point;
}

static const double offsets[] = {-2, -1, 1, 2}, weights[] = {1. / 12, -2. / 3, 2. / 3, -1. / 12};

/* Computes differences of the potential and of r around the point with steps s of u: r and J, the latter by rows. */
static void differentiate(const test_body *b, place *p, double s, double *slopes, double *differences)
{
  int n = b->n;
  double *moved = malloc((size_t)n * sizeof *moved), phi, magnitude;
  memset(slopes, 0, (size_t)n * sizeof *slopes);
  memset(differences, 0, (size_t)n * n * sizeof *differences);
  for (int d = 0; d < n; d++) {
    for (int k = 0; k < 4; k++) {
      p->u[d] = offsets[k] * s;
      flesh_point point = point_of(p);
      CHECK_OK(flesh_system_potential(b->system, &point, p->shift, &phi, &magnitude));
      CHECK_OK(flesh_system_residual(b->system, &point, moved));
      CHECK(magnitude >= fabs(phi) * (1 - 1e-12));
      slopes[d] += weights[k] * phi / s;
      for (int e = 0; e < n; e++) differences[e * n + d] += weights[k] * moved[e] / s;
    }
    p->u[d] = 0;
  }
  free(moved);
}

static double largest_difference(int n, const double *x, const double *y)
{
  double largest = 0;
  for (int k = 0; k < n; k++) largest = fmax(largest, fabs(x[k] - (y ? y[k] : 0)));
  return largest;
}

/* Checks every entry of r against differences of the potential, and every entry of J against differences of r; the
 * projected J is positive semi-definite and not below J. Whole systems test the sum and shared slots, too. */
static void check_every_entry(const test_body *b, const flesh_shift *shift, const char *name)
{
  int n = b->n;
  place p = place_create(b, shift, 5);
  double *r = malloc((size_t)n * sizeof *r), *slopes = malloc((size_t)n * sizeof *slopes);
  double *differences = malloc((size_t)n * n * sizeof *differences);
  flesh_point point = point_of(&p);
  CHECK_OK(flesh_system_residual(b->system, &point, r));
  flesh_block_matrix *K = NULL;
  CHECK_OK(flesh_system_matrix_create(b->system, &K));
  flesh_shift projecting = *shift;
  projecting.filter = 1;
  CHECK_OK(flesh_system_jacobian(b->system, &point, shift, K));
  double *J = test_dense(K);
  CHECK_OK(flesh_system_jacobian(b->system, &point, &projecting, K));
  double *projected = test_dense(K), *gain = malloc((size_t)n * n * sizeof *gain);
  double gradient_size = largest_difference(n, r, NULL), size = largest_difference(n * n, J, NULL);
  double gradient_error = INFINITY, error = INFINITY, asymmetry = 0;
  /* Long steps suit smooth effects, short ones the thin layer of a barrier and tensions that depend on the speed. */
  for (double s = 1e-3; s > 5e-6; s /= 10) {
    differentiate(b, &p, s, slopes, differences);
    gradient_error = fmin(gradient_error, largest_difference(n, r, slopes));
    error = fmin(error, largest_difference(n * n, J, differences));
  }
  for (int k = 0; k < n * n; k++) {
    asymmetry = fmax(asymmetry, fabs(J[k] - J[k % n * n + k / n]));
    gain[k] = projected[k] - J[k];
  }
  double low = smallest_eigenvalue(n, projected), above = smallest_eigenvalue(n, gain);
  printf("# %s (%g,%g,%g): r off by %.2g, J by %.2g; projected from %.2g\n", name, shift->x, shift->v, shift->a,
         size > 0 ? gradient_error / gradient_size : 0, size > 0 ? error / size : 0, size > 0 ? low / size : 0);
  CHECK_BELOW(gradient_error, 1e-8 * gradient_size);
  /* The differences of a constant r are rounding errors. */
  CHECK_BELOW(error, 1e-8 * size + 1e-11 * gradient_size);
  CHECK_BELOW(asymmetry, 1e-14 * size);
  CHECK(low >= -1e-13 * size);
  CHECK(above >= -1e-13 * size);
  free(r);
  free(slopes);
  free(differences);
  free(J);
  free(projected);
  free(gain);
  flesh_block_matrix_destroy(&K);
  place_destroy(&p);
}

static void every_row_of_the_registry(void)
{
  int rows;
  const flesh_effect_row *const *row = flesh_effect_registry(&rows);
  CHECK(rows >= 6);
  for (int k = 0; k < rows; k++)
    for (int mass = 0; mass < 2; mass++) {
      test_body b;
      make_cube(2, FLESH_ENERGY_S, mass ? FLESH_MASS_CONSISTENT : FLESH_MASS_LUMPED, &b);
      test_add_sample(row[k], &b);
      CHECK_OK(flesh_system_finalize(b.system));
      test_jitter(b.n, 0.15, 11 + (unsigned)k, b.state.x);
      for (int e = 0; e < flesh_system_effect_count(b.system); e++) {
        flesh_derivative_report report;
        const flesh_effect *effect = flesh_system_effect(b.system, e);
        CHECK_OK(flesh_effect_check_derivatives(effect, b.mesh, 0.3, b.state.x, 3 + (unsigned)k, &report));
        CHECK(flesh_derivative_report_passes(&report, 1e-8));
        CHECK(effect->operations->potential && effect->operations->residual);
        CHECK(!strcmp(effect->operations->name, row[k]->name));
        CHECK(flesh_system_has_role(b.system, effect->operations->role));
      }
      for (int s = 0; s < SHIFTS && flesh_system_effect_count(b.system); s++)
        check_every_entry(&b, &shifts[s], row[k]->name);
      /* A row without an effect must constrain something. */
      uint8_t *fixed = malloc((size_t)b.n);
      CHECK((flesh_system_fixed(b.system, 0.3, fixed) > 0) == (flesh_system_effect_count(b.system) == 0));
      free(fixed);
      test_body_destroy(&b);
    }
}

static void all_rows_together(void)
{
  int rows;
  const flesh_effect_row *const *row = flesh_effect_registry(&rows);
  for (int mass = 0; mass < 2; mass++) {
    test_body b;
    make_cube(2, FLESH_ENERGY_E, mass ? FLESH_MASS_CONSISTENT : FLESH_MASS_LUMPED, &b);
    for (int k = 0; k < rows; k++) test_add_sample(row[k], &b);
    CHECK_OK(flesh_system_finalize(b.system));
    test_jitter(b.n, 0.2, 77, b.state.x);
    for (int s = 0; s < SHIFTS; s++) check_every_entry(&b, &shifts[s], "all");
    test_body_destroy(&b);
  }
}

/* phi is V/sx for a potential of position, a.Ma/(2 sa) for inertia, and 0 if its shift is 0. */
static void potentials_are_energies(void)
{
  int rows;
  const flesh_effect_row *const *row = flesh_effect_registry(&rows);
  for (int k = 0; k < rows; k++) {
    test_body b;
    make_cube(1, FLESH_ENERGY_S, FLESH_MASS_CONSISTENT, &b);
    test_add_sample(row[k], &b);
    CHECK_OK(flesh_system_finalize(b.system));
    test_jitter(b.n, 0.1, 5, b.state.x);
    test_jitter(b.n, 3, 6, b.state.v);
    for (int e = 0; e < flesh_system_effect_count(b.system); e++) {
      const flesh_effect *effect = flesh_system_effect(b.system, e);
      if (!effect->operations->energy) continue; /* dissipative effects have none */
      double energy, phi = 0, nothing = 0, magnitude = 0;
      flesh_point point = flesh_point_at(0.3, b.state.x, b.state.v, b.state.v);
      point.load = 0.7;
      CHECK_OK(effect->operations->energy(effect, &point, &energy));
      int inertia = effect->operations->role == FLESH_ROLE_INERTIA;
      /* a = v here, so that one value serves both. */
      flesh_shift shift = inertia ? (flesh_shift){.x = 1, .v = 3, .a = 9} : (flesh_shift){.x = 4};
      CHECK_OK(effect->operations->potential(effect, &point, &shift, &phi, &magnitude));
      CHECK_NEAR(phi * (inertia ? 9 : 4), energy, 1e-13 * fabs(energy));
      CHECK(energy != 0 && magnitude >= fabs(phi) * (1 - 1e-14));
      shift = inertia ? (flesh_shift){.x = 1} : (flesh_shift){.v = 1, .a = 1};
      magnitude = 0;
      CHECK_OK(effect->operations->potential(effect, &point, &shift, &nothing, &magnitude));
      CHECK(nothing == 0 && magnitude == 0);
    }
    test_body_destroy(&b);
  }
}

/* `evaluate` adds to r, *phi and *magnitude the same bits as `residual` and `potential`. Returns whether the effect has
 * it; *forces and *potentials count the shifts for which they add anything. */
static int check_evaluate(const test_body *b, const flesh_effect *effect, const flesh_point *point,
                          const flesh_shift *shift, int *forces, int *potentials)
{
  const flesh_effect_operations *can = effect->operations;
  if (!can->library || !can->library->evaluate) return 0;
  double *r[2], phi[2] = {3, 3}, magnitude[2] = {5, 5};
  int changed = 0;
  for (int k = 0; k < 2; k++) {
    r[k] = malloc((size_t)b->n * sizeof *r[k]);
    for (int d = 0; d < b->n; d++) r[k][d] = d + 0.1;
  }
  CHECK(can->residual && can->potential);
  CHECK_OK(can->residual(effect, point, r[0]));
  CHECK_OK(can->potential(effect, point, shift, &phi[0], &magnitude[0]));
  CHECK_OK(can->library->evaluate(effect, point, shift, r[1], &phi[1], &magnitude[1]));
  CHECK(!memcmp(r[0], r[1], (size_t)b->n * sizeof *r[0]));
  CHECK(phi[0] == phi[1] && magnitude[0] == magnitude[1]);
  for (int d = 0; d < b->n; d++) changed |= r[1][d] != d + 0.1;
  *forces += changed;
  *potentials += phi[1] != 3;
  for (int k = 0; k < 2; k++) free(r[k]);
  return 1;
}

/* Checks `evaluate` for a system, some of whose effects have it; each is counted as evaluated for both. */
static void check_system_evaluate(const test_body *b, flesh_point point, const flesh_shift *shift)
{
  flesh_effect_cost counted[2][40] = {0};
  const int effects = flesh_system_effect_count(b->system);
  double *r[2], phi[2] = {3, 3}, magnitude[2] = {5, 5};
  CHECK(effects <= 40);
  for (int k = 0; k < 2; k++) {
    const flesh_environment environment = {.costs = &(flesh_costs){.effects = counted[k]}};
    point.environment = &environment;
    r[k] = calloc((size_t)b->n, sizeof *r[k]);
    if (k) CHECK_OK(test_evaluate(b->system, &point, shift, r[1], &phi[1], &magnitude[1]));
    else CHECK_OK(flesh_system_residual(b->system, &point, r[0]));
    if (!k) CHECK_OK(flesh_system_potential(b->system, &point, shift, &phi[0], &magnitude[0]));
  }
  CHECK(!memcmp(r[0], r[1], (size_t)b->n * sizeof *r[0]) && test_norm(b->n, r[1]) > 0);
  CHECK(phi[0] == phi[1] && magnitude[0] == magnitude[1]);
  CHECK(!memcmp(counted[0], counted[1], sizeof counted[0]) && counted[1][0].residuals == 1);
  for (int k = 0; k < 2; k++) free(r[k]);
}

static void evaluations_are_residual_and_potential(void)
{
  int rows, found = 0;
  const flesh_effect_row *const *row = flesh_effect_registry(&rows);
  const flesh_shift some[] = {{.x = 4, .v = 3, .a = 9}, {.v = 1, .a = 1}, {.x = 2}};
  for (int k = 0; k <= rows; k++) /* finally all together */
    for (int s = 0; s < 6; s++) {
      test_body b;
      make_cube(3, FLESH_ENERGY_S, s < 3 ? FLESH_MASS_LUMPED : FLESH_MASS_CONSISTENT, &b);
      for (int j = 0; j < rows; j++)
        if (j == k || k == rows) test_add_sample(row[j], &b);
      CHECK_OK(flesh_system_finalize(b.system));
      test_jitter(b.n, 0.05, 5, b.state.x);
      test_jitter(b.n, 3, 6, b.state.v);
      flesh_point point = flesh_point_at(0.3, b.state.x, b.state.v, b.state.v);
      point.load = 0.7;
      int alone = 0, forces = 0, potentials = 0;
      for (int e = 0; e < flesh_system_effect_count(b.system); e++)
        for (int i = 0; i < 3; i++)
          alone += check_evaluate(&b, flesh_system_effect(b.system, e), &point, &some[i], &forces, &potentials);
      CHECK(forces == alone && potentials >= alone / 3); /* forces at every shift, a potential at one or more */
      found += alone / 3;
      if (k == rows) check_system_evaluate(&b, point, &some[s % 3]);
      test_body_destroy(&b);
    }
  CHECK(found >= 2 * 6 * 5);
}

static flesh_point still_at(const double *x, const double *zero)
{
  return flesh_point_at(0, x, zero, zero);
}

/* Computes F of a tet from its corners by Cramer's rule. */
static void deformation_of(const flesh_mesh *mesh, int tet, const double *x, double F[9], double inverse[9])
{
  const double *X = flesh_mesh_positions(mesh);
  const int *node = flesh_mesh_tets(mesh) + 4 * tet;
  double D[9], d[9];
  for (int i = 0; i < 3; i++)
    for (int a = 0; a < 3; a++) {
      D[3 * i + a] = X[3 * node[a + 1] + i] - X[3 * node[0] + i];
      d[3 * i + a] = x[3 * node[a + 1] + i] - x[3 * node[0] + i];
    }
  double det = 0;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      int a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, e = (j + 2) % 3;
      inverse[3 * j + i] = D[3 * a + c] * D[3 * b + e] - D[3 * a + e] * D[3 * b + c];
    }
  for (int j = 0; j < 3; j++) det += D[j] * inverse[3 * j];
  for (int k = 0; k < 9; k++) inverse[k] /= det;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      F[3 * i + j] = 0;
      for (int a = 0; a < 3; a++) F[3 * i + j] += d[3 * i + a] * inverse[3 * a + j];
    }
}

/* Compares energy, residual and both Jacobians of the elasticity with sums over tets of the material's own functions,
 * clamped with GSL's 9x9 eigensolver. */
static void check_against_material(const test_body *b, const char *name)
{
  int n = b->n;
  double *r = calloc((size_t)n, sizeof *r), *expected = calloc((size_t)n, sizeof *expected);
  double *H[2] = {calloc((size_t)n * n, sizeof(double)), calloc((size_t)n * n, sizeof(double))};
  double energy = 0, sum, zero = 0;
  gsl_eigen_symmv_workspace *work = gsl_eigen_symmv_alloc(9);
  gsl_matrix *A = gsl_matrix_alloc(9, 9), *Q = gsl_matrix_alloc(9, 9);
  gsl_vector *w = gsl_vector_alloc(9);
  for (int e = 0; e < flesh_mesh_tet_count(b->mesh); e++) {
    const flesh_material *material = &b->body.materials[b->body.tet_material ? b->body.tet_material[e] : 0];
    const int *node = flesh_mesh_tets(b->mesh) + 4 * e;
    double volume = flesh_mesh_tet_volumes(b->mesh)[e], F[9], G[9], P[9], hessian[81], clamped[81], psi, g[4][3];
    deformation_of(b->mesh, e, b->state.x, F, G);
    CHECK_OK(flesh_material_energy(material, F, &psi));
    CHECK_OK(flesh_material_stress(material, F, P));
    CHECK_OK(flesh_material_hessian(material, F, hessian));
    for (int c = 0; c < 3; c++) {
      g[0][c] = -(G[c] + G[3 + c] + G[6 + c]);
      for (int a = 0; a < 3; a++) g[a + 1][c] = G[3 * a + c];
    }
    memcpy(A->data, hessian, sizeof hessian);
    gsl_eigen_symmv(A, w, Q, work);
    memset(clamped, 0, sizeof clamped);
    for (size_t m = 0; m < 9; m++)
      for (size_t p = 0; p < 9; p++)
        for (size_t q = 0; q < 9; q++)
          clamped[9 * p + q] +=
              fmax(gsl_vector_get(w, m), 0) * gsl_matrix_get(Q, p, m) * gsl_matrix_get(Q, q, m);
    energy += volume * psi;
    for (int a = 0; a < 4; a++)
      for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) expected[3 * node[a] + i] += volume * P[3 * i + j] * g[a][j];
        for (int c = 0; c < 4; c++)
          for (int k = 0; k < 3; k++)
            for (int j = 0; j < 3; j++)
              for (int l = 0; l < 3; l++) {
                size_t place = (size_t)(3 * node[a] + i) * n + 3 * node[c] + k;
                double weight = volume * g[a][j] * g[c][l];
                H[0][place] += weight * hessian[9 * (3 * i + j) + 3 * k + l];
                H[1][place] += weight * clamped[9 * (3 * i + j) + 3 * k + l];
              }
      }
  }
  flesh_point point = still_at(b->state.x, b->state.v);
  CHECK_OK(flesh_system_energies(b->system, &point, &sum));
  CHECK_NEAR(sum, energy, 1e-12 * fabs(energy));
  CHECK_OK(flesh_system_residual(b->system, &point, r));
  for (int d = 0; d < n; d++) zero = fmax(zero, fabs(expected[d]));
  CHECK_BELOW(test_distance(n, r, expected), 1e-11 * zero);
  flesh_block_matrix *K = NULL;
  CHECK_OK(flesh_system_matrix_create(b->system, &K));
  for (int project = 0; project < 2; project++) {
    CHECK_OK(flesh_system_jacobian(b->system, &point, &(flesh_shift){.x = 1, .filter = project}, K));
    double *J = test_dense(K), size = 0;
    for (int k = 0; k < n * n; k++) size = fmax(size, fabs(J[k]));
    double off = test_distance(n * n, J, H[project]) / size;
    if (!(off <= 1e-10)) printf("# %s, project %d: off by %.3g\n", name, project, off);
    CHECK_BELOW(off, 1e-10);
    free(J);
  }
  flesh_block_matrix_destroy(&K);
  gsl_eigen_symmv_free(work);
  gsl_matrix_free(A);
  gsl_matrix_free(Q);
  gsl_vector_free(w);
  free(H[0]);
  free(H[1]);
  free(r);
  free(expected);
}

static void elasticity_is_the_material(void)
{
  for (flesh_energy energy = 0; energy < FLESH_ENERGY_COUNT; energy++) {
    test_body b;
    int anywhere = !flesh_psi_needs_volume(energy); /* defined for every F */
    CHECK_OK(test_body_create(test_box(2, 1, 1, 2, 1, 1), material_of(energy), 1000, FLESH_MASS_LUMPED, 0, &b));
    CHECK_OK(flesh_system_finalize(b.system));
    test_jitter(b.n, 0.08, 3, b.state.x);
    check_against_material(&b, flesh_energy_name(energy));
    check_every_entry(&b, &shifts[0], flesh_energy_name(energy));
    /* Squeezed to a third: many negative eigenvalues. */
    for (int d = 0; d < b.n; d += 3) b.state.x[d] *= 0.35;
    check_against_material(&b, flesh_energy_name(energy));
    /* Scrambled: tets of either sign of J. */
    test_jitter(b.n, 0.7, 9, b.state.x);
    CHECK(flesh_mesh_jacobians(b.mesh, b.state.x, NULL, NULL, NULL) < -0.1);
    if (anywhere) {
      check_against_material(&b, flesh_energy_name(energy));
      check_every_entry(&b, &shifts[0], flesh_energy_name(energy));
    }
    test_body_destroy(&b);
  }
}

/* Undefined and non-finite points give recoverable statuses from every operation, never numbers. */
static void undefined_states_are_statuses(void)
{
  for (flesh_energy energy = 0; energy < FLESH_ENERGY_COUNT; energy++) {
    test_body b;
    CHECK_OK(test_body_create(test_box(1, 1, 1, 1, 1, 1), material_of(energy), 1000, FLESH_MASS_LUMPED, 0, &b));
    CHECK_OK(flesh_system_finalize(b.system));
    flesh_block_matrix *K = NULL;
    CHECK_OK(flesh_system_matrix_create(b.system, &K));
    double *r = calloc((size_t)b.n, sizeof *r), phi, magnitude, energies;
    const double bad[] = {-1, NAN, INFINITY, 1e200};
    for (int k = 0; k < 4; k++) {
      b.state.x[3] = bad[k]; /* node 1 along x: -1 turns its tets inside out */
      int wanted = k > 0 ? FLESH_NONFINITE : flesh_psi_needs_volume(energy) ? FLESH_UNDEFINED : FLESH_OK;
      flesh_point point = still_at(b.state.x, b.state.v);
      int got = flesh_system_residual(b.system, &point, r);
      if (got != wanted) printf("# %s at %g: %s\n", flesh_energy_name(energy), bad[k], flesh_status_name(got));
      CHECK(got == wanted);
      CHECK(flesh_system_potential(b.system, &point, &shifts[0], &phi, &magnitude) == wanted);
      CHECK(flesh_system_energies(b.system, &point, &energies) == wanted);
      CHECK(flesh_system_jacobian(b.system, &point, &shifts[0], K) == wanted);
      CHECK(flesh_system_jacobian(b.system, &point, &(flesh_shift){.x = 1, .filter = 1}, K) == wanted);
    }
    free(r);
    flesh_block_matrix_destroy(&K);
    test_body_destroy(&b);
  }
}

/* A user-defined psi with all first and second derivatives, and with data. */
static int fung(double I_C, double J, const flesh_material *material, flesh_psi *psi)
{
  const double *k = material->user;
  double e = exp(k[1] * (I_C - 3) + k[2] * (J - 1));
  *psi = (flesh_psi){k[0] * e + k[3] * (J - 1) * (J - 1), k[0] * k[1] * e, k[0] * k[2] * e + 2 * k[3] * (J - 1),
                     k[0] * k[1] * k[1] * e, k[0] * k[1] * k[2] * e, k[0] * k[2] * k[2] * e + 2 * k[3]};
  return FLESH_OK;
}

static void materials_by_region(void)
{
  test_body b;
  static const double constants[4] = {1e4, 0.3, -0.6, 1e5};
  flesh_material materials[3] = {material_of(FLESH_ENERGY_S), material_of(FLESH_ENERGY_B)};
  CHECK_OK(flesh_material_from_psi(fung, constants, &materials[2]));
  CHECK_OK(test_body_create(test_box(2, 1, 1, 2, 1, 1), materials[0], 1000, FLESH_MASS_LUMPED, 0, &b));
  flesh_system_destroy(&b.system);
  int of_tet[12];
  for (int e = 0; e < 12; e++) of_tet[e] = (7 * e + 1) % 3;
  b.body.materials = materials;
  b.body.tet_material = of_tet;
  flesh_effect *effect = NULL;
  CHECK_OK(flesh_system_create(b.mesh, &b.system));
  CHECK_OK(flesh_effect_elasticity(&b.body, &effect));
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  CHECK_OK(flesh_system_finalize(b.system));
  test_jitter(b.n, 0.08, 21, b.state.x);
  check_every_entry(&b, &shifts[0], "three materials");
  check_against_material(&b, "three materials");
  test_body_destroy(&b);
}

/* Without a load, r has no resultant force and torque, and V does not change by a rigid motion. */
static void elasticity_is_frame_free(void)
{
  test_body b;
  CHECK_OK(test_body_create(test_box(2, 2, 2, 1, 1, 1), material_of(FLESH_ENERGY_S), 1000, FLESH_MASS_LUMPED, 0, &b));
  CHECK_OK(flesh_system_finalize(b.system));
  test_jitter(b.n, 0.2, 31, b.state.x);
  double *r = calloc((size_t)b.n, sizeof *r), *y = calloc((size_t)b.n, sizeof *y), before, after;
  flesh_point point = still_at(b.state.x, b.state.v);
  CHECK_OK(flesh_system_residual(b.system, &point, r));
  CHECK_OK(flesh_system_energies(b.system, &point, &before));
  double force[3] = {0}, torque[3] = {0}, size = test_norm(b.n, r);
  for (int i = 0; i < b.n / 3; i++)
    for (int c = 0; c < 3; c++) {
      int d = (c + 1) % 3, e = (c + 2) % 3;
      force[c] += r[3 * i + c];
      torque[c] += b.state.x[3 * i + d] * r[3 * i + e] - b.state.x[3 * i + e] * r[3 * i + d];
      /* Rotates by 0.7 about z, written out, and shifts. */
      y[3 * i + c] = c == 2   ? b.state.x[3 * i + 2] - 5
                     : c == 0 ? cos(0.7) * b.state.x[3 * i] - sin(0.7) * b.state.x[3 * i + 1] + 3
                              : sin(0.7) * b.state.x[3 * i] + cos(0.7) * b.state.x[3 * i + 1];
    }
  for (int c = 0; c < 3; c++) {
    CHECK_NEAR(force[c], 0, 1e-13 * size);
    CHECK_NEAR(torque[c], 0, 1e-12 * size);
  }
  point = still_at(y, b.state.v);
  CHECK_OK(flesh_system_energies(b.system, &point, &after));
  CHECK_NEAR(after, before, 1e-12 * fabs(before));
  free(r);
  free(y);
  test_body_destroy(&b);
}

/* Compares inertia and gravity with the mesh module's masses, and gravity's work with m g h. */
static void masses_and_weights(void)
{
  for (int mass = 0; mass < 2; mass++) {
    test_body b;
    flesh_effect *effect = NULL;
    make_cube(2, FLESH_ENERGY_S, mass ? FLESH_MASS_CONSISTENT : FLESH_MASS_LUMPED, &b);
    CHECK_OK(flesh_effect_inertia(&b.body, &effect));
    CHECK_OK(flesh_system_add_effect(b.system, &effect));
    CHECK_OK(test_body_gravity(&b, 1, -2, 3));
    CHECK_OK(flesh_system_finalize(b.system));
    double *a = calloc((size_t)b.n, sizeof *a), *r = calloc((size_t)b.n, sizeof *r),
           *Ma = calloc((size_t)b.n, sizeof *Ma), *lumped = calloc((size_t)b.n, sizeof *lumped), energies[2];
    test_jitter(b.n, 3, 1, a);
    test_body_mass_times(&b, a, Ma);
    flesh_mesh_lumped_mass(b.mesh, b.density, lumped);
    flesh_point point = flesh_point_at(0, b.state.x, a, a);
    point.load = 0.25;
    CHECK_OK(flesh_system_residual(b.system, &point, r));
    double kinetic = 0, height = 0;
    for (int d = 0; d < b.n; d++) {
      double weight = lumped[d / 3] * (double[]){1, -2, 3}[d % 3];
      CHECK_NEAR(r[d], Ma[d] - 0.25 * weight, 1e-12 * lumped[d / 3] * 20);
      kinetic += a[d] * Ma[d] / 2;
      height -= 0.25 * weight * b.state.x[d];
    }
    CHECK_OK(flesh_system_energies(b.system, &point, energies));
    CHECK_NEAR(energies[0], kinetic, 1e-13 * kinetic);
    CHECK_NEAR(energies[1], height, 1e-13 * 2000);
    free(a);
    free(r);
    free(Ma);
    free(lumped);
    test_body_destroy(&b);
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(every_row_of_the_registry), TEST(all_rows_together), TEST(potentials_are_energies),
                   TEST(evaluations_are_residual_and_potential), TEST(elasticity_is_the_material),
                   TEST(materials_by_region), TEST(undefined_states_are_statuses), TEST(elasticity_is_frame_free),
                   TEST(masses_and_weights));
}
