// TEST full memory needs=ranks ranks=1,2,3,5
/* test_shared_solves.c: conjugate gradients on several ranks against one rank: solutions, iterations, global sums,
 * attainable residuals, and negative curvature. */
#include "ranks.h"

#include "body.h"
#include "linear/block_matrix.h"
#include "linear/linear.h"

/* K + `inertia` M of a bar, as a whole, which every rank has, and of this rank's part; and a right-hand side. */
typedef struct problem {
  flesh_mesh *mesh;
  flesh_rank_part *part;
  test_body whole, own;
  flesh_block_matrix *A[2]; /* matrices of the whole and of the part */
  flesh_threads *threads[2]; /* the part's threads have its team */
  double *b[2], *weights[2]; /* right-hand sides and weights, on whole and part */
  uint8_t *fixed[2];         /* [3*nodes] fixed dofs; NULL: none */
} problem;

enum { WHOLE, PART };

static void make_matrix(test_body *body, double inertia, flesh_block_matrix **A)
{
  const flesh_point point = flesh_point_at(0, body->state.x, body->state.v, body->state.v);
  CHECK_OK(flesh_system_finalize(body->system));
  CHECK_OK(flesh_system_matrix_create(body->system, A));
  CHECK_OK(flesh_system_jacobian(body->system, &point, &(flesh_shift){.x = 1, .a = inertia}, *A));
}

static void make_of(const int cells[3], const double size[3], double inertia, problem *p)
{
  unsigned long long seed = 3;
  const flesh_material material = test_material(FLESH_ENERGY_E, 0.4);
  *p = (problem){0};
  CHECK_OK(flesh_mesh_box(cells, size, (const double[]){0, 0, 0}, &p->mesh));
  p->part = ranks_cut(p->mesh);
  CHECK_OK(test_body_create(p->mesh, material, 1000, FLESH_MASS_LUMPED, 1, &p->whole));
  CHECK_OK(test_body_create((flesh_mesh *)flesh_rank_part_mesh(p->part), material, 1000, FLESH_MASS_LUMPED, 1, &p->own));
  make_matrix(&p->whole, inertia, &p->A[WHOLE]);
  make_matrix(&p->own, inertia, &p->A[PART]);
  const int n[2] = {p->whole.n, p->own.n};
  for (int k = 0; k < 2; k++) {
    CHECK_OK(flesh_threads_create(1, &p->threads[k]));
    p->b[k] = calloc((size_t)n[k], sizeof(double));
    p->weights[k] = calloc((size_t)n[k], sizeof(double));
  }
  flesh_threads_set_team(p->threads[PART], flesh_rank_part_team(p->part));
  for (int d = 0; d < n[WHOLE]; d++) p->b[WHOLE][d] = test_uniform(&seed) - 0.5, p->weights[WHOLE][d] = 1 + d % 3;
  for (int d = 0; d < n[PART]; d++) {
    const int i = 3 * flesh_rank_part_nodes(p->part)[d / 3] + d % 3;
    p->b[PART][d] = p->b[WHOLE][i], p->weights[PART][d] = p->weights[WHOLE][i];
  }
}

static void make(double inertia, problem *p)
{
  make_of((const int[]){24, 5, 5}, (const double[]){1, 0.2, 0.2}, inertia, p);
}

/* Holds a face along the body, so that overlaps have constrained nodes that only other ranks own. */
static void hold(problem *p)
{
  const test_body *bodies[2] = {&p->whole, &p->own};
  for (int k = 0; k < 2; k++) {
    const double *X = flesh_mesh_positions(bodies[k]->mesh);
    p->fixed[k] = calloc((size_t)bodies[k]->n, 1);
    for (int d = 0; d < bodies[k]->n; d++) {
      p->fixed[k][d] = X[d - d % 3 + 1] <= 1e-9;
      if (p->fixed[k][d]) p->b[k][d] = 0;
    }
    flesh_block_fix(p->A[k], p->fixed[k], 1e3, NULL);
  }
}

