/* mass.c: the lumped and the consistent mass of tets of four and of ten nodes. */
#include "element/mass.h"

#include <stdint.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "element/body.h"

int flesh_mass_matrix_create(const flesh_body *body, flesh_mass_matrix *mass)
{
  int nodes = flesh_mesh_node_count(body->mesh);
  *mass = (flesh_mass_matrix){.nodes = nodes};
  int status = flesh_body_check_density(body);
  if (status) return status;
  if (body->mass == FLESH_MASS_LUMPED) {
    mass->lumped = flesh_calloc((size_t)nodes, sizeof *mass->lumped);
    if (!mass->lumped) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the masses of %d nodes", nodes);
    flesh_mesh_lumped_mass(body->mesh, body->density, mass->lumped);
    return FLESH_OK;
  }
  status = flesh_tets_create(body, FLESH_TETS_MASSES, &mass->tets);
  if (status) flesh_mass_matrix_clear(mass);
  return status;
}

void flesh_mass_matrix_clear(flesh_mass_matrix *mass)
{
  flesh_free(mass->lumped);
  flesh_tets_clear(&mass->tets);
  *mass = (flesh_mass_matrix){0};
}

int flesh_mass_matrices_are_same(const flesh_mass_matrix *self, const flesh_mass_matrix *other)
{
  if (self->nodes != other->nodes || !self->lumped != !other->lumped) return 0;
  if (self->lumped) return !memcmp(self->lumped, other->lumped, (size_t)self->nodes * sizeof *self->lumped);
  return flesh_tets_are_same(&self->tets, &other->tets, 0);
}

const flesh_cells *flesh_mass_matrix_cells(const flesh_mass_matrix *mass)
{
  return mass->lumped ? NULL : &mass->tets.cells;
}

/* Parts of the nodes for lumped masses, one per task: a part is as large as is worth a task, and does not depend on the
 * number of threads. */
enum { MOST_PARTS = 64, NODES_OF_PART = 512 };

typedef struct job {
  const flesh_mass_matrix *mass;
  double scale;
  const double *x;
  double *y;
  const flesh_block_matrix *K;
  int parts;
  double squares[MOST_PARTS];
} job;

static void run_parts(job *j, flesh_threads *threads, flesh_task *task)
{
  int parts = j->mass->nodes / NODES_OF_PART;
  j->parts = parts < 1 ? 1 : parts < MOST_PARTS ? parts : MOST_PARTS;
  flesh_threads_run(threads, j->parts, task, j);
}

static int first_of_part(const job *j, int task) { return (int)((int64_t)j->mass->nodes * task / j->parts); }

static void multiply_part(void *data, int task)
{
  const job *j = data;
  for (int i = first_of_part(j, task), end = first_of_part(j, task + 1); i < end; i++) {
    const double m = j->scale * j->mass->lumped[i];
    for (int c = 0; c < 3; c++) j->y[3 * i + c] += m * j->x[3 * i + c];
  }
}

