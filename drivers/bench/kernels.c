/* kernels.c: measures every kernel of a step by itself, against the least bytes and operations that it needs. */
#include <math.h>
#include <nvector/nvector_serial.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "bench/bench.h"
#include "linear/block_matrix.h"
#include "linear/preconditioner.h"
#include "linear/linear.h"
#include "sundials/compatibility.h"
#include "sundials/vector.h"

typedef struct bench {
  flesh_system *system;
  const flesh_effect *elasticity;
  flesh_block_matrix *K, *A; /* elasticity alone; with inertia, as in a step of 1/60 s */
  flesh_preconditioner_data *preconditioner;
  const flesh_linear *linear;
  flesh_product product;
  flesh_point point;
  int projected;
  size_t n;
  double *x, *r, *z, sum; /* [n] */
  double *from, *to; /* [4 * nodes] operand and result of the product */
  float *single_from, *single_to; /* the same in single precision */
  SUNContext context;
  N_Vector vectors[2]; /* views of r and z, vectorised as in KINSOL and IDA */
} bench;

static int element_force(void *data)
{
  bench *b = data;
  return b->elasticity->operations->residual(b->elasticity, &b->point, b->r);
}

static int element_energy(void *data)
{
  bench *b = data;
  return b->elasticity->operations->energy(b->elasticity, &b->point, &b->sum);
}

static int hessian(void *data)
{
  bench *b = data;
  const flesh_shift shift = {.x = 1, .filter = b->projected};
  return flesh_system_jacobian(b->system, &b->point, &shift, b->K);
}

static int product(void *data)
{
  bench *b = data;
  b->sum += b->linear->product_multiply(&b->product, b->A, b->point.threads, NULL, b->from, b->to);
  return FLESH_OK;
}

static int single_product(void *data)
{
  bench *b = data;
  b->sum += b->linear->product_multiply_single(&b->product, NULL, 1, b->point.threads, NULL, b->single_from,
                                          b->single_to);
  return FLESH_OK;
}

static int set_up(void *data)
{
  bench *b = data;
  return b->linear->preconditioner_setup(b->preconditioner, b->A, NULL);
}

static int apply(void *data)
{
  bench *b = data;
  b->sum += b->linear->preconditioner_solve(b->preconditioner, b->single_from);
  return FLESH_OK;
}

static int dot(void *data)
{
  bench *b = data;
  b->sum += N_VDotProd(b->vectors[0], b->vectors[1]);
  return FLESH_OK;
}

static int combine(void *data)
{
  bench *b = data;
  N_VLinearSum(1e-3, b->vectors[0], 1, b->vectors[1], b->vectors[1]);
  return FLESH_OK;
}

/* Writes positions to x that are stretched, twisted and perturbed, so that tets differ and many need projecting. */
static void deform(const flesh_mesh *mesh, double *x)
{
  const double *X = flesh_mesh_positions(mesh);
  flesh_mesh_info info;
  flesh_mesh_inspect(mesh, &info);
  double length = info.high[0] - info.low[0];
  for (int i = 0; i < info.nodes; i++) {
    double s = (X[3 * i] - info.low[0]) / length, angle = 1.57 * s;
    double y = X[3 * i + 1] - (info.low[1] + info.high[1]) / 2;
    double z = X[3 * i + 2] - (info.low[2] + info.high[2]) / 2;
    x[3 * i] = X[3 * i] + 0.2 * length * s;
    x[3 * i + 1] = y * cos(angle) - z * sin(angle);
    x[3 * i + 2] = y * sin(angle) + z * cos(angle);
    for (int c = 0; c < 3; c++)
      x[3 * i + c] += 0.02 * info.edge_mean * sin(12.9898 * i + 78.233 * c);
  }
}