static void drop(problem *p)
{
  for (int k = 0; k < 2; k++) {
    free(p->fixed[k]);
    flesh_block_matrix_destroy(&p->A[k]);
    flesh_threads_destroy(&p->threads[k]);
    free(p->b[k]);
    free(p->weights[k]);
  }
  p->own.mesh = NULL; /* the part's */
  test_body_destroy(&p->own);
  test_body_destroy(&p->whole);
  flesh_rank_part_destroy(&p->part);
}

/* Options and results of a solve. */
typedef struct solve {
  flesh_preconditioner kind;
  const flesh_levels *levels; /* NULL: the default ones */
  int weighted, after_indefinite, most, single;
  double tolerance;
  int status;
  long reductions, messages;
  flesh_pcg_result result;
  double *x; /* [3*nodes of the whole] */
  double residual, gap; /* residual of the whole's matrix; residual according to conjugate gradients */
} solve;

/* Computes r = A x - b of the whole and its weighted norm. */
static double residual_of(const problem *p, const solve *s, double *r)
{
  double square = 0;
  flesh_block_multiply(p->A[WHOLE], s->x, r);
  for (int d = 0; d < p->whole.n; d++) {
    r[d] -= p->b[WHOLE][d];
    square += pow(s->weighted ? p->weights[WHOLE][d] * r[d] : r[d], 2);
  }
  return sqrt(square);
}

static void run(const problem *p, int which, solve *s)
{
  const flesh_linear *linear = flesh_linear_for(FLESH_INSTRUCTIONS_AUTO);
  const test_body *body = which == PART ? &p->own : &p->whole;
  flesh_preconditioner_data *preconditioner = NULL;
  flesh_pcg_space *space = NULL;
  double *x = calloc((size_t)body->n, sizeof *x), *r = calloc((size_t)p->whole.n, sizeof *r);
  CHECK_OK(linear->preconditioner_create_levels(s->kind, p->A[which], flesh_mesh_positions(body->mesh), s->levels,
                                                p->threads[which], &preconditioner));
  CHECK_OK(linear->preconditioner_setup(preconditioner, p->A[which], p->fixed[which]));
  CHECK_OK(linear->pcg_space_create(p->A[which], s->single, p->threads[which], &space));
  const flesh_communicator_figures before = flesh_communicator_exchanged(ranks);
  const flesh_pcg_request request = {
      .A = p->A[which], .preconditioner = preconditioner, .b = p->b[which],
      .weights = s->weighted ? p->weights[which] : NULL, .tolerance = s->tolerance, .max_iterations = s->most,
      .after_indefinite = s->after_indefinite, .single = s->single};
  s->status = linear->pcg(space, &request, x, &s->result);
  s->reductions = flesh_communicator_exchanged(ranks).reductions - before.reductions;
  s->messages = flesh_communicator_exchanged(ranks).messages - before.messages;
  s->x = calloc((size_t)p->whole.n, sizeof *s->x);
  if (which == PART) flesh_rank_part_gather(p->part, x, s->x);
  else memcpy(s->x, x, (size_t)p->whole.n * sizeof *x);
  s->residual = residual_of(p, s, r);
  for (int d = 0; d < p->own.n && which == PART; d++) x[d] = r[3 * flesh_rank_part_nodes(p->part)[d / 3] + d % 3];
  s->gap = linear->pcg_model_error(space, NULL, which == PART ? x : r);
  linear->pcg_space_destroy(&space);
  linear->preconditioner_destroy(&preconditioner);
  free(x);
  free(r);
}

static double norm(int n, const double *x)
{
  double square = 0;
  for (int d = 0; d < n; d++) square += x[d] * x[d];
  return sqrt(square);
}

/* Two exchanges per iteration, and one at the start. A sum takes a rank at most as many messages as the number of ranks
 * has binary digits. */
