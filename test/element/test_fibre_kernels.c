// TEST quick seconds=60
/* test_fibre_kernels.c: the batched kernels of fibres, with every instruction set of this machine, against one tet at a
 * time: energies, derivatives, filtered Hessians, parts of a mesh, meshes with both kinds of tets, threads. */
#include <gsl/gsl_eigen.h>
#include <stdlib.h>

#include "body.h"
#include "effect/effect.h"
#include "mesh/mesh.h"
#include "quadratic.h"
#include "test.h"

/* The last two have a tension that depends on the speed. */
static const flesh_fibre fibres_of[4] = {
    {.curve = FLESH_FIBRE_BLEMKER, .peak_stress = 3e5, .optimal_stretch = 1.1, .passive_stress = 2e4,
     .passive_exponent = 6.6, .passive_limit = 0.4},
    {.curve = FLESH_FIBRE_THELEN, .peak_stress = 2e5, .optimal_stretch = 0.8, .passive_stress = 1e3,
     .passive_exponent = 8, .passive_limit = 0.6},
    {.curve = FLESH_FIBRE_BLEMKER, .peak_stress = 3e5, .optimal_stretch = 1.1, .max_shortening_velocity = 10},
    {.curve = FLESH_FIBRE_THELEN, .peak_stress = 2e5, .optimal_stretch = 0.8, .max_shortening_velocity = 100}};

typedef enum kind { LINEAR, STRAIGHT, CURVED, MIXED, KINDS } kind;
static const char *const kind_names[KINDS] = {"four nodes", "ten nodes", "curved", "mixed"};

/* A quadratic box, and beside it a linear one. */
static flesh_mesh *mixed_mesh(void)
{
  flesh_mesh *ten = raised_box(2, 0.2), *four = test_box(2, 2, 2, 1, 1, 1), *mesh = NULL;
  const int n = flesh_mesh_node_count(ten), m = flesh_mesh_node_count(four), tens = flesh_mesh_tet_count(ten),
            fours = flesh_mesh_tet_count(four);
  double *X = malloc(3 * (size_t)(n + m) * sizeof *X);
  int *tets = malloc(4 * (size_t)(tens + fours) * sizeof *tets);
  int *edges = malloc(6 * (size_t)(tens + fours) * sizeof *edges);
  memcpy(X, flesh_mesh_positions(ten), 3 * (size_t)n * sizeof *X);
  for (int d = 0; d < 3 * m; d++) X[3 * n + d] = flesh_mesh_positions(four)[d] + 5 * (d % 3 == 0);
  /* The two kinds alternate, so that their order in the mesh differs from that of the groups. */
  int at = 0;
  for (int e = 0; e < tens || e < fours; e++) {
    for (int k = 0; k < 4 && e < fours; k++) tets[4 * at + k] = flesh_mesh_tets(four)[4 * e + k] + n;
    for (int k = 0; k < 6 && e < fours; k++) edges[6 * at + k] = -1;
    at += e < fours;
    for (int k = 0; k < 4 && e < tens; k++) tets[4 * at + k] = flesh_mesh_tets(ten)[4 * e + k];
    for (int k = 0; k < 6 && e < tens; k++) edges[6 * at + k] = flesh_mesh_tet_edges(ten)[6 * e + k];
    at += e < tens;
  }
  CHECK_OK(flesh_mesh_build(&(flesh_mesh_lists){.nodes = n + m, .tets = tens + fours, .positions = X,
                                                .tet_nodes = tets, .edge_nodes = edges}, NULL, &mesh));
  free(X);
  free(tets);
  free(edges);
  flesh_mesh_destroy(&ten);
  flesh_mesh_destroy(&four);
  return mesh;
}

static flesh_mesh *curved_mesh(void)
{
  flesh_mesh *straight = raised_box(2, 0.2), *mesh = NULL;
  const int n = flesh_mesh_node_count(straight);
  double *X = malloc(3 * (size_t)n * sizeof *X);
  memcpy(X, flesh_mesh_positions(straight), 3 * (size_t)n * sizeof *X);
  for (int i = 0; i < n; i++) X[3 * i] += 0.1 * sin(3 * X[3 * i + 1]), X[3 * i + 2] += 0.1 * cos(3 * X[3 * i]);
  CHECK_OK(flesh_mesh_build(&(flesh_mesh_lists){.nodes = n, .tets = flesh_mesh_tet_count(straight), .positions = X,
                                                .tet_nodes = flesh_mesh_tets(straight),
                                                .edge_nodes = flesh_mesh_tet_edges(straight)}, NULL, &mesh));
  free(X);
  flesh_mesh_destroy(&straight);
  return mesh;
}