static void square_part(void *data, int task)
{
  job *j = data;
  double sum = 0;
  for (int i = first_of_part(j, task), end = first_of_part(j, task + 1); i < end; i++) {
    const double *x = j->x + 3 * (size_t)i;
    sum += j->mass->lumped[i] * (x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
  }
  j->squares[task] = sum;
}

static void add_part(void *data, int task)
{
  const job *j = data;
  for (int i = first_of_part(j, task), end = first_of_part(j, task + 1); i < end; i++) {
    double *block = j->K->values + 9 * (size_t)j->K->row_start[i];
    for (int c = 0; c < 3; c++) block[4 * c] += j->scale * j->mass->lumped[i];
  }
}

/* Integrals of N_a N_b over a straight ten-node tet, times 420/V. Values in order: a corner with itself, with another
 * corner, with a node on one of its edges, with one on another edge; a node on an edge with itself, with those on edges
 * that meet it, and with that on the opposite edge. */
static const signed char ten_by_ten[10][10] = {
    {6, 1, 1, 1, -4, -4, -4, -6, -6, -6},       {1, 6, 1, 1, -4, -6, -6, -4, -4, -6},
    {1, 1, 6, 1, -6, -4, -6, -4, -6, -4},       {1, 1, 1, 6, -6, -6, -4, -6, -4, -4},
    {-4, -4, -6, -6, 32, 16, 16, 16, 16, 8},    {-4, -6, -4, -6, 16, 32, 16, 16, 8, 16},
    {-4, -6, -6, -4, 16, 16, 32, 8, 16, 16},    {-6, -4, -4, -6, 16, 16, 8, 32, 16, 16},
    {-6, -4, -6, -4, 16, 8, 16, 16, 32, 16},    {-6, -6, -4, -4, 8, 16, 16, 16, 16, 32}};

/* Computes the mass matrix of a ten-node tet. */
static void masses_of(const flesh_batches *batches, int tet, double scale, double M[10][10])
{
  const double *masses = batches->masses + (size_t)batches->masses_per_tet * (size_t)tet;
  for (int a = 0; a < 10; a++)
    for (int b = a; b < 10; b++)
      M[a][b] = M[b][a] = scale * (batches->masses_per_tet == 1 ? *masses * ten_by_ten[a][b] : *masses++);
}

static int residual_of_ten(const flesh_batches *batches, int tile, const flesh_tet_point *at, double *r, double *sums)
{
  const int *batch = batches->tiles.batch + tile;
  for (int e = batches->first[batch[0]]; e < batches->first[batch[1]]; e++) {
    const int *node = batches->nodes + 10 * (size_t)e;
    double value = 0, M[10][10];
    masses_of(batches, e, at->scale, M);
    for (int c = 0; c < 3; c++) {
      double x[10];
      for (int a = 0; a < 10; a++) x[a] = at->v[3 * (size_t)node[a] + c];
      for (int a = 0; a < 10; a++) {
        double sum = 0;
        for (int b = 0; b < 10; b++) sum += M[a][b] * x[b];
        value += sum * x[a];
        if (r) r[3 * (size_t)node[a] + c] += sum;
      }
    }
    for (int k = 0; k < 2 && sums; k++) sums[k] += 0.5 * value;
  }
  return FLESH_OK;
}

/* Adds M x = rho V/20 (sum of x over its nodes + x) of each tet, without lanes; at->v is x. */
static int residual_kernel(const flesh_batches *batches, int tile, const flesh_tet_point *at, double *r, double *sums)
{
  const int *batch = batches->tiles.batch + tile;
  for (int e = batches->first[batch[0]]; e < batches->first[batch[1]]; e++) {
    const int *node = batches->nodes + 4 * (size_t)e;
    const double m = at->scale * batches->masses[e];
    double value = 0;
    for (int c = 0; c < 3; c++) {
      double sum = 0, squares = 0, x[4];
      for (int a = 0; a < 4; a++) {
        x[a] = at->v[3 * (size_t)node[a] + c];
        sum += x[a];
        squares += x[a] * x[a];
      }
      value += sum * sum + squares;
      for (int a = 0; a < 4 && r; a++) r[3 * (size_t)node[a] + c] += m * (sum + x[a]);
    }
    for (int k = 0; k < 2 && sums; k++) sums[k] += 0.5 * m * value;
  }
  return FLESH_OK;
}

static int hessian_kernel(const flesh_batches *batches, int tile, const flesh_tet_point *at, const int *slots,
                        double *values)
{
  const flesh_tiles *tiles = &batches->tiles;
  const int pairs = tiles->pair_first[tile + 1] - tiles->pair_first[tile];
  const int nodes = tiles->node_first[tile + 1] - tiles->node_first[tile];
  const size_t lanes = (size_t)batches->lanes, m = (size_t)batches->nodes_per_tet;
  double own[FLESH_TILE_PAIRS_10], with_itself[FLESH_TILE_NODES]; /* factors of the identity in blocks of pairs, and of nodes */
  memset(own, 0, (size_t)pairs * sizeof *own);
  memset(with_itself, 0, (size_t)nodes * sizeof *with_itself);
  for (int k = tiles->batch[tile]; k < tiles->batch[tile + 1]; k++) {
    const uint16_t *pair = tiles->pairs + m * (m - 1) / 2 * lanes * (size_t)k;
    const uint16_t *node = tiles->nodes + m * lanes * (size_t)k;
    for (int e = batches->first[k]; e < batches->first[k + 1]; e++) {
      double M[10][10];
      const double mass = m == 4 ? at->scale * batches->masses[e] : 0;
      if (m == 10) masses_of(batches, e, at->scale, M);
      for (size_t a = 0; a < m; a++) {
        with_itself[*node++ / 4] += m == 4 ? 2 * mass : M[a][a];
        for (size_t b = a + 1; b < m; b++) own[*pair++ / 8] += m == 4 ? mass : M[a][b];
      }
    }
  }
  for (int k = 0; k < pairs + nodes; k++) {
    double *block = values + 9 * (size_t)slots[tiles->pair_first[tile] + tiles->node_first[tile] + k];
    for (int c = 0; c < 3; c++) block[4 * c] += k < pairs ? own[k] : with_itself[k - pairs];
  }
  return FLESH_OK;
}

const flesh_tet_kernel flesh_mass4 = {residual_kernel, hessian_kernel, NULL};
const flesh_tet_kernel flesh_mass10 = {residual_of_ten, hessian_kernel, NULL};

void flesh_mass_matrix_apply(const flesh_mass_matrix *self, double scale, flesh_threads *threads, const double *x,
                             double *y, double *half_square)
{
  if (!self->lumped) {
    double sums[2];
    const flesh_tet_point at = {.v = x, .scale = scale};
    flesh_tets_residual(&self->tets, FLESH_KERNEL_MASS, &at, threads, y, half_square ? sums : NULL);
    if (half_square) *half_square = sums[0];
    return;
  }
  job j = {.mass = self, .scale = scale, .x = x, .y = y};
  if (y) run_parts(&j, threads, multiply_part);
  if (!half_square) return;
  run_parts(&j, threads, square_part);
  *half_square = 0;
  for (int p = 0; p < j.parts; p++) *half_square += j.squares[p];
  *half_square *= scale / 2;
}

void flesh_mass_matrix_evaluate(const flesh_mass_matrix *self, double rate, flesh_threads *threads, const double *x,
                                const flesh_contribution *to)
{
  double value;
  flesh_mass_matrix_apply(self, rate, threads, x, to->r, to->shift != 0 ? &value : NULL);
  if (to->shift == 0) return;
  *to->phi += value / to->shift;
  *to->magnitude += value / to->shift;
}

void flesh_mass_matrix_add(const flesh_mass_matrix *self, double scale, flesh_threads *threads,
                           flesh_block_matrix *K, const int *slots)
{
  if (self->lumped) {
    run_parts(&(job){.mass = self, .scale = scale, .K = K}, threads, add_part);
    return;
  }
  const flesh_tet_point at = {.scale = scale};
  flesh_tets_hessian(&self->tets, FLESH_KERNEL_MASS, &at, threads, slots, K->values);
}

size_t flesh_mass_matrix_memory(const flesh_mass_matrix *self)
{
  return self->lumped ? (size_t)self->nodes * sizeof *self->lumped : flesh_tets_memory(&self->tets);
}