static void check_messages(const problem *p, const solve *s)
{
  int digits = 0;
  while (flesh_communicator_size(ranks) >> digits) digits++;
  const int neighbours = flesh_rank_part_team(p->part)->neighbours.count;
  CHECK(s->messages <= neighbours * (2 * s->result.iterations + 1) + digits * s->reductions);
}

/* With so much inertia that solves are too short for rounding to matter. The preconditioner of diagonal blocks is the
 * same on any number of ranks, and so are its iterations. */
static void an_iteration_takes_one_sum(void)
{
  static const flesh_preconditioner kinds[] = {FLESH_PRECONDITIONER_JACOBI, FLESH_PRECONDITIONER_IC,
                                               FLESH_PRECONDITIONER_TWO_LEVEL};
  problem p;
  make(1e4, &p);
  const double tolerance = 1e-6 * norm(p.whole.n, p.b[WHOLE]);
  const int several = flesh_communicator_size(ranks) > 1;
  for (int k = 0; k < 6; k++) {
    solve s[2];
    for (int which = 0; which < 2; which++) {
      s[which] = (solve){.kind = kinds[k / 2], .weighted = k % 2, .tolerance = tolerance, .most = 300};
      run(&p, which, &s[which]);
      CHECK_OK(s[which].status);
      CHECK_BELOW(s[which].residual, 1.001 * tolerance);
      CHECK_NEAR(s[which].result.residual, s[which].residual, 1e-3 * tolerance);
    }
    /* Additional sums: b, the first and the last residual; a new right-hand side of the coarse level for every three
     * decades, fewer than twelve in total, however residuals go up and down. */
    const int loads = kinds[k / 2] == FLESH_PRECONDITIONER_TWO_LEVEL ? 12 / 3 : 0;
    if (several) CHECK(s[PART].reductions <= s[PART].result.iterations + 3 + loads);
    if (several) CHECK(s[PART].reductions > s[PART].result.iterations);
    check_messages(&p, &s[PART]);
    if (kinds[k / 2] == FLESH_PRECONDITIONER_JACOBI)
      CHECK_NEAR(s[PART].result.iterations, s[WHOLE].result.iterations, 2);
    printf("# %s%s: %d iterations and %ld sums; on one rank %d\n", flesh_preconditioner_name(kinds[k / 2]),
           k % 2 ? ", weighted" : "", s[PART].result.iterations, s[PART].reductions, s[WHOLE].result.iterations);
    free(s[WHOLE].x);
    free(s[PART].x);
  }
  drop(&p);
}

/* Down to the accuracy of single precision, on all ranks or none. */
static void solves_in_single_precision_reach_the_tolerance(void)
{
  problem p;
  make(100, &p);
  const int several = flesh_communicator_size(ranks) > 1;
  const double size = norm(p.whole.n, p.b[WHOLE]), depths[] = {1e-1, 1e-3, several ? 1.2e-4 : 2e-5};
  for (int k = 0; k < 6; k++) {
    solve s[2];
    for (int single = 0; single < 2; single++) {
      s[single] = (solve){.kind = k % 2 ? FLESH_PRECONDITIONER_IC : FLESH_PRECONDITIONER_TWO_LEVEL,
                          .tolerance = depths[k / 2] * size, .most = 300, .single = single};
      run(&p, PART, &s[single]);
      CHECK_OK(s[single].status);
      CHECK(s[single].result.single == single);
      CHECK_BELOW(s[single].residual, 1.05 * s[single].tolerance);
    }
    CHECK_NEAR(s[1].result.iterations, s[0].result.iterations, 2);
    printf("# to %g: %d iterations, in double precision %d; residual %g of what was asked\n", depths[k / 2],
           s[1].result.iterations, s[0].result.iterations, s[1].residual / s[1].tolerance);
    free(s[0].x);
    free(s[1].x);
  }
  const solve none[] = {{.tolerance = (several ? 5e-5 : 5e-6) * size}, {.tolerance = 0.1 * size, .weighted = 1},
                        {.tolerance = 0.1 * size, .kind = FLESH_PRECONDITIONER_JACOBI}};
  for (int k = 0; k < (several ? 3 : 2); k++) {
    solve s = none[k];
    s.single = 1;
    s.most = 300;
    if (k < 2) s.kind = FLESH_PRECONDITIONER_IC;
    run(&p, PART, &s);
    CHECK(!s.result.single);
    CHECK_BELOW(s.residual, 1.001 * s.tolerance);
    free(s.x);
  }
  drop(&p);
}