typedef struct problem {
  flesh_mesh *mesh;
  double *density, *fibres, *x;
  flesh_body body;
} problem;

static void make(kind kind, flesh_instructions instructions, double jitter, problem *p)
{
  unsigned long long seed = 3;
  p->mesh = kind == LINEAR ? test_box(3, 2, 2, 1.2, 1, 1) : kind == STRAIGHT ? raised_box(2, 0.2)
            : kind == CURVED ? curved_mesh() : mixed_mesh();
  const int tets = flesh_mesh_tet_count(p->mesh), n = 3 * flesh_mesh_node_count(p->mesh);
  p->density = malloc((size_t)tets * sizeof *p->density);
  p->fibres = malloc(3 * (size_t)tets * sizeof *p->fibres);
  p->x = malloc((size_t)n * sizeof *p->x);
  for (int e = 0; e < tets; e++) p->density[e] = 1000;
  for (int d = 0; d < 3 * tets; d++) p->fibres[d] = d / 3 % 17 == 3 ? 0 : 2 * test_uniform(&seed) - 1;
  memcpy(p->x, flesh_mesh_positions(p->mesh), (size_t)n * sizeof *p->x);
  test_jitter(n, jitter, 9, p->x);
  p->body = (flesh_body){.mesh = p->mesh, .density = p->density, .instructions = instructions};
}

static void clear(problem *p)
{
  flesh_mesh_destroy(&p->mesh);
  free(p->density);
  free(p->fibres);
  free(p->x);
}

