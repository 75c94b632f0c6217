/* multigrid.c: hypre's BoomerAMG against flesh's own preconditioners, on matrices of bent and twisted bodies.
 *
 *   mpirun -n 2 build/test/multigrid MESH|NX,NY,NZ POISSON h [SETTINGS...]
 *
 * A mesh file, or a box of so many cells whose edges are equal, held where x is least; its filtered Hessian in statics
 * (h = 0), or in steps of h seconds by backward Euler. Conjugate gradients to 1e-2, 1e-4 and 1e-8 of a load by gravity.
 * SETTINGS are own, own/VERTICES/NODES (the coarse level of all ranks has at most so many vertices; NODES nodes to a
 * vertex of each rank's own level, 0: there is none), ic, or boomeramg's numbers by commas, as in linear/boomeramg.h.
 * Prints a line of each: iterations, CPU time of set-up, of an application and of a product with the matrix, and memory,
 * each of the rank with most. */
#include "ranks.h"

#include <malloc.h>
#include <time.h>

#include "base/parallel_vector.h"
#include "base/team.h"
#include "body.h"
#include "linear/block_matrix.h"
#include "linear/boomeramg.h"
#include "linear/linear.h"

static const char *body_name;
static double poisson, step;
static int setting_count;
static char **settings;

typedef struct problem {
  test_body b;
  flesh_rank_part *part;
  const flesh_team *team;
  flesh_threads *threads;
  flesh_block_matrix *K;
  uint8_t *fixed;
  double *load;
  const flesh_linear *linear;
  int *order;
  float *r, *z;
} problem;