static int open_system(const flesh_bench_bar *bar, bench *b)
{
  flesh_effect *effect = NULL;
  int status = flesh_system_create(bar->mesh, &b->system);
  if (!status) status = flesh_effect_elasticity(&bar->body, &effect);
  if (!status) status = flesh_system_add_effect(b->system, &effect);
  if (!status) status = flesh_system_finalize(b->system);
  if (!status) b->elasticity = flesh_system_effect(b->system, 0);
  if (!status) status = flesh_system_matrix_create(b->system, &b->K);
  if (!status) status = flesh_system_matrix_create(b->system, &b->A);
  return status;
}

/* Makes A = M/h^2 + K at the deformed state, with the face x = 0 held, its preconditioner and its products. */
static int make_matrix(const flesh_bench_bar *bar, bench *b)
{
  const flesh_shift shift = {.x = 1, .filter = FLESH_FILTER_CLAMP};
  int nodes = flesh_mesh_node_count(bar->mesh);
  double *mass = calloc((size_t)nodes, sizeof *mass);
  uint8_t *fixed = calloc(b->n, 1);
  int status = mass && fixed ? FLESH_OK : flesh_no_memory();
  if (!status) status = flesh_system_jacobian(b->system, &b->point, &shift, b->A);
  if (!status) {
    flesh_mesh_lumped_mass(bar->mesh, bar->density, mass);
    for (int i = 0; i < nodes; i++)
      for (int c = 0; c < 3; c++)
        b->A->values[9 * (size_t)b->A->row_start[i] + 4 * (size_t)c] += 3600 * mass[i];
    const double *X = flesh_mesh_positions(bar->mesh);
    for (int i = 0; i < nodes; i++)
      if (X[3 * i] <= 0) memset(fixed + 3 * i, 1, 3);
    flesh_block_fix(b->A, fixed, 1, NULL);
    status = b->linear->preconditioner_create(FLESH_PRECONDITIONER_AUTO, b->A, X, flesh_mesh_order(bar->mesh),
                                              b->point.threads, &b->preconditioner);
  }
  flesh_bisection bisection = {0};
  if (!status) status = flesh_bisection_create(b->A, NULL, &bisection);
  if (!status) status = b->linear->product_create(b->A, &bisection, 1, &b->product);
  flesh_bisection_clear(&bisection);
  size_t stride;
  const size_t length = 4 * (size_t)b->product.nodes;
  if (!status && !(b->from = flesh_huge_pages_vectors(4, length, &stride))) status = flesh_no_memory();
  if (!status) {
    b->to = b->from + stride;
    b->single_from = (float *)(b->from + 2 * stride);
    b->single_to = (float *)(b->from + 3 * stride);
    for (size_t i = 0; i < b->n / 3; i++)
      for (size_t c = 0; c < 3; c++) b->single_from[4 * i + c] = (float)(b->from[4 * i + c] = b->x[3 * i + c]);
    b->linear->product_multiply_single(&b->product, b->A, b->linear->preconditioner_scale(b->preconditioner),
                                       b->point.threads, NULL, b->single_from, b->single_to);
  }
  free(mass);
  free(fixed);
  return status;
}

static int open_bench(const flesh_bench_bar *bar, int threads, bench *b)
{
  b->linear = flesh_linear_for(bar->body.instructions);
  b->n = 3 * (size_t)flesh_mesh_node_count(bar->mesh);
  b->x = malloc(b->n * sizeof *b->x);
  b->r = calloc(b->n, sizeof *b->r);
  b->z = calloc(b->n, sizeof *b->z);
  if (!b->x || !b->r || !b->z) return flesh_no_memory();
  deform(bar->mesh, b->x);
  b->point = flesh_point_at(0, b->x, b->x, b->x);
  double *numbers[2] = {b->r, b->z};
  if (flesh_suncontext_create(&b->context)) return flesh_no_memory();
  for (int k = 0; k < 2; k++) {
    b->vectors[k] = N_VMake_Serial((sunindextype)b->n, numbers[k], b->context);
    if (!b->vectors[k]) return flesh_no_memory();
  }
  int status = flesh_threads_create(threads, &b->point.threads);
  for (int k = 0; k < 2 && !status; k++) status = flesh_vector_vectorise(b->vectors[k], b->point.threads);
  if (!status) status = open_system(bar, b);
  if (!status) status = make_matrix(bar, b);
  return status;
}