/* Computes the gradients of the shape functions by the barycentric coordinates of corners 1 to 3 at a point. */
static void gradients(int nodes, const double L[4], double dN[10][3])
{
  static const double dL[4][3] = {{-1, -1, -1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int c = 0; c < 3; c++) {
    for (int i = 0; i < 4; i++) dN[i][c] = nodes == 4 ? dL[i][c] : (4 * L[i] - 1) * dL[i][c];
    for (int k = 0; nodes == 10 && k < 6; k++)
      dN[4 + k][c] = 4 * (L[ends[k][0]] * dL[ends[k][1]][c] + L[ends[k][1]] * dL[ends[k][0]][c]);
  }
}

static double det3(double A[3][3])
{
  return A[0][0] * (A[1][1] * A[2][2] - A[1][2] * A[2][1]) - A[0][1] * (A[1][0] * A[2][2] - A[1][2] * A[2][0]) +
         A[0][2] * (A[1][0] * A[2][1] - A[1][1] * A[2][0]);
}

/* Returns the energy of tet e. F a = (dx/dxi) (dX/dxi)^-1 a, by Cramer's rule. */
static double energy_of_tet(const problem *p, const flesh_fibre *fibre, double activation, int e)
{
  const double *a = p->fibres + 3 * e, length = sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
  const int nodes = flesh_mesh_is_quadratic(p->mesh, e) ? 10 : 4, points = nodes == 10 ? 4 : 1;
  int node[10];
  double sum = 0;
  memcpy(node, flesh_mesh_tets(p->mesh) + 4 * (size_t)e, 4 * sizeof *node);
  if (nodes == 10) ten_nodes(p->mesh, e, node);
  for (int q = 0; q < points && length > 0; q++) {
    double L[4], dN[10][3], D[3][3] = {{0}}, d[3][3] = {{0}}, xi[3], square = 0, tension[3];
    for (int i = 0; i < 4; i++) L[i] = i == q ? 0.58541019662496845446 : 0.13819660112501051518;
    gradients(nodes, L, dN);
    for (int k = 0; k < nodes; k++)
      for (int i = 0; i < 3; i++)
        for (int c = 0; c < 3; c++) {
          D[i][c] += flesh_mesh_positions(p->mesh)[3 * node[k] + i] * dN[k][c];
          d[i][c] += p->x[3 * node[k] + i] * dN[k][c];
        }
    for (int c = 0; c < 3; c++) {
      double replaced[3][3];
      memcpy(replaced, D, sizeof replaced);
      for (int i = 0; i < 3; i++) replaced[i][c] = a[i] / length;
      xi[c] = det3(replaced) / det3(D);
    }
    for (int i = 0; i < 3; i++) {
      const double f = d[i][0] * xi[0] + d[i][1] * xi[1] + d[i][2] * xi[2];
      square += f * f;
    }
    CHECK_OK(flesh_fibre_tension(fibre, activation, sqrt(square), tension));
    sum += det3(D) / 6 / points * tension[0];
  }
  return sum;
}

/* Chooses every other run of five tets; or all. */
static int choose(const problem *p, int part, int *tets, double *fibres)
{
  int count = 0;
  for (int e = 0; e < flesh_mesh_tet_count(p->mesh); e++) {
    if (part && e / 5 % 2 != part - 1) continue;
    memcpy(fibres + 3 * count, p->fibres + 3 * e, 3 * sizeof *fibres);
    tets[count++] = e;
  }
  return count;
}

static flesh_effect *muscle_of(const problem *p, int part, const flesh_fibre *fibre, const flesh_amplitude *activation)
{
  const int all = flesh_mesh_tet_count(p->mesh);
  int *tets = malloc((size_t)all * sizeof *tets);
  double *fibres = malloc(3 * (size_t)all * sizeof *fibres);
  const int count = choose(p, part, tets, fibres);
  flesh_effect *effect = NULL;
  CHECK_OK(flesh_effect_muscle(&p->body, count, part ? tets : NULL, fibres, fibre, activation, &effect));
  free(tets);
  free(fibres);
  return effect;
}

static const flesh_curve_point rise[] = {{0, 0}, {1, 0.8}};
static const flesh_amplitude rising = {.count = 2, .points = rise, .from = -INFINITY, .until = INFINITY};

static double energy_at(const problem *p, const flesh_effect *effect, double t)
{
  double energy = NAN;
  const flesh_point point = flesh_point_at(t, p->x, p->x, p->x);
  CHECK_OK(effect->operations->energy(effect, &point, &energy));
  return energy;
}

/* Checks energies of all tets and of two parts; derivatives; filtered Hessians without negative eigenvalues. */
static void check(kind kind, flesh_instructions instructions, double jitter, const flesh_fibre *fibre)
{
  problem p;
  make(kind, instructions, jitter, &p);
  double worst = 0, errors[2] = {0, 0}, right[3] = {0, 0, 0};
  for (int e = 0; e < flesh_mesh_tet_count(p.mesh); e++) {
    const double one = energy_of_tet(&p, fibre, 0.4, e);
    right[0] += one;
    right[1 + e / 5 % 2] += one;
  }
  for (int part = 0; part < 3; part++) {
    flesh_effect *effect = muscle_of(&p, part, fibre, &rising);
    flesh_derivative_report report;
    worst = fmax(worst, fabs(energy_at(&p, effect, 0.5) / right[part] - 1));
    CHECK_OK(flesh_effect_check_derivatives(effect, p.mesh, 0.5, p.x, 7, &report));
    for (int s = 0; s < FLESH_CHECK_SHIFTS; s++) {
      errors[0] = fmax(errors[0], report.potential[s]);
      errors[1] = fmax(errors[1], fmax(report.jacobian[s], report.asymmetry));
      CHECK(report.evaluate[s] == 0);
    }
    CHECK(report.negative > -1e-12);
    CHECK(flesh_effect_instructions(effect) == instructions);
    flesh_effect_destroy(&effect);
  }
  printf("# %s, %s, %s, jitter %g: energy off by %.2g, force %.2g, Hessian %.2g\n", kind_names[kind],
         flesh_instructions_name(instructions), flesh_fibre_curve_name(fibre->curve), jitter, worst, errors[0],
         errors[1]);
  CHECK_BELOW(worst, 1e-13);
  CHECK_BELOW(errors[0], 1e-8);
  CHECK_BELOW(errors[1], 1e-6); /* the Hessian of blemker's curve has kinks */
  clear(&p);
}

/* Including inverted tets. */
static void kernels_are_tets_one_by_one(void)
{
  const double jitters[] = {0.05, 0.8};
  for (flesh_instructions set = FLESH_INSTRUCTIONS_PORTABLE; flesh_instructions_name(set); set++) {
    flesh_instructions found;
    if (!strcmp(flesh_instructions_name(set), "unknown") || flesh_instructions_find(set, &found)) break;
    for (kind kind = 0; kind < KINDS; kind++)
      for (int k = 0; k < 8; k++) check(kind, set, jitters[k % 2], &fibres_of[k / 2]);
  }
}

static void dense_of(const problem *p, const flesh_effect *effect, flesh_eigenvalue_filter filter, double *H)
{
  flesh_system *system = NULL;
  flesh_block_matrix *K = NULL;
  flesh_effect *own = (flesh_effect *)effect;
  CHECK_OK(flesh_system_create(p->mesh, &system));
  CHECK_OK(flesh_system_add_effect(system, &own));
  CHECK_OK(flesh_system_finalize(system));
  CHECK_OK(flesh_system_matrix_create(system, &K));
  const flesh_point point = flesh_point_at(1, p->x, p->x, p->x);
  CHECK_OK(flesh_system_jacobian(system, &point, &(flesh_shift){.x = 1, .filter = filter}, K));
  double *dense = test_dense(K);
  memcpy(H, dense, 144 * sizeof *H);
  free(dense);
  flesh_block_matrix_destroy(&K);
  flesh_system_destroy(&system);
}

/* The Hessian of one four-node tet is that of fibres at one point: eigenvalues are kept, set to 0, or made positive. */
static void one_tet_is_filtered_as_by_an_eigensolver(void)
{
  const double X[12] = {0, 0, 0, 1, 0, 0.2, 0.1, 1, 0, 0.3, 0.2, 1.1}, a[3] = {1, 0.5, -0.3};
  double worst = 0;
  int indefinite = 0;
  for (int trial = 0; trial < 60; trial++) {
    problem p = {0};
    double H[3][144], values[12], vectors[144];
    CHECK_OK(flesh_mesh_create(4, X, 1, (const int[]){0, 1, 2, 3}, NULL, &p.mesh));
    p.x = malloc(sizeof X);
    memcpy(p.x, X, sizeof X);
    test_jitter(12, 0.7, (unsigned)trial, p.x);
    p.body = (flesh_body){.mesh = p.mesh};
    for (int f = 0; f < 3; f++) {
      flesh_effect *effect = NULL;
      CHECK_OK(flesh_effect_muscle(&p.body, 1, NULL, a, &fibres_of[trial % 2], NULL, &effect));
      dense_of(&p, effect, (flesh_eigenvalue_filter)f, H[f]);
    }
    double copy[144], largest = 0;
    memcpy(copy, H[0], sizeof copy);
    gsl_matrix_view A = gsl_matrix_view_array(copy, 12, 12), V = gsl_matrix_view_array(vectors, 12, 12);
    gsl_vector_view w = gsl_vector_view_array(values, 12);
    gsl_eigen_symmv_workspace *space = gsl_eigen_symmv_alloc(12);
    gsl_eigen_symmv(&A.matrix, &w.vector, &V.matrix, space);
    gsl_eigen_symmv_free(space);
    for (int k = 0; k < 12; k++) largest = fmax(largest, fabs(values[k]));
    int negative = 0;
    for (int k = 0; k < 12; k++) negative |= values[k] < -1e-9 * largest;
    indefinite += negative;
    for (int i = 0; i < 12; i++)
      for (int j = 0; j < 12; j++) {
        double clamped = 0, absolute = 0;
        for (int k = 0; k < 12; k++) {
          const double both = vectors[12 * i + k] * vectors[12 * j + k];
          clamped += fmax(values[k], 0) * both;
          absolute += fabs(values[k]) * both;
        }
        worst = fmax(worst, fabs(H[FLESH_FILTER_CLAMP][12 * i + j] - clamped) / largest);
        worst = fmax(worst, fabs(H[FLESH_FILTER_ABSOLUTE][12 * i + j] - absolute) / largest);
      }
    clear(&p);
  }
  printf("# filtered matrices off by %.2g; %d of 60 indefinite\n", worst, indefinite);
  CHECK_BELOW(worst, 1e-13);
  CHECK(indefinite > 5);
}

/* A body squashed to a point, to a plane, or mirrored: everything is finite, and the Hessian is filtered. */
static void nothing_is_lost_where_fibres_have_no_length(void)
{
  for (kind kind = 0; kind < KINDS; kind++)
    for (int how = 0; how < 3; how++) {
      problem p;
      make(kind, FLESH_INSTRUCTIONS_AUTO, 0, &p);
      const int n = 3 * flesh_mesh_node_count(p.mesh);
      for (int d = 0; d < n; d++) p.x[d] = how == 0 ? 0 : d % 3 == 2 ? (how == 1 ? 0 : -p.x[d]) : p.x[d];
      for (int c = 0; c < 2; c++) {
        flesh_effect *effect = muscle_of(&p, 0, &fibres_of[c], NULL);
        flesh_derivative_report report;
        CHECK_OK(flesh_effect_check_derivatives(effect, p.mesh, 0, p.x, 7, &report));
        CHECK(report.negative > -1e-12);
        if (how == 0) CHECK(energy_at(&p, effect, 0) == 0);
        else CHECK_BELOW(report.jacobian[0], 1e-6);
        flesh_effect_destroy(&effect);
      }
      p.x[4] = NAN;
      flesh_effect *effect = muscle_of(&p, 0, &fibres_of[0], NULL);
      const flesh_point point = flesh_point_at(0, p.x, p.x, p.x);
      double *r = calloc((size_t)n, sizeof *r);
      CHECK(effect->operations->residual(effect, &point, r) == FLESH_NONFINITE);
      free(r);
      flesh_effect_destroy(&effect);
      clear(&p);
    }
}

/* A box of many pieces whose tets have fibres in any direction. */
static void make_large(int order, problem *p)
{
  unsigned long long seed = 1;
  flesh_mesh *box = test_box(12, 12, 12, 1, 1, 1);
  *p = (problem){.mesh = box};
  if (order == 2) {
    CHECK_OK(flesh_mesh_raise_order(box, &p->mesh));
    flesh_mesh_destroy(&box);
  }
  const int tets = flesh_mesh_tet_count(p->mesh), n = 3 * flesh_mesh_node_count(p->mesh);
  p->fibres = malloc(3 * (size_t)tets * sizeof *p->fibres);
  p->x = malloc((size_t)n * sizeof *p->x);
  for (int d = 0; d < 3 * tets; d++) p->fibres[d] = test_uniform(&seed);
  memcpy(p->x, flesh_mesh_positions(p->mesh), (size_t)n * sizeof *p->x);
  test_jitter(n, 0.01, 2, p->x);
  p->body = (flesh_body){.mesh = p->mesh};
}

static void threads_give_the_same_bits(void)
{
  for (int order = 1; order <= 2; order++) {
    problem p;
    make_large(order, &p);
    const int n = 3 * flesh_mesh_node_count(p.mesh);
    flesh_system *system = NULL;
    flesh_effect *effect = muscle_of(&p, 1, &fibres_of[0], NULL);
    flesh_block_matrix *K = NULL;
    CHECK_OK(flesh_system_create(p.mesh, &system));
    CHECK_OK(flesh_system_add_effect(system, &effect));
    CHECK_OK(flesh_system_finalize(system));
    CHECK_OK(flesh_system_matrix_create(system, &K));
    const size_t values = 9 * (size_t)K->row_start[K->rows];
    double *r[2], *k[2], phi[2], size;
    for (int t = 0; t < 2; t++) {
      flesh_threads *threads = NULL;
      r[t] = calloc((size_t)n, sizeof *r[t]);
      k[t] = malloc(values * sizeof *k[t]);
      CHECK_OK(flesh_threads_create(t ? 3 : 1, &threads));
      flesh_point point = flesh_point_at(0, p.x, p.x, p.x);
      point.threads = threads;
      CHECK_OK(flesh_system_residual(system, &point, r[t]));
      CHECK_OK(flesh_system_potential(system, &point, &(flesh_shift){.x = 1}, &phi[t], &size));
      CHECK_OK(flesh_system_jacobian(system, &point, &(flesh_shift){.x = 1, .filter = FLESH_FILTER_CLAMP}, K));
      memcpy(k[t], K->values, values * sizeof *k[t]);
      flesh_threads_destroy(&threads);
    }
    CHECK(!memcmp(r[0], r[1], (size_t)n * sizeof *r[0]) && !memcmp(k[0], k[1], values * sizeof *k[0]));
    CHECK(phi[0] == phi[1] && test_norm(n, r[0]) > 0);
    for (int t = 0; t < 2; t++) free(r[t]), free(k[t]);
    flesh_block_matrix_destroy(&K);
    flesh_system_destroy(&system);
    clear(&p);
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(kernels_are_tets_one_by_one), TEST(one_tet_is_filtered_as_by_an_eigensolver),
                   TEST(nothing_is_lost_where_fibres_have_no_length), TEST_OF_THREADS(threads_give_the_same_bits));
}