/* The residual of a truncated solve is one of the predicted ones. */
static void residuals_are_foretold(void)
{
  problem p;
  make(1e4, &p);
  for (int weighted = 0; weighted <= 1; weighted++) {
    solve s = {.kind = FLESH_PRECONDITIONER_TWO_LEVEL, .weighted = weighted, .most = 4};
    run(&p, PART, &s);
    CHECK(s.status == FLESH_NOT_CONVERGED);
    CHECK(s.result.iterations == 4);
    CHECK_NEAR(s.result.residual, s.residual, 1e-8 * s.residual);
    free(s.x);
  }
  drop(&p);
}

/* The recursive residual deviates from b - A x only by rounding: some round-off in each iteration of the summed terms,
 * which are at most |A| |x| (Greenbaum 1997). */
static void recurrences_stay_with_the_residual(void)
{
  problem p;
  make(1e-2, &p);
  double size = 0;
  for (int i = 0; i < p.A[WHOLE]->rows; i++)
    for (int c = 0; c < 3; c++) size = fmax(size, p.A[WHOLE]->values[9 * p.A[WHOLE]->row_start[i] + 4 * c]);
  solve s[2];
  for (int which = 0; which < 2; which++) {
    s[which] = (solve){.kind = FLESH_PRECONDITIONER_TWO_LEVEL, .tolerance = 0, .most = 300};
    run(&p, which, &s[which]);
    CHECK(s[which].status == FLESH_NOT_CONVERGED || s[which].status == FLESH_OK);
  }
  const double unit = 2.2e-16 * size * norm(p.whole.n, s[PART].x);
  printf("# gap %.2g and residual %.2g units of round-off; on one rank %.2g, %.2g\n", s[PART].gap / unit,
         s[PART].residual / unit, s[WHOLE].gap / unit, s[WHOLE].residual / unit);
  CHECK_BELOW(s[PART].residual, 300 * unit);
  CHECK_BELOW(s[PART].gap, 300 * unit);
  free(s[WHOLE].x);
  free(s[PART].x);
  drop(&p);
}

/* K - c M has directions of negative curvature. The first is met in the same iteration on any number of ranks; on
 * request the solve continues, and every iteration lowers the model. */
static void negative_curvature_is_seen(void)
{
  problem p;
  make(-200, &p);
  for (int after = 0; after <= 4; after += 4) {
    solve s[2];
    double model[2] = {0};
    double *r = calloc((size_t)p.whole.n, sizeof *r);
    for (int which = 0; which < 2; which++) {
      s[which] = (solve){.kind = FLESH_PRECONDITIONER_JACOBI, .after_indefinite = after, .most = 2000};
      run(&p, which, &s[which]);
      CHECK(s[which].status == FLESH_NOT_POSITIVE);
      residual_of(&p, &s[which], r);
      for (int d = 0; d < p.whole.n; d++) model[which] += s[which].x[d] * (r[d] - p.b[WHOLE][d]) / 2;
    }
    printf("# %d iterations, model %.6g; on one rank %d, %.6g\n", s[PART].result.iterations, model[PART],
           s[WHOLE].result.iterations, model[WHOLE]);
    CHECK_NEAR(s[PART].result.iterations, s[WHOLE].result.iterations, 0);
    CHECK_NEAR(model[PART], model[WHOLE], 1e-4 * fabs(model[WHOLE]));
    CHECK(model[PART] < 0);
    free(s[WHOLE].x);
    free(s[PART].x);
    free(r);
  }
  drop(&p);
}