/* CPU time of this process, which yields the processor while it waits for others: waiting is not counted in full. */
static double seconds(void)
{
  struct timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static double held(void)
{
  const struct mallinfo2 info = mallinfo2();
  return (double)(info.uordblks + info.hblkhd);
}

static flesh_mesh *whole_mesh(void)
{
  flesh_mesh *mesh = NULL;
  int n[3];
  if (sscanf(body_name, "%d,%d,%d", n, n + 1, n + 2) == 3) {
    const double size[3] = {1, (double)n[1] / n[0], (double)n[2] / n[0]};
    CHECK_OK(flesh_mesh_box(n, size, (const double[]){0, 0, 0}, &mesh));
  } else {
    CHECK_OK(flesh_mesh_read(body_name, &mesh));
  }
  return mesh;
}

/* Twisted by 40 degrees, stretched by a tenth and sheared, all at constant volume. */
static void deform(int n, double left, double length, double *x)
{
  for (int i = 0; i < n; i += 3) {
    const double s = (x[i] - left) / length, angle = 0.7 * s, y = x[i + 1], z = x[i + 2];
    x[i] = left + length * 1.1 * s;
    x[i + 1] = (cos(angle) * y - sin(angle) * z) / sqrt(1.1);
    x[i + 2] = (sin(angle) * y + cos(angle) * z) / sqrt(1.1) + 0.2 * length * s * s;
  }
}

static void make(const flesh_mesh *whole, problem *p)
{
  double box[2] = {INFINITY, -INFINITY};
  const double *X = flesh_mesh_positions(whole);
  for (int i = 0; i < flesh_mesh_node_count(whole); i++) {
    box[0] = fmin(box[0], X[3 * i]);
    box[1] = fmax(box[1], X[3 * i]);
  }
  *p = (problem){.part = ranks_cut(whole), .linear = flesh_linear_for(FLESH_INSTRUCTIONS_AUTO)};
  p->team = flesh_rank_part_team(p->part);
  CHECK_OK(flesh_threads_create(1, &p->threads));
  flesh_threads_set_team(p->threads, p->team);
  test_body *b = &p->b;
  CHECK_OK(test_body_create((flesh_mesh *)flesh_rank_part_mesh(p->part), test_material(FLESH_ENERGY_S, poisson), 1000,
                            FLESH_MASS_LUMPED, 1, b));
  CHECK_OK(test_body_gravity(b, 0, 0, -9.81));
  int count = 0, *nodes = malloc((size_t)b->n * sizeof *nodes);
  for (int i = 0; i < b->n / 3; i++)
    if (b->state.x[3 * i] <= box[0] + 1e-3 * (box[1] - box[0])) nodes[count++] = i;
  if (count) CHECK_OK(flesh_system_add_pin(b->system, count, nodes, FLESH_AXES_ALL, -INFINITY, INFINITY));
  free(nodes);
  CHECK_OK(flesh_system_finalize(b->system));
  deform(b->n, box[0], box[1] - box[0], b->state.x);
  p->fixed = calloc((size_t)b->n, 1);
  p->load = calloc((size_t)b->n, sizeof *p->load);
  p->order = malloc((size_t)b->n * sizeof *p->order);
  p->r = calloc(2 * (size_t)b->n, sizeof *p->r);
  p->z = calloc(2 * (size_t)b->n, sizeof *p->z);
  for (int i = 0; i < b->n / 3; i++) p->order[i] = i;
  const double shift = step > 0 ? 1 / (step * step) : 0;
  const flesh_point point = flesh_point_at(0, b->state.x, b->state.v, b->state.v);
  CHECK_OK(flesh_system_matrix_create(b->system, &p->K));
  CHECK_OK(flesh_system_jacobian(b->system, &point, &(flesh_shift){1, 0, shift, FLESH_FILTER_CLAMP}, p->K));
  CHECK_OK(flesh_system_load(b->system, &point, p->load));
  flesh_system_fixed(b->system, 0, p->fixed);
  for (int d = 0; d < b->n; d++)
    if (p->fixed[d]) p->load[d] = 0;
  flesh_block_fix(p->K, p->fixed, flesh_block_mean_diagonal(p->K), NULL);
  flesh_team_collect(p->team, p->load);
}

static void drop(problem *p)
{
  flesh_block_matrix_destroy(&p->K);
  free(p->fixed), free(p->load), free(p->order), free(p->r), free(p->z);
  flesh_threads_destroy(&p->threads);
  p->b.mesh = NULL; /* the part's */
  test_body_destroy(&p->b);
  flesh_rank_part_destroy(&p->part);
}

typedef struct preconditioner {
  flesh_preconditioner_data *own;
  flesh_boomeramg *hypre;
  double setup, apply, product, bytes; /* seconds */
} preconditioner;

static double dot(const problem *p, const double *x, const double *y)
{
  return flesh_dot(p->threads, p->b.n, x, y);
}

static void apply(problem *p, preconditioner *m, const double *r, double *z)
{
  const int n = p->b.n;
  const double start = seconds();
  if (m->hypre) {
    const double unit = 1 / sqrt(dot(p, r, r));
    for (int d = 0; d < n; d++) p->r[4 * (d / 3) + d % 3] = (float)(unit * r[d]);
    flesh_boomeramg_solve(m->hypre, p->order, p->r, p->z);
    for (int d = 0; d < n; d++) z[d] = p->z[4 * (d / 3) + d % 3] / unit;
  } else {
    p->linear->preconditioner_apply(m->own, r, z);
  }
  for (int d = 3 * p->team->own; d < n; d++) z[d] = 0;
  m->apply += seconds() - start;
}

/* q = K d, d being made consistent. */
static void multiply(problem *p, preconditioner *m, double *d, double *q)
{
  const double start = seconds();
  flesh_team_share(p->team, d);
  flesh_block_multiply(p->K, d, q);
  flesh_team_collect(p->team, q);
  m->product += seconds() - start;
}

enum { MOST = 5000 };

/* Iterations to each of the tolerances; MOST: never. Returns their number in all. */
static int solve(problem *p, preconditioner *m, int reached[3])
{
  const size_t n = (size_t)p->b.n;
  double *r = malloc(n * sizeof *r), *z = malloc(n * sizeof *z), *d = calloc(n, sizeof *d), *q = malloc(n * sizeof *q);
  memcpy(r, p->load, n * sizeof *r);
  const double first = sqrt(dot(p, r, r)), tolerances[3] = {1e-2, 1e-4, 1e-8};
  double old = 0;
  int k = 0, level = 0;
  reached[0] = reached[1] = reached[2] = MOST;
  for (; k < MOST && level < 3; k++) {
    apply(p, m, r, z);
    const double rz = dot(p, r, z);
    if (!(rz > 0)) break; /* not positive definite */
    for (size_t i = 0; i < n; i++) d[i] = z[i] + (k ? rz / old : 0) * d[i];
    old = rz;
    multiply(p, m, d, q);
    const double alpha = rz / dot(p, d, q);
    for (size_t i = 0; i < n; i++) r[i] -= alpha * q[i];
    const double size = sqrt(dot(p, r, r));
    while (level < 3 && size <= tolerances[level] * first) reached[level++] = k + 1;
  }
  free(r), free(z), free(d), free(q);
  return k ? k : 1;
}

static flesh_boomeramg_options options_of(const char *text)
{
  flesh_boomeramg_options o = {0};
  sscanf(text, "%lf,%d,%d,%d,%d,%d,%d,%d,%d", &o.strength, &o.coarsening, &o.nodal, &o.interpolation, &o.longest,
         &o.smoother, &o.aggressive, &o.rotations, &o.longest_rotation);
  return o;
}

static void measure(problem *p, const char *setting)
{
  preconditioner m = {0};
  const double *X = flesh_mesh_positions(p->b.mesh), before = held();
  int reached[3], served = 1;
  if (strchr(setting, ',')) {
    const flesh_boomeramg_options options = options_of(setting);
    CHECK_OK(flesh_boomeramg_create(&options, p->K->rows, X, p->team, &m.hypre));
    const double start = seconds();
    served = flesh_boomeramg_setup(m.hypre, p->K, 1) == FLESH_OK;
    m.setup = seconds() - start;
  } else {
    const flesh_preconditioner kind = strcmp(setting, "ic") ? FLESH_PRECONDITIONER_TWO_LEVEL : FLESH_PRECONDITIONER_IC;
    flesh_levels levels = {0};
    const int given = sscanf(setting, "own/%d/%lf", &levels.shared, &levels.own) >= 1;
    CHECK_OK(p->linear->preconditioner_create_levels(kind, p->K, X, given ? &levels : NULL, p->threads, &m.own));
    const double start = seconds();
    CHECK_OK(p->linear->preconditioner_setup(m.own, p->K, p->fixed));
    m.setup = seconds() - start;
  }
  m.bytes = m.own ? (double)p->linear->preconditioner_memory(m.own) : held() - before;
  const int all = served ? solve(p, &m, reached) : 1;
  double most[4] = {1e3 * m.setup, 1e3 * m.apply / all, 1e3 * m.product / all, m.bytes / 1e6};
  flesh_communicator_largest(ranks, 4, most);
  if (flesh_communicator_rank(ranks) == 0 && served)
    printf("# %-28s iterations %4d %4d %4d  set-up %7.1f ms, application %6.2f, product %5.2f; to 1e-4 %7.0f ms; "
           "%6.1f MB\n", setting, reached[0], reached[1], reached[2], most[0], most[1], most[2],
           most[0] + reached[1] * (most[1] + most[2]), most[3]);
  fflush(stdout);
  if (m.hypre) flesh_boomeramg_destroy(&m.hypre);
  if (m.own) p->linear->preconditioner_destroy(&m.own);
}

static void compare(void)
{
  problem p;
  flesh_mesh *whole = whole_mesh();
  make(whole, &p);
  if (flesh_communicator_rank(ranks) == 0)
    printf("# %s: %d tets, %d nodes, nu %g, h %g, %d ranks\n", body_name, flesh_mesh_tet_count(whole),
           flesh_mesh_node_count(whole), poisson, step, flesh_communicator_size(ranks));
  for (int k = 0; k < setting_count; k++) measure(&p, settings[k]);
  drop(&p);
  flesh_mesh_destroy(&whole);
}

int main(int argc, char **argv)
{
  if (argc < 5) return 2;
  body_name = argv[1];
  poisson = atof(argv[2]);
  step = atof(argv[3]);
  setting_count = argc - 4;
  settings = argv + 4;
  return RUN_TESTS_ON_RANKS(argc, argv, TEST(compare));
}