static void close_bench(bench *b)
{
  b->linear->preconditioner_destroy(&b->preconditioner);
  flesh_block_matrix_destroy(&b->K);
  flesh_block_matrix_destroy(&b->A);
  flesh_system_destroy(&b->system);
  flesh_threads_destroy(&b->point.threads);
  for (int k = 0; k < 2; k++)
    if (b->vectors[k]) N_VDestroy(b->vectors[k]);
  if (b->context) SUNContext_Free(&b->context);
  free(b->x);
  free(b->r);
  free(b->z);
  b->linear->product_clear(&b->product);
  free(b->from); /* frees `to` and the vectors in single precision, too */
}

/* Least work of a kernel. Bytes of a tet: its shape (10 numbers), 4 nodes and 6 pairs of them (2 bytes each), the
 * places of about two blocks (4 bytes each) and the numbers of about three pairs whose sum is a diagonal block (2 bytes
 * each). Bytes of a node: position and sum (24 bytes each way). Bytes of a block: 72, which an assembly writes once,
 * and a column. A preconditioner reads a matrix twice and writes two triangles of numbers with eight binary digits; for
 * its coarse level it reads where every block goes (16 bytes) and where every node is (20). Operations are counted by
 * hand in lib/effect/elasticity_kernel.c for S; a division or root counts as one, and two operations in single
 * precision as one, since the ceiling is that of double precision. */
typedef struct kernel {
  const char *name;
  int (*work)(void *data);
  int projected;
  double tet_bytes, node_bytes, block_bytes; /* bytes moved */
  double tet_operations, node_operations, block_operations;
} kernel;

static const kernel kernels[] = {
    {"element force", element_force, 0, 88, 72, 0, 210, 0, 0},
    {"element energy", element_energy, 0, 88, 24, 0, 165, 0, 0},
    {"true Hessian", hessian, 0, 114, 24, 72, 610, 0, 0},
    {"projected Hessian", hessian, 1, 114, 24, 72, 1640, 0, 0},
    {"matrix-vector product", product, 0, 0, 96, 76, 0, 0, 36},
    {"single-precision product", single_product, 0, 0, 48, 40, 0, 0, 18},
    {"preconditioner set-up", set_up, 0, 0, 0, 200, 0, 0, 0},
    {"preconditioner solve", apply, 0, 0, 104, 44, 0, 0, 18},
    {"dot product", dot, 0, 0, 48, 0, 0, 6, 0},
    {"vector sum", combine, 0, 0, 72, 0, 0, 6, 0},
};

int flesh_bench_kernels(const flesh_bench_plan *plan, const flesh_bench_bar *bar, int threads, json_t *rows)
{
  bench b = {0};
  int status = open_bench(bar, threads, &b);
  double tets = flesh_mesh_tet_count(bar->mesh), nodes = flesh_mesh_node_count(bar->mesh);
  double blocks = status ? 0 : b.A->row_start[b.A->rows];
  for (size_t k = 0; k < sizeof kernels / sizeof kernels[0] && !status; k++) {
    const kernel *own = &kernels[k];
    flesh_bench_time time;
    b.projected = own->projected;
    status = flesh_bench_measure(NULL, own->work, &b, plan->repeats, &time);
    if (status) break;
    json_t *row = flesh_bench_row("kernel", own->name, bar->mesh, &time), *least = json_pack(
        "{sf sf}", "bytes", own->tet_bytes * tets + own->node_bytes * nodes + own->block_bytes * blocks, "operations",
        own->tet_operations * tets + own->node_operations * nodes + own->block_operations * blocks);
    json_object_update_new(row, least);
    json_array_append_new(rows, row);
  }
  close_bench(&b);
  return status;
}