/* A set-up that is saved and loaded into an empty preconditioner has the same bits. */
static void check_archive(const problem *p, const flesh_levels *levels)
{
  const flesh_linear *linear = flesh_linear_for(FLESH_INSTRUCTIONS_AUTO);
  const double *X = flesh_mesh_positions(p->own.mesh);
  const size_t n = (size_t)p->own.n;
  double *z[2] = {calloc(n, sizeof(double)), calloc(n, sizeof(double))};
  flesh_archive archive = {0};
  for (int k = 0; k < 2; k++) {
    flesh_preconditioner_data *one = NULL;
    CHECK_OK(linear->preconditioner_create_levels(FLESH_PRECONDITIONER_TWO_LEVEL, p->A[PART], X, levels,
                                                  p->threads[PART], &one));
    if (k == 0) {
      CHECK_OK(linear->preconditioner_setup(one, p->A[PART], p->fixed[PART]));
      linear->preconditioner_archive(one, &archive);
      archive = (flesh_archive){.mode = FLESH_ARCHIVE_SAVE, .data = calloc(archive.at, 1), .size = archive.at};
    }
    linear->preconditioner_archive(one, &archive);
    CHECK(!archive.wrong && archive.at == archive.size);
    archive.mode = FLESH_ARCHIVE_LOAD;
    archive.at = 0;
    linear->preconditioner_apply(one, p->b[PART], z[k]);
    linear->preconditioner_destroy(&one);
  }
  CHECK(memcmp(z[0], z[1], n * sizeof(double)) == 0);
  free(archive.data);
  free(z[0]);
  free(z[1]);
}

/* With `more` coarse levels the ranks take fewer iterations than with a single shared cell. The solution satisfies the
 * constraints, also at nodes that only other ranks own. */
static void compare_levels(const int cells[3], flesh_levels more)
{
  const flesh_levels levels[] = {{.shared = 8}, more};
  problem p;
  make_of(cells, (const double[]){1, (double)cells[1] / cells[0], (double)cells[2] / cells[0]}, 1e-2, &p);
  hold(&p);
  const double tolerance = 1e-8 * norm(p.whole.n, p.b[WHOLE]);
  solve s[2];
  for (int k = 0; k < 2; k++) {
    s[k] = (solve){.kind = FLESH_PRECONDITIONER_TWO_LEVEL, .levels = &levels[k], .tolerance = tolerance, .most = 500};
    run(&p, PART, &s[k]);
    CHECK_OK(s[k].status);
    CHECK_BELOW(s[k].residual, 1.01 * tolerance);
    check_messages(&p, &s[k]);
    for (int d = 0; d < p.whole.n; d++)
      if (p.fixed[WHOLE][d]) CHECK(s[k].x[d] == 0);
    free(s[k].x);
  }
  printf("# %d x %d x %d cells: %d iterations, with %d vertices and %g nodes to one of the ranks' own %d\n", cells[0],
         cells[1], cells[2], s[0].result.iterations, more.shared, more.own, s[1].result.iterations);
  CHECK_BELOW(s[1].result.iterations, 0.9 * s[0].result.iterations);
  check_archive(&p, &more);
  drop(&p);
}

/* This takes no messages. */
static void ranks_have_levels_of_their_own(void) { compare_levels((const int[]){24, 5, 5}, (flesh_levels){8, 20}); }

/* The factor of their matrix has fill-in. */
static void ranks_share_many_vertices(void) { compare_levels((const int[]){9, 9, 9}, (flesh_levels){250, 0}); }

int main(int argc, char **argv)
{
  return RUN_TESTS_ON_RANKS(argc, argv, TEST(an_iteration_takes_one_sum),
                            TEST(solves_in_single_precision_reach_the_tolerance), TEST(residuals_are_foretold),
                            TEST(ranks_have_levels_of_their_own), TEST(ranks_share_many_vertices),
                            TEST(recurrences_stay_with_the_residual), TEST(negative_curvature_is_seen));
}
